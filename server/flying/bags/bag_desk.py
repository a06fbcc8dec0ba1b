"""Bags of ROS as pages see them: brought in, listed, made into recordings that Review opens."""

from __future__ import annotations

import asyncio
import shutil
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from server.errors import BadRequestError, InUseError, NotFoundError
from server.flying.bags import bag_task
from server.flying.recordings import RecordingDesk
from server.library import Library
from server.library.shelf import iso_utc
from server.library.whole_files import new_id
from server.schemas import BagDoc, BagRecordedDoc, BagRecordingBody, BagTopicDoc
from server.schemas.bag_docs import BagRole
from server.work.job_board import JobBoard

if TYPE_CHECKING:
    from telemetry.recording.ros.bag import BagTable, BagTopic

MOST_KEPT = 2
"""Bags; each may be as large as an upload may be, and larger once it is unpacked."""
_LATEST_UTC_S = 4e9
_ORDER: tuple[BagRole, ...] = ("points", "poses", "transforms", "fix", "other")


@dataclass(frozen=True, slots=True)
class _Kept:
    doc: BagDoc
    upload: Path
    folder: Path
    bag: Path
    """One of both, or within the folder."""
    table: BagTable


class BagDesk:
    """All methods belong to the event loop. Nothing of it outlives the server."""

    def __init__(self, library: Library, board: JobBoard, recordings: RecordingDesk) -> None:
        self._library, self._board, self._recordings = library, board, recordings
        self._kept: dict[str, _Kept] = {}
        self._read = Counter[str]()
        """How many jobs read a bag, by its id: it stays as long."""

    async def add(self, upload: Path, name: str) -> BagDoc:
        """Lists an uploaded bag and keeps it. Raises RecordingError, BadRequestError, JobCancelledError."""
        folder, size = self._library.new_upload(), upload.stat().st_size
        try:
            bag, table = await self._board.run(
                f"Reading {name}",
                lambda lane, progress: lane.call(bag_task.list_uploaded, upload, folder, name, progress=progress),
            )
        except BaseException:
            await asyncio.to_thread(_remove, upload, folder)
            raise
        doc = _doc(table, name, size)
        self._kept[doc.id] = _Kept(doc, upload, folder, bag, table)
        await self._forget_oldest()
        return doc

    def docs(self) -> list[BagDoc]:
        """Newest first."""
        return [kept.doc for kept in reversed(self._kept.values())]

    async def record(self, bag_id: str, body: BagRecordingBody) -> BagRecordedDoc:
        """Raises NotFoundError, BadRequestError, RecordingError, JobCancelledError."""
        kept = self._of(bag_id)
        asked, out = _asked(body), self._library.new_upload(".mcap")
        self._read[bag_id] += 1
        try:
            flight = await self._board.run(
                f"Making a recording of {kept.doc.name}",
                lambda lane, progress: lane.call(
                    bag_task.make_recording,
                    self._of(bag_id).bag,
                    kept.doc.name,
                    kept.table,
                    asked,
                    body.sensor,
                    out,
                    progress=progress,
                ),
            )
            recording = await self._recordings.add(out, f"{Path(kept.doc.name).stem}.mcap")
        finally:
            self._read[bag_id] -= 1
            await asyncio.to_thread(out.unlink, missing_ok=True)
            await self._forget_oldest()
        return BagRecordedDoc(recording=recording, notes=list(flight.notes))

    async def forget(self, bag_id: str) -> None:
        """Raises NotFoundError, and InUseError while a recording is being made of it."""
        kept = self._of(bag_id)
        if self._read[bag_id]:
            what = f"A recording of {kept.doc.name} is being made."
            raise InUseError(what, advice="Wait for it, or cancel it.")
        del self._read[bag_id]
        del self._kept[bag_id]
        await asyncio.to_thread(_remove, kept.upload, kept.folder)

    async def _forget_oldest(self) -> None:
        """Down to as many as are kept; one that is read stays until it is not."""
        idle = [bag_id for bag_id in self._kept if not self._read[bag_id]]
        for bag_id in idle[: max(0, len(self._kept) - MOST_KEPT)]:
            await self.forget(bag_id)

    def _of(self, bag_id: str) -> _Kept:
        if bag_id not in self._kept:
            raise NotFoundError("There is no such bag any more.", advice="Bring it in again.")
        return self._kept[bag_id]


def _remove(upload: Path, folder: Path) -> None:
    upload.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def _asked(body: BagRecordingBody) -> bag_task.BagAsked:
    # Brings in the arrays of maps: only when a bag is made into a recording.
    from telemetry.recording.ros.bag_flight import BagAsked

    lat_deg, lon_deg = body.home_lat_deg, body.home_lon_deg
    if (lat_deg is None) != (lon_deg is None):
        what = "Of the first pose's place one number is missing."
        raise BadRequestError(what, where="home_lat_deg, home_lon_deg", advice="Give both, or neither.")
    place = None if lat_deg is None or lon_deg is None else (lat_deg, lon_deg)
    return BagAsked(body.points, body.pose, body.frame, body.max_gap_s, body.home_alt_amsl_m, place)


def _doc(table: BagTable, name: str, size: int) -> BagDoc:
    topics = sorted((_topic(topic) for topic in table.topics), key=lambda t: (_ORDER.index(t.role), t.name))
    return BagDoc(
        id=new_id(), name=name, kind=table.kind, bytes=size, topics=topics, missing=_missing(topics, table.fault)
    )


def _topic(topic: BagTopic) -> BagTopicDoc:
    first_s, last_s = topic.first_utc_s, topic.last_utc_s
    dated = first_s is not None and 0.0 <= first_s < _LATEST_UTC_S
    return BagTopicDoc(
        name=topic.name,
        type=topic.type,
        role=_role(topic.type),
        messages=topic.count,
        said=topic.said,
        first_utc=iso_utc(first_s) if dated and first_s is not None else None,
        span_s=None if first_s is None or last_s is None else last_s - first_s,
    )


def _role(kind: str) -> BagRole:
    from telemetry.recording.ros.bag_types import BAG_POINT_TYPES, FIX, POSE_TYPES, TF_TYPES

    groups: tuple[tuple[frozenset[str], BagRole], ...] = (
        (BAG_POINT_TYPES, "points"),
        (POSE_TYPES, "poses"),
        (TF_TYPES, "transforms"),
        (frozenset({FIX}), "fix"),
    )
    for types, role in groups:
        if kind in types:
            return role
    return "other"


def _missing(topics: list[BagTopicDoc], fault: str) -> list[str]:
    readable = {topic.role for topic in topics if topic.messages}
    said = [f"It is damaged: nothing could be read after a place ({fault})."] if fault else []
    if "points" not in readable:
        said.append(
            "It holds no points (PointCloud2, LaserScan, Range, Livox's CustomMsg): no recording can be made of it."
        )
    if not readable & {"poses", "transforms"}:
        said.append("It holds neither poses nor transforms: nothing tells where the robot was.")
    elif "transforms" not in readable:
        said.append("It holds no transforms: only a sensor whose points are in the robot's own frame can be placed.")
    if "fix" not in readable:
        said.append("It holds no NavSatFix: give latitude and longitude of the first pose.")
    if any(topic.messages and topic.first_utc is None for topic in topics):
        said.append("Its clock tells no date.")
    lost = sum(topic.said - topic.messages for topic in topics if topic.said > topic.messages)
    if lost:
        said.append(f"{lost:,} messages that its index counts cannot be read.")
    return said
