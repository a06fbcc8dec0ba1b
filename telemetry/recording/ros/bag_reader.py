"""Opens a bag of any kind and decodes its messages, by rosbags. Runs in the decoding process, and nowhere else."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from ruamel.yaml import YAML

from telemetry.errors import RecordingError
from telemetry.recording.ros.bag_types import LIVOX_TYPES, LONGEST_NAME, MOST_TOPICS
from telemetry.recording.ros.livox_messages import MESSAGE_DEFINITION, POINT_DEFINITION

_STANDARD = {True: Stores.ROS1_NOETIC, False: Stores.ROS2_HUMBLE}
"""Of bags that carry no definitions."""


class OpenBag:
    """A bag while it is open; whatever rosbags raises of a broken one goes through."""

    def __init__(self, reader: Ros1Reader | Ros2Reader) -> None:
        self._reader, self._is_ros1 = reader, isinstance(reader, Ros1Reader)
        self.connections: list[Connection] = list(reader.connections)
        if len({each.topic for each in self.connections}) > MOST_TOPICS:
            raise RecordingError(f"It has more than {MOST_TOPICS:,} topics.", advice="Record fewer topics.")
        if any(len(name) > LONGEST_NAME for each in self.connections for name in (each.topic, each.msgtype)):
            raise RecordingError("Its names of topics are absurdly long.", advice="Record it again.")
        self.message_count = sum(max(0, each.msgcount) for each in self.connections)
        self._store: Any = None

    def raw(self, topics: Collection[str] | None = None) -> Iterator[tuple[Connection, int, bytes | memoryview]]:
        """(connection, when it was recorded in ns, bytes)"""
        wanted = [each for each in self.connections if topics is None or each.topic in topics]
        if wanted:
            yield from self._reader.messages(wanted)

    def decoded(self, topics: Collection[str]) -> Iterator[tuple[str, str, int, Any]]:
        """(topic, type, when it was recorded in ns, message); None for a message that is no such message."""
        self._store = self._store or self._typestore(topics)
        decode = self._store.deserialize_ros1 if self._is_ros1 else self._store.deserialize_cdr
        for connection, t_ns, data in self.raw(topics):
            try:
                message = decode(data, connection.msgtype)
            except MemoryError:
                raise
            except Exception:  # rosbags decodes by generated code, which fails in any way
                message = None
            yield connection.topic, connection.msgtype, t_ns, message

    def _typestore(self, topics: Collection[str]) -> Any:
        """The bag's own definitions of what is decoded; the standard ones for what it does not define."""
        store, own = get_typestore(_STANDARD[self._is_ros1]), dict[str, Any]()
        for connection in self.connections:
            definition = connection.msgdef
            if connection.topic not in topics:
                continue
            if definition.format == MessageDefinitionFormat.NONE:
                own |= _livox_types(connection.msgtype) if connection.msgtype in LIVOX_TYPES else {}
                continue
            is_idl = definition.format == MessageDefinitionFormat.IDL
            own |= (
                get_types_from_idl(definition.data)
                if is_idl
                else get_types_from_msg(definition.data, connection.msgtype)
            )
        if not own:
            return store
        wanted = {each.msgtype for each in self.connections if each.topic in topics}
        typestore = get_typestore(Stores.EMPTY)
        typestore.register({**(store.fielddefs if not wanted <= own.keys() else {}), **own})
        return typestore


def _livox_types(name: str) -> dict[str, Any]:
    point = name.replace("CustomMsg", "CustomPoint")
    return {**get_types_from_msg(POINT_DEFINITION, point), **get_types_from_msg(MESSAGE_DEFINITION, name)}


@contextmanager
def open_bag(path: Path, kind: str) -> Iterator[OpenBag]:
    """``kind``: ros1, or any kind of ROS 2."""
    if kind == "folder":
        _refuse_packed_files(path)
    with ExitStack() as stack:
        reader = stack.enter_context(Ros1Reader(path) if kind == "ros1" else Ros2Reader(path))
        yield OpenBag(reader)


def _refuse_packed_files(folder: Path) -> None:
    """rosbags would unpack all of them on opening, however much they become."""
    found = YAML(typ="safe").load((folder / "metadata.yaml").read_text())
    about = found.get("rosbag2_bagfile_information") if isinstance(found, dict) else None
    if isinstance(about, dict) and str(about.get("compression_mode")).lower() == "file":
        what = "Its files are compressed as a whole (compression_mode: file)."
        raise RecordingError(what, advice="Write it anew with compression_mode: message or none (ros2 bag convert).")
