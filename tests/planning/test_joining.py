"""A plan is joined at its nearest place that is not flown yet; the way there and the rest are one line."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Home, Mission, MissionItem
from planning.errors import CapacityError, MissionError
from planning.missions.flown import flown_line
from planning.missions.joined_mission import (
    ALIKE_M,
    HEADROOM_M,
    NEXT_M,
    Joining,
    as_planned,
    common_places,
    joined_mission,
    joining,
)
from planning.missions.mission_items import Place
from tests.planning.test_guided_ways import HOME, NORTH, WEST, at, flat, model

DSM = model(flat())
UP_M = 12.0
SQUARE = ((60.0, 60.0), (90.0, 60.0), (90.0, 90.0), (60.0, 90.0), (30.0, 90.0))


def mission(places: tuple[tuple[float, float], ...] = SQUARE, *, firmware: str = "ardupilot") -> Mission:
    home = Home(*at(DSM, *HOME), 100.0)
    none = (0.0, 0.0, 0.0, 0.0)
    speed = MissionItem(MavCmd.DO_CHANGE_SPEED, 2, (1.0, 3.0, -1.0, 0.0))
    photos = MissionItem(MavCmd.DO_SET_CAM_TRIGG_DIST, 2, (5.0, 0.0, 1.0, 0.0))
    up = MissionItem(MavCmd.NAV_TAKEOFF, 3, none, home.lat_deg, home.lon_deg, UP_M)
    points = [MissionItem(MavCmd.NAV_WAYPOINT, 3, none, *at(DSM, *place), UP_M) for place in places]
    end = MissionItem(MavCmd.NAV_RETURN_TO_LAUNCH, 2, none)
    made = "px4" if firmware == "px4" else "ardupilot"
    return Mission(home, (speed, up, points[0], photos, *points[1:], end), firmware=made)


def joined(east_m: float, south_m: float, up_m: float = UP_M, *, flown_items: int = 0) -> Joining:
    plan = mission()
    at_m = np.array([WEST + east_m, NORTH - south_m, 100.0 + up_m])
    return joining(plan, flown_line(plan, DSM), DSM, at_m, flown_items=flown_items)


def place_m(found: Joining) -> F64:
    x, y = DSM.xy_from_lat_lon(np.array([[found.lat_deg, found.lon_deg]]))[0]
    return np.array([x - WEST, NORTH - y, found.alt_dsm_m])


def test_it_is_joined_where_it_is_nearest() -> None:
    found = joined(75.0, 66.0)
    assert place_m(found) == pytest.approx([75.0, 60.0, 112.0], abs=0.01)
    assert (found.item, found.left_out) == (4, 1)
    assert found.away_m == pytest.approx(6.0, abs=0.01)


def test_what_was_flown_is_not_joined_again() -> None:
    found = joined(75.0, 66.0, flown_items=5)
    assert place_m(found)[1] > 60.0
    assert found.item == 5
    with pytest.raises(MissionError, match="Nothing of this plan is left"):
        joined(75.0, 66.0, flown_items=8)


def test_just_before_an_items_place_it_is_joined_there_so_that_its_hold_is_kept() -> None:
    found = joined(88.5, 60.5)
    assert place_m(found)[:2] == pytest.approx([90.0, 60.0], abs=0.01)
    assert found.item == 4


def slow_distance(points_m: F64, leg: int, at_m: F64) -> float:
    a, b = points_m[leg], points_m[leg + 1]
    return min(float(np.linalg.norm(a + share * (b - a) - at_m)) for share in np.linspace(0.0, 1.0, 2001))


@settings(max_examples=40, deadline=None)
@given(east_m=st.floats(5.0, 115.0), south_m=st.floats(5.0, 115.0), up_m=st.floats(2.0, 40.0), flown=st.integers(0, 7))
def test_no_leg_ahead_is_nearer_and_none_as_near_comes_earlier(
    east_m: float, south_m: float, up_m: float, flown: int
) -> None:
    found = joined(east_m, south_m, up_m, flown_items=flown)
    plan = mission()
    line = flown_line(plan, DSM)
    at_m = np.array([WEST + east_m, NORTH - south_m, 100.0 + up_m])
    ahead = {k: slow_distance(line.points_m, k, at_m) for k, item in enumerate(line.leg_item) if item >= flown}
    least_m = min(ahead.values())
    assert found.away_m <= math.hypot(least_m + ALIKE_M, NEXT_M) + NEXT_M
    assert found.item >= flown
    earlier = [away_m for k, away_m in ahead.items() if line.leg_item[k] < found.item]
    assert all(away_m > least_m + ALIKE_M - 0.05 for away_m in earlier)


def way(*places: tuple[float, float, float]) -> list[Place]:
    return [Place(*at(DSM, east_m, south_m), 100.0 + up_m) for east_m, south_m, up_m in places]


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_way_and_rest_are_one_mission_that_begins_in_the_air(firmware: str) -> None:
    plan = mission(firmware=firmware)
    at_m = np.array([WEST + 75.0, NORTH - 66.0, 100.0 + UP_M])
    found = joining(plan, flown_line(plan, DSM), DSM, at_m, flown_items=0)
    rest = joined_mission(plan, found, way((75.0, 66.0, UP_M), (75.0, 60.0, UP_M)), most_items=50)
    commands = [item.command for item in rest.items]
    waypoint, speed, photos = MavCmd.NAV_WAYPOINT, MavCmd.DO_CHANGE_SPEED, MavCmd.DO_SET_CAM_TRIGG_DIST
    assert commands[:4] == [waypoint, speed, waypoint, photos], "at its speed, and with photos from the line on"
    assert commands[4:] == [*[waypoint] * 4, MavCmd.NAV_RETURN_TO_LAUNCH]
    line = flown_line(rest, DSM, begins_in_air=True)
    assert not line.unjudged
    east_south = np.column_stack([line.points_m[:, 0] - WEST, NORTH - line.points_m[:, 1]])
    expected = [(75.0, 66.0), (75.0, 60.0), (90.0, 60.0), (90.0, 90.0), (60.0, 90.0), (30.0, 90.0)]
    assert east_south == pytest.approx(np.array(expected), abs=0.02)
    assert line.points_m[:2, 2] == pytest.approx(100.0 + UP_M + HEADROOM_M, abs=0.011)
    assert line.points_m[2:, 2] == pytest.approx(100.0 + UP_M, abs=0.011)
    from_ground = flown_line(rest, DSM)
    assert "before any take-off" in from_ground.unjudged[0].why, "it is no mission to start from the ground"


def test_a_take_off_in_the_air_is_not_judged() -> None:
    line = flown_line(mission(), DSM, begins_in_air=True)
    assert "take-off in flight" in line.unjudged[0].why


def test_more_items_than_the_vehicle_takes_are_refused() -> None:
    plan = mission()
    found = joining(plan, flown_line(plan, DSM), DSM, np.array([WEST + 75.0, NORTH - 66.0, 112.0]), flown_items=0)
    places = way((75.0, 66.0, UP_M), (75.0, 60.0, UP_M))
    assert len(joined_mission(plan, found, places, most_items=10).items) == 9
    with pytest.raises(CapacityError, match="10 items, and the vehicle takes 9"):
        joined_mission(plan, found, places, most_items=9)


def test_what_begins_both_missions_alike_is_flown_up_to_where_the_vehicle_was() -> None:
    old, new = mission(), mission((*SQUARE[:3], (100.0, 100.0)))
    assert common_places(old, new, next_item=1) == 0
    assert common_places(old, new, next_item=6) == 5, "the second place lies behind it"
    assert common_places(old, new, next_item=9) == 6, "beyond the third they differ"
    assert common_places(mission(SQUARE[1:]), new, next_item=9) == 0


@pytest.mark.parametrize(
    ("next_item", "flown"),
    [(1, 3), (2, 3), (3, 5), (4, 6), (5, 7)],
    ids=["on the way", "still on it", "on the plan's line", "a place later", "and one more"],
)
def test_what_was_flown_is_known_through_a_second_joining(next_item: int, flown: int) -> None:
    plan = mission()
    here = MissionItem(MavCmd.NAV_WAYPOINT, 3, (0.0, 0.0, 0.0, 0.0), *at(DSM, 75.0, 66.0), UP_M)
    taken_up = replace(plan, items=(here, here, *plan.items[5:]))
    before, item = as_planned(taken_up, plan.items[:5], way_items=2, flown_items=3, next_item=next_item)
    assert common_places(before, plan, next_item=item) == flown
    assert common_places(taken_up, plan, next_item=next_item) == 0, "where it hovered is in no plan"
