"""Which mission commands move a multicopter along straight lines, which do not move it, which cannot be judged.

Numbers are MAV_CMD values. Whatever is in none of the tables is unknown and cannot be judged either.
"""

from __future__ import annotations

WAYPOINT, RETURN_TO_LAUNCH, LAND, TAKEOFF = 16, 20, 21, 22
STRAIGHT = frozenset({WAYPOINT, 17, 19})
"""Fly straight to the place and pass or hold there: waypoint, loiter unlimited, loiter for a time."""
TAKEOFFS = frozenset({TAKEOFF, 84})
"""Take-off and VTOL take-off, which a multicopter flies alike."""

BENT = {
    18: "circles around a point",
    31: "spirals to an altitude",
    82: "flies a spline",
}
"""Go to a place, but not on a straight line."""

OTHER_UNJUDGED = {
    85: "is a VTOL landing",
    92: "hands the vehicle over to a companion computer",
    113: "changes altitude",
    176: "changes the flight mode",
    177: "jumps to another item",
    179: "moves home, to which altitudes and the return refer",
    180: "changes a parameter, such as the return height",
    185: "ends the flight",
    186: "changes altitude",
    189: "starts a landing sequence",
    191: "breaks off a landing",
    192: "flies somewhere else",
    193: "pauses the mission",
    208: "releases a parachute",
    209: "tests a motor",
    212: "starts tuning in flight",
    218: "triggers an auxiliary function, which may change the flight mode",
    221: "hands the vehicle over to another system",
    222: "hands the vehicle over to another system",
    223: "starts or stops an engine",
}

_STAY = frozenset(
    {93, 112, 114, 115, 178, 181, 182, 183, 184, 187, 188, 194, 195, 196, 197, 198}
    | set(range(200, 208))
    | {211, 214, 215, 216, 217, 220}
    | {530, 531, 532, 533, 534, 1000, 1001}
)


def stays(command: int) -> bool:
    """Whether the command neither moves the vehicle nor changes what later items mean."""
    return command in _STAY or 2000 <= command < 3000
