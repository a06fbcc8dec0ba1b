"""What is found about one setting, and the vehicle's settings as rules ask for them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from telemetry.parameters.files import value_text

State = Literal["bad", "look", "good"]
"""bad: it endangers this flight. look: a person has to decide, or it could not be judged. good: nothing is found."""
ORDER: dict[State, int] = {"bad": 0, "look": 1, "good": 2}


@dataclass(frozen=True, slots=True)
class Finding:
    state: State
    parameter: str
    text: str
    """What it will do on this plan."""
    better: float | None = None
    """The value that would be right, in the parameter's own unit."""
    value: float | None = None
    """What it is, in the same."""


@dataclass(frozen=True, slots=True)
class Held:
    """A setting under the name that the vehicle has for it."""

    name: str
    value: float
    """As it is written on the vehicle."""
    unit: float = 1.0
    """Metres (metres a second) in one of the parameter's own."""

    @property
    def metres(self) -> float:
        return self.value * self.unit

    def own(self, metres: float) -> float:
        """A value in the parameter's own unit."""
        return round(metres / self.unit, 3)

    def finding(self, state: State, text: str, better: float | None = None) -> Finding:
        return Finding(state, self.name, text, better, self.value)


@dataclass(frozen=True, slots=True)
class VehicleSettings:
    """As read; what the vehicle does not have is missing or None."""

    values: Mapping[str, float | None]

    def held(self, *names: str | tuple[str, float]) -> Held | None:
        """The first that the vehicle has; with a name may stand its unit in metres."""
        for entry in names:
            name, unit = (entry, 1.0) if isinstance(entry, str) else entry
            value = self.values.get(name)
            if value is not None and math.isfinite(value):
                # As it was set: a vehicle tells 0.800000011920929 where that was 0.8.
                return Held(name, float(value_text(value)), unit)
        return None

    def number(self, name: str, default: float) -> float:
        held = self.held(name)
        return default if held is None else held.value


def unread(name: str, what: str) -> Finding:
    """What was not seen is not called good."""
    return Finding("look", name, f"The vehicle does not tell it: {what} is not known. Look yourself.")
