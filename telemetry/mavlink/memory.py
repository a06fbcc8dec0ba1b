"""What a link node writes down so that the next one, after a crash, takes up where it ended."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from telemetry.messages import Candidate, FlightStatus


@dataclass(frozen=True, slots=True)
class Wanted:
    address: str
    adopt: bool
    """The first autopilot heard there is to be adopted."""


@dataclass(frozen=True, slots=True)
class Memory:
    connections: tuple[Wanted, ...] = ()
    adopted: Candidate | None = None
    flight: FlightStatus = field(default_factory=FlightStatus)
    highest_token: int = 0


def read_memory(file: Path) -> Memory:
    """An empty one when there is none that can be read: then the operator connects again."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Memory)
    except (OSError, msgspec.MsgspecError):
        return Memory()


def write_memory(file: Path, memory: Memory) -> None:
    """Whole or not at all. A disk that is full costs the memory of a crash, nothing else."""
    new = file.with_suffix(".new")
    with contextlib.suppress(OSError):
        new.write_bytes(msgspec.json.encode(memory))
        os.replace(new, file)
