"""The place that is led along the legs: its speed, its corners, and what a silent link would make of it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg, offset_m
from telemetry.flight.guided.feed import FedLeg, Feed, bounds_of
from telemetry.flight.guided.leading import Leading
from telemetry.flight.guided.orders import Place
from telemetry.topics.messages import GuidedTarget
from tests.telemetry.guided_flights import off_line

LAT_DEG, LON_DEG, FEED, STEP_S = 0.0, 10.0, Feed(), 0.1
places = st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.floats(5, 25))


def place(north_m: float, east_m: float, up_m: float) -> Place:
    return Place(*moved_deg((LAT_DEG, LON_DEG), east_m, north_m), up_m, 100.0)


def target(
    north_m: float, east_m: float, up_m: float, *, speed_m_s: float = 6.0, loiter_s: float = 0.0
) -> GuidedTarget:
    at = place(north_m, east_m, up_m)
    return GuidedTarget(1, at.lat_deg, at.lon_deg, up_m, speed_m_s, loiter_s=loiter_s)


def neu(at: Place) -> tuple[float, float, float]:
    east_m, north_m = offset_m((LAT_DEG, LON_DEG), at.lat_deg, at.lon_deg)
    return north_m, east_m, at.alt_rel_home_m


def led(points: list[tuple[float, float, float]]) -> F64:
    """(N, 6) place and velocity at each step, for a vehicle that is always where the place is."""
    start, targets, rows = place(*points[0]), [target(*point) for point in points[1:]], []
    speed_m_s = 0.0
    for k, goal in enumerate(targets):
        leg = FedLeg(start, goal, bounds_of(start, targets[k:], FEED)[0], FEED, speed_m_s=speed_m_s)
        for _ in range(20_000):
            if leg.is_over:
                break
            leg.advance(STEP_S, leg.set_point(100.0, None).place)
            found = leg.set_point(100.0, None)
            rows.append((*neu(found.place), *found.v_neu_m_s))
        assert leg.is_over
        start, speed_m_s = place(*points[k + 1]), leg.out_m_s
    return np.array(rows)


@settings(deadline=None, max_examples=25)
@given(st.lists(places, min_size=3, max_size=6))
def test_a_link_that_falls_silent_leaves_the_vehicle_near_the_line(points: list[tuple[float, float, float]]) -> None:
    line = np.array(points)
    assume(np.hypot(*np.diff(line, axis=0)[:, :2].T).min() > 2.0)
    rows = led(points)
    carried = rows[:, :3] + rows[:, 3:] * FEED.silent_s
    assert np.hypot(*off_line(rows[:, :3], line)).max() < 0.01
    assert np.hypot(*off_line(carried, line)).max() < FEED.off_line_m + 0.3


def test_it_is_as_fast_as_asked_and_climbs_no_faster_than_the_vehicle_can() -> None:
    level, steep, down = (
        np.diff(led([start, end])[:, :3], axis=0) / STEP_S
        for start, end in (((0, 0, 10), (80, 0, 10)), ((0, 0, 10), (40, 0, 50)), ((40, 0, 50), (0, 0, 10)))
    )
    assert level[:, 0].max() == pytest.approx(6.0, abs=0.01)
    assert steep[:, 2].max() == pytest.approx(FEED.climb_m_s, abs=0.01)
    assert down[:, 2].min() == pytest.approx(-FEED.descent_m_s, abs=0.01)


def test_corners_are_taken_the_slower_the_sharper_they_are_and_stood_at_where_it_waits() -> None:
    def out_m_s(*points: tuple[float, float, float], loiter_s: float = 0.0) -> float:
        targets = [target(*point, loiter_s=loiter_s) for point in points[1:]]
        return bounds_of(place(*points[0]), targets, FEED)[0].out_m_s

    straight_on = out_m_s((0, 0, 10), (40, 0, 10), (80, 0, 10))
    slight, right, back = (out_m_s((0, 0, 10), (40, 0, 10), end) for end in ((80, 5, 10), (40, 40, 10), (0, 0, 10)))
    assert straight_on > 5.0 > slight > right > back > 0.0
    assert right == pytest.approx(FEED.turn_m_s / math.sqrt(2))
    assert out_m_s((0, 0, 10), (40, 0, 10), (80, 0, 10), loiter_s=2.0) == 0.0
    assert out_m_s((0, 0, 10), (40, 0, 10), (40.5, 0, 10)) < math.sqrt(2 * FEED.accel_m_s2 * 0.5) + 0.01


def test_it_waits_for_a_vehicle_that_falls_behind() -> None:
    start, goal = place(0, 0, 10), target(80, 0, 10)
    leg = FedLeg(start, goal, bounds_of(start, [goal], FEED)[0], FEED, speed_m_s=0.0)
    for _ in range(200):
        leg.advance(STEP_S, start)
    ahead_m = neu(leg.set_point(100.0, None).place)[0]
    assert 1.0 < ahead_m < 6.0
    leg.advance(STEP_S, start)
    assert neu(leg.set_point(100.0, None).place)[0] == pytest.approx(ahead_m)


def test_after_silence_it_goes_on_from_where_the_vehicle_is() -> None:
    leading, start, goal = Leading(FEED), place(0, 0, 10), target(80, 0, 10)
    leading.go(start, [goal], 0.0)
    times_s = np.arange(0.0, 4.0, STEP_S)
    found = [leading.set_point(start, t_s, heading_rad=None) for t_s in times_s]
    assert all(found)
    assert leading.set_point(start, 3.93, heading_rad=None) is None
    later = leading.set_point(place(12.0, 0.0, 10.0), 9.0, heading_rad=1.0)
    assert later is not None
    assert neu(later.place)[0] == pytest.approx(12.0)
    assert later.v_neu_m_s == (0.0, 0.0, 0.0)
    assert later.place.heading_rad == 1.0


def test_it_is_sent_as_often_as_said() -> None:
    leading, start, goal = Leading(FEED), place(0, 0, 10), target(80, 0, 10)
    leading.go(start, [goal], 0.0)
    due = [t_s for t_s in np.arange(0.0, 2.0, 0.02) if leading.set_point(start, float(t_s), heading_rad=None)]
    assert all(later - earlier == pytest.approx(FEED.period_s) for earlier, later in pairwise(due))
