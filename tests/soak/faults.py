"""Faults of one flight: which process, when, and how; drawn from a seed, and done by process ids of its own station."""

from __future__ import annotations

import contextlib
import math
import os
import random
import signal
import time
from dataclasses import dataclass
from typing import Literal, get_args

NODES = ("link", "recorder", "radar", "vision", "tracks")
How = Literal["kill", "stop", "pause", "starve"]
"""stop: for good, so that it has to be ended; pause: it goes on after a while; starve: it runs a tenth of the time."""
PAUSE_S, STARVE_S, BEAT_S, AWAKE = 1.5, 6.0, 0.2, 0.1


@dataclass(frozen=True, slots=True)
class Fault:
    after_s: float
    """Since the vehicle flew."""
    who: str
    how: How

    def __str__(self) -> str:
        return f"{self.how} {self.who} at {self.after_s:.0f} s"


@dataclass(frozen=True, slots=True)
class Done:
    """``until_s``: when it was over as far as the fault itself goes; that of a killed process at once."""

    fault: Fault
    pid: int
    at_s: float
    until_s: float
    back_s: float = math.inf
    """When a process of that name proved again that it works."""


def drawn(seed: int, *, first_s: float, last_s: float, every_s: float) -> tuple[Fault, ...]:
    """In the order of time. Each process has at most one fault at a time; a server is told of alone."""
    rng, faults, at_s = random.Random(seed), [], first_s
    while at_s < last_s:
        faults.append(Fault(at_s, rng.choice(("server", *NODES)), rng.choice(get_args(How))))
        at_s += every_s * rng.uniform(0.7, 1.3)
    return tuple(faults)


def do(fault: Fault, pid: int) -> Done:
    """Returns when it is done; a process that is stopped for good is left to those who watch it."""
    at_s = time.monotonic()
    with contextlib.suppress(ProcessLookupError):
        if fault.how == "kill":
            os.kill(pid, signal.SIGKILL)
        elif fault.how == "stop":
            os.kill(pid, signal.SIGSTOP)
        elif fault.how == "pause":
            os.kill(pid, signal.SIGSTOP)
            time.sleep(PAUSE_S)
            os.kill(pid, signal.SIGCONT)
        else:
            while time.monotonic() < at_s + STARVE_S:
                os.kill(pid, signal.SIGSTOP)
                time.sleep(BEAT_S * (1 - AWAKE))
                os.kill(pid, signal.SIGCONT)
                time.sleep(BEAT_S * AWAKE)
    return Done(fault, pid, at_s, time.monotonic())
