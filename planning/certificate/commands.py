"""Which mission commands move a multicopter along straight lines, which do not move it, which cannot be judged.

Whatever is in none of the tables is unknown and cannot be judged either.
"""

from __future__ import annotations

from planning.basics.mav_cmd import MavCmd

STRAIGHT = frozenset({MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TIME})
"""Fly straight to the place and pass or hold there: waypoint, loiter unlimited, loiter for a time."""
TAKEOFFS = frozenset({MavCmd.NAV_TAKEOFF, MavCmd.NAV_VTOL_TAKEOFF})
"""Take-off and VTOL take-off, which a multicopter flies alike."""

REMOVE = "Remove it."
BENT: dict[int, tuple[str, str]] = {
    MavCmd.NAV_LOITER_TURNS: ("circles around a point", "Replace the circle by waypoints along it."),
    MavCmd.NAV_LOITER_TO_ALT: (
        "spirals to an altitude",
        "Replace it by a waypoint with a hold, and give the next one the height.",
    ),
    MavCmd.NAV_SPLINE_WAYPOINT: ("flies a spline", "Make it a plain waypoint."),
}
"""(what it does, mend): go to a place, but not on a straight line."""

_HANDED_OVER = "Remove it: what a companion computer flies is not in the mission."
OTHER_UNJUDGED: dict[int, tuple[str, str]] = {
    MavCmd.NAV_VTOL_LAND: ("is a VTOL landing", "End the mission with a return or a landing."),
    MavCmd.NAV_GUIDED_ENABLE: ("hands the vehicle over to a companion computer", _HANDED_OVER),
    MavCmd.CONDITION_CHANGE_ALT: ("changes altitude", "Give the height to the next waypoint instead."),
    MavCmd.DO_SET_MODE: ("changes the flight mode", "Remove it; end the mission with a return or a landing."),
    MavCmd.DO_JUMP: ("jumps to another item", "Write the repeated items out, one after the other."),
    MavCmd.DO_SET_HOME: (
        "moves home, to which altitudes and the return refer",
        "Remove it; set home before the upload.",
    ),
    MavCmd.DO_SET_PARAMETER: (
        "changes a parameter, such as the return height",
        "Remove it; set the parameter on the vehicle before the flight.",
    ),
    MavCmd.DO_FLIGHTTERMINATION: ("ends the flight", REMOVE),
    MavCmd.DO_CHANGE_ALTITUDE: ("changes altitude", "Give the height to the next waypoint instead."),
    MavCmd.DO_LAND_START: ("starts a landing sequence", "Remove it; end the mission with a return or a landing."),
    MavCmd.DO_GO_AROUND: ("breaks off a landing", REMOVE),
    MavCmd.DO_REPOSITION: ("flies somewhere else", "Make it a plain waypoint."),
    MavCmd.DO_PAUSE_CONTINUE: ("pauses the mission", "Remove it; give the waypoint before it a hold time."),
    MavCmd.DO_PARACHUTE: ("releases a parachute", REMOVE),
    MavCmd.DO_MOTOR_TEST: ("tests a motor", REMOVE),
    MavCmd.DO_AUTOTUNE_ENABLE: ("starts tuning in flight", REMOVE),
    MavCmd.DO_AUX_FUNCTION: ("triggers an auxiliary function, which may change the flight mode", REMOVE),
    MavCmd.DO_GUIDED_MASTER: ("hands the vehicle over to another system", _HANDED_OVER),
    MavCmd.DO_GUIDED_LIMITS: ("hands the vehicle over to another system", _HANDED_OVER),
    MavCmd.DO_ENGINE_CONTROL: ("starts or stops an engine", REMOVE),
}
UNKNOWN = ("is not a command known here", "Remove it, or replace it by plain waypoints.")

_STAY = frozenset(
    {
        MavCmd.NAV_DELAY, MavCmd.CONDITION_DELAY, MavCmd.CONDITION_DISTANCE, MavCmd.CONDITION_YAW,
        MavCmd.DO_CHANGE_SPEED, MavCmd.DO_SET_RELAY, MavCmd.DO_REPEAT_RELAY, MavCmd.DO_SET_SERVO,
        MavCmd.DO_REPEAT_SERVO, MavCmd.DO_SET_ACTUATOR, MavCmd.DO_RETURN_PATH_START, MavCmd.DO_SET_REVERSE,
        MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI_WPNEXT_OFFSET, MavCmd.DO_SET_ROI_NONE, MavCmd.DO_SET_ROI_SYSID,
        MavCmd.DO_GRIPPER, MavCmd.DO_SET_CAM_TRIGG_INTERVAL, MavCmd.DO_SET_RESUME_REPEAT_DIST, MavCmd.DO_SPRAYER,
        MavCmd.DO_SEND_SCRIPT_MESSAGE, MavCmd.DO_MOUNT_CONTROL_QUAT,
        MavCmd.SET_CAMERA_MODE, MavCmd.SET_CAMERA_ZOOM, MavCmd.SET_CAMERA_FOCUS, MavCmd.SET_STORAGE_USAGE,
        MavCmd.SET_CAMERA_SOURCE, MavCmd.DO_GIMBAL_MANAGER_PITCHYAW, MavCmd.DO_GIMBAL_MANAGER_CONFIGURE,
        *range(200, 208),
    }
)  # fmt: skip


def stays(command: int) -> bool:
    """Whether the command neither moves the vehicle nor changes what later items mean."""
    return command in _STAY or 2000 <= command < 3000
