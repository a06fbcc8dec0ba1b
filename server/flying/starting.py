"""The start: allowed only on a fresh check of what is on board, where the vehicle stands, and what was accepted."""

from __future__ import annotations

from dataclasses import dataclass

from server.errors import CheckNeededError
from server.placing import metres_apart
from server.schemas import PreflightDoc, StartFlight
from telemetry.vehicle import VehicleState

FRESH_S = 120.0
"""Long enough to read the check and to hold the button; the vehicle must not have moved meanwhile."""
HOME_MOVED_M, HOME_ROSE_M = 2.0, 0.5
_AGAIN = "Press Check again."


@dataclass(frozen=True, slots=True)
class Ready:
    """A check that was made, and what it holds for."""

    doc: PreflightDoc
    digest: str
    state: VehicleState
    """As it was then."""
    checked_mono_s: float


def check_start(ready: Ready | None, body: StartFlight, state: VehicleState, now_mono_s: float) -> None:
    """Raises CheckNeededError with the first reason why this start is not allowed."""
    if ready is None or ready.digest != body.digest:
        raise CheckNeededError("This mission has not been checked before the start.", advice="Press Check first.")
    if now_mono_s - ready.checked_mono_s > FRESH_S:
        raise CheckNeededError(f"The check is {now_mono_s - ready.checked_mono_s:.0f} s old.", advice=_AGAIN)
    if _home_moved(ready.state, state):
        raise CheckNeededError("The vehicle's home has moved since the check.", advice=_AGAIN)
    for row in ready.doc.rows:
        if row.state in ("bad", "unknown"):
            raise CheckNeededError(row.text, advice=row.mend or _AGAIN)
        if row.state == "accept" and row.code not in body.accept:
            raise CheckNeededError(row.text, advice="Accept it, or mend it and check again.")


def _home_moved(then: VehicleState, now: VehicleState) -> bool:
    if then.home_lat_deg is None or then.home_lon_deg is None or now.home_lat_deg is None or now.home_lon_deg is None:
        return True
    apart_m = metres_apart((then.home_lat_deg, then.home_lon_deg), (now.home_lat_deg, now.home_lon_deg))
    rose_m = abs((now.home_alt_amsl_m or 0.0) - (then.home_alt_amsl_m or 0.0))
    return apart_m > HOME_MOVED_M or rose_m > HOME_ROSE_M
