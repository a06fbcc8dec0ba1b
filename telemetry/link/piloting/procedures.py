"""How a pilot's command is carried out: one procedure at a time, a newer one ends the older, whose caller is told so.

Among them a change of the flight mode, until the mode itself shows, and how a vehicle is led through the places of
GUIDED, by its own settings.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import dataclass
from typing import Any

from planning.basics.plan_model import Firmware
from telemetry.errors import NotAllowedError, SilentError, TelemetryError
from telemetry.flight.guided.beginning import HOME_SHOWS_S, home_elsewhere
from telemetry.flight.guided.feed import Feed
from telemetry.link.adopted import AdoptedVehicle
from telemetry.mavlink.autopilot_orders import Order
from telemetry.topics.vehicle import VehicleState

Accepted = Callable[[], None]
"""To be called when the vehicle has taken the order: from then on nobody waits for the rest."""
Procedure = Callable[[Accepted], Coroutine[Any, Any, None]]
Spawn = Callable[[Coroutine[Any, Any, None]], asyncio.Task[None]]
ReadParameters = Callable[[tuple[str, ...]], Awaitable[dict[str, float | None]]]
SHOWS_S = 3.0
TRIES = 3
OPTIONS, STRAIGHT_LEGS = "GUID_OPTIONS", 64
"""ArduCopter then flies to the places of GUIDED as it does to waypoints."""
TIMEOUT, LEAST_SILENT_S = "GUID_TIMEOUT", 3.0
"""A shorter one would let it be led faster than it was simulated."""


@dataclass(frozen=True, slots=True)
class _UnderWay:
    task: asyncio.Task[None]
    started: asyncio.Future[None]
    """Done when it is accepted or over."""
    shows: Callable[[], bool]


class Procedures:
    """``say``: what went wrong after a procedure had been accepted."""

    def __init__(self, spawn: Spawn, say: Callable[[str], None]) -> None:
        self._spawn, self._say = spawn, say
        self._current: _UnderWay | None = None

    @property
    def is_under_way(self) -> bool:
        return self._current is not None and not self._current.task.done()

    def end(self) -> None:
        """What shows that it was accepted has been, also where avoidance takes it over at once."""
        self.on_tick()
        if self._current is not None:
            self._current.task.cancel()
            self._current = None

    def on_tick(self) -> None:
        """Whether what is under way shows by now that it was accepted."""
        if self._current is not None and not self._current.started.done() and self._current.shows():
            self._current.started.set_result(None)

    async def take_over(self, procedure: Procedure, *, shows: Callable[[], bool] = lambda: False) -> None:
        """Ends what was under way, then waits until ``procedure`` is accepted or over; it may go on after that.

        ``shows``: whether it has been accepted, for a procedure that is not told so.
        """
        self.end()
        started: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        task = self._spawn(self._carry_out(procedure, started))
        self._current = _UnderWay(task, started, shows)
        task.add_done_callback(lambda _: _refuse_if_open(started))
        await started

    async def _carry_out(self, procedure: Procedure, started: asyncio.Future[None]) -> None:
        def accepted() -> None:
            if not started.done():
                started.set_result(None)

        try:
            await procedure(accepted)
        except TelemetryError as error:
            if started.done():
                self._say(str(error))
            else:
                started.set_exception(error)
        else:
            accepted()


def _refuse_if_open(started: asyncio.Future[None]) -> None:
    if not started.done():
        started.set_exception(NotAllowedError("Another command was given before this one was carried out."))


async def see_home_here(vehicle: AdoptedVehicle) -> None:
    """Raises NotAllowedError where home is not where the vehicle stands, and does not come there."""
    with contextlib.suppress(SilentError):
        await vehicle.wait_until(
            lambda state: home_elsewhere(state) is None, timeout_s=HOME_SHOWS_S, what="take its home where it stands"
        )
    if (refusal := home_elsewhere(vehicle.state)) is not None:
        raise refusal


async def change_mode(vehicle: AdoptedVehicle, names: tuple[str, ...], accepted: Callable[[], None]) -> None:
    """To the first of ``names`` that is not refused, until the mode itself shows. Raises RefusedError, SilentError.

    An acknowledgement does not say of which mode it is: that of an earlier order must not pass for one of this.
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


@dataclass(frozen=True, slots=True)
class GuidedWay:
    feed: Feed | None = None
    """None: it is sent its places."""
    note: str = ""


async def guided_way(firmware: Firmware, read_parameters: ReadParameters) -> GuidedWay:
    """What is not known is taken for the worse."""
    if firmware != "ardupilot":
        return GuidedWay()
    known: Mapping[str, float | None] = {}
    with contextlib.suppress(TelemetryError):
        known = await read_parameters((OPTIONS, TIMEOUT))
    options = known.get(OPTIONS)
    if options is not None and int(options) & STRAIGHT_LEGS:
        return GuidedWay()
    silent_s = max(known.get(TIMEOUT) or 0.0, LEAST_SILENT_S)
    note = (
        "In GUIDED this vehicle shapes height and place apart: it is led along the legs, ten times a second, no faster"
        f" than a link that falls silent for {silent_s:g} s allows."
        f" Set {OPTIONS} {STRAIGHT_LEGS | int(options or 0)} on the vehicle, and it flies straight legs by itself;"
        " or fly in AUTO."
    )
    return GuidedWay(Feed(silent_s=silent_s), note)
