"""What is wanted of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from telemetry.topics.simulated import RadarKind

Report = Callable[[str, float | None], None]


def _to_nobody(step: str, share: float | None) -> None:
    """Where nobody waits for it."""


@dataclass(frozen=True, slots=True)
class ScenarioRequest:
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
    charts: bool = False
    """Whether curves are wanted that cost extra time."""
    report: Report = field(default=_to_nobody, compare=False)
    """How far it is: what is being done, and what share of the whole, if that is known."""
