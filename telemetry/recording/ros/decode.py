"""What the decoding process does with a bag: its table of topics, or points, poses and transforms as files of rows."""

from __future__ import annotations

import math
import resource
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from telemetry.errors import RecordingError
from telemetry.recording.ros.bag_reader import OpenBag, open_bag
from telemetry.recording.ros.bag_types import (
    BAG_POINT_TYPES,
    FIX,
    FRAME,
    LIVOX_TYPES,
    LONGEST_NAME,
    MOST_BYTES,
    MOST_LAT_DEG,
    MOST_LON_DEG,
    MOST_NAMES,
    MOST_POINTS,
    MOST_ROWS,
    PLACE,
    TABLES,
    TF_TYPES,
    TRANSFORM,
)
from telemetry.recording.ros.livox_messages import has_other_clock, slices_of
from telemetry.recording.ros.point_messages import MalformedMessageError, points_of
from telemetry.recording.ros.pose_messages import PoseFound, frame_name, pose_of, stamp_ns_of, transform_of

Json = dict[str, Any]
Send = Callable[..., None]
Ask = Callable[[Json], Json]
_PROGRESS_EVERY = 200
_REINDEX = "Copy it again; of one cut short: rosbag reindex (ROS 1), ros2 bag reindex or mcap recover (ROS 2)."


def list_bag(job: Json, send: Send, ask: Ask) -> None:
    """Every topic with its type, messages that can be read, and the first and last time of recording."""
    _answered(_listed, job, send, ask)


def read_bag(job: Json, send: Send, ask: Ask) -> None:
    """Rows of ``TABLES`` into files in ``job["directory"]``; "topics" says what is wanted: points, pose, places."""
    _answered(_read, job, send, ask)


JOBS: dict[str, Callable[[Json, Send, Ask], None]] = {"list_bag": list_bag, "read_bag": read_bag}


def _answered(work: Callable[[OpenBag, Json, Send], Json], job: Json, send: Send, ask: Ask) -> None:
    """Whatever is wrong with the bag is said; running out of memory or disk is the caller's to say."""
    ask({})
    tempfile.tempdir = job["directory"]
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_BYTES, MOST_BYTES))
    try:
        with open_bag(Path(job["source"]), job["format"]) as bag:
            found = work(bag, job, send)
    except RecordingError as error:
        send("error", kind="format", what=error.what, advice=error.advice)
    except (MemoryError, OSError):
        raise
    except Exception as error:  # rosbags raises whatever its parsers meet
        cause = " ".join(str(error).split())[:200] or type(error).__name__
        send("error", kind="format", what=f"It is corrupt, cut short or no bag ({cause}).", advice=_REINDEX)
    else:
        send("done", **found)


def _listed(bag: OpenBag, job: Json, send: Send) -> Json:
    del job
    topics: dict[tuple[str, str], list[int]] = {(c.topic, c.msgtype): [0, 0, 0] for c in bag.connections}
    said = Counter[tuple[str, str]]()
    for connection in bag.connections:
        said[connection.topic, connection.msgtype] += max(0, connection.msgcount)
    fault = ""
    try:
        for number, (connection, t_ns, _) in enumerate(bag.raw()):
            found = topics[connection.topic, connection.msgtype]
            found[:] = [found[0] + 1, min(found[1], t_ns) if found[0] else t_ns, max(found[2], t_ns)]
            _tell(send, number, bag.message_count)
    except (MemoryError, OSError):
        raise
    except Exception as error:  # what was read until then stands
        fault = " ".join(str(error).split())[:200] or type(error).__name__
    rows = [
        {"topic": topic, "type": kind, "count": count, "said": said[topic, kind], "first_ns": first, "last_ns": last}
        for (topic, kind), (count, first, last) in sorted(topics.items())
    ]
    return {"topics": rows, "fault": fault}


def _read(bag: OpenBag, job: Json, send: Send) -> Json:
    wanted = set(job["topics"])
    wanted |= {each.topic for each in bag.connections if each.msgtype in TF_TYPES}
    with ExitStack() as stack:
        sorter = _Sorter(Path(job["directory"]), job["points"], job["pose"], stack)
        for number, (topic, kind, t_ns, message) in enumerate(bag.decoded(wanted)):
            sorter.take(topic, kind, t_ns, message)
            _tell(send, number, bag.message_count)
    return {"names": list(sorter.names), "counts": dict(sorter.counts), "broken": sorter.broken}


