"""Mission items as ArduCopter takes, keeps and gives them back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.basics.mav_cmd import MavCmd, MavFrame
from telemetry.simulation.simulator.autopilot.mission_steps import Step, StepKind

KEPT_FRAMES: dict[int, int] = {
    MavFrame.GLOBAL: MavFrame.GLOBAL,
    MavFrame.GLOBAL_INT: MavFrame.GLOBAL,
    MavFrame.GLOBAL_RELATIVE_ALT: MavFrame.GLOBAL_RELATIVE_ALT,
    MavFrame.GLOBAL_RELATIVE_ALT_INT: MavFrame.GLOBAL_RELATIVE_ALT,
}
"""Frame asked for and frame kept: above the sea, above home. Terrain frames are not simulated."""
PLACES = {
    MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TIME, MavCmd.NAV_LAND, MavCmd.NAV_TAKEOFF,
    MavCmd.DO_SET_HOME, MavCmd.DO_LAND_START, MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI,
}  # fmt: skip
"""Commands whose position is kept."""
KINDS: dict[int, StepKind] = {
    MavCmd.NAV_WAYPOINT: "waypoint",
    MavCmd.NAV_LOITER_UNLIM: "loiter",
    MavCmd.NAV_LOITER_TIME: "loiter_time",
    MavCmd.NAV_RETURN_TO_LAUNCH: "return",
    MavCmd.NAV_LAND: "land",
    MavCmd.NAV_TAKEOFF: "takeoff",
    MavCmd.NAV_DELAY: "delay",
    MavCmd.CONDITION_YAW: "yaw",
    MavCmd.DO_JUMP: "jump",
    MavCmd.DO_CHANGE_SPEED: "speed",
}
WITHOUT_MOTION = {
    MavCmd.CONDITION_DELAY, MavCmd.DO_SET_HOME, MavCmd.DO_SET_RELAY, MavCmd.DO_SET_SERVO, MavCmd.DO_REPEAT_SERVO,
    MavCmd.DO_LAND_START, MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI_NONE, MavCmd.DO_SET_ROI,
    MavCmd.DO_DIGICAM_CONTROL, MavCmd.DO_MOUNT_CONFIGURE, MavCmd.DO_MOUNT_CONTROL, MavCmd.DO_SET_CAM_TRIGG_DIST,
    MavCmd.DO_GRIPPER, MavCmd.DO_AUTOTUNE_ENABLE, MavCmd.DO_SET_CAM_TRIGG_INTERVAL, MavCmd.DO_MOUNT_CONTROL_QUAT,
    MavCmd.DO_GUIDED_LIMITS, MavCmd.SET_CAMERA_MODE, MavCmd.SET_CAMERA_ZOOM, MavCmd.DO_GIMBAL_MANAGER_PITCHYAW,
    MavCmd.IMAGE_START_CAPTURE, MavCmd.IMAGE_STOP_CAPTURE, MavCmd.VIDEO_START_CAPTURE, MavCmd.VIDEO_STOP_CAPTURE,
}  # fmt: skip
"""Cameras, gimbals, servos, regions of interest: taken, kept and passed over."""
FIRST_ALONE = PLACES & KINDS.keys()
"""Places that are flown to: of their parameters the first alone is kept."""
YAW_MAY_BE_NAN = {
    MavCmd.NAV_WAYPOINT, MavCmd.NAV_LAND, MavCmd.NAV_TAKEOFF, MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI_NONE,
    MavCmd.DO_SET_ROI,
}  # fmt: skip
WHOLE_SECONDS = {MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_TIME, MavCmd.CONDITION_DELAY}
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
            above="home" if self.frame == MavFrame.GLOBAL_RELATIVE_ALT else "sea",
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
    if command in FIRST_ALONE:
        whole = 0.0 if command == MavCmd.NAV_LOITER_UNLIM else float(int(max(0.0, min(params[0], 65535.0))))
        return whole, 0.0, 0.0, 0.0
    first, second, third, fourth = (value if math.isfinite(value) else 0.0 for value in params)
    return (float(int(first)) if command in WHOLE_SECONDS else first), second, third, fourth
