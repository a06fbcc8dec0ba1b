"""The start: allowed only on a fresh check of what is on board, where the vehicle stands, and what was accepted."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from mapping.geometry.frames import apart_m
from server.errors import CheckNeededError
from server.flying.check_task import Checked
from server.flying.in_flight.take_up_desk import FIRMWARES
from server.schemas import CheckRow, PreflightDoc, StartFlight
from server.schemas.flight_docs import CHECK_FRESH_S
from telemetry.errors import NotAllowedError
from telemetry.topics.messages import PlanRecord
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.vehicle import VehicleState

MOVED_M, ROSE_M = 3.0, 2.0
"""More than a standing receiver and barometer wander in that time."""
_AGAIN = "Press Check again."


@dataclass(frozen=True, slots=True)
class Ready:
    """A check that was made, and what it holds for."""

    checked: Checked
    digest: str
    vehicle: str
    """Id of the candidate that was adopted."""
    state: VehicleState
    """As it was judged."""
    checked_mono_s: float


def preflight_now(
    ready: Ready, avoidance: AvoidanceStatus, others: CheckRow | None, *, utc_minus_mono_s: float
) -> PreflightDoc:
    """The check with what avoidance sees by now, and where other vehicles are: both may have come or gone since."""
    from telemetry.flight.preflight.eyes_check import avoidance_row
    from telemetry.flight.preflight.parameters import Speeds

    checked = ready.checked
    speeds = checked.speeds or Speeds()
    row = avoidance_row(avoidance, speeds, checked.braking, utc_minus_mono_s=utc_minus_mono_s)
    shown = CheckRow(code=row.code, state=row.state, text=row.text, mend=row.mend)
    return checked.doc.model_copy(update={"rows": [*checked.doc.rows, shown, *([] if others is None else [others])]})


def check_start(
    ready: Ready | None,
    body: StartFlight,
    state: VehicleState,
    avoidance: AvoidanceStatus,
    others: CheckRow | None,
    *,
    now_mono_s: float,
    utc_minus_mono_s: float,
) -> Ready:
    """The check that allows this start. Raises CheckNeededError with the first reason why there is none."""
    if ready is None or ready.digest != body.digest:
        raise CheckNeededError("This mission has not been checked before the start.", advice="Press Check first.")
    if now_mono_s - ready.checked_mono_s > CHECK_FRESH_S:
        raise CheckNeededError(f"The check is {now_mono_s - ready.checked_mono_s:.0f} s old.", advice=_AGAIN)
    if _has_moved(ready.state, state):
        raise CheckNeededError("The vehicle was moved after the check.", advice=_AGAIN)
    if ready.checked.fence_kinds_untaken != state.fence_kinds_untaken:
        raise CheckNeededError("Which kinds of the vehicle's fence act has changed since the check.", advice=_AGAIN)
    for row in preflight_now(ready, avoidance, others, utc_minus_mono_s=utc_minus_mono_s).rows:
        if row.state in ("bad", "unknown"):
            raise CheckNeededError(row.text, advice=row.mend or _AGAIN)
        if row.state == "accept" and row.code not in body.accept:
            raise CheckNeededError(row.text, advice="Accept it, or mend it and check again.")
    return ready


def check_goes_on(others: CheckRow | None, accept: Collection[str]) -> None:
    """Raises CheckNeededError where a plan that was taken up in flight meets another vehicle, and nobody accepts it."""
    if others is None or others.state == "good" or (others.state == "accept" and others.code in accept):
        return
    advice = "Accept it under On board, or wait." if others.state == "accept" else others.mend
    raise CheckNeededError(others.text, advice=advice)


def _has_moved(then: VehicleState, now: VehicleState) -> bool:
    """A disarmed vehicle takes its home where it stands, so that place counts, not the home of its last flight."""
    places = _place(then), _place(now)
    if places[0] is None or places[1] is None or then.alt_amsl_m is None or now.alt_amsl_m is None:
        return True
    rose_m = 0.0 if now.armed else abs(now.alt_amsl_m - then.alt_amsl_m)
    return apart_m(places[0], places[1]) > MOVED_M or rose_m > ROSE_M


def _place(state: VehicleState) -> tuple[float, float] | None:
    if state.armed:
        lat_deg, lon_deg = state.home_lat_deg, state.home_lon_deg
    else:
        lat_deg, lon_deg = state.lat_deg, state.lon_deg
    return None if lat_deg is None or lon_deg is None else (lat_deg, lon_deg)


def check_firmware(record: PlanRecord, state: VehicleState) -> None:
    """Raises NotAllowedError for a plan of another autopilot."""
    if state.autopilot != "other" and state.autopilot != record.firmware:
        raise NotAllowedError(
            f"The plan was made for {FIRMWARES[record.firmware]}, the vehicle flies {FIRMWARES[state.autopilot]}.",
            advice="Choose the vehicle's own profile in Plan, then upload again.",
        )
