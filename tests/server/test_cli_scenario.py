"""``hedgehop scenario``: its answers, its exit codes and what it refuses; one flight among objects of one's own."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from planning.basics.limits import LARGEST_SEED
from telemetry.recording.flight_log import read_flight_log
from telemetry.simulation.scenarios.catalogue import NAMES
from telemetry.simulation.scenarios.stage.result import (
    AlertSeen,
    Figure,
    FlightResult,
    MapFigures,
    ScenarioRequest,
    ScenarioResult,
    measured,
)
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from tests.server.cli_runs import hedgehop


@pytest.fixture
def flights(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ScenarioRequest]]:
    """What would be flown; the figure is reached for even seeds."""
    asked: list[tuple[str, ScenarioRequest]] = []

    def run(name: str, wanted: ScenarioRequest) -> ScenarioResult:
        asked.append((name, wanted))
        share = 0.95 if wanted.seed % 2 == 0 else 0.5
        flight = FlightResult(
            title="flight",
            duration_s=70.0,
            contact=False,
            min_true_distance_m=3.0,
            alerts=(AlertSeen(9.0, "radar", 8.0),),
            radar=MapFigures(voxels=10, within_m={"1": 0.8}, vertical_spread_m=0.1, precision=0.9, recall=0.8),
            vision=MapFigures(),
            figures=(Figure("share found", share, least=0.9),),
        )
        return ScenarioResult(name, wanted.seed, (flight,))

    monkeypatch.setattr(import_module("server.cli.scenario_command"), "run_scenario", run)
    return asked


@pytest.mark.parametrize("name", NAMES)
def test_every_scenario_has_its_name(name: str, flights: list[tuple[str, ScenarioRequest]]) -> None:
    run = hedgehop("scenario", name, "--seed", 4)
    assert run.code == 0
    assert f"{name}, seed 4" in run.out
    assert "share found: 0.95  (at least 0.9: reached)" in run.out
    assert flights == [(name, ScenarioRequest(4))]


def test_a_figure_that_is_not_reached_ends_it_with_1(flights: list[tuple[str, ScenarioRequest]]) -> None:
    run = hedgehop("scenario", "wood", "--seed", 3, "--json")
    assert run.code == 1
    assert run.json["name"] == "wood"
    assert run.json["seed"] == 3
    assert run.json["alerts"] == [{"t_s": 9.0, "sensor": "radar", "distance_m": 8.0}]
    assert run.json["first_alert_s"] == 9.0
    assert run.json["radar"]["within_m"] == {"1": 0.8}
    assert not run.json["passed"]


def test_many_seeds_are_flown_and_counted(flights: list[tuple[str, ScenarioRequest]]) -> None:
    run = hedgehop("scenario", "castle-building", "--seed", 2, "--seeds", 3)
    assert run.code == 1
    assert [wanted.seed for _, wanted in flights] == [2, 3, 4]
    assert "castle-building: 2 of 3 seeds reached every figure" in run.out
    counted = hedgehop("scenario", "castle-building", "--seeds", 2, "--json").json
    assert (counted["passed"], counted["seeds"], len(counted["runs"])) == (1, [0, 1], 2)


def are_refused(wrong: Mapping[Any, str], flights: list[tuple[str, ScenarioRequest]]) -> None:
    """With these words each, before anything flies."""
    for arguments, words in wrong.items():
        run = hedgehop("scenario", *arguments)
        assert run.code == 2, arguments
        assert words in run.err
    assert flights == []


def test_what_cannot_be_flown_is_refused_before_anything_flies(
    flights: list[tuple[str, ScenarioRequest]], tmp_path: Path
) -> None:
    there = tmp_path / "there.mcap"
    there.write_bytes(b"")
    wrong = {
        ("jungle",): "There is no scenario",
        ("wood", "--world", tmp_path / "none.json"): "There is no such file",
        ("wood", "--record", there): "There is such a file already",
        ("wood", "--record", tmp_path / "new.mcap", "--seeds", 2): "A recording holds one seed",
        ("wood", "--seeds", 0): "--seeds",
        ("wood", "--seed", LARGEST_SEED + 1): "--seed",
        ("wood", "--seed", LARGEST_SEED - 1, "--seeds", 3): "The last seed would be 10,001",
        ("foliage", "--plots", tmp_path, "--seeds", 2): "Figures show one seed, not 2",
    }
    are_refused(wrong, flights)


def test_curves_are_asked_for_and_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[ScenarioRequest] = []
    line = series("measured", [0.0, 1.0], [0.0, 2.0])
    chart = Chart("errors", "m", "%", (line, series("paper", [0.5], [1.0], drawn="points", printed=True)))

    def run(name: str, wanted: ScenarioRequest) -> ScenarioResult:
        asked.append(wanted)
        return ScenarioResult(name, wanted.seed, (measured("Errors, AWR1843", (), charts=(chart, chart)),))

    monkeypatch.setattr(import_module("server.cli.scenario_command"), "run_scenario", run)
    assert hedgehop("scenario", "iq-reflector", "--plots", tmp_path / "new").code == 0
    assert hedgehop("scenario", "iq-reflector").code == 0
    assert [wanted.charts for wanted in asked] == [True, False]
    with Image.open(tmp_path / "new" / "errors-awr1843.png") as image:
        assert image.size[0] > 1000
        assert len(set(image.convert("L").get_flattened_data())) > 20


def test_of_the_arena_radar_and_figures_can_be_chosen(flights: list[tuple[str, ScenarioRequest]]) -> None:
    sets = ("tracker.coordinates=polar", "tracker.gate=9", "velocities.max_turn_deg=60", "tracker.gate=8.5")
    run = hedgehop("scenario", "arena", "--radar", "iq", *(word for one in sets for word in ("--set", one)))
    assert run.code == 0
    settings = {"tracker": {"coordinates": "polar", "gate": "8.5"}, "velocities": {"max_turn_deg": "60"}}
    assert flights == [("arena", ScenarioRequest(0, radar="iq", settings=settings))]
    hedgehop("scenario", "arena", "--set", "velocities.choice=edge")
    assert flights[-1] == ("arena", ScenarioRequest(0, settings={"velocities": {"choice": "edge"}}))


def test_what_cannot_be_chosen_is_refused_by_its_name(flights: list[tuple[str, ScenarioRequest]]) -> None:
    wrong = {
        ("arena", "--set", "tracker.gate"): '"tracker.gate" sets nothing',
        ("arena", "--set", "gate=9"): '"gate=9" sets nothing',
        ("arena", "--set", "engine.power=9"): '"engine.power=9" sets nothing',
        ("arena", "--set", "=9"): '"=9" sets nothing',
        ("arena", "--radar", "sonar"): "--radar",
        ("wood", "--set", "tracker.gate=9"): "arena only",
        ("wood", "--radar", "iq"): "arena only",
    }
    are_refused(wrong, flights)


@pytest.mark.parametrize(
    ("figure", "words"),
    [
        ("tracker.gates=9", 'There is no "gates"'),
        ("tracker.gate=wide", '"wide" is no number'),
        ("tracker.birth_updates=4.7", '"4.7" is no whole number'),
        ("tracker.coordinates=round", 'There are no coordinates "round"'),
        ("tracker.detection_probability=1", "detection_probability"),
        ("velocities.nearest_only=7", "neither true nor false"),
        ("velocities.choice=wide", 'There is no choice "wide"'),
        ("velocities.max_turn_deg=-1", '"-1" is no number'),
    ],
)
def test_a_wrong_figure_is_refused_before_anything_flies(figure: str, words: str) -> None:
    run = hedgehop("scenario", "arena", "--set", figure)
    assert run.code == 2
    assert words in run.err
    named = hedgehop("scenario", "arena", "--set", figure, "--json")
    assert named.json["error"]["where"] == figure.partition("=")[0].partition(".")[2]


def test_a_broken_world_is_refused_with_its_place(tmp_path: Path) -> None:
    world = tmp_path / "broken.json"
    world.write_text(json.dumps({"format": "hedgehop-world", "version": 1, "objects": [{"type": "box"}]}))
    run = hedgehop("scenario", "wood", "--world", world, "--json")
    assert run.code == 2
    assert "objects[0]" in run.json["error"]["where"]


def test_a_world_of_ones_own_is_flown_and_kept_for_review(tmp_path: Path) -> None:
    world, kept = tmp_path / "own.json", tmp_path / "own.mcap"
    corner = {"type": "corner_reflector", "at_m": [0, 68], "base_m": 3.0, "edge_m": 0.2}
    world.write_text(json.dumps({"format": "hedgehop-world", "version": 1, "name": "own", "objects": [corner]}))
    run = hedgehop("scenario", "corner-reflector", "--world", world, "--record", kept, "--json")
    assert run.code in (0, 1)
    assert run.json["radar"]["voxels"] > 0
    assert not run.json["contact"]
    assert run.json["min_true_distance_m"] == pytest.approx(30.0, abs=1.5)
    log = read_flight_log(kept)
    assert log.plan is not None
    assert log.plan.name == "corner-reflector"
    assert len(log.states) > 500
