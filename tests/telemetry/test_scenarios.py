"""The scenarios' harness: virtual time, one result per seed, its figures, scenes and things strewn in the way."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from telemetry.recording.flight_log import read_flight_log
from telemetry.simulation.scenarios.hugging.encounters import away_m, level_away_m, objects_of
from telemetry.simulation.scenarios.hugging.strewn import strewn
from telemetry.simulation.scenarios.stage import scenes
from telemetry.simulation.scenarios.stage.course import Course, Waypoint, course_mission, script_request
from telemetry.simulation.scenarios.stage.map_against_world import clusters_of, level_slice, recall, spread, within
from telemetry.simulation.scenarios.stage.paper_fields import field, known
from telemetry.simulation.scenarios.stage.result import (
    AlertSeen,
    Figure,
    FlightResult,
    MapFigures,
    ScenarioRequest,
    ScenarioResult,
    tally,
    tally_json,
)
from telemetry.simulation.scenarios.stage.running import flown_of, setup_of
from telemetry.simulation.scenarios.stage.scenes import VALLEY, ScenarioScene
from telemetry.simulation.scenarios.stage.world_objects import box, cylinder, reflector, tree, wall, world_document
from telemetry.simulation.simulator.scene import SceneTerrain, World
from telemetry.topics.vehicle import SimTruth

HOP = ScenarioScene(
    world_document("hop", [wall("fence", (-6.0, 14.0), (6.0, 14.0), 5.0, material="stone")]),
    Course((Waypoint((0.0, 3.0, 3.0), 2.0, 0.0),), takeoff_m=3.0, end="land"),
)
KEYS = {
    "name", "seed", "duration_s", "contact", "min_true_distance_m", "alerts", "first_alert_s", "radar", "vision",
    "false_alarms_per_km", "missed",
}  # fmt: skip


def flight(**more: object) -> FlightResult:
    values: dict[str, object] = {
        "title": "out and back",
        "duration_s": 60.0,
        "contact": False,
        "min_true_distance_m": math.inf,
        "alerts": (AlertSeen(4.0, "radar", 12.5), AlertSeen(3.0, "vision", None)),
        "radar": MapFigures(3, {"1": 0.5}, 0.4, 0.9, 0.8),
        "vision": MapFigures(),
    }
    return FlightResult(**(values | more))  # type: ignore[arg-type]


def test_a_seed_decides_everything_and_virtual_time_leaves_no_trace_of_the_clock(tmp_path: Path) -> None:
    first, second = (
        flown_of(
            setup_of(HOP, ScenarioRequest(5, record=tmp_path / f"{number}.mcap"), "hop"),
            ScenarioRequest(5, record=tmp_path / f"{number}.mcap"),
        )
        for number in (1, 2)
    )
    assert first.landed
    assert first.nearest_m == pytest.approx(11.0, abs=0.5)
    assert first.alerts_seen() == second.alerts_seen()
    assert first.track == second.track
    assert np.array_equal(first.voxels("radar"), second.voxels("radar"))
    assert len(first.voxels("radar")) > 0
    other = flown_of(setup_of(HOP, ScenarioRequest(6), "hop"), ScenarioRequest(6))
    assert other.track != first.track
    log = read_flight_log(tmp_path / "1.mcap")
    assert log.end_utc_s - log.start_utc_s > 15
    assert {"GUIDED", "LAND"} <= {mode for _, mode in log.modes}
    assert log.mission is not None
    assert log.plan is not None
    assert log.faults == ()


def test_figures_know_their_limits() -> None:
    assert Figure("share", 0.9, least=0.9).reached
    assert not Figure("share", 0.89, least=0.9).reached
    assert Figure("clusters", 1.0, least=1.0, most=1.0).reached
    assert not Figure("delay", math.inf, most=0.2).reached
    assert Figure("precision", 0.1).reached
    assert "NOT REACHED" in Figure("share", 0.5, least=0.9).line()
    assert Figure("spread", 1.5, unit=" m").line() == "spread: 1.5 m"


def test_results_are_one_json_object_with_the_keys_promised() -> None:
    one = ScenarioResult("wood", 3, (flight(),)).as_json()
    assert set(one) >= KEYS
    assert one["alerts"][0] == {"t_s": 4.0, "sensor": "radar", "distance_m": 12.5}
    assert one["first_alert_s"] == 3.0
    assert one["min_true_distance_m"] is None
    assert set(one["radar"]) == {"voxels", "within_m", "vertical_spread_m", "precision", "recall"}
    json.dumps(one, allow_nan=False)
    bad = flight(contact=True, min_true_distance_m=0.1, missed=2, figures=(Figure("contacts", 1.0, most=0.0),))
    both = ScenarioResult("castle-building", 3, (flight(missed=1), bad))
    several = both.as_json()
    assert set(several) >= KEYS
    assert several["contact"]
    assert several["missed"] == 3
    assert several["min_true_distance_m"] == 0.1
    assert several["duration_s"] == 120.0
    assert not several["passed"]
    assert len(several["flights"]) == 2
    assert any("CONTACT" in line for line in both.lines())


def test_many_seeds_are_counted_figure_by_figure() -> None:
    good, bad = (
        ScenarioResult("wood", seed, (flight(figures=(Figure("found", value, least=0.9),)),))
        for seed, value in ((1, 0.95), (2, 0.5))
    )
    assert tally([good, bad])[0] == "wood: 1 of 2 seeds reached every figure"
    counted = tally_json([good, bad])
    assert counted["passed"] == 1
    assert counted["figures"] == [{"words": "found", "reached": 1, "of": 2, "worst": 0.5, "unit": ""}]
    json.dumps(counted, allow_nan=False)


@pytest.mark.parametrize("seed", range(6))
def test_scenes_are_worlds_that_block_the_way_only_where_they_should(seed: int) -> None:
    for scene in (scenes.corner_reflector(), scenes.wood(seed), scenes.ruined_building(seed)):
        world = World.parse(scene.document, frame=VALLEY, dsm=field(VALLEY, scene.hills))
        line = np.array([waypoint.enu_m for waypoint in scene.course.waypoints])
        assert world.distance_m(line).min() > 2.0
    castle = scenes.castle_building(seed)
    world = World.parse(castle.document, frame=VALLEY)
    along = np.column_stack([np.zeros(400), np.linspace(0.0, 80.0, 400), np.full(400, scenes.CASTLE_HEIGHT_M)])
    inside = along[world.distance_m(along) <= 0.0, 1]
    assert inside.min() == pytest.approx(scenes.CASTLE_AHEAD_M, abs=0.5)


def test_the_reflector_stands_where_the_paper_has_it() -> None:
    scene = scenes.corner_reflector()
    world = World.parse(scene.document, frame=VALLEY, dsm=field(VALLEY, scene.hills))
    assert world.reflectors[0] == pytest.approx([0.0, 68.0, 3.0], abs=0.3)


def test_a_course_is_the_same_for_script_and_mission() -> None:
    course = scenes.castle_building(1).course
    request, mission = script_request(course, VALLEY), course_mission(course, VALLEY)
    flown = [item for item in mission.items if item.command == 16]
    assert [(item.lat_deg, item.lon_deg, item.alt_m) for item in flown] == [
        (target.lat_deg, target.lon_deg, target.alt_rel_home_m) for target in request.targets
    ]


def test_known_ground_is_near_the_true_one_and_never_the_same() -> None:
    true = field(VALLEY, (scenes.Hill((0.0, 50.0), 3.0, 8.0),))
    surveyed = known(true, np.random.default_rng(1))
    off = surveyed.elevation_m - true.elevation_m
    assert 0.03 < off.std() < 0.07
    assert float(np.nanmax(true.elevation_m)) == pytest.approx(VALLEY.alt_amsl_m + 3.0, abs=0.01)


def test_what_is_strewn_stands_in_the_way_and_above_it() -> None:
    line = np.array([[0.0, 0.0, 6.0], [0.0, 120.0, 9.0], [150.0, 120.0, 6.0]])
    objects = strewn(line, SceneTerrain.level(), np.random.default_rng(2))
    assert {thing["type"] for thing in objects} == {"cylinder", "wall", "tree"}
    world = World.parse(world_document("strewn", objects))
    steps = np.linspace(0.0, 1.0, 2000)[:, None]
    way = np.concatenate([line[k] + steps * (line[k + 1] - line[k]) for k in (0, 1)])
    for rows in objects_of(world).values():
        assert away_m(rows, way).min() < 0.2


def test_nearness_tells_height_from_place() -> None:
    world = World.parse(
        world_document("pair", [cylinder("mast", (10.0, 0.0), 0.5, 20.0), box("hut", (0.0, 9.0), (2, 2, 2))])
    )
    rows = objects_of(world)
    assert away_m(rows["mast"], np.array([[10.0, 0.0, 25.0]]))[0] == pytest.approx(5.0)
    assert level_away_m(rows["mast"], np.array([7.0, 0.0, 90.0])) == pytest.approx(2.5)
    assert level_away_m(rows["hut"], np.array([0.0, 9.0, -5.0])) == 0.0
    assert level_away_m(np.empty((0, 10)), np.zeros(3)) == math.inf


def test_shares_spreads_and_clusters_of_plain_numbers() -> None:
    assert within(np.array([0.4, 1.2, 9.0]))["1.5"] == pytest.approx(2 / 3)
    assert within(np.empty(0)) == {}
    assert spread(np.linspace(0.0, 100.0, 1001)) == pytest.approx(90.0)
    places = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    assert clusters_of(places, link_m=2.5).tolist() == [0, 0, 0, 1]
    surface = np.array([[0.5, 0.5, 0.5], [10.5, 0.5, 0.5]])
    assert recall(surface, surface[:1], voxel_m=1.0, within_m=2.0) == 0.5
    assert recall(np.empty((0, 3)), surface, voxel_m=1.0, within_m=2.0) is None


def test_the_ideal_slice_sees_faces_and_nothing_behind_them() -> None:
    world = World.parse(
        world_document("faces", [box("near", (0.0, 10.0), (4.0, 2.0, 6.0)), tree("far", (0.0, 30.0), 9.0, 0.5, 2.0)])
    )
    truth = SimTruth(0, 0, 1.0, 0, 0, 0, (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, True)
    met = level_slice(world, [truth, replace(truth, t_sim_s=1.1)], most_m=40.0)
    assert np.all(met[:, 2] == 3.0)
    assert met[:, 1].min() == pytest.approx(9.0, abs=1e-6)
    assert met[:, 1].max() < 12.0


def test_a_reflector_is_written_as_world_files_have_it() -> None:
    world = World.parse(world_document("one", [reflector("corner", (1.0, 2.0), 3.0, 0.2)]))
    assert world.reflectors[0] == pytest.approx([1.0, 2.0, 3.0], abs=0.2)
