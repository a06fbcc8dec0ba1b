"""What a protocol machine asks for: a message to be sent, or news of how its work goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from telemetry.errors import TelemetryError

Message = Any
"""A pymavlink message object of the ``ardupilotmega`` v20 dialect."""


@dataclass(frozen=True, slots=True)
class Send:
    """To the adopted vehicle."""

    message: Message


@dataclass(frozen=True, slots=True)
class Done:
    """The machine has ended well; it asks for nothing more."""

    result: object = None


@dataclass(frozen=True, slots=True)
class Failed:
    """The machine has ended; it asks for nothing more."""

    error: TelemetryError


@dataclass(frozen=True, slots=True)
class Progress:
    phase: str
    done: int
    total: int


Action = Send | Done | Failed | Progress


def ended(actions: list[Action]) -> Done | Failed | None:
    """The end of the machine, if it is among these actions."""
    return next((action for action in actions if isinstance(action, Done | Failed)), None)
