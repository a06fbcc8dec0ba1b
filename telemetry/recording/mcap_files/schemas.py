"""Published dataclasses as JSON with a JSON Schema each, plain enough for the viewers that read MCAP.

Those viewers want one type per field: what is None is left out of the JSON, and every field stands for its own type.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from functools import cache
from typing import Any

import msgspec

from mapping.sensor_frames import CloudFrame
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.cloud_codec import CloudCodec

_PLAIN: dict[object, dict[str, str]] = {
    float: {"type": "number"},
    int: {"type": "integer"},
    str: {"type": "string"},
    bool: {"type": "boolean"},
    bytes: {"type": "string", "contentEncoding": "base64"},
}


def json_schema(kind: Any) -> dict[str, Any]:
    """JSON Schema of a type as published messages are made of; TypeError for any other."""
    if kind in _PLAIN:
        return dict(_PLAIN[kind])
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        properties = {field.name: json_schema(hints[field.name]) for field in dataclasses.fields(kind)}
        return {"title": getattr(kind, "__name__", ""), "type": "object", "properties": properties}
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return {"type": "string", "enum": list(arguments)}
    if origin in (typing.Union, types.UnionType):
        return json_schema(_only_one(kind, [a for a in arguments if a is not type(None)]))
    if origin is tuple:
        return {
            "type": "array",
            "items": json_schema(_only_one(kind, list(dict.fromkeys(a for a in arguments if a is not ...)))),
        }
    raise TypeError(f"{kind} has no schema here")


def _only_one(kind: Any, kinds: list[Any]) -> Any:
    if len(kinds) != 1:
        raise TypeError(f"{kind} holds more than one type")
    return kinds[0]


class JsonCodec:
    """Writes and reads the messages of one type."""

    def __init__(self, kind: type) -> None:
        self.kind = kind
        self.schema_name = f"hedgehop.{kind.__name__}"
        self.schema = json.dumps(json_schema(kind)).encode()
        self._decoder = msgspec.json.Decoder(kind)

    def encode(self, message: Any) -> bytes:
        return msgspec.json.encode(_without_none(msgspec.to_builtins(message)))

    def decode(self, data: bytes) -> Any:
        """Raises RecordingError for what is no such message."""
        try:
            return self._decoder.decode(data)
        except msgspec.ValidationError:
            return self._decode_with_gaps(data)
        except msgspec.DecodeError as error:
            raise self._error(error) from error

    def _decode_with_gaps(self, data: bytes) -> Any:
        """Fields without a default that were None when written are missing in the JSON."""
        try:
            found = msgspec.json.decode(data, type=dict[str, Any])
            return msgspec.convert(_with_none(found, self.kind), self.kind)
        except msgspec.MsgspecError as error:
            raise self._error(error) from error

    def _error(self, error: Exception) -> RecordingError:
        return RecordingError(f"A message is no {self.kind.__name__}: {error}.")


@cache
def codec_of(kind: type) -> JsonCodec | CloudCodec:
    return CloudCodec() if kind is CloudFrame else JsonCodec(kind)


@cache
def _fields(kind: type) -> tuple[tuple[str, Any, bool], ...]:
    """(name, type, has no default) of every field."""
    hints = typing.get_type_hints(kind)
    return tuple(
        (f.name, hints[f.name], f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING)
        for f in dataclasses.fields(kind)
    )


def _with_none(value: Any, kind: Any) -> Any:
    """What ``_without_none`` took away, put back as the type asks for it, also in what is nested."""
    if isinstance(value, list):
        kinds = [k for k in typing.get_args(kind) if k is not ...]
        return [_with_none(v, kinds[0]) if kinds else v for v in value]
    if not isinstance(value, dict):
        return value
    held = next((k for k in (kind, *typing.get_args(kind)) if dataclasses.is_dataclass(k)), None)
    if held is None:
        return value
    gaps = {name: None for name, _, needed in _fields(typing.cast(type, held)) if needed}
    known = {name: _with_none(value[name], k) for name, k, _ in _fields(typing.cast(type, held)) if name in value}
    return gaps | value | known


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {
            name: _without_none(v) if isinstance(v, (dict, list)) else v for name, v in value.items() if v is not None
        }
    if isinstance(value, list):
        return [_without_none(v) for v in value]
    return value
