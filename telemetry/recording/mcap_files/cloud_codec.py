"""Point clouds in the schema that MCAP viewers draw, with the fields of ours beside it: one message serves both."""

from __future__ import annotations

import base64
import json
import math
from typing import Any

import msgspec

from mapping.sensor_frames import CloudFrame, RadarFrame
from telemetry.errors import RecordingError

SCHEMA_NAME = "foxglove.PointCloud"
_FLOAT32 = 7
_NUMBER = {"type": "number"}
_STRIDE_BYTES = 12
_LATEST_UTC_S = 4e9
_FIELDS = [{"name": name, "offset": 4 * number, "type": _FLOAT32} for number, name in enumerate("xyz")]
_FROM_RIGHT_FORWARD_UP = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": -math.sqrt(0.5), "w": math.sqrt(0.5)},
}
"""Viewers count forward, left and up; sensors here right, forward and up."""


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_SCHEMA = {
    "title": SCHEMA_NAME,
    **_object(
        timestamp=_TIME,
        frame_id={"type": "string"},
        pose=_object(
            position=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
            orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
        ),
        point_stride={"type": "integer"},
        fields={
            "type": "array",
            "items": _object(name={"type": "string"}, offset={"type": "integer"}, type={"type": "integer"}),
        },
        data={"type": "string", "contentEncoding": "base64"},
    ),
}


def schema() -> bytes:
    return json.dumps(_SCHEMA).encode()


def point_cloud(frame: CloudFrame | RadarFrame) -> dict[str, Any]:
    """The frame's points as viewers know them."""
    sec, nsec = divmod(round(frame.t_utc_s * 1e9), 1_000_000_000) if 0 < frame.t_utc_s < _LATEST_UTC_S else (0, 0)
    return {
        "timestamp": {"sec": sec, "nsec": nsec},
        "frame_id": "vehicle",
        "pose": _FROM_RIGHT_FORWARD_UP,
        "point_stride": _STRIDE_BYTES,
        "fields": _FIELDS,
        "data": base64.b64encode(frame.xyz_m).decode(),
    }


class _Stored(msgspec.Struct):
    t_mono_s: float
    t_utc_s: float
    number: int
    source: str
    voxel_m: float
    data: bytes


class CloudCodec:
    """Writes and reads cloud frames."""

    kind = CloudFrame
    schema_name = SCHEMA_NAME

    def __init__(self) -> None:
        self.schema = schema()
        self._decoder = msgspec.json.Decoder(_Stored)

    def encode(self, frame: CloudFrame) -> bytes:
        own = {name: getattr(frame, name) for name in ("t_mono_s", "t_utc_s", "number", "source", "voxel_m")}
        return msgspec.json.encode(own | point_cloud(frame))

    def decode(self, data: bytes) -> CloudFrame:
        """Raises RecordingError for what is no such message."""
        try:
            found = self._decoder.decode(data)
        except msgspec.MsgspecError as error:
            raise RecordingError(f"A message is no CloudFrame: {error}.") from error
        return CloudFrame(found.t_mono_s, found.t_utc_s, found.number, found.source, found.data, found.voxel_m)
