"""Before a start a mission is held against what other vehicles fly, or have on board."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from mapping.geometry.frames import moved_deg
from server.flying.apart.nearness import NEAR_M, RADIUS_M, Flown
from server.flying.apart.other_vehicles import PENDING, Other, OtherVehicles, row_against
from server.heard.led_way import led_ahead
from server.heard.plan_follower import Ahead, Whole
from server.schemas import CheckRow
from telemetry.topics.vehicle import VehicleState

HOME = 47.0, 8.0
NOW_S = 5000.0
HOME_ALT_M = 480.0
SPEED_M_S = 5.0
State = Literal["good", "accept", "bad", "unknown"]


def whole(*east_north_m: tuple[float, float], up_m: float = 20.0, rtl_m: float = 60.0) -> Whole:
    """From home at the first place up to ``up_m`` in 10 s, through all places at 5 m/s, and back."""
    line_m = np.array(east_north_m)
    gone_s = 10.0 + np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line_m, axis=0), axis=1))]) / SPEED_M_S
    heights_m = [0.0, *[up_m] * len(line_m), rtl_m, rtl_m, 0.0]
    way_m = np.vstack([line_m[:1], line_m, line_m[-1:], line_m[:1], line_m[:1]])
    places = np.array([moved_deg(HOME, *place) for place in way_m])
    return Whole(places, np.array(heights_m), np.concatenate([[0.0], gone_s]), 10.0)


def standing(plan: Whole | None, *, name: str = "Wasp", home_alt_m: float | None = HOME_ALT_M) -> Other:
    lat_deg, lon_deg = HOME if plan is None else plan.lat_lon_deg[0]
    state = VehicleState(1, 1, lat_deg=lat_deg, lon_deg=lon_deg, alt_amsl_m=home_alt_m)
    return Other(Flown(name, state, None), flies=False, on_board=plan)


def flying(plan: Whole, gone_s: float) -> Other:
    """So long after its lift-off."""
    assert plan.t_s is not None
    left = plan.t_s > gone_s
    count = len(plan.t_s)
    place = [np.interp(gone_s, plan.t_s, plan.lat_lon_deg[:count, axis]) for axis in (0, 1)]
    up_m = float(np.interp(gone_s, plan.t_s, plan.alt_rel_home_m[:count]))
    ahead = Ahead(plan.lat_lon_deg[:count][left], plan.alt_rel_home_m[:count][left], plan.t_s[left] - gone_s)
    state = VehicleState(1, 1, armed=True, landed="in_air", lat_deg=float(place[0]), lon_deg=float(place[1]))
    state = replace(state, position_t_mono_s=NOW_S, alt_amsl_m=HOME_ALT_M + up_m, home_alt_amsl_m=HOME_ALT_M)
    return Other(Flown("Bee", state, ahead), flies=True, on_board=plan)


def told(mine: Other, *others: Other) -> CheckRow:
    return row_against(mine, others, NOW_S)


EAST = whole((0, 0), (400, 0))
ACROSS = whole((200, -200), (200, 200))
"""Crosses EAST half way, at the same height."""


def test_alone_or_far_apart_is_good() -> None:
    assert told(standing(EAST)).text == "No other vehicle flies or has a mission on board."
    assert told(standing(EAST), standing(None)).state == "good"
    assert (
        told(standing(EAST), standing(whole((0, 300), (400, 300)))).text
        == "No other vehicle's way comes near this one."
    )
    assert told(standing(EAST), flying(whole((0, 300), (400, 300)), 30.0)).state == "good"


def test_a_mission_that_is_only_on_board_is_judged_without_times() -> None:
    row = told(standing(EAST), standing(ACROSS, name="Bee"))
    assert row.state == "accept"
    lat_deg, lon_deg = moved_deg(HOME, 200, 0)
    assert row.text == (
        f"Bee has a mission on board that comes within 0 m of this one, at {lat_deg:.7f}, {lon_deg:.7f}."
    )
    assert row.mend == "Fly one after the other, or plan them apart."


@pytest.mark.parametrize(
    ("gone_s", "state"),
    [
        (0.0, "bad"),  # lifts off with this one: both are at the crossing after 50 s
        (45.0, "accept"),  # is past it long before this one comes
        (88.0, "good"),  # only the rest of its way counts
    ],
)
def test_one_that_flies_is_judged_by_the_predicted_times(gone_s: float, state: State) -> None:
    # Its way home, at the height of the line, crosses again: it is higher here.
    row = told(standing(EAST), flying(replace(ACROSS, alt_rel_home_m=_home_at(ACROSS, 200.0)), gone_s))
    assert row.state == state, row.text
    if state == "bad":
        assert "Started now, it may come within 0 m of Bee in " in row.text
        assert row.mend == "Start later, or land Bee first."


def test_the_way_home_counts_at_any_time_after_the_line() -> None:
    """Both fly home at 60 m over the same place; nothing times that."""
    mine = whole((0, 0), (400, 0), up_m=20.0, rtl_m=60.0)
    theirs = whole((200, -200), (200, 200), up_m=100.0, rtl_m=60.0)
    assert told(standing(mine), standing(replace(theirs, alt_rel_home_m=_home_at(theirs, 200.0)))).state == "good"
    assert told(standing(mine), standing(theirs)).state == "accept"
    assert told(standing(mine), flying(theirs, 60.0)).state in ("accept", "bad")


def taken_up(plan: Whole, gone_s: float) -> Other:
    """It holds where the plan would be after so long, and goes on from there."""
    assert plan.t_s is not None
    it = flying(plan, gone_s)
    left = np.concatenate([plan.t_s > gone_s, [True] * 3])
    begin_deg = [[it.flown.state.lat_deg or 0.0, it.flown.state.lon_deg or 0.0]]
    up_m = (it.flown.state.alt_amsl_m or 0.0) - HOME_ALT_M
    rest = Whole(
        np.vstack([begin_deg, plan.lat_lon_deg[left]]),
        np.concatenate([[up_m], plan.alt_rel_home_m[left]]),
        np.concatenate([[0.0], plan.t_s[plan.t_s > gone_s] - gone_s]),
        0.0,
    )
    return replace(it, flown=replace(it.flown, ahead=None), on_board=rest, waits_in_air=True)


@pytest.mark.parametrize(
    ("holds_s", "gone_s", "state"),
    [
        (10.0, 10.0, "bad"),  # both are 40 s from the crossing
        (48.0, 10.0, "accept"),  # 2 s from it, long before the other one comes
        (80.0, 10.0, "good"),  # past it: its own way home is higher
    ],
)
def test_a_plan_that_was_taken_up_is_judged_from_where_it_holds_as_if_resumed_now(
    holds_s: float, gone_s: float, state: State
) -> None:
    theirs = flying(replace(ACROSS, alt_rel_home_m=_home_at(ACROSS, 200.0)), gone_s)
    row = told(taken_up(EAST, holds_s), theirs)
    assert row.state == state, row.text
    if state == "bad":
        assert row.text.startswith("Resumed now, it may come within 0 m of Bee in ")
        assert row.mend == "Resume later, or land Bee first."


def test_where_the_vehicle_takes_off_it_is_from_the_start_until_it_leaves() -> None:
    """The other one passes over home, low, while this one climbs."""
    over_home = whole((-60, 0), (0, 5), (-60, 10), up_m=8.0)
    assert told(standing(EAST), flying(over_home, 12.0)).state == "bad"


def test_who_flies_without_a_plan_may_be_anywhere() -> None:
    guided = flying(ACROSS, 20.0)
    for other in (replace(guided, on_board=None), replace(guided, flown=replace(guided.flown, ahead=None))):
        row = told(standing(EAST), other)
        assert (row.state, row.text) == ("accept", "Bee is in the air, and no plan tells where it will be.")


def test_the_worst_of_several_is_said() -> None:
    meets = flying(ACROSS, 0.0)
    assert told(standing(EAST), standing(ACROSS), meets, standing(whole((0, 300), (400, 300)))).state == "bad"


def test_unknown_heights_are_one_height_and_different_ones_keep_apart() -> None:
    below = whole((200, -200), (200, 200), up_m=20.0)
    high = standing(below, home_alt_m=HOME_ALT_M + 150.0)
    assert told(standing(EAST), high).state == "good"
    assert told(standing(EAST), standing(below, home_alt_m=None)).state == "accept"


def test_without_its_own_line_nothing_is_told_as_clear() -> None:
    assert told(standing(None), standing(EAST)) == PENDING
    assert PENDING.state == "unknown"


def test_how_near_is_too_near_begins_at_the_balls() -> None:
    for apart_m, state in ((NEAR_M + 2 * RADIUS_M - 1, "accept"), (NEAR_M + 2 * RADIUS_M + 1, "good")):
        assert told(standing(EAST), standing(whole((0, apart_m), (400, apart_m)))).state == state


def test_who_waits_is_told_each_second_and_a_failure_is_no_all_clear() -> None:
    rows: dict[int, list[CheckRow]] = {1: [], 2: []}
    others = {1: standing(EAST, name="Wasp"), 2: standing(ACROSS, name="Bee")}

    def look(number: int) -> Other:
        return others[number]

    watch = OtherVehicles(
        {number: lambda number=number: look(number) for number in others},
        {number: rows[number].append for number in others},
        now_mono_s=lambda: NOW_S,
    )
    asyncio.run(watch.look())
    assert rows[1][-1].text.startswith("Bee has a mission on board")
    assert rows[2][-1].text.startswith("Wasp has a mission on board")
    # One that flies is watched in the air instead.
    others[2] = flying(ACROSS, 0.0)
    asyncio.run(watch.look())
    assert (rows[1][-1].state, len(rows[2])) == ("bad", 1)
    # One that holds with a new plan waits as well.
    others[2] = taken_up(ACROSS, 20.0)
    asyncio.run(watch.look())
    assert rows[2][-1].text.startswith("Wasp has a mission on board")

    del others[2]

    async def runs() -> None:
        task = asyncio.ensure_future(watch.run())
        while rows[1][-1] != PENDING:
            await asyncio.sleep(0)
        task.cancel()

    asyncio.run(asyncio.wait_for(runs(), 30))
    assert rows[2][-1] == PENDING


def _home_at(plan: Whole, rtl_m: float) -> np.ndarray:
    heights_m = plan.alt_rel_home_m.copy()
    heights_m[-3:-1] = rtl_m
    return heights_m


def test_who_stands_on_its_way_is_in_it_until_he_is_led_away() -> None:
    lat_deg, lon_deg = moved_deg(HOME, 300, 0)
    state = replace(flying(ACROSS, 20.0).flown.state, lat_deg=lat_deg, lon_deg=lon_deg)
    hovers = Other(Flown("Bee", state, None), flies=True, on_board=None)
    row = told(standing(EAST), hovers)
    assert row.state == "bad"
    assert row.text.startswith("Started now, it may come within 0 m of Bee in ")
    assert row.mend == "Start later, or land Bee first."
    higher = replace(hovers, flown=replace(hovers.flown, state=replace(state, alt_amsl_m=HOME_ALT_M + 45.0)))
    assert told(standing(EAST), higher).state == "accept"
    # Nobody knows whether it is still there.
    long_ago = replace(state, position_t_mono_s=NOW_S - 60.0)
    row = told(standing(EAST), replace(hovers, flown=Flown("Bee", long_ago, None)))
    assert row.state == "accept"
    assert "may come within 0 m of Bee" in row.text
    assert row.text.endswith("It was last heard 60 s ago.")

    def led(north_m: float) -> Other:
        aside = replace(state, lat_deg=moved_deg(HOME, 300, 100.0)[0])
        places = np.array([(*moved_deg(HOME, 300, north_m), 20.0)])
        way = led_ahead(places, np.array([abs(100.0 - north_m) / SPEED_M_S]), 2.0)
        return replace(hovers, flown=Flown("Bee", aside, None, told=Flown("Bee", aside, way)))

    assert told(standing(EAST), led(50.0)).state == "accept"
    assert told(standing(EAST), led(3.0)).state == "bad"


def test_who_holds_beside_another_one_may_go_on_away_from_it_and_not_come_back() -> None:
    def holds(plan: Whole) -> Other:
        return replace(standing(replace(plan, takeoff_s=0.0)), waits_in_air=True, flies=True)

    lat_deg, lon_deg = moved_deg(HOME, 91.0, 0)
    up_m = EAST.alt_rel_home_m[1]
    beside = replace(flying(ACROSS, 20.0).flown.state, lat_deg=lat_deg, lon_deg=lon_deg, alt_amsl_m=HOME_ALT_M + up_m)
    other = Other(Flown("Bee", beside, None), flies=True, on_board=None)

    def from_100_m(plan: Whole) -> Whole:
        assert plan.t_s is not None
        return replace(
            plan,
            lat_lon_deg=plan.lat_lon_deg[2:],
            alt_rel_home_m=plan.alt_rel_home_m[2:],
            t_s=plan.t_s[2:] - plan.t_s[2],
        )

    assert told(holds(from_100_m(whole((0, 0), (100, 0), (400, 0)))), other).state == "accept"
    row = told(holds(from_100_m(whole((0, 0), (100, 0), (300, 0), (91, 0)))), other)
    assert row.state == "bad"
    assert "may come within 0 m of Bee" in row.text
