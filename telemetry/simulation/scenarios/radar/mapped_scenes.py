"""Scenarios: a wood and a ruined building, mapped by the radar (Miccinesi 2022, figs 16-21)."""

from __future__ import annotations

from telemetry.simulation.scenarios.stage import scenes
from telemetry.simulation.scenarios.stage.map_against_world import radar_figures, vision_figures
from telemetry.simulation.scenarios.stage.result import Figure, ScenarioRequest, ScenarioResult
from telemetry.simulation.scenarios.stage.running import flown_of, setup_of

WOOD, RUIN = "wood", "ruined-building"


def run_wood(wanted: ScenarioRequest) -> ScenarioResult:
    return _run(WOOD, scenes.wood(wanted.seed), wanted)


def run_ruin(wanted: ScenarioRequest) -> ScenarioResult:
    return _run(RUIN, scenes.ruined_building(wanted.seed), wanted)


def _run(name: str, scene: scenes.ScenarioScene, wanted: ScenarioRequest) -> ScenarioResult:
    setup = setup_of(scene, wanted, name)
    flown = flown_of(setup, wanted)
    radar, vision = radar_figures(flown, setup), vision_figures(flown, setup)
    figures = (
        Figure("contacts", float(flown.contact), most=0.0),
        Figure("precision of the radar map", radar.precision or 0.0),
        Figure("recall of the radar map", radar.recall or 0.0),
    )
    flight = flown.result(
        "mapping flight",
        radar=radar,
        vision=vision,
        figures=figures,
    )
    return ScenarioResult(name, wanted.seed, (flight,))
