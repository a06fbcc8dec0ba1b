"""Sidesteps: level, clear of what stands and of what moves, and back onto the line only where that keeps so."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.evading.keep_clear import Seen
from planning.evading.sidestep import AFTER_S, Mover, Proposed, Sidestep, sidestep
from planning.evading.way_past import NoWay
from tests.planning.test_avoidance import slope
from tests.reference.box_distance import polyline_boxes_m

HERE = np.array([0.0, 0.0, 10.0])
LINE = np.array([[0.0, 0.0, 10.0], [0.0, 60.0, 12.0], [40.0, 90.0, 8.0]])
HEAD_ON = Mover((0.0, 30.0), (0.0, -3.0))
RIGHT = Proposed((1.5, 3.0), 5.0, (HEAD_ON,), 3.0, 4.0)


def found(way: Sidestep | NoWay) -> Sidestep:
    assert isinstance(way, Sidestep), way
    return way


def test_the_proposed_velocity_is_held_and_the_line_is_joined_ahead() -> None:
    way = found(sidestep(HERE, LINE, RIGHT, []))
    held_s = 5.0 + math.hypot(1.5, 3.0) / 5.0 + 0.5
    assert way.points_enu_m[1] == pytest.approx([1.5 * held_s, 3.0 * held_s, 10.0])
    assert (way.speeds_m_s[0], way.speeds_m_s[1]) == (pytest.approx(math.hypot(1.5, 3.0)), 4.0)
    assert way.leg == 0
    back = way.points_enu_m[2]
    assert back[0] == pytest.approx(0.0)
    assert back[1] > 15.0
    assert way.moving_m >= 3.0


def closest_slowly_m(way: Sidestep, movers: tuple[Mover, ...], *, then_s: float = 0.0) -> float:
    """Every 20 ms; ``then_s`` it stays at its end."""
    nearest, t_s = math.inf, 0.0
    legs = list(zip(pairwise(way.points_enu_m), way.speeds_m_s, strict=True))
    for number, ((a, b), speed_m_s) in enumerate(legs):
        lasts_s = math.dist(a, b) / speed_m_s + (way.wait_s if number == 0 else 0.0)
        for k in range(int(lasts_s / 0.02) + 1):
            own = a[:2] + (b - a)[:2] * min(1.0, k * 0.02 / max(lasts_s, 1e-9))
            for m in movers:
                x, y = (m.enu_m[i] + (t_s + k * 0.02) * m.velocity_enu_m_s[i] for i in (0, 1))
                nearest = min(nearest, math.hypot(own[0] - x, own[1] - y))
        t_s += lasts_s
    for k in range(int(then_s / 0.02) + 1):
        end = way.points_enu_m[-1]
        for m in movers:
            x, y = (m.enu_m[i] + (t_s + k * 0.02) * m.velocity_enu_m_s[i] for i in (0, 1))
            nearest = min(nearest, math.hypot(end[0] - x, end[1] - y))
    return nearest


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
    st.floats(0.5, 12),
    st.lists(
        st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=3
    ),
)
def test_it_is_level_or_rises_and_its_distances_are_those_of_a_slow_look(
    velocity: tuple[float, float], hold_s: float, objects: list[tuple[float, float, float, float]]
) -> None:
    movers = tuple(Mover((e, n), (ve, vn)) for e, n, ve, vn in objects)
    way = sidestep(HERE, LINE, Proposed(velocity, hold_s, movers, 3.0, 4.0), [])
    if isinstance(way, NoWay):
        assert "away" in way.reason or "keeps only" in way.reason
        return
    assert way.points_enu_m[:, 2].min() >= HERE[2]
    assert way.points_enu_m[1, 2] == HERE[2]
    fastest_m_s = max(math.hypot(ve, vn) for _, _, ve, vn in objects) + 6.0
    assert way.moving_m <= closest_slowly_m(way, movers) + 0.2 * fastest_m_s + 0.05
    if way.leg is None:
        slowly_m = closest_slowly_m(way, movers, then_s=AFTER_S)
        assert way.moving_m == pytest.approx(slowly_m, abs=0.2 * fastest_m_s + 0.05)
    out = replace(way, points_enu_m=way.points_enu_m[:2], speeds_m_s=way.speeds_m_s[:1])
    assert way.moving_m >= min(3.0, closest_slowly_m(out, movers)) - 0.2 * fastest_m_s


def flown_m(way: Sidestep, movers: tuple[Mover, ...], *, start_m_s: tuple[float, float], after_s: float) -> float:
    """Closest approach of a vehicle that notices late, turns by 2.5 m/s2 and stops at every corner."""
    place, velocity, k, nearest = way.points_enu_m[0, :2].copy(), np.array(start_m_s), 1, math.inf
    for step in range(1000):
        wanted = np.array(start_m_s)
        if step * 0.02 >= after_s:
            to = way.points_enu_m[min(k, len(way.points_enu_m) - 1), :2] - place
            away_m = max(math.hypot(*to), 1e-6)
            speed_m_s = min(way.speeds_m_s[min(k, len(way.speeds_m_s)) - 1], math.sqrt(3.5 * away_m))
            wanted = to / away_m * speed_m_s
            k += away_m < 0.7
            if k >= len(way.points_enu_m) and way.leg is not None:
                wanted = np.array(start_m_s)
        change = wanted - velocity
        velocity = velocity + change * min(1.0, 0.05 / max(math.hypot(*change), 1e-9))
        place = place + velocity * 0.02
        for m in movers:
            x, y = (m.enu_m[i] + (step + 1) * 0.02 * m.velocity_enu_m_s[i] for i in (0, 1))
            nearest = min(nearest, math.hypot(place[0] - x, place[1] - y))
    return nearest


def test_a_vehicle_that_slows_down_at_the_end_keeps_what_was_told() -> None:
    """With its end at the closest approach it braked before the object and came to 1.0 m of it."""
    crosses = Mover((-12.9, 21.9), (2.0, 1.1))
    proposed = Proposed((0.41, 4.98), 6.0, (crosses,), 3.0, 5.0)
    north = np.array([[0.0, 0.0, 10.0], [0.0, 150.0, 10.0]])
    way = found(sidestep(HERE, north, proposed, []))
    for after_s in (0.0, 0.5, 1.0):
        assert flown_m(way, (crosses,), start_m_s=(0.0, 5.0), after_s=after_s) >= 3.0
    ends = np.vstack([HERE, HERE + np.array([0.41, 4.98, 0.0]) * 6.0, [0.0, 34.0, 10.0]])
    assert flown_m(replace(way, points_enu_m=ends), (crosses,), start_m_s=(0.0, 5.0), after_s=0.5) < 1.5


def test_where_the_way_back_leads_into_it_the_vehicle_holds() -> None:
    beside = tuple(Mover((-1.0, n), (0.0, 0.0)) for n in range(12, 60, 3))
    held = found(sidestep(HERE, LINE, replace(RIGHT, movers=beside), []))
    assert held.leg is None
    assert len(held.points_enu_m) == 2


def test_a_proposal_that_leads_into_it_by_now_is_refused() -> None:
    crosses = Mover((4.0, 0.0), (0.0, 3.0))
    way = sidestep(HERE, LINE, replace(RIGHT, velocity_enu_m_s=(3.0, 3.0), movers=(crosses,)), [])
    assert isinstance(way, NoWay)
    assert "keeps only" in way.reason


def test_without_a_mission_it_ends_in_a_hold() -> None:
    way = found(sidestep(HERE, None, RIGHT, []))
    assert (way.leg, len(way.points_enu_m), way.wait_s) == (None, 2, 0.0)


def test_what_would_run_into_the_vehicle_where_it_stops_is_let_past() -> None:
    """It passes before the object at 3.7 m, and would have stopped in its way, 2 m from it."""
    overtaking = Mover((-17.03, 3.82), (4.81, 3.19))
    proposed = Proposed((1.3, 4.83), 4.4, (overtaking,), 3.0, 4.0)
    way = found(sidestep(HERE, None, proposed, []))
    stops = replace(way, points_enu_m=np.vstack([HERE, HERE + np.array([1.3, 4.83, 0.0]) * 4.4]))
    assert closest_slowly_m(stops, (overtaking,)) > 3.5
    assert closest_slowly_m(stops, (overtaking,), then_s=AFTER_S) < 2.1
    assert way.moving_m > 2.4
    assert closest_slowly_m(way, (overtaking,), then_s=30.0) > 2.4
    follows = Mover((0.0, -20.0), (0.0, 3.0))
    nowhere = sidestep(HERE, None, Proposed((0.0, 4.0), 1.0, (follows,), 3.0, 4.0), [])
    assert isinstance(nowhere, NoWay)
    assert "At its end it keeps only" in nowhere.reason


def test_a_proposal_to_stay_waits_until_it_has_passed() -> None:
    crosses = Mover((-20.0, 8.0), (4.0, 0.0))
    way = found(sidestep(HERE, LINE, Proposed((0.0, 0.1), 7.0, (crosses,), 3.0, 4.0), []))
    assert way.wait_s == 7.0
    assert way.points_enu_m[1] == pytest.approx(HERE)
    assert way.moving_m == pytest.approx(8.0, abs=0.1)
    assert way.leg == 0


def wall(east_m: float, north_m: float) -> Seen:
    n, u = np.meshgrid(np.arange(-5.0, 6.0), np.arange(0.5, 20.0))
    return Seen(np.column_stack([np.full(n.size, east_m), north_m + n.ravel(), u.ravel()]), 1.0)


def test_what_stands_in_its_way_is_said() -> None:
    blocked = sidestep(HERE, LINE, RIGHT, [wall(5.0, 10.0)])
    assert isinstance(blocked, NoWay)
    assert "m of what was seen" in blocked.reason
    hill = sidestep(HERE, LINE, RIGHT, [], slope(rise=1.2))
    assert isinstance(hill, NoWay)
    assert "of the ground" in hill.reason
    far = sidestep(HERE, LINE, replace(RIGHT, hold_s=60.0), [])
    assert isinstance(far, NoWay)
    assert "away" in far.reason
    inside = sidestep(HERE, LINE, RIGHT, [wall(0.0, 0.0)])
    assert isinstance(inside, NoWay)
    assert "only 0.0 m" in inside.reason


def test_a_wall_on_the_way_back_moves_the_place_where_it_joins() -> None:
    standing = wall(2.0, 22.0)
    free, around = (found(sidestep(HERE, LINE, RIGHT, seen)) for seen in ([], [standing]))
    assert free.leg is not None
    if around.leg is not None:
        assert around.points_enu_m[2][1] > free.points_enu_m[2][1]
    assert polyline_boxes_m(around.points_enu_m, standing.centres_enu_m, 0.5) >= 2.0
    assert around.seen_m == pytest.approx(polyline_boxes_m(around.points_enu_m, standing.centres_enu_m, 0.5), abs=0.01)


@pytest.mark.parametrize("where", [np.array([np.nan, 0.0, 10.0]), HERE])
def test_numbers_that_are_none_are_no_way(where: F64) -> None:
    broken = replace(RIGHT, hold_s=math.nan) if where is HERE else RIGHT
    way = sidestep(where, LINE, broken, [])
    assert isinstance(way, NoWay)
    assert "unknown" in way.reason