def _tell(send: Send, number: int, of: int) -> None:
    if number % _PROGRESS_EVERY == 0:
        send("progress", stage="read", share=min(1.0, number / max(1, of)))


class _Sorter:
    """Puts what each message holds into the file of its table."""

    def __init__(self, directory: Path, points: str, pose: str, stack: ExitStack) -> None:
        self._points, self._pose = points, pose
        self._files = {name: stack.enter_context((directory / name).open("wb")) for name in TABLES}
        self._rows = Counter[str]()
        self.names: dict[str, int] = {}
        self.counts = Counter[str]()
        self.broken = ""
        """What was wrong with the first message that was."""

    def take(self, topic: str, kind: str, t_ns: int, message: Any) -> None:
        try:
            if message is None:
                raise MalformedMessageError("its bytes are no message of its type")
            self._sort(topic, kind, t_ns, message)
        except (MalformedMessageError, AttributeError, TypeError, ValueError, OverflowError) as error:
            self.counts["broken"] += 1
            self.broken = self.broken or f"{topic}: {str(error)[:200]}"

    def _sort(self, topic: str, kind: str, t_ns: int, message: Any) -> None:
        if kind in TF_TYPES:
            for each in message.transforms:
                self._transform("transforms", self._stamp(each.header, t_ns), transform_of(each), topic)
        elif topic == self._points and kind in LIVOX_TYPES:
            self._sweep(self._stamp(message.header, t_ns), message)
        elif topic == self._points and kind in BAG_POINT_TYPES:
            self._frame(self._stamp(message.header, t_ns), *points_of(message, kind), message)
        elif topic == self._pose:
            self._transform("poses", self._stamp(message.header, t_ns), pose_of(message, kind), topic)
        elif kind == FIX and int(message.status.status) >= 0:
            place = (float(message.latitude), float(message.longitude), float(message.altitude))
            if abs(place[0]) > MOST_LAT_DEG or abs(place[1]) > MOST_LON_DEG:
                raise MalformedMessageError(f"latitude {place[0]:g}°, longitude {place[1]:g}° is no place on Earth")
            if all(map(math.isfinite, place)):
                self._put("places", np.array([(self._stamp(message.header, t_ns), *place)], PLACE))

    def _sweep(self, stamp_ns: int, message: Any) -> None:
        slices, without_place = slices_of(message)
        self.counts["other_clock"] += has_other_clock(message, stamp_ns)
        for number, (after_ns, found) in enumerate(slices):
            self._frame(stamp_ns + after_ns, found, 0 if number else without_place, message)

    def _frame(self, stamp_ns: int, found: np.ndarray[Any, Any], without_place: int, message: Any) -> None:
        name = self._name(message.header.frame_id)
        self.counts["without_place"] += without_place
        first = self._rows["points"]
        self._put("points", found, MOST_POINTS)
        self._put("frames", np.array([(stamp_ns, first, len(found), name)], FRAME))

    def _transform(self, table: str, stamp_ns: int, pose: PoseFound, topic: str) -> None:
        parent, is_static = self._name(pose.parent), topic.rstrip("/").endswith("tf_static")
        number = self._name(pose.child) if pose.child else -1
        self._put(table, np.array([(stamp_ns, parent, number, pose.xyz_m, pose.q_wxyz, is_static)], TRANSFORM))

    def _stamp(self, header: Any, t_ns: int) -> int:
        """Of the header; when it was recorded for one that tells nothing."""
        stamp_ns = stamp_ns_of(header)
        self.counts["unstamped"] += stamp_ns == 0
        return stamp_ns or t_ns

    def _name(self, frame_id: str) -> int:
        name = frame_name(frame_id)
        if len(name) > LONGEST_NAME:
            raise MalformedMessageError("the name of its frame is absurdly long")
        if name not in self.names and len(self.names) >= MOST_NAMES:
            raise RecordingError(f"It has more than {MOST_NAMES:,} frames.", advice="Record fewer transforms.")
        return self.names.setdefault(name, len(self.names))

    def _put(self, table: str, rows: np.ndarray[Any, Any], most: int = MOST_ROWS) -> None:
        self._rows[table] += len(rows)
        if self._rows[table] > most:
            what = f"It holds more than {most:,} {table}."
            raise RecordingError(what, advice="Cut a shorter piece out of it (rosbag filter, ros2 bag convert).")
        self._files[table].write(rows.tobytes())
