"""How the station is, for who watches over it."""

from __future__ import annotations

from typing import Literal

from server.schemas.strict_model import Strict


class LoopDoc(Strict):
    """How late the server's loop came round: for so long messages of vehicles waited in it."""

    p99_ms: float
    """Of the last ten minutes at most."""
    longest_ms: float
    longest_utc: str
    since_utc: str
    longest_work_ms: float
    """Of the processor's time that the loop took for itself at once: not above 20, however busy the machine is."""


class HealthDoc(Strict):
    """Without a session only status and version."""

    status: Literal["ok"] = "ok"
    version: str
    loop: LoopDoc | None = None
    confinement: str | None = None
    """What is refused to workers and to decoders of rasters on this machine."""
