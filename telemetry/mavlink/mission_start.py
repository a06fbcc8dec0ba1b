"""The mission on board is started: armed, read once more, and sent off before the motors are off again."""

from __future__ import annotations

import contextlib

from telemetry.errors import RefusedError, SilentError, TelemetryError
from telemetry.mavlink.adopted import AdoptedVehicle
from telemetry.mavlink.flight_keeper import sequence_of
from telemetry.mavlink.going_on import ReadMission, check_again

ARMED_WITHIN_S = 10.0


async def start_mission(vehicle: AdoptedVehicle, digest: str, read_mission: ReadMission) -> None:
    """ArduPilot does not arm in AUTO; PX4 takes off as soon as it is armed in its mission mode.

    Raises RefusedError, SilentError, and MissionUnknownError where another mission is on board now. A vehicle that has
    switched its motors off meanwhile is not armed a second time: it may have been a pilot who did that.
    """
    orders = vehicle.orders
    first, at = sequence_of(1, vehicle.state.autopilot), vehicle.state.mission_item
    if at is None or at > first:  # not known: it may be where an earlier flight broke off
        await vehicle.obey(orders.mission_item(first))
    if vehicle.firmware == "ardupilot":
        await vehicle.obey(orders.mode("GUIDED"))
        await _arm(vehicle)
        await _check_or_disarm(vehicle, digest, read_mission)
        await _send_off(vehicle)
    else:
        await vehicle.obey(orders.mission_mode())
        await check_again(vehicle.onboard, digest, read_mission)
        await _arm(vehicle)
        await vehicle.obey(orders.start_mission())
        await _see_armed(vehicle)


async def _send_off(vehicle: AdoptedVehicle) -> None:
    """It was armed: where it is not any more, that is why."""
    try:
        await vehicle.obey(vehicle.orders.mission_mode())
        await vehicle.obey(vehicle.orders.start_mission())
        await _see_armed(vehicle)
    except (RefusedError, SilentError):
        if vehicle.state.armed:
            raise
        raise SilentError(
            "The vehicle's motors are off again, before it took off.",
            advice="ArduPilot does so DISARM_DELAY after arming, usually 10 s. If nobody else did it, too much is lost"
            " on the link: improve it, then start again.",
        ) from None


async def _see_armed(vehicle: AdoptedVehicle) -> None:
    await vehicle.wait_until(lambda state: state.armed, timeout_s=ARMED_WITHIN_S, what="arm")


async def _check_or_disarm(vehicle: AdoptedVehicle, digest: str, read_mission: ReadMission) -> None:
    try:
        await check_again(vehicle.onboard, digest, read_mission)
    except TelemetryError:
        with contextlib.suppress(TelemetryError):  # it switches its motors off by itself soon
            await vehicle.obey(vehicle.orders.disarm())
        raise


async def _arm(vehicle: AdoptedVehicle) -> None:
    if not vehicle.state.armed:
        await vehicle.obey(vehicle.orders.arm())
