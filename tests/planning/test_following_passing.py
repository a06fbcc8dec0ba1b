"""Which places count as flown to when avoidance flew a part of the mission, higher than planned."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.arrays import F64
from planning.following.figures import TrackFigures, judge
from planning.following.track import Track
from tests.planning.following_lines import flown, line

ROUTE = line([(0, 0, 12), (40, 0, 12), (80, 0, 12), (80, 40, 12)])
TAKEN_OVER_S = 15.0
"""At 30 m: before the first corner."""


def climbed_over(*, by_m: float = 10.0, until_s: float = 1e9) -> tuple[F64, F64]:
    """Along the route at 2 m/s, from the take-over on ``by_m`` higher; nothing after ``until_s``."""
    t_s, xyz_m = flown(ROUTE)
    xyz_m = xyz_m + np.where(t_s > TAKEN_OVER_S, by_m, 0.0)[:, None] * [0.0, 0.0, 1.0]
    return t_s[t_s <= until_s], xyz_m[t_s <= until_s]


def figures_of(t_s: F64, xyz_m: F64, **facts) -> TrackFigures:
    detour = (TAKEN_OVER_S, float(t_s[-1]))
    track = Track(t_s, xyz_m, **{"on_mission": ((0.0, TAKEN_OVER_S),), "detours": (detour,), **facts})
    figures = judge(ROUTE, track, None).figures
    assert figures is not None
    return figures


def test_places_passed_higher_by_avoidance_complete_the_mission() -> None:
    figures = figures_of(*climbed_over())
    assert figures.completed
    assert figures.end_s == pytest.approx(60.0, abs=0.2)
    assert figures.higher is not None
    assert figures.higher.most_m == pytest.approx(10.0)
    assert figures.higher.from_item == 1


def test_the_detour_counts_for_no_error() -> None:
    figures = figures_of(*climbed_over())
    assert figures.height_highest_m == pytest.approx(0.0, abs=1e-9)
    assert figures.positions == pytest.approx(10 * TAKEN_OVER_S, abs=2)


def test_the_same_flight_without_avoidance_is_not_completed() -> None:
    assert not figures_of(*climbed_over(), detours=()).completed


def test_a_flight_that_ends_before_the_last_place_is_not_completed() -> None:
    figures = figures_of(*climbed_over(until_s=55.0))
    assert not figures.completed
    assert figures.end_s == pytest.approx(55.0, abs=0.1)
    assert figures.higher is not None


def test_a_place_that_was_left_out_is_not_made_up_for_by_the_last_one() -> None:
    t_s, xyz_m = climbed_over()
    xyz_m[(t_s > 37) & (t_s < 43), :2] += [-4.0, 4.0]  # cuts the second corner
    assert not figures_of(t_s, xyz_m).completed


def test_a_place_that_was_passed_lower_does_not_count() -> None:
    assert not figures_of(*climbed_over(by_m=-2.0)).completed


def test_a_way_around_at_the_planned_height_is_not_called_higher() -> None:
    figures = figures_of(*climbed_over(by_m=0.0))
    assert figures.completed
    assert figures.higher is None


def test_places_that_the_vehicle_reported_before_need_not_be_measured() -> None:
    t_s, xyz_m = climbed_over()
    xyz_m[(t_s > 17) & (t_s < 25), 1] += 5.0  # cuts the first corner by more than anything that is measured
    told = ((0.0, 0), (20.0, 1))
    assert not figures_of(t_s, xyz_m).completed
    assert figures_of(t_s, xyz_m, reached=told).completed


def test_the_smallest_distance_is_looked_for_on_the_detour_too() -> None:
    t_s, xyz_m = climbed_over()
    track = Track(t_s, xyz_m, on_mission=((0.0, TAKEN_OVER_S),), detours=((TAKEN_OVER_S, 100.0),))
    window = judge(ROUTE, track, None).window
    assert window is not None
    assert not (window.judged & window.detour).any()
    assert (window.judged | window.detour).sum() == pytest.approx(len(t_s), abs=2)
