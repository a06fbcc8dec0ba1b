"""What is wanted of a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Wanted:
    seed: int = 0
    """Of the scene, the sensors' noise and the wind."""
    world: Path | None = None
    """A file that takes the place of the scenario's own objects, and of its ground if it names one."""
    record: Path | None = None
    """Where the flight is kept; of several flights each beside it, under its own name."""
