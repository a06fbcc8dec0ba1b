"""Mission items as ArduCopter takes, keeps and gives them back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.mav_cmd import MavCmd, MavFrame
from telemetry.simulation.simulator.autopilot.mission_steps import Step, StepKind

KEPT_FRAMES = {0: 0, 5: 0, 3: 3, 6: 3}
"""Frame asked for and frame kept: above the sea, above home. Terrain frames are not simulated."""
PLACES = {16, 17, 19, 21, 22, 179, 189, 195, 201}
"""Commands whose position is kept."""
KINDS: dict[int, StepKind] = {
    16: "waypoint",
    17: "loiter",
    19: "loiter_time",
    20: "return",
    21: "land",
    22: "takeoff",
    93: "delay",
    115: "yaw",
    177: "jump",
    178: "speed",
}
WITHOUT_MOTION = {
    112, 179, 181, 183, 184, 189, 195, 197, 201, 203, 204, 205, 206, 211, 212, 214, 220, 222, 530, 531, 1000, 2000,
    2001, 2500, 2501,
}  # fmt: skip
"""Cameras, gimbals, servos, regions of interest: taken, kept and passed over."""
YAW_MAY_BE_NAN = {16, 21, 22, 195, 197, 201}
WHOLE_SECONDS = {16, 19, 112}
HIGHEST_M = 83_000.0


@dataclass(frozen=True, slots=True)
class KeptItem:
    """What the vehicle remembers of an item."""

    command: int
    frame: int
    params: tuple[float, float, float, float]
    lat_e7: int
    lon_e7: int
    alt_cm: int

    def message(self, seq: int, target: tuple[int, int]) -> wire.MAVLink_mission_item_int_message:
        alt_m = float(np.float32(self.alt_cm) * np.float32(0.01))
        return wire.MAVLink_mission_item_int_message(
            *target, seq, self.frame, self.command, 0, 1, *self.params, self.lat_e7, self.lon_e7, alt_m
        )

    def step(self) -> Step:
        kind = KINDS.get(self.command, "nothing")
        return Step(
            kind,
            lat_deg=self.lat_e7 / 1e7,
            lon_deg=self.lon_e7 / 1e7,
            alt_m=self.alt_cm / 100,
            above="home" if self.frame == 3 else "sea",
            seconds=self.params[0] if kind in ("waypoint", "loiter_time", "delay") else 0.0,
            values=self.params,
        )


def keep(item: wire.MAVLink_mission_item_int_message) -> KeptItem | int:
    """The item as kept, or the MAV_MISSION_RESULT that refuses it."""
    params = (item.param1, item.param2, item.param3, item.param4)
    if item.command not in KINDS and item.command not in WITHOUT_MOTION:
        return wire.MAV_MISSION_UNSUPPORTED
    for index, value in enumerate(params):
        if not math.isfinite(value) and not (index == 3 and item.command in YAW_MAY_BE_NAN):
            return wire.MAV_MISSION_INVALID_PARAM1 + index
    if item.command not in PLACES:
        return KeptItem(item.command, 0, _kept_params(item.command, params), 0, 0, 0)
    return _refusal(item) or KeptItem(
        item.command,
        KEPT_FRAMES[item.frame],
        _kept_params(item.command, params),
        item.x,
        item.y,
        # The float that came over the wire, cut off to whole centimetres.
        int(np.float32(item.z) * np.float32(100)),
    )


def _refusal(item: wire.MAVLink_mission_item_int_message) -> int:
    """0: nothing is wrong with the position."""
    if item.frame not in KEPT_FRAMES:
        return wire.MAV_MISSION_UNSUPPORTED_FRAME
    if abs(item.x) > 900_000_000:
        return wire.MAV_MISSION_INVALID_PARAM5_X
    if abs(item.y) > 1_800_000_000:
        return wire.MAV_MISSION_INVALID_PARAM6_Y
    return 0 if abs(item.z) < HIGHEST_M else wire.MAV_MISSION_INVALID_PARAM7


def _kept_params(command: int, params: tuple[float, ...]) -> tuple[float, float, float, float]:
    if command in (16, 17, 19, 21, 22):
        whole = float(int(max(0.0, min(params[0], 65535.0)))) if command != 17 else 0.0
        return whole, 0.0, 0.0, 0.0
    first, second, third, fourth = (value if math.isfinite(value) else 0.0 for value in params)
    return (float(int(first)) if command in WHOLE_SECONDS else first), second, third, fourth
