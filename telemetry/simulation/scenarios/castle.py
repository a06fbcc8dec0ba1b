"""Scenario: straight into a building and over it, by each sensor alone, at night and without GNSS (Bigazzi 2022)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telemetry.simulation.scenarios.stage import scenes
from telemetry.simulation.scenarios.stage.map_against_world import radar_figures, vision_figures
from telemetry.simulation.scenarios.stage.result import Figure, FlightResult, ScenarioRequest, ScenarioResult
from telemetry.simulation.scenarios.stage.running import flown_of, setup_of
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent
from telemetry.topics.obstacles import Sensor

NAME = "castle-building"
LATEST_ALERT_S = 0.2
LOSS = GnssEvent("loss", 15.0, 1000.0)
"""From before the way, or its first metres, on."""
BEYOND_M = 12.0
"""So far behind the middle of the face the building has been passed."""


@dataclass(frozen=True, slots=True)
class Case:
    title: str
    sensors: tuple[Sensor, ...]
    able: tuple[Sensor, ...]
    """Those that can see in it."""
    dark: bool = False
    gnss_script: tuple[GnssEvent, ...] = ()


CASES = (
    Case("radar alone", ("radar",), ("radar",)),
    Case("vision alone", ("vision",), ("vision",)),
    Case("at night", ("radar", "vision"), ("radar",), dark=True),
    Case("without GNSS", ("radar", "vision"), ("vision",), gnss_script=(LOSS,)),
)


def run(wanted: ScenarioRequest) -> ScenarioResult:
    parts = []
    for case in CASES:
        wanted.report(case.title, len(parts) / len(CASES))
        parts.append(fly_case(case, wanted))
    return ScenarioResult(NAME, wanted.seed, tuple(parts))


def fly_case(case: Case, wanted: ScenarioRequest, *, ahead_m: float = scenes.CASTLE_AHEAD_M) -> FlightResult:
    """``ahead_m``: how far away the building's face is."""
    scene = scenes.castle_building(wanted.seed, ahead_m=ahead_m)
    setup = setup_of(
        scene,
        wanted,
        f"{NAME}, {case.title}",
        by_script=False,
        sensors=case.sensors,
        dark=case.dark,
        gnss_script=case.gnss_script,
        avoids=True,
        climb_m_s=scenes.CASTLE_CLIMB_M_S,
    )
    flown = flown_of(setup, wanted, part=case.title)
    return flown.result(
        case.title,
        radar=radar_figures(flown, setup),
        vision=vision_figures(flown, setup),
        figures=_figures(case, flown, ahead_m),
        notes=_notes(flown),
        charts=(_chart(case, flown, ahead_m),),
    )


def _chart(case: Case, flown: SeenFlight, ahead_m: float) -> Chart:
    """As fig. 12 shows the flight: out, over the building, and back, from the side."""
    path_m = np.array([truth.position_enu_m for truth in flown.track]).reshape(-1, 3)
    height_m = float(path_m[:, 2].max(initial=1.0))
    lines = (series("flown", path_m[:, 1], path_m[:, 2]), series("the building's face", [ahead_m] * 2, [0.0, height_m]))
    return Chart(f"Height along the way, {case.title} (fig. 12)", "north, m", "above home, m", lines)


def _figures(case: Case, flown: SeenFlight, ahead_m: float) -> tuple[Figure, ...]:
    passed = any(truth.position_enu_m[1] >= ahead_m + BEYOND_M for truth in flown.track)
    delays = [delay_s for sensor in case.able if (delay_s := flown.watches[sensor].delay_s) is not None]
    name = case.title
    figures = [
        Figure(f"{name}: contacts", float(flown.contact), most=0.0, paper="none (fig. 12)"),
        Figure(f"{name}: building detected", float(all(_saw(flown, s) for s in case.able)), least=1.0),
        Figure(f"{name}: building passed and landed", float(passed and flown.landed), least=1.0),
        Figure(f"{name}: alert behind the first voxel", max(delays, default=math.inf), most=LATEST_ALERT_S, unit=" s"),
    ]
    if case.dark:
        figures.append(
            Figure(f"{name}: vision says that it is blind", float(flown.has_said("vision: blind")), least=1.0)
        )
    if case.gnss_script:
        figures.append(
            Figure(f"{name}: radar says that it is frozen", float(flown.has_said("radar: frozen")), least=1.0)
        )
        figures.append(Figure(f"{name}: radar voxels new while frozen", float(flown.new_while_frozen), most=0.0))
    return tuple(figures)


def _saw(flown: SeenFlight, sensor: Sensor) -> bool:
    return any(alert.sensor == sensor for alert in flown.alerts_seen())


def _notes(flown: SeenFlight) -> tuple[str, ...]:
    return tuple(f"{t_s - flown.began_s:6.2f} s  {words}" for t_s, words in flown.said if words.startswith("avoidance"))
