"""Who asks: the operator's name, and the fencing token of the server's lease.

Tokens count milliseconds since 1970, so that none can be far ahead of the clock: one that is would shut out all that
come after it, and is refused.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

TOKEN_AHEAD_MS = 24 * 3600 * 1000
"""A clock may be set back by so much without anything being noticed of it."""


def highest_possible_token(now_utc_s: float | None = None) -> int:
    """For whoever issues tokens and whoever checks them, both by the clock of this machine."""
    return int(1000 * (time.time() if now_utc_s is None else now_utc_s)) + TOKEN_AHEAD_MS


@dataclass(frozen=True, slots=True)
class Operator:
    """``token`` only grows: whoever was in charge before has a lower one."""

    name: str
    token: int


@dataclass(frozen=True, slots=True)
class OperatorRequest:
    """A request that only the one in charge may make."""

    operator: Operator
