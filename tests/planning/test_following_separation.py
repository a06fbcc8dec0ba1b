"""How near two moving vehicles come: never told farther than a slow search over all times finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.errors import ParameterError
from planning.following import separation
from planning.following.separation import MOST_PIECES, PIECE_S, TimedLine, nearest

METRES = st.floats(-60.0, 60.0)
PLACES = st.lists(st.tuples(METRES, METRES, METRES), min_size=2, max_size=4)
STEPS_S = st.lists(st.floats(0.0, 8.0), min_size=3, max_size=3)


def line(points: list[tuple[float, float, float]], steps_s: list[float], *, start_s: float = 0.0, **known: float):
    t_s = start_s + np.concatenate([[0.0], np.cumsum(steps_s[: len(points) - 1])])
    return TimedLine(np.array(points), t_s, known.pop("radius_m", 0.0), **known)


def slowly(a: TimedLine, b: TimedLine, every_s: float = 0.1) -> float:
    """The definition, over a grid of times; infinite where both are never under way at once."""
    least_m = math.inf
    for t_a in np.arange(a.t_s[0], a.t_s[-1] + 1e-9, every_s):
        for t_b in np.arange(b.t_s[0], b.t_s[-1] + 1e-9, every_s):
            gone_a, gone_b = t_a - a.t_s[0], t_b - b.t_s[0]
            span_s = a.early_late_s + a.early_late_share * gone_a + b.early_late_s + b.early_late_share * gone_b
            if abs(t_a - t_b) <= span_s:
                apart_m = math.dist(_at(a, t_a), _at(b, t_b))
                radii_m = a.radius_m + a.spread_m_s * gone_a + b.radius_m + b.spread_m_s * gone_b
                least_m = min(least_m, max(0.0, apart_m - radii_m))
    return least_m


def _at(of: TimedLine, t_s: float) -> list[float]:
    return [float(np.interp(t_s, of.t_s, of.points_enu_m[:, axis])) for axis in range(3)]


@settings(max_examples=60, deadline=None)
@given(PLACES, PLACES, STEPS_S, STEPS_S, st.floats(-5.0, 5.0), st.floats(0.0, 2.0), st.floats(0.0, 0.2))
def test_it_is_never_told_farther_than_it_is(
    one: list[tuple[float, float, float]],
    other: list[tuple[float, float, float]],
    steps_one_s: list[float],
    steps_other_s: list[float],
    start_s: float,
    early_late_s: float,
    spread_m_s: float,
) -> None:
    a = line(one, steps_one_s, radius_m=1.0, early_late_s=early_late_s, spread_m_s=spread_m_s)
    b = line(other, steps_other_s, start_s=start_s, early_late_share=0.1)
    slow_m = slowly(a, b, 0.25)
    for most_pieces in (MOST_PIECES, 3):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(separation, "MOST_PIECES", most_pieces)
            found = nearest(a, b)
        if found is None:
            assert slow_m == math.inf
        else:
            assert found.distance_m <= slow_m + 1e-6


def test_two_that_cross_at_the_same_time_meet_and_say_where_and_when() -> None:
    east = line([(-50, 0, 10), (50, 0, 10)], [10.0])
    north = line([(0, -50, 13), (0, 50, 13)], [10.0])
    found = nearest(east, north)
    assert found is not None
    assert found.distance_m == pytest.approx(3.0)
    assert found.at_enu_m == pytest.approx((0.0, 0.0, 11.5), abs=0.01)
    assert found.t_s == pytest.approx(5.0, abs=PIECE_S)


def test_the_same_crossing_minutes_apart_is_none() -> None:
    east = line([(-50, 0, 10), (50, 0, 10)], [10.0])
    late = line([(0, -50, 10), (0, 50, 10)], [10.0], start_s=60.0)
    assert nearest(east, late) is None
    # Unless the one may be as late as the other.
    found = nearest(line([(-50, 0, 10), (50, 0, 10)], [10.0], early_late_s=70.0), late)
    assert found is not None
    assert found.distance_m == pytest.approx(0.0, abs=1e-9)


def test_lines_that_begin_long_ago_cost_no_more_than_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both vehicles were last heard an hour ago: a second's look at them must not take a minute and a gigabyte."""
    held: list[int] = []

    def counted(*segments: F64) -> tuple[F64, F64]:
        held.append(len(segments[0]))
        return between(*segments)

    between = separation._between
    monkeypatch.setattr(separation, "_between", counted)
    old = {"radius_m": 3.0, "early_late_s": 2.0, "early_late_share": 0.1}
    one = line([(0, 0, 0), (300, 0, 0), (300, 0, 0)], [60.0, 3600.0], **old)
    other = line([(0, 500, 0), (300, 500, 0), (300, 500, 0)], [60.0, 3600.0], **old)
    found = nearest(one, other, since_s=3600.0)
    assert found is not None
    assert found.distance_m == pytest.approx(494.0)
    assert sum(held) < 200_000


