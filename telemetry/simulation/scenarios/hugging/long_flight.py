"""Scenario: an hour of terrain hugging, and what the radar's global map and the recording of it come to."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planning.errors import ParameterError
from telemetry.simulation.scenarios.hugging.encounter_charts import encounter_charts
from telemetry.simulation.scenarios.hugging.encounters import encounters
from telemetry.simulation.scenarios.hugging.hugging import hugging, random_route
from telemetry.simulation.scenarios.hugging.strewn import strewn
from telemetry.simulation.scenarios.hugging.terrain_hugging import APART_M, etna
from telemetry.simulation.scenarios.stage.map_against_world import radar_figures
from telemetry.simulation.scenarios.stage.result import (
    Figure,
    FlightResult,
    ScenarioRequest,
    ScenarioResult,
)
from telemetry.simulation.scenarios.stage.running import FlightRecording, surveyed
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from telemetry.simulation.scenarios.stage.setup import Setup, Tell
from telemetry.simulation.scenarios.stage.virtual_flight import fly
from telemetry.simulation.scenarios.stage.world_objects import world_document
from telemetry.simulation.simulator.scene import SceneTerrain, World
from telemetry.topics.messages import Published, Topic
from telemetry.topics.obstacles import PerceptionStatus

NAME = "long-flight"
HOUR_S, LOOK_S = 3600.0, 300.0
S_PER_POINT, FEWEST_POINTS = 45.0, 4
"""So many points that it is still on its way in the end."""
OBJECTS_APART_M = 150.0
"""Things to alarm on, but not so many that the crossing ways of an hour lead through a forest."""
PREPARING_S = 900.0
"""At most, for the upload of a mission so long."""
BATTERY_MAH = 1e6
"""No battery lasts an hour; the map must."""
MOST_DEARER = 1.2


@dataclass(frozen=True, slots=True)
class Look:
    """At map and recording, in flight."""

    t_s: float
    voxels: int
    """Believed ones, known ground with them."""
    map_bytes: int
    file_bytes: int


class Growth:
    """Looks at the first radar status of every ``every_s`` of the flight."""

    def __init__(self, recording: FlightRecording, path: Path, every_s: float) -> None:
        self._recording, self._path, self._every_s = recording, path, every_s
        self._began_s: float | None = None
        self.looks: list[Look] = []

    def tell(self, topic: str, message: Published, t_utc_s: float) -> None:
        self._recording.tell(topic, message, t_utc_s)
        if topic != Topic.PERCEPTION_RADAR or not isinstance(message, PerceptionStatus):
            return
        if self._began_s is None:
            self._began_s = t_utc_s
        t_s = t_utc_s - self._began_s
        if t_s >= self._every_s * len(self.looks):
            file_bytes = self._path.stat().st_size
            self.looks.append(Look(t_s, message.voxels_occupied, message.map_bytes, file_bytes))


def run(wanted: ScenarioRequest) -> ScenarioResult:
    """Raises ParameterError for a world of one's own: the route is made for the generated hillside."""
    if wanted.world is not None:
        raise ParameterError("This scenario brings its own world.", where="--world", advice="Leave --world away.")
    return run_for(wanted, HOUR_S, LOOK_S)


def run_for(wanted: ScenarioRequest, seconds: float, every_s: float) -> ScenarioResult:
    with tempfile.TemporaryDirectory(prefix="hedgehop-long-flight-") as folder:
        path = wanted.record or Path(folder) / "flight.mcap"
        setup = _setup(wanted.seed, seconds)
        recording = FlightRecording(path, NAME, setup.ground)
        growth = Growth(recording, path, every_s)
        try:
            flight = _flown(setup, seconds, growth.tell, growth)
        finally:
            recording.close()
    return ScenarioResult(NAME, wanted.seed, (flight,))


def _flown(setup: Setup, seconds: float, tell: Tell, growth: Growth) -> FlightResult:
    flown = fly(setup, tell)
    found = encounters(flown, setup.world, setup.settings)
    title = "an hour over the hillside" if seconds == HOUR_S else f"{seconds:.0f} s over the hillside"
    result = flown.result(
        title,
        radar=radar_figures(flown, setup),
        false_alarms_per_km=found.false_per_km,
        missed=found.missed,
        figures=(*found.figures, *growth_figures(growth.looks)),
        notes=(*map(_words, growth.looks), *found.notes),
        charts=(*encounter_charts(flown, setup.world, found), growth_chart(growth.looks)),
    )
    return replace(result, duration_s=flown.armed_s)


def _setup(seed: int, seconds: float) -> Setup:
    random = np.random.default_rng([seed, 7])
    dsm = etna()
    points = FEWEST_POINTS + round(seconds / S_PER_POINT)
    plan = hugging(dsm, random_route(dsm, random, points=points, apart_m=APART_M))
    terrain = SceneTerrain.from_dsm(plan.dsm, plan.frame)
    objects = strewn(plan.line_enu_m, terrain, random, apart_m=OBJECTS_APART_M)
    return Setup(
        title=NAME,
        world=World.parse(world_document(NAME, objects), frame=plan.frame, terrain=terrain),
        seed=seed,
        mission=plan.mission,
        ground=surveyed(plan.dsm, seed),
        solid=False,
        most_armed_s=seconds,
        longest_s=seconds + PREPARING_S,
        battery_mah=BATTERY_MAH,
    )


def growth_figures(looks: list[Look]) -> tuple[Figure, ...]:
    """Whether memory grows with what is new and with nothing else: at no stretch does a new voxel cost more than at the
    first. (It comes to cost less: where the vehicle has been before, new voxels find room in blocks that are there.)"""
    voxels = np.array([look.voxels for look in looks if look.voxels], np.float64)
    sizes = np.array([look.map_bytes for look in looks if look.voxels], np.float64)
    first = (sizes[0] - looks[0].map_bytes) / voxels[0]
    later = np.diff(sizes) / np.maximum(np.diff(voxels), 1.0)
    return (
        Figure("bytes per new voxel at first", float(first)),
        Figure("bytes per new voxel later, at most", float(later.max()), most=MOST_DEARER * float(first)),
        Figure("map's memory in the end", sizes[-1] / 1e6, unit=" MB"),
        Figure("recording", looks[-1].file_bytes / 1e6, unit=" MB"),
    )


def growth_chart(looks: list[Look]) -> Chart:
    voxels = [look.voxels / 1000 for look in looks]
    map_size = series("the map's memory", voxels, [look.map_bytes / 1e6 for look in looks])
    return Chart("Memory by what is new", "voxels, thousands", "MB", (map_size,))


def _words(look: Look) -> str:
    return (
        f"after {look.t_s:.0f} s: {look.voxels:,} voxels, map {look.map_bytes / 1e6:.1f} MB, "
        f"recording {look.file_bytes / 1e6:.1f} MB"
    )
