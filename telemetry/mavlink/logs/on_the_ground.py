"""Logs are read on the ground only: they take the link's bandwidth, and autopilots refuse it in flight."""

from __future__ import annotations

from telemetry.errors import NotAllowedError
from telemetry.topics.vehicle import VehicleState

_ADVICE = "Land and disarm it first: reading logs takes the link from what keeps the flight safe."


def refuse_in_flight(state: VehicleState) -> None:
    """Raises NotAllowedError unless the vehicle says that it is disarmed."""
    if state.heartbeat_t_mono_s is None:
        raise NotAllowedError("Whether the vehicle is armed is not known.", advice=_ADVICE)
    if state.armed:
        raise NotAllowedError("The vehicle is armed.", advice=_ADVICE)


def armed_meanwhile() -> NotAllowedError:
    return NotAllowedError("The vehicle was armed: reading its logs has been ended.", advice=_ADVICE)
