"""Short versions of the papers' field tests: what each must show, on seeds that nothing was tuned to."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from statistics import fmean

import pytest

from planning.terrain.geotiff import read_dsm
from telemetry.simulation.scenarios.castle import CASES, fly_case
from telemetry.simulation.scenarios.catalogue import run_scenario
from telemetry.simulation.scenarios.hugging import long_flight, terrain_hugging
from telemetry.simulation.scenarios.stage.result import Figure, ScenarioRequest, ScenarioResult

pytestmark = pytest.mark.slow


def unreached(figures: tuple[Figure, ...]) -> list[str]:
    return [figure.line() for figure in figures if not figure.reached]


def test_a_corner_reflector_is_one_compact_cluster_where_it_stands() -> None:
    """Of one seed's returns some more or fewer lie beside it by chance: eight seeds lie between 0.89 and 0.97."""
    results = [run_scenario("corner-reflector", ScenarioRequest(seed)) for seed in (21, 22, 23)]
    figures = zip(*(result.figures for result in results), strict=True)
    means = tuple(replace(each[0], value=fmean(figure.value for figure in each)) for each in figures)
    assert unreached(means) == []
    assert not any(result.flights[0].contact for result in results)


@pytest.mark.parametrize("number", range(len(CASES)), ids=[case.title.replace(" ", "-") for case in CASES])
def test_each_sensor_alone_clears_a_building(number: int) -> None:
    """Many more seeds are flown by the scenario itself."""
    result = fly_case(CASES[number], ScenarioRequest(31 + number % 2), ahead_m=26.0)
    assert unreached(result.figures) == [], result.notes
    assert result.min_true_distance_m > 0.5


@pytest.mark.parametrize("name", ["wood", "ruined-building"])
def test_maps_of_what_stands_there_are_mostly_right_and_mostly_whole(name: str) -> None:
    (flight,) = run_scenario(name, ScenarioRequest(41)).flights
    assert not flight.contact
    for figures in (flight.radar, flight.vision):
        assert figures.precision is not None
        assert figures.recall is not None
        assert figures.precision > 0.7
        assert figures.recall > 0.6
    above, side, *_, share = flight.charts
    assert len(flight.charts) == 5
    assert all(len(one.x) > 20 for one in above.series[:3])
    assert any(one.printed for one in side.series) == (name == "wood")
    shown = {one.name: dict(zip(one.x, one.y, strict=True)) for one in share.series}
    assert shown["radar: precision"][2.0] == pytest.approx(100 * (flight.radar.precision or 0.0), abs=1e-3)


def hugging_is_safe(result: ScenarioResult) -> None:
    """Rates need kilometres: a short flight may hold one false alarm, and no object that is met unannounced."""
    (flight,) = result.flights
    assert math.isclose(flight.min_true_distance_m, 0.0, abs_tol=0.5)
    assert flight.missed == 0, flight.notes
    assert sum(note.startswith("FALSE") for note in flight.notes) <= 1, flight.notes


def test_things_strewn_over_a_volcano_are_told_before_it_is_too_late() -> None:
    result = terrain_hugging.run_over(terrain_hugging.etna(), ScenarioRequest(51), "etna-like", most_m=150.0)
    hugging_is_safe(result)
    profile, distances, false, cross = result.flights[0].charts
    assert sum(one.name in ("", "what the model does not know") for one in profile.series) >= 2
    told, needed = distances.series[:2]
    assert all(one > least for one, least in zip(told.y, needed.y, strict=True))
    assert false.series[0].x[-1] == pytest.approx(150.0, abs=5.0)
    assert max(cross.series[0].y) < 2.0


def test_things_strewn_over_real_bush_are_told_before_it_is_too_late(shared_data: Path) -> None:
    dsm = read_dsm(shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")
    hugging_is_safe(terrain_hugging.run_over(dsm, ScenarioRequest(52), "coromandel", apart_m=60.0, most_m=150.0))


def test_a_longer_flight_makes_its_map_grow_with_what_is_new_alone(tmp_path: Path) -> None:
    kept = tmp_path / "flight.mcap"
    (flight,) = long_flight.run_for(ScenarioRequest(61, record=kept), 60.0, 5.0).flights
    assert 59.0 < flight.duration_s < 61.0
    values = {figure.words: figure.value for figure in flight.figures}
    assert 20.0 < values["bytes per new voxel at first"] < 2000.0
    assert values["recording"] == pytest.approx(kept.stat().st_size / 1e6, rel=0.2)


def test_growth_that_does_not_come_from_new_voxels_is_not_reached() -> None:
    looks = [long_flight.Look(300.0 * k, 10_000 * k, 4_000_000 + 600_000 * k, 10_000 * k) for k in range(13)]
    assert unreached(long_flight.growth_figures(looks)) == []
    leaking = [long_flight.Look(one.t_s, one.voxels, one.map_bytes + int(one.t_s**2), 0) for one in looks]
    assert unreached(long_flight.growth_figures(leaking)) != []
    idle = [*looks, long_flight.Look(3900.0, looks[-1].voxels, looks[-1].map_bytes + 600_000, 0)]
    assert unreached(long_flight.growth_figures(idle)) != []
