"""Writes messages of ROS 2 into one MCAP file, as its own recorder does: CDR, with the messages' definitions."""

from __future__ import annotations

from pathlib import Path
from secrets import token_hex
from types import TracebackType

from mcap.writer import Writer

from mapping.geometry.arrays import F32, F64
from telemetry.recording.ros.bag_types import CLOUD, FIX, ODOMETRY, TF
from telemetry.recording.ros.ros2_messages import OCTOMAP, Ros2Messages


class Ros2Writer:
    """One file; messages in any order. It is written aside, and only there when it is whole."""

    def __init__(self, path: Path, *, library: str) -> None:
        self._messages = Ros2Messages()
        self._path, self._aside = path, path.with_name(f".tmp-{path.name}-{token_hex(8)}")
        self._file = self._aside.open("wb")
        self._writer = Writer(self._file)
        self._writer.start(profile="ros2", library=library)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self.counts: dict[str, int] = {}
        """Messages by topic."""

    def __enter__(self) -> Ros2Writer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            with self._file:
                if kind is None:
                    self._writer.finish()
            if kind is None:
                self._aside.replace(self._path)
        finally:
            self._aside.unlink(missing_ok=True)

    def odometry(self, topic: str, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> None:
        self._write(topic, stamp_ns, ODOMETRY, self._messages.odometry(stamp_ns, parent, child, xyz_m, q_wxyz))

    def transform(self, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> None:
        self._write("/tf", stamp_ns, TF, self._messages.transform(stamp_ns, parent, child, xyz_m, q_wxyz))

    def fix(self, topic: str, stamp_ns: int, frame: str, place: tuple[float, float, float], *, has_fix: bool) -> None:
        self._write(topic, stamp_ns, FIX, self._messages.fix(stamp_ns, frame, place, has_fix=has_fix))

    def cloud(self, topic: str, stamp_ns: int, frame: str, columns: dict[str, F32]) -> None:
        self._write(topic, stamp_ns, CLOUD, self._messages.cloud(stamp_ns, frame, columns))

    def octomap(self, topic: str, stamp_ns: int, frame: str, resolution_m: float, data: bytes) -> None:
        """A binary tree: ``data`` as ``tree_data`` makes it."""
        self._write(topic, stamp_ns, OCTOMAP, self._messages.octomap(stamp_ns, frame, resolution_m, data))

    def _write(self, topic: str, stamp_ns: int, kind: str, data: bytes) -> None:
        self._writer.add_message(self._channel(topic, kind), log_time=stamp_ns, publish_time=stamp_ns, data=data)
        self.counts[topic] = self.counts.get(topic, 0) + 1

    def _channel(self, topic: str, kind: str) -> int:
        if kind not in self._schemas:
            definition = self._messages.definition_of(kind).encode()
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition)
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        return self._channels[topic]
