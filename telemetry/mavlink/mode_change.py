"""Another flight mode for the vehicle, until the mode itself shows.

The acknowledgement of a mode command does not say of which one: that of an earlier order, whose place this one has
taken, must not pass for the answer to this one.
"""

from __future__ import annotations

from collections.abc import Callable

from telemetry.errors import SilentError
from telemetry.mavlink.adopted import AdoptedVehicle
from telemetry.mavlink.orders import Order
from telemetry.vehicle import VehicleState

SHOWS_S = 3.0
TRIES = 3


async def change_mode(vehicle: AdoptedVehicle, names: tuple[str, ...], accepted: Callable[[], None]) -> None:
    """To the first of ``names`` that is not refused. Raises RefusedError, SilentError.

    ``accepted`` is called with the first acknowledgement; it ends when somebody else has chosen a third mode.
    """
    before = vehicle.state.mode
    orders = [_order(vehicle, name) for name in names]
    for _ in range(TRIES):
        await vehicle.obey_first(*orders)
        accepted()
        if await _shows(vehicle, names, before):
            return
    what = f"The vehicle took the order to change to {names[0]}, but is still in {before}."
    raise SilentError(what, advice="Command it again, or take over by remote control.")


def _order(vehicle: AdoptedVehicle, name: str) -> Order:
    """A vehicle that flies to a place in GUIDED is not stopped by GUIDED: it is sent to where it is."""
    state = vehicle.state
    lat_deg, lon_deg, alt_m = state.lat_deg, state.lon_deg, state.alt_rel_home_m
    if name != "GUIDED" or state.mode != name or lat_deg is None or lon_deg is None or alt_m is None:
        return vehicle.orders.mode(name)
    return vehicle.orders.go_to(lat_deg, lon_deg, alt_m)


async def _shows(vehicle: AdoptedVehicle, names: tuple[str, ...], before: str) -> bool:
    changed: Callable[[VehicleState], bool] = lambda state: state.mode in names or state.mode != before  # noqa: E731
    try:
        await vehicle.wait_until(changed, timeout_s=SHOWS_S, what="change its mode")
    except SilentError:
        return False
    return True
