"""Avoidance on board of this link: who may switch it on, and what it hears and sends of the adopted vehicle."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from planning.basics.plan_model import Firmware
from telemetry.errors import NotAllowedError, SilentError
from telemetry.flight.avoidance.avoiding import Avoiding
from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_from
from telemetry.link.adopted import AdoptedVehicle
from telemetry.mavlink.actions import Action, Message, Send
from telemetry.mavlink.modes import commanded_mode
from telemetry.topics.messages import FlightStatus
from telemetry.topics.obstacles import AvoidanceStatus, AvoidBy, PerceptionSettings, PerceptionStatus
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.requests import FlyManoeuvre, FlyRest, MayFlyManoeuvre
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import VehicleState

BUILT_FOR = ("ardupilot", "px4")
WHO_IT_IS_S = 3.0
"""A vehicle that was just adopted is waited for so long to say what it is."""


class Avoidance:
    """Of one adopted vehicle. What it decides is sent at once; it waits for nothing."""

    def __init__(
        self,
        vehicle: AdoptedVehicle,
        *,
        remaining: Callable[[VehicleState], RemainingMission | None],
        on_engage: Callable[[], None],
        on_end: Callable[[], None],
    ) -> None:
        self._vehicle = vehicle
        self._avoiding = Avoiding(
            vehicle.target,
            remaining=remaining,
            fence=vehicle.onboard.fence,
            firmware=vehicle.firmware,
            on_engage=on_engage,
            on_end=on_end,
        )

    @property
    def is_engaged(self) -> bool:
        return self._avoiding.is_engaged

    @property
    def leads(self) -> bool:
        """It is engaged, and not paused."""
        return self.is_engaged and not self._avoiding.detour.is_paused

    @property
    def avoids_by(self) -> AvoidBy | None:
        """None: it is off, or the pilot has taken over."""
        avoiding = self._avoiding
        return avoiding.by if avoiding.enabled and not avoiding.released else None

    @property
    def status(self) -> AvoidanceStatus:
        return self._avoiding.status

    @property
    def remaining(self) -> RemainingMission | None:
        """What is left of a flight that was taken over, at its planned heights."""
        return self._avoiding.detour.remaining if self.is_engaged else None

    def flight_status(self, since_utc_s: float | None) -> FlightStatus:
        return self._avoiding.flight_status(since_utc_s=since_utc_s)

    # Requests.

    def check_autopilot(self) -> None:
        if self._vehicle.state.autopilot not in BUILT_FOR:
            what = "Avoidance is built for ArduPilot and PX4 only."
            raise NotAllowedError(what, advice="Watch the alerts and fly by hand.")

    async def check_may_be_enabled(self, *, consent: bool) -> None:
        """Raises NotAllowedError: a vehicle that is no simulation climbs by itself only if its operator wants it."""
        self.check_autopilot()
        if consent or await self._is_simulation():
            return
        raise NotAllowedError(
            "On a real vehicle avoidance needs your consent: it will stop, climb or step aside by itself.",
            advice="Give it when you switch avoidance on.",
        )

    async def _is_simulation(self) -> bool:
        vehicle = self._vehicle
        with contextlib.suppress(SilentError):  # what does not say that it is simulated is real
            await vehicle.wait_until(
                lambda _: vehicle.capabilities is not None, timeout_s=WHO_IT_IS_S, what="say what it is"
            )
        return vehicle.is_simulation

    def enable(self, by: AvoidBy = "climb") -> None:
        self._avoiding.enable(time.monotonic(), by)

    def disable(self) -> None:
        self._perform(self._avoiding.disable(time.monotonic()))

    def check_may_fly(self, request: FlyManoeuvre | MayFlyManoeuvre) -> None:
        """Raises NotAllowedError for a prepared way that may not be flown now."""
        self.check_autopilot()
        self._avoiding.check_may_fly(request)

    def fly(self, request: FlyManoeuvre, remaining: RemainingMission) -> None:
        self._perform(self._avoiding.fly(request, remaining, time.monotonic()))

    def fly_rest(self, request: FlyRest) -> None:
        self._perform(self._avoiding.fly_rest(request, time.monotonic()))

    def pause(self) -> None:
        self._perform(self._avoiding.pause(time.monotonic()))

    def resume(self) -> None:
        self._perform(self._avoiding.resume(time.monotonic()))

    def stop(self) -> None:
        """Another command follows."""
        self._avoiding.stop()

    # What comes in.

    def on_order(self, message: Message) -> None:
        """What this link sends: a mode that it asks for is no pilot's. A place in the mode that shows changes none."""
        state = self._vehicle.state
        mode = commanded_mode(message, state.autopilot, state.vehicle_type)
        if mode is None or (message.get_type() == "COMMAND_INT" and mode == state.mode):
            return
        self._avoiding.commanded(mode, time.monotonic())

    def on_message(self, message: Message) -> None:
        self._perform(self._avoiding.on_message(message, time.monotonic()))

    def on_state(self, state: VehicleState) -> None:
        self._perform(self._avoiding.on_state(state, time.monotonic()))

    def on_perception(self, status: PerceptionStatus) -> None:
        self._perform(self._avoiding.on_perception(status, time.monotonic()))

    def on_tracks(self, status: TracksStatus) -> None:
        self._perform(self._avoiding.on_tracks(status, time.monotonic()))

    def on_settings(self, settings: PerceptionSettings) -> None:
        self._avoiding.on_settings(settings)

    def on_tick(self) -> None:
        self._perform(self._avoiding.on_tick(time.monotonic()))

    def _perform(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Send):
                self._vehicle.send(action.message)


def remaining_after(
    request: FlyManoeuvre | MayFlyManoeuvre,
    remaining: RemainingMission | None,
    onboard: OnboardMission | None,
    firmware: Firmware,
    *,
    flies_way: bool,
) -> RemainingMission:
    """What is flown after the way past an obstacle, of what was under way, else of the mission on board.

    ``flies_way``: a certified way is flown. Raises NotAllowedError where nothing can be flown from that item on.
    """
    item = request.rejoin_item
    if item is None:
        return RemainingMission((), "hold")
    if remaining is not None and remaining.way == "guided" and flies_way:
        # It has no items: nothing of it would be left, and one that ends with landing would land beside its place.
        what = f"A certified way is flown, not a mission: it has no item {item} to go on from."
        raise NotAllowedError(what, advice="Hold, then ask for another way.")
    if remaining is not None:
        return RemainingMission(tuple(t for t in remaining.targets if t.item >= item), remaining.end, remaining.way)
    remaining = None if onboard is None else remaining_from(onboard, item, firmware)
    if remaining is None:
        what = f"What follows from item {item} on cannot be flown in GUIDED."
        raise NotAllowedError(what, advice="Pause, and fly past the obstacle by hand.")
    return remaining
