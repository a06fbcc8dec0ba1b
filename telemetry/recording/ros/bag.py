"""A bag of ROS 1 or ROS 2, decoded in a confined process: its table of topics, and what maps are made of."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from planning.errors import RasterError
from planning.terrain.rasters import sandbox
from planning.terrain.rasters.header import RasterLimits
from telemetry.errors import RecordingError
from telemetry.recording.file_types import MCAP_MAGIC
from telemetry.recording.ros.bag_types import FIX, KNOWN_TYPES, MOST_LAT_DEG, MOST_LON_DEG, TABLES

BagKind = Literal["ros1", "folder", "mcap", "db3"]
Progress = Callable[[float], None]
Rows = NDArray[np.void]

LIMITS = RasterLimits(max_memory_bytes=3 * 2**30, header_s=60.0)
_DECODER = __name__.rpartition(".")[0]
_SMALLER = "Cut a shorter piece out of it, or one with fewer topics (rosbag filter, ros2 bag convert)."
_ROS1_MAGIC, _SQLITE_MAGIC, _METADATA = b"#ROSBAG V2.0", b"SQLite format 3\x00", "metadata.yaml"
_OUR_LIBRARY = "hedgehop"
_ENDINGS: dict[BagKind, str] = {"ros1": ".bag", "folder": "", "mcap": ".mcap", "db3": ".db3"}


@dataclass(frozen=True, slots=True)
class BagTopic:
    name: str
    type: str
    """As ROS 2 writes it: sensor_msgs/msg/PointCloud2."""
    count: int
    """Of messages that can be read."""
    said: int
    """As the bag's own index counts them."""
    first_utc_s: float | None
    last_utc_s: float | None
    """When they were recorded; None where there is none."""

    @property
    def is_known(self) -> bool:
        return self.type in KNOWN_TYPES


@dataclass(frozen=True, slots=True)
class BagTable:
    kind: BagKind
    topics: tuple[BagTopic, ...]
    fault: str
    """Why nothing after a place could be read; empty if all could."""

    def of_types(self, types: Collection[str]) -> list[BagTopic]:
        return [topic for topic in self.topics if topic.type in types]


@dataclass(frozen=True, slots=True)
class BagContents:
    """Rows as in ``bag_types.TABLES``, and the names of frames that they count in."""

    frames: Rows
    """In the order of their stamps."""
    points: Rows
    transforms: Rows
    poses: Rows
    places: Rows
    names: tuple[str, ...]
    unstamped: int
    """Messages without a time of their own: that of recording stands for it."""
    without_place: int
    """Points that were no numbers."""
    broken: int
    """Messages that contradict themselves."""
    first_broken: str
    other_clock: int = 0
    """Messages whose sensor's own clock tells another time than their header."""


def bag_kind(path: Path) -> BagKind | None:
    """By content, never by name; None for what is no bag, and for Hedgehop's own recordings."""
    if path.is_dir():
        return "folder" if (path / _METADATA).is_file() else None
    if not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(1024)
    if head.startswith(_ROS1_MAGIC):
        return "ros1"
    if head.startswith(_SQLITE_MAGIC):
        return "db3"
    return "mcap" if head.startswith(MCAP_MAGIC) and not _is_own(head) else None


def _is_own(head: bytes) -> bool:
    """A recording of Hedgehop's, as far as its first record says; what it writes for ROS has a profile."""
    try:
        profile, rest = _text(head[len(MCAP_MAGIC) + 9 :])
        library, _ = _text(rest)
    except struct.error:
        return False
    return not profile and library.startswith(_OUR_LIBRARY)


def _text(data: bytes) -> tuple[str, bytes]:
    (length,) = struct.unpack_from("<I", data)
    return data[4 : 4 + length].decode("utf-8", "replace"), data[4 + length :]


