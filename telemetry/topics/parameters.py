"""A vehicle's parameters as they are read and written, and what became of each that was written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

NAME_BYTES = 16
NAME_PATTERN = rf"[A-Za-z0-9_]{{1,{NAME_BYTES}}}"
NAME_RULE = f"A parameter's name has at most {NAME_BYTES} letters, digits and _."
REAL32 = 9
"""MAV_PARAM_TYPE; 1 to 6 are whole numbers of 8, 16 and 32 bits, odd ones without a sign."""
WHOLE_RANGES: dict[int, tuple[int, int]] = {
    1: (0, 2**8 - 1),
    2: (-(2**7), 2**7 - 1),
    3: (0, 2**16 - 1),
    4: (-(2**15), 2**15 - 1),
    5: (0, 2**32 - 1),
    6: (-(2**31), 2**31 - 1),
}
"""By MAV_PARAM_TYPE: the smallest and the largest."""
SINGLE = 2.0**-22
"""Share of a value: two steps of single precision, which vehicles keep."""
MOST_CHANGES = 20
"""Of one request, which is one line in the log of commands."""


@dataclass(frozen=True, slots=True)
class Parameter:
    name: str
    value: float | None
    """None: what the vehicle sent is no number."""
    kind: int = REAL32
    """MAV_PARAM_TYPE"""
    default: float | None = None
    """Of its firmware, where the vehicle says it."""


@dataclass(frozen=True, slots=True)
class ParameterList:
    """Everything that a vehicle has, in its own order."""

    parameters: tuple[Parameter, ...]

    def by_name(self) -> dict[str, Parameter]:
        return {parameter.name: parameter for parameter in self.parameters}


@dataclass(frozen=True, slots=True)
class VehicleMetadata:
    """The vehicle's own description of its parameters."""

    crc: int
    """CRC-32 of the file that leads to it: the same one means the same description."""
    content: bytes
    """As it lies on the vehicle; empty where it was known before."""


@dataclass(frozen=True, slots=True)
class ParameterChange:
    name: str
    value: float


Outcome = Literal["set", "same", "adjusted", "kept", "refused", "unknown", "not sent"]


@dataclass(frozen=True, slots=True)
class ParameterWritten:
    """What became of one change."""

    name: str
    asked: float
    before: float | None
    """None: was not read."""
    after: float | None
    """As read back; None: not known."""
    outcome: Outcome
    """set: read back as asked. same: it was so before, and nothing was sent. adjusted: the vehicle holds a third value.
    kept: it holds the old one. refused: it said no, or nothing was sent because it cannot be so. unknown: no answer."""
    words: str = ""
    """Why, and what to do."""

    @property
    def took(self) -> bool:
        """The vehicle holds what was asked."""
        return self.outcome in ("set", "same")
