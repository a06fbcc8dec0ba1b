"""A plan that is taken up in the air: where its line is joined, and the mission of the way there and the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import FlownLine, Mission, MissionItem
from planning.certificate.commands import STRAIGHT
from planning.errors import CapacityError, MissionError
from planning.missions.mission_items import Heights, Place, unset, waypoint
from planning.terrain.dsm import Dsm

NEXT_M = 2.0
"""So near before an item's place the line is joined at that place itself."""
ALIKE_M = 1.0
"""Of places that are so much farther away than the nearest, the first along the line is taken."""
HEADROOM_M = 0.1
"""Of the way over what was certified: vehicles keep whole centimetres, and places of 1e-7 degrees."""
ALONG = (MavCmd.DO_CHANGE_SPEED,)
"""Set before the way already."""
SET_AGAIN = (
    MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI_NONE, MavCmd.DO_MOUNT_CONTROL, MavCmd.DO_GIMBAL_MANAGER_PITCHYAW,
    MavCmd.DO_SET_CAM_TRIGG_DIST, MavCmd.CONDITION_YAW,
)  # fmt: skip
"""What holds from an item on, and is set again where the line is joined."""


@dataclass(frozen=True, slots=True)
class Joining:
    """Where the line is joined."""

    item: int
    """Index into ``Mission.items`` of the first that is flown to from there."""
    lat_deg: float
    lon_deg: float
    alt_dsm_m: float
    away_m: float
    """From the vehicle."""
    left_out: int
    """Waypoints that lie before it and were not flown."""


def common_places(flown: Mission, planned: Mission, *, next_item: int) -> int:
    """How many items of ``planned`` belong to places that were flown: those that begin both missions alike, before
    item ``next_item`` (1 is the first) of the one that is flown."""
    before = _places(flown.items[: next_item - 1])
    ahead = _places(planned.items)
    count = 0
    for (_, one), (index, other) in zip(before, ahead, strict=False):
        if one != other:
            break
        count = index + 1
    return count


def as_planned(
    taken_up: Mission, passed: Sequence[MissionItem], *, way_items: int, flown_items: int, next_item: int
) -> tuple[Mission, int]:
    """A mission that was taken up as its plan would be flown, and the item that is flown to (1 is the first).

    ``way_items`` of it lead into the plan; ``passed``: the plan's items before those that follow, ``flown_items`` of
    which were flown before. What is left out counts as flown once the plan's line is joined.
    """
    if next_item <= way_items:
        return replace(taken_up, items=tuple(passed[:flown_items])), flown_items + 1
    items = (*passed, *taken_up.items[way_items:])
    return replace(taken_up, items=items), len(passed) + next_item - way_items


def _places(items: Sequence[MissionItem]) -> list[tuple[int, tuple[int, int]]]:
    placed = [(k, item) for k, item in enumerate(items) if item.command in STRAIGHT]
    return [(k, (round(item.lat_deg * 1e7), round(item.lon_deg * 1e7))) for k, item in placed]


def joining(mission: Mission, line: FlownLine, dsm: Dsm, at_m: F64, *, flown_items: int) -> Joining:
    """The nearest place of a mission's line to the vehicle at (3,) x, y, alt_dsm, on a leg that is not flown yet.

    Of places as near as each other the first one, so that as little as can be is left out. Raises MissionError.
    """
    starts_m, ends_m = line.points_m[:-1], line.points_m[1:]
    ahead = [k for k, item in enumerate(line.leg_item) if item >= flown_items and _is_place(mission.items[item])]
    if not ahead:
        raise MissionError(
            "Nothing of this plan is left to be flown from here.", advice="Add points to it, or return home."
        )
    share = _shares(starts_m, ends_m, at_m)
    places_m = starts_m + share[:, None] * (ends_m - starts_m)
    away_m = np.linalg.norm(places_m - at_m, axis=1)
    least_m = min(away_m[k] for k in ahead)
    leg = next(k for k in ahead if away_m[k] <= least_m + ALIKE_M)
    place_m = ends_m[leg] if np.linalg.norm(ends_m[leg] - places_m[leg]) < NEXT_M else places_m[leg]
    item = int(line.leg_item[leg])
    lat_deg, lon_deg = dsm.lat_lon_from_xy(place_m[None, :2])[0]
    return Joining(
        item=item,
        lat_deg=float(lat_deg),
        lon_deg=float(lon_deg),
        alt_dsm_m=float(place_m[2]),
        away_m=float(np.linalg.norm(place_m - at_m)),
        left_out=sum(_is_place(each) for each in mission.items[flown_items:item]),
    )


def _is_place(item: MissionItem) -> bool:
    return item.command in STRAIGHT


def _shares(starts_m: F64, ends_m: F64, at_m: F64) -> F64:
    """(K,) of each leg, where it is nearest."""
    along = ends_m - starts_m
    length_sq = np.maximum(np.sum(along * along, axis=1), 1e-12)
    return np.clip(np.sum((at_m - starts_m) * along, axis=1) / length_sq, 0.0, 1.0)


def joined_mission(mission: Mission, at: Joining, way: Sequence[Place], *, most_items: int) -> Mission:
    """For a vehicle in the air at the first place of ``way``: the way, then the mission from the joining on.

    It has no take-off, so that it can begin nowhere else. Raises CapacityError.
    """
    heights = Heights(MavFrame.GLOBAL_RELATIVE_ALT, mission.home.alt_dsm_m)
    first, *others = (_on_way(place, heights, mission) for place in way)
    speeds = _last_of(mission.items[: at.item], ALONG)
    settings = _last_of(mission.items[: at.item], SET_AGAIN)
    items = (first, *speeds, *others, *settings, *mission.items[at.item :])
    rows = len(items) + (1 if mission.firmware == "ardupilot" else 0)
    if rows > most_items:
        raise CapacityError(
            f"The way and the rest of the plan are {rows} items, and the vehicle takes {most_items}.",
            advice="Delete points, or allow more excess height in Plan.",
        )
    return replace(mission, items=items)


def _on_way(place: Place, heights: Heights, mission: Mission) -> MissionItem:
    higher = replace(place, alt_dsm_m=place.alt_dsm_m + HEADROOM_M)
    return waypoint(higher, heights, hold_s=0.0, yaw_deg=unset(mission.firmware))


def _last_of(items: Sequence[MissionItem], commands: tuple[int, ...]) -> list[MissionItem]:
    """The last of each command, in their order; of speeds the last of each kind."""
    last: dict[tuple[int, float], MissionItem] = {}
    for item in items:
        if item.command in commands:
            kind = item.params[0] if item.command == MavCmd.DO_CHANGE_SPEED else math.inf
            last.pop((item.command, kind), None)
            last[item.command, kind] = item
    return list(last.values())
