"""Messages, requests and answers as MessagePack, and which topic carries what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar, cast, get_args

import msgspec

from planning.errors import DescribedError
from telemetry.errors import BusError
from telemetry.topics.messages import MESSAGE_TYPES, REPLAY_PREFIX, ErrorInfo, Published, Topic

T = TypeVar("T")

EACH_ARRIVES = frozenset(
    {
        Topic.TEXT,
        Topic.RAW,
        Topic.COMMAND,
        Topic.RADAR_FRAME,
        Topic.SLAM_POSE,
        Topic.RANGE_FRAME,
        Topic.UWB_SCAN,
        Topic.MAP_RADAR,
        Topic.MAP_VISION,
        Topic.MAP_VISION_FLIGHT,
        Topic.MAP_RANGES,
        Topic.ALERT,
    }
)
"""Topics that are streams of events. Of all the others only the latest message counts, and it is kept."""


def plain_name(topic: str) -> str:
    """``replay/<topic>`` carries what ``<topic>`` carries."""
    return topic.removeprefix(REPLAY_PREFIX)


def is_kept(topic: str) -> bool:
    """Whether a late subscriber gets the last message of this topic."""
    return plain_name(topic) not in EACH_ARRIVES


def encode_message(topic: str, message: Published) -> bytes:
    """Raises BusError for a topic that is not in the table or carries another type."""
    expected = MESSAGE_TYPES.get(plain_name(topic))
    if expected is None:
        raise BusError(
            f"There is no topic {topic!r} on the bus.", advice="Use a name of telemetry.topics.messages.Topic."
        )
    if not isinstance(message, expected):
        raise BusError(f"{topic} carries {expected.__name__}, not {type(message).__name__}.")
    return encode(message)


def decode_message(topic: str, payload: bytes) -> Published:
    """Raises BusError for what another version of Hedgehop may have sent."""
    cls = MESSAGE_TYPES.get(plain_name(topic))
    if cls is None:
        raise BusError(f"A message came under {topic!r}, which is no topic.")
    return cast(Published, _decode(payload, cls, topic))


def encode(value: object) -> bytes:
    return msgspec.msgpack.encode(value, enc_hook=_plain_number)


def encode_request(request: object) -> bytes:
    return encode((type(request).__name__, request))


def decode_request(payload: bytes, requests: Any) -> Any:
    """``requests`` is a dataclass or a union of dataclasses; the class name on the wire chooses among them."""
    classes = {cls.__name__: cls for cls in get_args(requests) or (requests,)}
    name, body = cast(tuple[str, msgspec.Raw], _decode(payload, tuple[str, msgspec.Raw], "request"))
    if name not in classes:
        raise BusError(
            f"{name!r} is not understood there.",
            advice="Server and nodes seem to be of different versions: end all of them and start again.",
        )
    return _decode(body, classes[name], name)


def encode_answer(result: object) -> bytes:
    return encode((True, result))


def encode_failure(info: ErrorInfo) -> bytes:
    return encode((False, info))


def decode_answer(payload: bytes, result: type[T]) -> T:
    """Returns the result, or raises the error that the handler raised."""
    worked, body = cast(tuple[bool, msgspec.Raw], _decode(payload, tuple[bool, msgspec.Raw], "answer"))
    if not worked:
        raise error_of(cast(ErrorInfo, _decode(body, ErrorInfo, "answer")))
    return cast(T, _decode(body, result, "answer"))


def _decode(payload: bytes | msgspec.Raw, cls: Any, where: str) -> object:
    try:
        return msgspec.msgpack.decode(payload, type=cls)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise BusError(
            f"What came over the bus cannot be understood ({error}).",
            where=where,
            advice="Server and nodes seem to be of different versions: end all of them and start again.",
        ) from error


def _plain_number(value: object) -> object:
    """numpy's numbers are no Python numbers for the encoder."""
    item = getattr(value, "item", None)
    if item is None or getattr(value, "shape", None) != ():
        raise NotImplementedError(f"{type(value).__name__} cannot travel on the bus")
    return item()


def error_of(info: ErrorInfo) -> DescribedError:
    """The error again, of the class that has its code; a ``BusError`` when this process knows no such class."""
    return _class_of(info.code)(info.what, where=info.where, advice=info.advice)


def _class_of(code: str) -> type[DescribedError]:
    # Classes of other floors appear when their modules are imported, so the table is not made once for all.
    return next((cls for cls in _subclasses(DescribedError) if cls.code == code), BusError)


def _subclasses(cls: type[DescribedError]) -> Iterator[type[DescribedError]]:
    for child in cls.__subclasses__():
        yield child
        yield from _subclasses(child)
