"""The scenarios by name."""

from __future__ import annotations

from importlib import import_module

from telemetry.scenarios.result import ScenarioResult
from telemetry.scenarios.wanted import Wanted

_WHERE = {
    "corner-reflector": ("corner_reflector", "run"),
    "wood": ("mapped_scenes", "run_wood"),
    "ruined-building": ("mapped_scenes", "run_ruin"),
    "castle-building": ("castle", "run"),
    "etna-like": ("terrain_hugging", "run"),
    "long-flight": ("long_flight", "run"),
    "arena": ("arena", "run"),
    "iq-reflector": ("iq_reflector", "run"),
    "foliage": ("foliage", "run"),
}
NAMES = tuple(_WHERE)


def run_scenario(name: str, wanted: Wanted) -> ScenarioResult:
    """Loads only what the scenario needs: kernels and rasters take seconds.

    Raises FormatError for a broken world file, RecordingError and TelemetryError.
    """
    module, function = _WHERE[name]
    return getattr(import_module(f"telemetry.scenarios.{module}"), function)(wanted)
