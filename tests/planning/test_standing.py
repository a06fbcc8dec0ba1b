"""What a sensor has seen that does not tell heights: columns from the ground up, as high as they may be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.evading.boxes import nearest_box
from planning.evading.columns import standing
from planning.evading.manoeuvres import Manoeuvre, NoWay, Seen, around, over
from planning.evading.seen import conflicts
from tests.reference.box_distance import polyline_boxes_m

HERE = np.array([0.0, 0.0, 8.0])
SLOPES = (-0.4, -0.25, -0.1, 0.0, 0.1, 0.25, 0.36)
UP_20_DEG = math.tan(math.radians(20))


def wall(ahead_m: float, *heights_m: float) -> F64:
    """A radar's layers of a wall 11 m wide across the way, as seen from these heights."""
    return np.array([(e + 0.5, ahead_m + 0.5, up) for e in range(-5, 6) for up in heights_m])


def line(slope: float) -> F64:
    return np.array([HERE, [0.0, 80.0, HERE[2] + 80.0 * slope]])


def test_a_thing_that_is_still_seen_may_reach_as_high_as_the_radar_looks() -> None:
    found = standing(Seen(np.array([[0.5, 30.5, 7.5], [0.5, 30.5, 8.5], [4.5, 30.5, 5.5]]), 1.0), HERE)
    assert found.half_up_m is not None
    assert found.is_open is not None
    tops_m = found.centres_enu_m[:, 2] + found.half_up_m
    # The second one ends below the vehicle, which has looked over it.
    assert tops_m == pytest.approx([9.0 + UP_20_DEG * math.hypot(0.5, 30.5), 6.0])
    assert found.is_open.tolist() == [True, False]
    assert (found.centres_enu_m[:, 2] - found.half_up_m).max() < -90.0


@pytest.mark.parametrize("slope", SLOPES)
def test_on_any_slope_the_mission_ahead_meets_what_stands_on_it(slope: float) -> None:
    met = conflicts(line(slope), wall(40, 8.5), resolution_m=1.0, radius_m=0.8, standing_from_enu_m=HERE)
    assert met is not None
    assert met.top_unseen
    assert met.ahead_m == pytest.approx(40.5 * math.hypot(1, slope), abs=0.6)
    assert met.enu_m[2] == pytest.approx(8.5 + UP_20_DEG * math.hypot(met.enu_m[0], met.enu_m[1]))


def test_steeper_than_the_radar_looks_up_the_line_leads_above_it() -> None:
    assert conflicts(line(0.6), wall(40, 8.5), resolution_m=1.0, radius_m=0.8, standing_from_enu_m=HERE) is None


def test_what_was_flown_over_is_not_met_once_more() -> None:
    above = np.array([0.0, 36.0, 11.0])
    onward = np.array([above, [0.0, 80.0, 11.0]])
    seen = wall(40, 6.5, 7.5, 8.5)
    assert conflicts(onward, seen, resolution_m=1.0, radius_m=0.8, standing_from_enu_m=above) is None
    down = np.array([above, [0.0, 80.0, 0.0]])
    met = conflicts(down, seen, resolution_m=1.0, radius_m=0.8, standing_from_enu_m=above)
    assert met is not None
    assert not met.top_unseen


@pytest.mark.parametrize("ahead_m", [10, 15])
@pytest.mark.parametrize("slope", SLOPES)
def test_ways_past_it_count_on_its_height_on_any_slope(slope: float, ahead_m: int) -> None:
    seen = [standing(Seen(wall(ahead_m, 8.5), 1.0), HERE)]
    up, aside = over(HERE, line(slope), seen), around(HERE, line(slope), seen)
    assert isinstance(up, Manoeuvre)
    assert up.top_unseen
    above_m = np.interp([ahead_m, ahead_m + 1], up.points_enu_m[:, 1], up.points_enu_m[:, 2]).min()
    assert above_m >= 9.0 + UP_20_DEG * ahead_m + 2.0
    assert isinstance(aside, Manoeuvre)
    # Whatever its height: nowhere above it, and not through what is behind it.
    away_m, _ = nearest_box(aside.points_enu_m * [1, 1, 0], wall(ahead_m, 8.5) * [1, 1, 0], 0.5)
    assert away_m >= 2.0
    assert not aside.top_unseen


def test_what_ends_below_the_vehicle_is_flown_over_with_a_clearance() -> None:
    high = np.array([0.0, 0.0, 11.0])
    seen = [standing(Seen(wall(15, 7.5, 8.5), 1.0), high)]
    up = over(high, np.array([high, [0.0, 80.0, -5.0]]), seen)
    assert isinstance(up, Manoeuvre)
    assert not up.top_unseen
    assert up.seen_m == pytest.approx(2.0, abs=0.5)
    assert isinstance(over(high, np.array([high, [0.0, 80.0, 15.0]]), seen), NoWay)


@given(seed=st.integers(0, 10_000))
def test_distances_to_columns_are_those_to_stacks_of_cubes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-15, 15, (3, 3))
    feet, high = rng.integers(-12, 12, (6, 3)) + 0.5, rng.integers(1, 9, 6)
    stacks = np.concatenate([foot + np.outer(np.arange(n), [0, 0, 1]) for foot, n in zip(feet, high, strict=True)])
    middles = feet + np.outer((high - 1) / 2, [0, 0, 1])
    found, _ = nearest_box(points, middles, 0.5, half_up_m=high / 2)
    assert found == pytest.approx(polyline_boxes_m(points, stacks, 0.5), abs=0.06)


def test_through_a_higher_gate_it_may_be_higher() -> None:
    seen = Seen(np.array([[0.5, 30.5, 8.5]]), 1.0)
    usual, wide = standing(seen, HERE), standing(seen, HERE, reach_up=math.tan(math.radians(30)))
    assert usual.half_up_m is not None
    assert wide.half_up_m is not None
    more_m = 2 * (wide.half_up_m[0] - usual.half_up_m[0])
    assert more_m == pytest.approx(math.hypot(0.5, 30.5) * (math.tan(math.radians(30)) - UP_20_DEG))
    steep = conflicts(
        line(0.5), wall(40, 8.5), resolution_m=1.0, radius_m=0.8, standing_from_enu_m=HERE,
        reach_up=math.tan(math.radians(30)),
    )  # fmt: skip
    assert steep is not None
    assert conflicts(line(0.5), wall(40, 8.5), resolution_m=1.0, radius_m=0.8, standing_from_enu_m=HERE) is None
