"""Heights counted from another home: the flown line stays where it is over the surface model."""

from __future__ import annotations

import math
from dataclasses import replace

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Home, Mission, MissionItem
from planning.certificate.commands import TAKEOFFS
from planning.formats.commands import has_position
from planning.missions.flown import HOME_FRAMES
from planning.missions.mission_items import MIN_TAKEOFF_M, TRUNCATION_GUARD_M


def rereference(mission: Mission, shift_m: float, *, home: Home | None = None) -> Mission:
    """The mission for a home whose ground is ``shift_m`` higher (lower, when negative) than the planned one's.

    Items relative to home are moved the other way, take-off too, rounded up to what vehicles keep; items above
    mean sea level stay as they are. ``home`` takes the place of the planned one.
    """
    items = tuple(_moved(item, shift_m) for item in mission.items)
    return replace(mission, items=items, home=home or mission.home)


def _moved(item: MissionItem, shift_m: float) -> MissionItem:
    if item.frame not in HOME_FRAMES or item.command == MavCmd.NAV_LAND:
        return item  # a landing ends on the ground, wherever that is
    if item.command in TAKEOFFS:
        return replace(item, alt_m=max(_stored(item.alt_m - shift_m), MIN_TAKEOFF_M))
    if not has_position(item):
        return item
    return replace(item, alt_m=_stored(item.alt_m - shift_m))


def _stored(alt_m: float) -> float:
    """Up to the whole centimetre, and a little above it because vehicles cut. 0 cm would mean "as high as now".

    Vehicles cut towards zero: what lies just above -1 cm becomes 0 cm, too.
    """
    centimetres = math.ceil(round((alt_m - TRUNCATION_GUARD_M) * 100.0, 6))
    return (1 if centimetres in (-1, 0) else centimetres) / 100.0 + TRUNCATION_GUARD_M
