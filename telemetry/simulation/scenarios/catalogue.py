"""The scenarios by name, and what each of them holds against which paper."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

from telemetry.simulation.scenarios.stage.result import ScenarioRequest, ScenarioResult


@dataclass(frozen=True, slots=True)
class Scenario:
    name: str
    flown: str
    """What happens in it."""
    held: str
    """What it is held to."""
    paper: str
    """Whose field test, with the figures."""
    module: str
    function: str = "run"
    hours: bool = False
    """Too long, and too much of the disk, for anybody to wait for in a browser."""


SCENARIOS = (
    Scenario(
        "corner-reflector",
        "Sideways past a reflector 68 m ahead.",
        "Its returns lie where it stands, in one cluster; the spread of the three rotations.",
        "Miccinesi 2022, figs 10-15",
        "radar.radar_maps",
        "run_reflector",
    ),
    Scenario(
        "wood",
        "Past trees, mapped by the radar.",
        "Precision and recall of the map against the true surfaces.",
        "Miccinesi 2022, figs 16-21",
        "radar.radar_maps",
        "run_wood",
    ),
    Scenario(
        "ruined-building",
        "Past walls, mapped by the radar.",
        "Precision and recall of the map against the true surfaces.",
        "Miccinesi 2022, figs 16-21",
        "radar.radar_maps",
        "run_ruin",
    ),
    Scenario(
        "castle-building",
        "Towards a building: each sensor alone, at night, without GNSS.",
        "No contact, the alert within 0.2 s, cleared on top.",
        "Bigazzi 2022, figs 9-12",
        "castle",
    ),
    Scenario(
        "etna-like",
        "5 m over a volcano's flank, among things that its surface model does not know.",
        "False alarms per km, objects alarmed in time.",
        "Melita 2020, the flight on Etna",
        "hugging.terrain_hugging",
    ),
    Scenario(
        "long-flight",
        "The same for an hour.",
        "The map's memory grows with new voxels alone.",
        "Bigazzi 2022, the global map",
        "hugging.long_flight",
        hours=True,
    ),
    Scenario(
        "arena",
        "26 and 78 ways past two poles, by the tracks and the sidestep that fly live.",
        "None touched; the tracks' error by distance from boresight.",
        "Wessendorp 2021, figs 5-8",
        "arena.arena",
    ),
    Scenario(
        "iq-reflector",
        "Nothing is flown: a reflector from ADC samples on.",
        "Errors in range, speed and azimuth; two targets resolved.",
        "Miccinesi 2022, fig. 7; Wessendorp 2021, eqs 1-3",
        "radar.iq_reflector",
    ),
    Scenario(
        "foliage",
        "A rover with a UWB radar past foliage and obstacles.",
        "Table II and fig. 6 reproduced; foliage cleared, obstacles kept.",
        "Ahtiainen, Tables II and III, figs 6 and 9",
        "foliage.foliage",
    ),
)
NAMES = tuple(scenario.name for scenario in SCENARIOS)


def scenario_named(name: str) -> Scenario:
    """One of ``NAMES``."""
    return next(scenario for scenario in SCENARIOS if scenario.name == name)


def run_scenario(name: str, wanted: ScenarioRequest) -> ScenarioResult:
    """Loads only what the scenario needs: kernels and rasters take seconds.

    Raises FormatError for a broken world file, RecordingError and TelemetryError.
    """
    chosen = scenario_named(name)
    return getattr(import_module(f".{chosen.module}", __package__), chosen.function)(wanted)
