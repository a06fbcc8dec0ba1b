"""The simulated PX4's own files about itself: where they lie, and what it says of some of its parameters."""

from __future__ import annotations

import json
import lzma
import zlib
from functools import cache

from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.mavlink.texts.event_messages import ComponentMetadata
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.px4.px4_parameters import PX4_SPECS
from telemetry.simulation.simulator.protocol.made_files import MadeFile

GENERAL, PARAMETERS = "/etc/extras/component_general.json.xz", "/etc/extras/parameters.json.xz"
_URI_BYTES = 100
_ABOUT = {
    "BAT1_CAPACITY": ("mAh", "Capacity of the battery"),
    "COM_DISARM_LAND": ("s", "Time after a landing until it disarms"),
    "MPC_ACC_HOR": ("m/s^2", "Horizontal acceleration in missions"),
    "MPC_JERK_AUTO": ("m/s^3", "Jerk in missions"),
    "MPC_LAND_SPEED": ("m/s", "Speed of the landing"),
    "MPC_TKO_SPEED": ("m/s", "Speed of the take-off"),
    "MPC_XY_CRUISE": ("m/s", "Horizontal speed in missions"),
    "MPC_XY_VEL_MAX": ("m/s", "Largest horizontal speed"),
    "MPC_Z_V_AUTO_DN": ("m/s", "Descent in missions"),
    "MPC_Z_V_AUTO_UP": ("m/s", "Climb in missions"),
    "NAV_ACC_RAD": ("m", "Radius within which a waypoint is reached"),
    "RTL_CONE_ANG": ("deg", "Half angle of the cone within which it returns lower"),
    "RTL_RETURN_ALT": ("m", "Height of the return above home"),
}


def px4_file(parameters: Parameters, path: str) -> MadeFile | None:
    """None: there is none of this path."""
    del parameters
    content = _files().get(path)
    return None if content is None else MadeFile(content, len(content))


def component_metadata(t_boot_ms: int) -> MAVLink_message:
    uri = f"mftp://{GENERAL}".encode().ljust(_URI_BYTES, b"\0")
    return ComponentMetadata(t_boot_ms, _crc32(_files()[GENERAL]), list(uri))


@cache
def _files() -> dict[str, bytes]:
    parameters = _packed({"version": 1, "parameters": [_entry(name) for name in _ABOUT]})
    listed = {"type": 1, "uri": f"mftp://{PARAMETERS}", "fileCrc": _crc32(parameters)}
    return {PARAMETERS: parameters, GENERAL: _packed({"version": 1, "metadataTypes": [listed]})}


def _entry(name: str) -> dict[str, object]:
    (units, text), spec = _ABOUT[name], PX4_SPECS[name]
    kind = "Float" if spec.kind == "float" else "Int32"
    entry: dict[str, object] = {"name": name, "type": kind, "shortDesc": text, "units": units, "default": spec.default}
    limits = {"min": spec.low, "max": spec.high}
    return entry | {key: limit for key, limit in limits.items() if abs(limit) != float("inf")}


def _packed(content: object) -> bytes:
    return lzma.compress(json.dumps(content).encode())


def _crc32(content: bytes) -> int:
    """As MAVLink FTP counts it: from 0 on, not inverted."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF
