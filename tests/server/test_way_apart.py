"""A guided way is held apart from the other vehicles in the air, as they are known."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg, offset_m
from server.flying.apart.nearness import AHEAD_S, NEAR_M, RADIUS_M, Flown
from server.flying.apart.way_apart import NEARER_M, Apart, way_apart
from server.heard.led_way import later_share, led_ahead
from server.heard.plan_follower import Ahead
from telemetry.topics.vehicle import VehicleState

HOME = 47.0, 8.0
HOME_ALT_M, UP_M, SPEED_M_S = 480.0, 20.0, 3.0
NOW_S = 1000.0


def at(east_m: float, north_m: float = 0.0, *, up_m: float = UP_M, **more: Any) -> VehicleState:
    lat_deg, lon_deg = moved_deg(HOME, east_m, north_m)
    state = VehicleState(1, 1, armed=True, landed="in_air", position_t_mono_s=NOW_S, lat_deg=lat_deg, lon_deg=lon_deg)
    heights = {"alt_amsl_m": HOME_ALT_M + up_m, "home_alt_amsl_m": HOME_ALT_M, "alt_rel_home_m": up_m}
    return replace(state, **heights, **more)


def way(*east_north_m: tuple[float, float], others: list[Flown], state: VehicleState | None = None) -> Apart:
    """Level, at 3 m/s, from its first place on."""
    line_m = np.array(east_north_m)
    t_s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line_m, axis=0), axis=1))]) / SPEED_M_S
    places = tuple((*moved_deg(HOME, *place), UP_M) for place in east_north_m)
    return way_apart(state or at(*east_north_m[0]), places, t_s, others, NOW_S)


def ahead(*east_north_s: tuple[float, float, float]) -> Ahead:
    places = np.array([moved_deg(HOME, *each[:2]) for each in east_north_s])
    return Ahead(places, np.full(len(places), UP_M), np.array([each[2] for each in east_north_s]))


def test_a_way_to_where_another_one_hovers_is_refused_however_long_it_takes() -> None:
    for far_m in (30.0, 600.0):
        apart = way((0.0, 0.0), (far_m, 0.0), others=[Flown("Bee", at(far_m), None)])
        (reason,) = apart.reasons
        assert reason.code == "others"
        assert reason.text.startswith("It may come within 0 m of Bee in about ")
        assert "lead Bee away or land it first" in reason.mend
    assert way((0.0, 0.0), (30.0, 0.0), others=[Flown("Bee", at(30.0, up_m=60.0), None)]) == Apart()
    assert way((0.0, 0.0), (30.0, 0.0), others=[Flown("Bee", at(30.0, 30.0), None)]) == Apart()


def test_one_whose_height_is_not_known_is_as_high() -> None:
    high = replace(at(30.0, up_m=60.0), alt_amsl_m=None)
    assert way((0.0, 0.0), (30.0, 0.0), others=[Flown("Bee", high, None)]).reasons


def test_who_crosses_by_his_plan_is_met_or_not_by_the_times_of_both_at_the_worse_end() -> None:
    crosses = at(60.0, -60.0, v_north_m_s=SPEED_M_S)

    def plan(after_s: float) -> Flown:
        ends = (60.0, -60.0, after_s - 12.0), (60.0, 60.0, after_s + 28.0)
        return Flown("Bee", replace(crosses, v_north_m_s=0.0), ahead((60.0, -60.0, 0.0), *ends))

    # 60 m at 3 m/s: 20 s by length and speed, 8 s at the soonest and 70 s at the latest as it is led.
    for after_s in (20.0, 40.0, 65.0):
        assert way((0.0, 0.0), (120.0, 0.0), others=[plan(after_s)]).reasons, after_s
    assert way((0.0, 0.0), (120.0, 0.0), others=[plan(400.0)]) == Apart()
    # It holds where it ends: on the other one's line, not for ever.
    assert way((0.0, 0.0), (60.0, 0.0), others=[plan(70.0 + AHEAD_S - 15.0)]).reasons
    assert way((0.0, 0.0), (60.0, 0.0), others=[plan(400.0)]) == Apart()


def test_who_begins_too_near_may_part_and_come_back_no_more() -> None:
    near = [Flown("Bee", at(8.0), None)]
    parts = way((0.0, 0.0), (-40.0, 0.0), others=near)
    assert parts.reasons == ()
    assert parts.notes == ("It begins within 2 m of Bee.",)
    around = [(8.0 - 8.0 * math.cos(k * math.pi / 8), 8.0 * math.sin(k * math.pi / 8)) for k in range(17)]
    assert way(*around, others=near).reasons, "it goes around it, and parts never"
    assert way((0.0, 0.0), (0.0, 0.1), others=near).notes, "it turns its nose, and stays"
    assert way((0.0, 0.0), (-3.0, 0.0), (40.0, 0.0), others=near).reasons
    assert way((0.0, 0.0), (NEARER_M + 1.0, 0.0), others=near).reasons
    assert way((0.0, 0.0), (-60.0, 0.0), (-60.0, 30.0), (16.0, 30.0), (16.0, 0.0), others=near).reasons
    # Nobody knows that it is not as high: to go down past it is not to part from it.
    unknown = [Flown("Bravo's Bee", replace(at(1.0), alt_amsl_m=None), None, key="Bravo/1")]
    places = [(*HOME, 60.0), (*HOME, 10.0)]
    down = way_apart(at(0.0, up_m=60.0), tuple(places), np.array([0.0, 25.0]), unknown, NOW_S)
    assert "call the other station" in down.notes[0]


def test_one_that_is_silent_or_tells_no_place_is_named() -> None:
    silent = Flown("Bee", replace(at(900.0), position_t_mono_s=NOW_S - 120.0), None)
    assert "last heard 120 s ago" in way((0.0, 0.0), (30.0, 0.0), others=[silent]).notes[0]
    there = Flown("Bee", replace(at(30.0), position_t_mono_s=NOW_S - 120.0), None)
    (reason,) = way((0.0, 0.0), (30.0, 0.0), others=[there]).reasons
    assert "last heard there 120 s ago" in reason.mend
    nowhere = Flown("Bee", replace(at(900.0), lat_deg=None, lon_deg=None), None)
    apart = way((0.0, 0.0), (30.0, 0.0), others=[nowhere])
    assert apart.notes == ("Bee is in the air, and does not tell where.",)
    assert apart.noted == {("Bee", "nowhere")}
    foreign = Flown("Bravo's Bee", replace(at(900.0), position_t_mono_s=NOW_S - 5.5), None, key="Bravo/1")
    assert way((0.0, 0.0), (30.0, 0.0), others=[foreign]).noted == {("Bravo's Bee", "silent Bravo/1")}
    by_hand = Flown("Bravo's Bee", at(900.0, v_east_m_s=5.0), None, key="Bravo/1")
    assert way((0.0, 0.0), (30.0, 0.0), others=[by_hand]).noted == {("Bravo's Bee", "unplanned Bravo/1")}


def test_one_that_is_led_counts_along_its_way_and_where_it_is() -> None:
    led = led_ahead(np.array([(*moved_deg(HOME, 60.0, 0.0), UP_M)]), np.array([20.0]), later_share(2))
    comes = Flown("Bee", at(60.0, -60.0), None, told=Flown("Bee", at(60.0, -60.0), led))
    assert way((0.0, 0.0), (60.0, 0.0), others=[comes]).reasons
    assert way((0.0, 0.0), (60.0, -60.0), others=[comes]).reasons
    assert way((0.0, 0.0), (-60.0, 0.0), others=[comes]) == Apart()


def test_where_turns_make_it_late_it_is_met_as_late() -> None:
    """An orbit takes up to six times as long as lengths and speeds say; another one crosses its last quarter then."""
    around = [(20.0 - 20.0 * math.cos(k * math.pi / 16), 20.0 * math.sin(k * math.pi / 16)) for k in range(33)]
    nominal_s = 2.0 * math.pi * 20.0 / SPEED_M_S
    place = around[24]
    outside = place[0], place[1] - 60.0
    waits = ahead((*outside, 0.0), (*outside, 4.0 * nominal_s), (*place, 4.0 * nominal_s + 12.0))
    assert way(*around, others=[Flown("Bee", at(*outside), waits)]).reasons


def test_another_one_that_is_led_is_looked_along_as_far_as_it_may_have_come() -> None:
    led = led_ahead(
        np.array([(*moved_deg(HOME, 60.0, 165.0), UP_M), (*moved_deg(HOME, 60.0, -60.0), UP_M)]),
        np.array([0.0, 75.0]),
        later_share(3),
    )
    comes = Flown("Bee", at(60.0, 165.0), None, told=Flown("Bee", at(60.0, 165.0), led))
    # It is at (60, 0) after 40 s to 175 s; this one is there after 8 s to 70 s and stays for 60 s.
    assert way((0.0, 0.0), (60.0, 0.0), others=[comes]).reasons


def test_where_no_height_of_home_tells_how_high_a_plan_is_it_is_as_high() -> None:
    ends = ahead((60.0, -60.0, 0.0), (60.0, 0.0, 20.0))
    comes = Flown("Bee", replace(at(60.0, -60.0), home_alt_amsl_m=None), ends)
    assert way((0.0, 0.0), (60.0, 0.0), others=[comes]).reasons


def test_what_nobody_here_can_hold_is_said_and_refuses_nothing() -> None:
    there = Flown("Bravo's Bee", at(30.0), None, key="Bravo/1")
    apart = way((0.0, 0.0), (30.0, 0.0), others=[there])
    assert apart.reasons == ()
    assert apart.notes[0].startswith("It may come within 0 m of Bravo's Bee in about ")
    assert "call the other station" in apart.notes[0]
    silent = Flown("Bravo's Bee", at(900.0), None, is_silent=True, key="Bravo/1")
    assert "not heard any more" in way((0.0, 0.0), (30.0, 0.0), others=[silent]).notes[0]
    by_hand = Flown("Bee", at(900.0, v_east_m_s=4.0), None)
    assert way((0.0, 0.0), (30.0, 0.0), others=[by_hand]).notes == (
        "Bee is in the air, and no plan tells where it will be.",
    )
    told = Flown("Bravo's Bee", at(900.0), None, key="Bravo/1", told=Flown("Bravo's Bee", at(30.0), None))
    assert way((0.0, 0.0), (30.0, 0.0), others=[told]).notes


@given(st.floats(-60, 60), st.floats(-60, 60), st.floats(-60, 60), st.floats(-60, 60))
def test_no_way_that_is_let_through_passes_a_standing_one_too_near(
    east_m: float, north_m: float, other_east_m: float, other_north_m: float
) -> None:
    """By brute force along the straight way; and none that stays well away is refused."""
    other = at(other_east_m, other_north_m)
    refused = bool(way((0.0, 0.0), (east_m, north_m), others=[Flown("Bee", other, None)]).reasons)
    share = np.linspace(0.0, 1.0, 400)
    place_m = np.array(offset_m(HOME, other.lat_deg or 0.0, other.lon_deg or 0.0))
    off_m = np.hypot(share * east_m - place_m[0], share * north_m - place_m[1])
    least_m = float(off_m.min())
    if least_m > NEAR_M + 2 * RADIUS_M + 0.1:
        assert not refused
    elif least_m < min(NEAR_M + 2 * RADIUS_M - 0.1, float(off_m[0]) - NEARER_M - 0.1):
        assert refused


@pytest.mark.parametrize("lat_deg", [None, HOME[0]])
def test_from_the_ground_it_begins_where_it_stands(lat_deg: float | None) -> None:
    """It takes its home there: what it told as home before is of no matter."""
    stands = replace(at(0.0, up_m=12.0), armed=False, landed="on_ground", lat_deg=lat_deg)
    places, t_s = ((*HOME, 0.0), (*HOME, UP_M)), np.array([0.0, 8.0])
    assert way_apart(stands, places, t_s, [Flown("Bee", at(6.0, up_m=12.0 + UP_M), None)], NOW_S).reasons
    assert way_apart(stands, places, t_s, [Flown("Bee", at(40.0), None)], NOW_S) == Apart()
