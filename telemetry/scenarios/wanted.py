"""What is wanted of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from telemetry.sensing import RadarKind


@dataclass(frozen=True, slots=True)
class Wanted:
    seed: int = 0
    """Of the scene, the sensors' noise and the wind."""
    world: Path | None = None
    """A file that takes the place of the scenario's own objects, and of its ground if it names one."""
    radar: RadarKind | None = None
    """Simulated by what it would report, or from its samples on; None: as the scenario has it."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Other perception settings than the scenario's, of those that it takes: "tracker" and "velocities"."""
    record: Path | None = None
    """Where the flight is kept; of several flights each beside it, under its own name."""
