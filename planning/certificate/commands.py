"""Which mission commands move a multicopter along straight lines, which do not move it, which cannot be judged.

Numbers are MAV_CMD values. Whatever is in none of the tables is unknown and cannot be judged either.
"""

from __future__ import annotations

WAYPOINT, RETURN_TO_LAUNCH, LAND, TAKEOFF = 16, 20, 21, 22
STRAIGHT = frozenset({WAYPOINT, 17, 19})
"""Fly straight to the place and pass or hold there: waypoint, loiter unlimited, loiter for a time."""
TAKEOFFS = frozenset({TAKEOFF, 84})
"""Take-off and VTOL take-off, which a multicopter flies alike."""

REMOVE = "Remove it."
BENT = {
    18: ("circles around a point", "Replace the circle by waypoints along it."),
    31: ("spirals to an altitude", "Replace it by a waypoint with a hold, and give the next one the height."),
    82: ("flies a spline", "Make it a plain waypoint."),
}
"""(what it does, mend): go to a place, but not on a straight line."""

_HANDED_OVER = "Remove it: what a companion computer flies is not in the mission."
OTHER_UNJUDGED = {
    85: ("is a VTOL landing", "End the mission with a return or a landing."),
    92: ("hands the vehicle over to a companion computer", _HANDED_OVER),
    113: ("changes altitude", "Give the height to the next waypoint instead."),
    176: ("changes the flight mode", "Remove it; end the mission with a return or a landing."),
    177: ("jumps to another item", "Write the repeated items out, one after the other."),
    179: ("moves home, to which altitudes and the return refer", "Remove it; set home before the upload."),
    180: (
        "changes a parameter, such as the return height",
        "Remove it; set the parameter on the vehicle before the flight.",
    ),
    185: ("ends the flight", REMOVE),
    186: ("changes altitude", "Give the height to the next waypoint instead."),
    189: ("starts a landing sequence", "Remove it; end the mission with a return or a landing."),
    191: ("breaks off a landing", REMOVE),
    192: ("flies somewhere else", "Make it a plain waypoint."),
    193: ("pauses the mission", "Remove it; give the waypoint before it a hold time."),
    208: ("releases a parachute", REMOVE),
    209: ("tests a motor", REMOVE),
    212: ("starts tuning in flight", REMOVE),
    218: ("triggers an auxiliary function, which may change the flight mode", REMOVE),
    221: ("hands the vehicle over to another system", _HANDED_OVER),
    222: ("hands the vehicle over to another system", _HANDED_OVER),
    223: ("starts or stops an engine", REMOVE),
}
UNKNOWN = ("is not a command known here", "Remove it, or replace it by plain waypoints.")

_STAY = frozenset(
    {93, 112, 114, 115, 178, 181, 182, 183, 184, 187, 188, 194, 195, 196, 197, 198}
    | set(range(200, 208))
    | {211, 214, 215, 216, 217, 220}
    | {530, 531, 532, 533, 534, 1000, 1001}
)


def stays(command: int) -> bool:
    """Whether the command neither moves the vehicle nor changes what later items mean."""
    return command in _STAY or 2000 <= command < 3000