def list_bag(path: Path, *, progress: Progress | None = None) -> BagTable:
    """Reads all of it once. Raises RecordingError for what is no bag or holds nothing that can be read."""
    with sandbox.private_directory() as directory:
        kind, found = _job("list_bag", path, directory, progress)
    topics = tuple(
        BagTopic(row["topic"], row["type"], row["count"], row["said"], *_times(row)) for row in found["topics"]
    )
    return BagTable(kind, topics, found["fault"])


def _times(row: dict[str, Any]) -> tuple[float | None, float | None]:
    return (row["first_ns"] / 1e9, row["last_ns"] / 1e9) if row["count"] else (None, None)


def read_bag(path: Path, table: BagTable, *, points: str, pose: str, progress: Progress | None = None) -> BagContents:
    """The messages of both topics, all transforms and all NavSatFix. Raises RecordingError."""
    topics = [points, pose, *(topic.name for topic in table.of_types({FIX}))]
    wanted = {"points": points, "pose": pose, "topics": topics}
    with sandbox.private_directory() as directory:
        _, found = _job("read_bag", path, directory, progress, **wanted)
        return contents_of(directory, found)


def contents_of(directory: Path, found: dict[str, Any]) -> BagContents:
    """Of the files that the decoding process has left there, and of what it said; neither is believed unseen.

    Raises RecordingError where they do not fit together.
    """
    rows = {name: np.fromfile(directory / name, dtype) for name, dtype in TABLES.items()}
    names, counts = tuple(map(str, found["names"])), found["counts"]
    if not _fits(rows, len(names)):
        raise RecordingError("What was decoded of it does not fit together.", advice="Copy or record it again.")
    rows["frames"] = np.sort(rows["frames"], order="stamp_ns", kind="stable")
    return BagContents(
        **rows,
        names=names,
        unstamped=counts.get("unstamped", 0),
        without_place=counts.get("without_place", 0),
        broken=counts.get("broken", 0),
        first_broken=found["broken"],
        other_clock=counts.get("other_clock", 0),
    )


def _fits(rows: dict[str, Rows], names: int) -> bool:
    """Whether all numbers of frames and points are of some that are there, and all places on Earth."""
    frames, moves = rows["frames"], [rows["transforms"], rows["poses"]]
    numbers = [frames["frame"], *(move["parent"] for move in moves), rows["transforms"]["child"]]
    ends = frames["first"] + frames["count"]
    lat_deg, lon_deg = rows["places"]["lat_deg"], rows["places"]["lon_deg"]
    return (
        all(bool(((number >= 0) & (number < names)).all()) for number in numbers)
        and bool((rows["poses"]["child"] < names).all())
        and bool(((np.abs(lat_deg) <= MOST_LAT_DEG) & (np.abs(lon_deg) <= MOST_LON_DEG)).all())
        and bool(((frames["first"] >= 0) & (frames["count"] >= 0) & (ends <= len(rows["points"]))).all())
    )


def _job(job: str, path: Path, directory: Path, progress: Progress | None, **fields: Any) -> tuple[BagKind, Any]:
    kind = bag_kind(path)
    if kind is None:
        what = "There is no such bag." if not path.exists() else "It is no bag of ROS."
        advice = "Give a .bag of ROS 1, or of ROS 2 the folder with metadata.yaml, an .mcap or a .db3."
        raise RecordingError(what, where=path.name, advice=advice)
    link = directory / (token_hex(8) + _ENDINGS[kind])
    link.symlink_to(path.resolve(), target_is_directory=kind == "folder")
    order = {"job": job, "decoder": _DECODER, "format": kind, "source": str(link), "directory": str(directory)}
    try:
        found = sandbox.run_job(
            order | fields, directory=directory, limits=LIMITS, where=path.name, on_header=lambda _: {},
            progress=None if progress is None else lambda _, share: progress(share), smaller=_SMALLER,
        )  # fmt: skip
    except RasterError as error:
        raise RecordingError(error.what, where=error.where, advice=error.advice) from error
    return kind, found
