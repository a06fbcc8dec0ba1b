"""When something may be inside a growing cylinder: the closed form against looking at many moments."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planning.errors import ParameterError
from planning.following.zones import Enu, Zone, closest, first_inside

UNTIL_S = 60.0
STEP_S = 0.02
STANDS_M_S = 1e-6

places = st.tuples(st.floats(-20_000, 20_000), st.floats(-20_000, 20_000), st.floats(-2_000, 2_000))
speeds = st.tuples(st.floats(-250, 250), st.floats(-250, 250), st.floats(-30, 30))
zones = st.builds(
    Zone,
    st.floats(0, 10_000),
    st.one_of(st.floats(0, 1_000), st.just(math.inf)),
    st.floats(0, 150),
    st.floats(0, 15),
)


def excess_m(offset: Enu, velocity: Enu, zone: Zone, t_s: float) -> float:
    """How far outside of the cylinder at that moment; below zero: inside."""
    x, y, z = (at + v * t_s for at, v in zip(offset, velocity, strict=True))
    beside = math.hypot(x, y) - zone.radius_m - zone.radius_spread_m_s * t_s
    over = -math.inf if math.isinf(zone.height_m) else abs(z) - zone.height_m - zone.height_spread_m_s * t_s
    return max(beside, over)


@given(places, speeds, zones)
@example((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), Zone(0.0, 0.0))
@example((5_000.0, 0.0, 100.0), (-50.0, 0.0, 0.0), Zone(1_000.0, 300.0, 50.0, 1.0))
@example((5_000.0, 100.0, 900.0), (-100.0, 0.0, -20.0), Zone(500.0, 100.0))
@example((0.0, 4_000.0, 50.0), (0.0, 10.0, 0.0), Zone(1_000.0, 100.0, 80.0))
def test_it_finds_the_first_moment_that_a_slow_search_finds(offset: Enu, velocity: Enu, zone: Zone) -> None:
    found_s = first_inside(offset, velocity, zone, UNTIL_S)
    moments = [k * STEP_S for k in range(round(UNTIL_S / STEP_S) + 1)]
    slow_s = next((t for t in moments if excess_m(offset, velocity, zone, t) <= 0), None)
    if found_s is not None:
        assert 0 <= found_s <= UNTIL_S
        assert excess_m(offset, velocity, zone, found_s) < 1e-3  # it is inside then
    if slow_s is not None:
        before_m = excess_m(offset, velocity, zone, slow_s)
        assert found_s is not None or before_m > -1e-3
        assert found_s is None or found_s <= slow_s + 1e-6  # and not first at a later moment


@given(places, speeds)
@example((1.0, 0.0, 0.0), (-9e-7, 0.0, 0.0))
def test_the_closest_approach_is_no_farther_than_at_any_moment(offset: Enu, velocity: Enu) -> None:
    distance_m, in_s = closest(offset, velocity)
    assert in_s >= 0
    at_m = math.hypot(offset[0] + velocity[0] * in_s, offset[1] + velocity[1] * in_s)
    assert distance_m == pytest.approx(at_m, abs=1e-6)
    for k in range(0, 3_000, 7):
        t_s = k / 10
        moved_m = STANDS_M_S * t_s  # what is slower counts as standing
        assert distance_m <= math.hypot(offset[0] + velocity[0] * t_s, offset[1] + velocity[1] * t_s) + 1e-6 + moved_m


def test_what_passes_high_above_is_never_inside_and_without_a_height_it_is() -> None:
    at, course = (3_000.0, 0.0, 2_000.0), (-100.0, 0.0, 0.0)
    assert first_inside(at, course, Zone(1_000.0, 300.0), UNTIL_S) is None
    assert first_inside(at, course, Zone(1_000.0, math.inf), UNTIL_S) == pytest.approx(20.0)
    assert first_inside(at, course, Zone(1_000.0, 300.0, 0.0, 100.0), UNTIL_S) == pytest.approx(20.0)
    assert first_inside(at, course, Zone(1_000.0, math.inf), 19.0) is None


@pytest.mark.parametrize("wrong", [(-1.0, 1.0), (1.0, -1.0), (math.nan, 1.0)])
def test_a_zone_smaller_than_nothing_is_refused(wrong: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="smaller than nothing"):
        Zone(*wrong)
