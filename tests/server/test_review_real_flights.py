"""Review of real autopilots that Hedgehop flew: its figures beside those that were worked out independently, by brute
force over every cell of the surface model, from the vehicle's true positions where its simulation told them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from planning.terrain.geotiff import read_dsm
from server.flying.review import recording_of, review
from server.schemas.review_docs import ReviewFigures
from telemetry.recording.flight_log import read_flight_log

AUTO, GUIDED = "arducopter-4.7_auto", "arducopter-4.7_guided_below_certified"
PX4_AUTO, PX4_GUIDED = "px4-1.17_auto_rtk", "px4-1.17_guided_rtk"


@pytest.fixture(scope="module")
def figures_of(shared_data: Path) -> Callable[[str], ReviewFigures]:
    dsm = read_dsm(shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")

    @cache
    def reviewed(name: str) -> ReviewFigures:
        path = shared_data / "logs" / "real_flights" / f"{name}.mcap"
        log = read_flight_log(path)
        found = review(log, recording_of(log, path), dsm=dsm).figures
        assert found is not None
        return found

    return reviewed


@pytest.mark.fact("A1")
@pytest.mark.parametrize(("name", "true_m", "certified_m", "required_m"), [
    (AUTO, 5.85, 6.17, 1.15),
    (GUIDED, 0.87, 1.29, 1.15),
])  # fmt: skip
def test_an_arducopters_distance_is_the_true_one_to_a_tenth_of_a_metre(
    figures_of: Callable[[str], ReviewFigures], name: str, true_m: float, certified_m: float, required_m: float
) -> None:
    found = figures_of(name)
    assert found.min_distance_m == pytest.approx(true_m, abs=0.115)
    assert found.certified_distance_m == pytest.approx(certified_m, abs=0.005)
    assert found.required_distance_m == required_m
    assert (found.below_required is None) == (true_m > required_m)


@pytest.mark.fact("A3", "A5")
@pytest.mark.parametrize(("name", "beside_m", "height_p95_m"), [
    (AUTO, 0.63, (0.20, 0.30)),
    (GUIDED, 0.63, (1.0, 1.5)),
])  # fmt: skip
def test_an_arducopter_keeps_beside_the_line_and_in_guided_not_to_its_height(
    figures_of: Callable[[str], ReviewFigures], name: str, beside_m: float, height_p95_m: tuple[float, float]
) -> None:
    found = figures_of(name)
    assert found.cross_track_max_m == pytest.approx(beside_m, abs=0.05)
    assert found.height_error_p95_m is not None
    assert height_p95_m[0] < found.height_error_p95_m < height_p95_m[1]


@pytest.mark.fact("A7")
@pytest.mark.parametrize("name", [AUTO, GUIDED])
def test_the_mission_of_an_arducopter_takes_as_long_as_predicted(
    figures_of: Callable[[str], ReviewFigures], name: str
) -> None:
    found = figures_of(name)
    assert found.duration_s == pytest.approx(found.predicted_s, rel=0.06)


@pytest.mark.fact("P6", "P7")
@pytest.mark.parametrize(
    ("name", "beside_m", "below_m", "above_m", "height_p95_m", "distance_m", "way_home_m", "took_s"),
    [
        (PX4_AUTO, (0.92, 0.36, 0.78), 0.99, 0.80, 0.58, 5.17, 4.37, 64.1),
        (PX4_GUIDED, (1.12, 0.34, 0.77), 0.59, 0.47, 0.43, 4.99, 4.61, 96.8),
    ],
)
def test_a_px4_leaves_the_line_as_measured(
    figures_of: Callable[[str], ReviewFigures],
    name: str,
    beside_m: tuple[float, float, float],
    below_m: float,
    above_m: float,
    height_p95_m: float,
    distance_m: float,
    way_home_m: float,
    took_s: float,
) -> None:
    """At most, mean and 95 % beside it; a predicted time of 58.6 s, a certificate of 4.99 m."""
    found = figures_of(name)
    assert (found.cross_track_max_m, found.cross_track_mean_m, found.cross_track_p95_m) == pytest.approx(
        beside_m, abs=0.006
    )
    assert (found.height_error_lowest_m, found.height_error_highest_m) == pytest.approx((-below_m, above_m), abs=0.006)
    assert found.height_error_p95_m == pytest.approx(height_p95_m, abs=0.006)
    assert (found.min_distance_m, found.min_distance_way_home_m) == pytest.approx((distance_m, way_home_m), abs=0.006)
    assert (found.duration_s, found.predicted_s) == pytest.approx((took_s, 58.6), abs=0.06)
    assert (found.certified_distance_m, found.completed) == (pytest.approx(4.985, abs=0.001), True)


@pytest.mark.fact("P8")
def test_a_px4_in_hold_is_far_behind_the_plan_and_in_mission_little(
    figures_of: Callable[[str], ReviewFigures],
) -> None:
    lag_s = {name: figures_of(name).lag_s for name in (PX4_AUTO, PX4_GUIDED)}
    assert lag_s == {PX4_AUTO: pytest.approx(3.2, abs=0.1), PX4_GUIDED: pytest.approx(21.0, abs=0.6)}
