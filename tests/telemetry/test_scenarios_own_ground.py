"""Terrain hugging over a surface model of one's own: what is strewn on it, and what is said where nothing stood."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from affine import Affine

from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from telemetry.perception.perceiver import Perceiver
from telemetry.simulation.scenarios.hugging.encounters import encounters, objects_of
from telemetry.simulation.scenarios.hugging.hugging import Hugging, random_route
from telemetry.simulation.scenarios.hugging.terrain_hugging import etna, run_over, world_of
from telemetry.simulation.scenarios.stage.course import Course, Waypoint, course_mission
from telemetry.simulation.scenarios.stage.paper_fields import field
from telemetry.simulation.scenarios.stage.result import (
    Figure,
    FlightResult,
    MapFigures,
    ScenarioRequest,
    ScenarioResult,
    tally,
    tally_json,
)
from telemetry.simulation.scenarios.stage.scenes import VALLEY
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.scenarios.stage.world_objects import Object, cylinder, world_document
from telemetry.simulation.simulator.scene import World
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.vehicle import SimTruth

LINE = np.array([[0.0, 0.0, 6.0], [0.0, 120.0, 6.0]])
SHARE = "share of unknown objects alarmed in time"


def plan() -> Hugging:
    course = Course((Waypoint((0.0, 120.0, 6.0), 3.0),), takeoff_m=6.0)
    return Hugging(field(VALLEY, ()), course_mission(course, VALLEY), VALLEY, LINE, 5.0)


def world_file(path: Path, *objects: Object, **more: object) -> Path:
    path.write_text(json.dumps(world_document("own", objects) | more))
    return path


def strewn_with(seed: int, world: Path | None = None) -> World:
    return world_of(plan(), ScenarioRequest(seed, world), "etna-like", np.random.default_rng(seed))


def test_bare_ground_of_ones_own_is_strewn_as_the_scenarios_own_is(tmp_path: Path) -> None:
    bare = world_file(tmp_path / "bare.json", dsm="hillside.tif")
    own, given = strewn_with(3), strewn_with(3, bare)
    assert len(own.shapes) > 1
    assert np.array_equal(own.placed.rows, given.placed.rows)
    assert not np.array_equal(given.placed.rows, strewn_with(4, bare).placed.rows)


def test_objects_of_ones_own_are_the_only_ones(tmp_path: Path) -> None:
    mast = cylinder("mast", (0.0, 50.0), 0.2, 9.0)
    assert set(objects_of(strewn_with(3, world_file(tmp_path / "one.json", mast, dsm="hillside.tif")))) == {"mast"}
    assert objects_of(strewn_with(3, world_file(tmp_path / "none.json"))) == {}


def flown_past(*, to_m: float = 60.0) -> SeenFlight:
    """North at 3 m/s, never told of anything."""
    flown = SeenFlight(began_s=0.0, vehicle_radius_m=0.5, way_m=to_m)
    flown.perceivers["radar"] = cast(Perceiver, None)
    for k, north_m in enumerate(np.arange(0.0, to_m + 0.1, 0.3)):
        t_s = 0.1 * k
        place, velocity = (0.0, float(north_m), 5.0), (0.0, 3.0, 0.0)
        flown.track.append(SimTruth(t_s, t_s, t_s, 0, 0, 0, place, velocity, 0.0, 0.0, 0.0, True))
    return flown


def share_past(*objects: Object) -> Figure:
    found = encounters(flown_past(), World.parse(world_document("own", objects)), PerceptionSettings())
    return next(figure for figure in found.figures if figure.words == SHARE)


def test_where_nothing_stood_in_the_way_nothing_is_reached() -> None:
    aside = share_past(cylinder("aside", (9.0, 30.0), 0.2, 9.0))
    assert math.isnan(aside.value)
    assert not aside.reached
    assert aside.line() == f"{SHARE}: none  (at least 0.95: not measured)"
    assert share_past(cylinder("ahead", (0.0, 30.0), 0.2, 9.0)).value == 0.0


def test_who_has_flown_nowhere_has_no_false_alarms_per_km() -> None:
    found = encounters(flown_past(to_m=0.0), World.parse(world_document("own", [])), PerceptionSettings())
    assert not any(figure.reached for figure in found.figures)


def result(seed: int, share: float, *, contact: bool = True) -> ScenarioResult:
    figures = (Figure(SHARE, share, least=0.95),)
    flight = FlightResult("hugging", 60.0, contact, 0.0, (), MapFigures(), MapFigures(), figures=figures)
    return ScenarioResult("etna-like", seed, (flight,))


def test_what_was_not_measured_is_null_and_does_not_pass() -> None:
    said = result(1, math.nan).as_json()
    assert said["figures"][0]["value"] is None
    assert not said["passed"]
    assert result(1, 1.0).as_json()["contact"]
    assert result(1, 1.0).passed
    json.dumps(said, allow_nan=False)


@pytest.mark.parametrize("shares", [(math.nan, 0.97), (0.97, math.nan)])
def test_the_worst_of_several_is_the_worst_that_was_measured(shares: tuple[float, float]) -> None:
    results = [result(seed, share) for seed, share in enumerate(shares)]
    row = tally_json(results)["figures"][0]
    assert (row["reached"], row["of"], row["worst"]) == (1, 2, 0.97)
    assert tally([result(1, math.nan)])[1].endswith("reached 0 of 1, worst none")


def square(side_m: float) -> Dsm:
    """The middle of the level field."""
    whole = field(VALLEY, ())
    cells, first = round(side_m / whole.resolution_m), 100
    part = whole.elevation_m[first : first + cells, first : first + cells]
    return replace(whole, elevation_m=part, transform=whole.transform @ Affine.translation(first, first))


@pytest.mark.parametrize(("side_m", "least_m"), [(150.0, 90.0), (80.0, 40.0)])
def test_a_route_is_as_wide_as_the_model_allows(side_m: float, least_m: float) -> None:
    dsm = square(side_m)
    route = random_route(dsm, np.random.default_rng(1), points=5, apart_m=90.0)
    xy = dsm.xy_from_lat_lon(np.array([[poi.lat_deg, poi.lon_deg] for poi in route]))
    assert len(route) == 5
    assert np.hypot(*np.diff(xy, axis=0).T).min() >= least_m - 0.01


@pytest.mark.parametrize("side_m", [20.0, 40.0])
def test_a_model_without_room_for_a_route_is_refused(side_m: float) -> None:
    with pytest.raises(ParameterError, match="no room for a route"):
        random_route(square(side_m), np.random.default_rng(1), points=5, apart_m=90.0)


@pytest.mark.slow
def test_what_is_told_on_bare_ground_is_flown_through_and_said_so(tmp_path: Path) -> None:
    bare = world_file(tmp_path / "bare.json", dsm="hillside.tif")
    flown = run_over(etna(), ScenarioRequest(51, bare), "etna-like", most_m=60.0)
    (flight,) = flown.flights
    assert flight.contact
    assert flight.min_true_distance_m < 0.5
    assert flight.missed == 0, flight.notes
    assert next(figure.value for figure in flight.figures if figure.words == SHARE) == 1.0