def test_what_was_near_before_is_not_near_now() -> None:
    east = line([(-50, 0, 10), (50, 0, 10), (50, 0, 10)], [10.0, 50.0])
    north = line([(0, -50, 13), (0, 50, 13), (0, 50, 13)], [10.0, 50.0])
    found = nearest(east, north, since_s=20.0)
    assert found is not None
    assert found.distance_m == pytest.approx(math.dist((50, 0, 10), (0, 50, 13)))
    assert found.t_s >= 20.0
    assert nearest(east, north, since_s=60.5) is None


def test_one_behind_the_other_on_the_same_line_keeps_its_distance() -> None:
    ahead = line([(0, 0, 0), (100, 0, 0)], [20.0])
    behind = line([(-20, 0, 0), (80, 0, 0)], [20.0])
    found = nearest(ahead, behind)
    assert found is not None
    # Within a piece the one may be at its end while the other is at its start.
    assert found.distance_m == pytest.approx(20.0 - 5.0 * 2 * PIECE_S, abs=2.6)
    assert found.distance_m <= 20.0


def test_what_is_less_known_comes_nearer() -> None:
    other = line([(0, 30, 0), (100, 30, 0)], [20.0])
    told = [
        nearest(line([(0, 0, 0), (100, 0, 0)], [20.0], radius_m=radius_m, spread_m_s=spread_m_s), other)
        for radius_m, spread_m_s in ((0.0, 0.0), (5.0, 0.0), (5.0, 0.5))
    ]
    distances_m = [found.distance_m for found in told if found is not None]
    assert distances_m == pytest.approx([30.0, 25.0, 15.0], abs=0.3)


def test_a_close_search_agrees_where_both_hover() -> None:
    one, other = line([(0, 0, 5), (0, 0, 5)], [4.0]), line([(3, 4, 5), (3, 4, 5)], [4.0], radius_m=1.0)
    found = nearest(one, other)
    assert found is not None
    assert found.distance_m == pytest.approx(slowly(one, other)) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("points", "t_s", "radius_m"),
    [
        ([(0, 0, 0)], [0.0], 1.0),
        ([(0, 0, 0), (1, 0, 0)], [0.0, math.nan], 1.0),
        ([(0, 0, 0), (1, 0, math.inf)], [0.0, 1.0], 1.0),
        ([(0, 0, 0), (1, 0, 0)], [1.0, 0.0], 1.0),
        ([(0, 0, 0), (1, 0, 0)], [0.0, 1.0], -1.0),
        ([(0, 0), (1, 0)], [0.0, 1.0], 1.0),
    ],
)
def test_what_is_no_timed_line_is_refused(points: list[tuple[float, ...]], t_s: list[float], radius_m: float) -> None:
    with pytest.raises(ParameterError):
        TimedLine(np.array(points, dtype=np.float64), np.array(t_s), radius_m)
