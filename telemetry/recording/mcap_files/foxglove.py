"""What MCAP viewers can show of a flight (positions, texts, radar targets, tracks), once more in their schemas."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec

from mapping.geometry.frames import offset_m
from mapping.sensor_frames import RadarFrame
from telemetry.recording.mcap_files import cloud_codec, track_scene
from telemetry.topics.messages import Published, VehicleText
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import VehicleState

HOME_FRAME, VEHICLE_FRAME = "home", "vehicle"
"""East, north, up of home; forward, left, up of the vehicle."""
_APPROXIMATED = 1
_UNKNOWN = 0
_LOG_LEVELS = (5, 5, 5, 4, 3, 2, 2, 1)
"""MAV_SEVERITY 0 to 7 -> fatal, error, warning, info, debug."""

_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})


def _one_of(*names: str) -> dict[str, Any]:
    return {"oneOf": [{"title": name, "const": number} for number, name in enumerate(names)]}


_SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.LocationFix": _object(
        timestamp=_TIME,
        frame_id=_TEXT,
        latitude=_NUMBER,
        longitude=_NUMBER,
        altitude=_NUMBER,
        position_covariance={"type": "array", "items": _NUMBER, "minItems": 9, "maxItems": 9},
        position_covariance_type=_one_of("UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN"),
    ),
    "foxglove.FrameTransform": _object(
        timestamp=_TIME,
        parent_frame_id=_TEXT,
        child_frame_id=_TEXT,
        translation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
        rotation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
    ),
    "foxglove.Log": _object(
        timestamp=_TIME,
        level=_one_of("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"),
        message=_TEXT,
        name=_TEXT,
        file=_TEXT,
        line={"type": "integer"},
    ),
}


@dataclass(frozen=True, slots=True)
class Standard:
    """A message in a standard schema, as JSON."""

    topic: str
    schema_name: str
    data: bytes


def standard_schema(name: str) -> bytes:
    if name == cloud_codec.SCHEMA_NAME:
        return cloud_codec.schema()
    if name == track_scene.SCHEMA_NAME:
        return track_scene.schema()
    return json.dumps({"title": name, **_SCHEMAS[name]}).encode()


class Standards:
    """Derives standard messages from published ones; a position or attitude is written once, when it is new."""

    def __init__(self) -> None:
        self._position_t_mono_s: float | None = None
        self._attitude_t_mono_s: float | None = None

    def of(self, message: Published) -> Iterator[Standard]:
        if isinstance(message, VehicleText):
            yield _log(message)
        elif isinstance(message, RadarFrame):
            yield Standard(
                "foxglove/radar", cloud_codec.SCHEMA_NAME, msgspec.json.encode(cloud_codec.point_cloud(message))
            )
        elif isinstance(message, TracksStatus):
            scene = track_scene.scene_update(message, HOME_FRAME)
            yield Standard("foxglove/tracks", track_scene.SCHEMA_NAME, msgspec.json.encode(scene))
        elif isinstance(message, VehicleState):
            moved = message.position_t_mono_s != self._position_t_mono_s
            turned = message.attitude_t_mono_s != self._attitude_t_mono_s
            self._position_t_mono_s = message.position_t_mono_s
            self._attitude_t_mono_s = message.attitude_t_mono_s
            if moved and message.lat_deg is not None and message.lon_deg is not None:
                yield _location_fix(message, message.lat_deg, message.lon_deg)
            if (moved or turned) and (offset := east_north_up_m(message)) is not None:
                yield _transform(message, offset)


def east_north_up_m(state: VehicleState) -> tuple[float, float, float] | None:
    """Position in metres from home, for pictures (a sphere, no ellipsoid). None while one of them is unknown."""
    lat, lon, up = state.lat_deg, state.lon_deg, state.alt_rel_home_m
    home_lat, home_lon = state.home_lat_deg, state.home_lon_deg
    if lat is None or lon is None or up is None or home_lat is None or home_lon is None:
        return None
    return *offset_m((home_lat, home_lon), lat, lon), up


def enu_from_body_quaternion(
    roll_rad: float, pitch_rad: float, heading_rad: float
) -> tuple[float, float, float, float]:
    """(x, y, z, w) that turns forward-left-up of the vehicle into east-north-up.

    Nose up and right wing down are positive angles, heading is clockwise from north.
    """
    half_yaw, half_pitch, half_roll = (math.pi / 2 - heading_rad) / 2, -pitch_rad / 2, roll_rad / 2
    cy, sy, cp, sp = math.cos(half_yaw), math.sin(half_yaw), math.cos(half_pitch), math.sin(half_pitch)
    cr, sr = math.cos(half_roll), math.sin(half_roll)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _time(t_utc_s: float) -> dict[str, int]:
    sec, nsec = divmod(round(t_utc_s * 1e9), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def _location_fix(state: VehicleState, lat_deg: float, lon_deg: float) -> Standard:
    across, up = state.horizontal_accuracy_m, state.vertical_accuracy_m
    known = across is not None and up is not None
    variances = (across**2, 0, 0, 0, across**2, 0, 0, 0, up**2) if across is not None and up is not None else (0,) * 9
    fix = {
        "timestamp": _time(state.t_utc_s),
        "frame_id": VEHICLE_FRAME,
        "latitude": lat_deg,
        "longitude": lon_deg,
        "altitude": 0.0 if state.alt_amsl_m is None else state.alt_amsl_m,
        "position_covariance": variances,
        "position_covariance_type": _APPROXIMATED if known else _UNKNOWN,
    }
    return Standard("foxglove/position", "foxglove.LocationFix", msgspec.json.encode(fix))


def _transform(state: VehicleState, offset_m: tuple[float, float, float]) -> Standard:
    attitude = enu_from_body_quaternion(state.roll_rad or 0.0, state.pitch_rad or 0.0, state.heading_rad or 0.0)
    transform = {
        "timestamp": _time(state.t_utc_s),
        "parent_frame_id": HOME_FRAME,
        "child_frame_id": VEHICLE_FRAME,
        "translation": dict(zip("xyz", offset_m, strict=True)),
        "rotation": dict(zip("xyzw", attitude, strict=True)),
    }
    return Standard("foxglove/attitude", "foxglove.FrameTransform", msgspec.json.encode(transform))


def _log(text: VehicleText) -> Standard:
    log = {
        "timestamp": _time(text.t_utc_s),
        "level": _LOG_LEVELS[text.severity] if 0 <= text.severity < len(_LOG_LEVELS) else 0,
        "message": text.text,
        "name": "vehicle",
        "file": "",
        "line": 0,
    }
    return Standard("foxglove/log", "foxglove.Log", msgspec.json.encode(log))
