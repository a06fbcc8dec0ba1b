"""The messages of the sensor link (docs/agent.md): MessagePack maps, told apart by their ``type``.

Body frame: x to the right, y forward, z up, metres. ``t_s`` of frames is when they were measured, on the ground
station's monotonic clock; the agent learns it by ``ping`` and ``pong``.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from mapping.errors import ParameterError
from mapping.geometry.arrays import F32
from mapping.uwb.uwb_params import UwbGeometry
from telemetry.errors import SensorLinkError

PROTOCOL_VERSION = 1
SUBPROTOCOL = "hedgehop.sensors.v1"
PATH = "/api/sensors"
TARGET_COLUMNS = 5
"""x, y, z, radial speed (positive: away), SNR in dB"""
TARGETS_MAX, POINTS_MAX, BINS_MAX = 1000, 100_000, 4096
NOTICE_LONGEST = 200
STEP_M = 0.005
"""Of the coordinates of points."""
REACH_M = STEP_M * 32767
"""16 bits reach 163 m."""


class Hello(msgspec.Struct, frozen=True, tag="hello", forbid_unknown_fields=True):
    """The agent's first message."""

    version: int
    name: str


class Ping(msgspec.Struct, frozen=True, tag="ping", forbid_unknown_fields=True):
    """``t_s``: the agent's own clock."""

    t_s: float


class RadarMessage(msgspec.Struct, frozen=True, tag="radar", forbid_unknown_fields=True):
    """One radar frame: ``targets`` are (N, 5) little-endian float32."""

    number: int
    t_s: float
    targets: bytes


class Cloud(msgspec.Struct, frozen=True, tag="cloud", forbid_unknown_fields=True):
    """One point cloud: ``points`` are (N, 3) little-endian int16, in steps of ``step_m``."""

    number: int
    t_s: float
    voxel_m: float
    step_m: float
    points: bytes


class Slam(msgspec.Struct, frozen=True, tag="slam", forbid_unknown_fields=True):
    """The camera's own pose, body frame -> SLAM frame."""

    t_s: float
    position_m: tuple[float, float, float]
    q_wxyz: tuple[float, float, float, float]
    tracking: Literal["good", "poor", "lost"]


class Uwb(msgspec.Struct, frozen=True, tag="uwb", forbid_unknown_fields=True):
    """One scan of a UWB radar: ``intensity`` is (bins,) little-endian float32; ``bearing_deg`` of its axis, clockwise
    from the nose."""

    number: int
    t_s: float
    intensity: bytes
    bin_m: float = 0.30
    first_bin_m: float = 0.0
    beamwidth_deg: float = 40.0
    bearing_deg: float = 0.0


class Notice(msgspec.Struct, frozen=True, tag="notice", forbid_unknown_fields=True):
    """What the pilot should know of a sensor: why it says nothing, or that it is back."""

    warning: bool
    text: str


class Welcome(msgspec.Struct, frozen=True, tag="welcome", forbid_unknown_fields=True):
    """The ground station's answer to ``hello``."""

    server_s: float


class Pong(msgspec.Struct, frozen=True, tag="pong", forbid_unknown_fields=True):
    """``t_s`` as it was asked, ``server_s`` when that came."""

    t_s: float
    server_s: float


class ArrivalReport(msgspec.Struct, frozen=True, tag="report", forbid_unknown_fields=True):
    """What arrived, once a second."""

    received: int
    lost: int
    late: int
    refused: int
    bytes_per_s: float
    text: str


FromAgent = Hello | Ping | RadarMessage | Cloud | Slam | Uwb | Notice
FromServer = Welcome | Pong | ArrivalReport
_from_agent = msgspec.msgpack.Decoder(FromAgent)
_from_server = msgspec.msgpack.Decoder(FromServer)
_encoder = msgspec.msgpack.Encoder()


def encode(message: FromAgent | FromServer) -> bytes:
    return _encoder.encode(message)


def decode_from_agent(data: bytes) -> FromAgent:
    """Raises SensorLinkError for what this protocol does not know."""
    return cast(FromAgent, _decode(_from_agent, data))


def decode_from_server(data: bytes) -> FromServer:
    """Raises SensorLinkError for what this protocol does not know."""
    return cast(FromServer, _decode(_from_server, data))


def cloud(xyz_m: F32, *, number: int, t_s: float, voxel_m: float) -> Cloud:
    """Points beyond ``REACH_M`` or without a number are left out."""
    steps = np.round(np.asarray(xyz_m, dtype=np.float64) / STEP_M)
    kept = (np.abs(steps) <= np.iinfo(np.int16).max).all(axis=1)
    return Cloud(number, t_s, voxel_m, STEP_M, steps[kept].astype("<i2").tobytes())


def points_of(message: Cloud) -> F32:
    """(N, 3) metres. Raises SensorLinkError for bytes that are no points, or too many."""
    if not 0.0 < message.step_m <= 1.0:
        raise SensorLinkError(f"A step of {message.step_m:g} m makes no sense.", where="cloud")
    steps = _rows(message.points, "<i2", 3, POINTS_MAX, "cloud")
    return steps.astype(np.float32) * np.float32(message.step_m)


def targets_of(message: RadarMessage) -> F32:
    """(N, 5). Raises SensorLinkError for bytes that are no targets, or too many."""
    return _rows(message.targets, "<f4", TARGET_COLUMNS, TARGETS_MAX, "radar").astype(np.float32)


def intensity_of(message: Uwb) -> F32:
    """(bins,). Raises SensorLinkError for bytes that are no scan, and for numbers that no UWB radar has."""
    intensity = _rows(message.intensity, "<f4", 1, BINS_MAX, "uwb").astype(np.float32)[:, 0]
    try:
        UwbGeometry(len(intensity), message.bin_m, message.first_bin_m, math.radians(message.beamwidth_deg))
    except ParameterError as error:
        raise SensorLinkError(error.what, where="uwb", advice=error.advice) from error
    if not (np.isfinite(intensity).all() and abs(message.bearing_deg) <= 360.0):
        raise SensorLinkError("A scan holds what is no number, or looks nowhere.", where="uwb")
    return intensity


def _rows(data: bytes, dtype: str, columns: int, most: int, where: str) -> NDArray[Any]:
    row_bytes = columns * np.dtype(dtype).itemsize
    if len(data) % row_bytes or len(data) // row_bytes > most:
        raise SensorLinkError(
            f"{len(data)} bytes are not 0 to {most} rows of {row_bytes} bytes.",
            where=where,
            advice="See the sensor link's documentation (docs/agent.md).",
        )
    return np.frombuffer(data, dtype=dtype).reshape(-1, columns)


def _decode(decoder: msgspec.msgpack.Decoder[FromAgent] | msgspec.msgpack.Decoder[FromServer], data: bytes) -> object:
    try:
        return decoder.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise SensorLinkError(
            f"A message of the sensor link cannot be understood ({error}).",
            where="sensor link",
            advice="Agent and ground station must be of the same version.",
        ) from error


class Sendable(NamedTuple):
    """The points (N, 3) that can be sent, and how many cannot."""

    xyz_m: F32
    not_finite: int
    out_of_reach: int


def sendable(xyz_m: F32, reach_m: float) -> Sendable:
    """Points whose coordinates are numbers, and none of them beyond ``reach_m``."""
    known = xyz_m[np.isfinite(xyz_m).all(axis=1)]
    near = known[(np.abs(known) <= np.float32(reach_m)).all(axis=1)]
    return Sendable(near, len(xyz_m) - len(known), len(known) - len(near))
