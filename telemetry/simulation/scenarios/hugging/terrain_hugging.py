"""Scenario: hugging a volcano's flank at 5 m, among things that its surface model knows nothing of."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path

import numpy as np

from planning.ground.demo_hillside import demo_dsm
from planning.terrain.dsm import Dsm
from telemetry.simulation.scenarios.hugging.encounter_charts import encounter_charts, following
from telemetry.simulation.scenarios.hugging.encounters import encounters
from telemetry.simulation.scenarios.hugging.hugging import Hugging, hugging, random_route
from telemetry.simulation.scenarios.hugging.strewn import strewn
from telemetry.simulation.scenarios.stage.map_against_world import radar_figures, vision_figures
from telemetry.simulation.scenarios.stage.result import ScenarioRequest, ScenarioResult
from telemetry.simulation.scenarios.stage.running import flown_of, own_ground, surveyed
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.simulation.scenarios.stage.world_objects import world_document
from telemetry.simulation.simulator.scene import SceneTerrain, World
from telemetry.simulation.simulator.scene.world_file import read_world

NAME = "etna-like"
ETNA_SEED = 7
POINTS, APART_M = 5, 90.0


def run(wanted: ScenarioRequest) -> ScenarioResult:
    own = own_ground(wanted.world) if wanted.world is not None else None
    return run_over(own or etna(), wanted, NAME)


@lru_cache(maxsize=1)
def etna() -> Dsm:
    return demo_dsm(ETNA_SEED)


def run_over(
    dsm: Dsm, wanted: ScenarioRequest, name: str, *, apart_m: float = APART_M, most_m: float = math.inf
) -> ScenarioResult:
    """A random route over a surface model; the flight goes through what it meets, to look at the next.

    ``most_m``: it ends after so much way.
    """
    random = np.random.default_rng([wanted.seed, 7])
    plan = hugging(dsm, random_route(dsm, random, points=POINTS, apart_m=apart_m))
    setup = _setup(plan, wanted, name, random, most_m)
    flown = flown_of(setup, wanted)
    found = encounters(flown, setup.world, setup.settings)
    figures, charts = following(flown, plan)
    flight = flown.result(
        "terrain hugging",
        radar=radar_figures(flown, setup),
        vision=vision_figures(flown, setup),
        false_alarms_per_km=found.false_per_km,
        missed=found.missed,
        figures=(*found.figures, *figures),
        notes=found.notes,
        charts=(*encounter_charts(flown, setup.world, found), *charts),
    )
    return ScenarioResult(name, wanted.seed, (flight,))


def _setup(plan: Hugging, wanted: ScenarioRequest, name: str, random: np.random.Generator, most_m: float) -> Setup:
    return Setup(
        title=name,
        world=world_of(plan, wanted, name, random),
        seed=wanted.seed,
        mission=plan.mission,
        ground=surveyed(plan.dsm, wanted.seed),
        solid=False,
        most_m=min(most_m, plan.length_m),
    )


def world_of(plan: Hugging, wanted: ScenarioRequest, name: str, random: np.random.Generator) -> World:
    """The wanted one, or things strewn over the plan's own ground. Raises FormatError for a broken file."""
    if wanted.world is not None and not _is_bare(wanted.world):
        return World.load(wanted.world, frame=plan.frame, dsm=plan.dsm)
    terrain = SceneTerrain.from_dsm(plan.dsm, plan.frame)
    objects = strewn(plan.line_enu_m, terrain, random)
    return World.parse(world_document(name, objects), frame=plan.frame, terrain=terrain)


def _is_bare(path: Path) -> bool:
    """Ground and nothing on it: things are strewn there as on the scenario's own."""
    file = read_world(path)
    return file.dsm is not None and not file.shapes
