"""What each of the pilot's commands means for the vehicle, one at a time: a newer one ends what an older one began."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

from telemetry.errors import NotAllowedError, RefusedError, TelemetryError
from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_flight
from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.avoidance import Avoidance, remaining_after
from telemetry.link.onboard import HOME_MOVED, Started, UnderWay, check_begins, check_same_mission
from telemetry.link.piloting.missions import (
    JoinMission,
    ReadMission,
    check_holds,
    check_may_start,
    check_not_begun_anew,
    first_item_next,
    same_route,
    set_speeds,
    start_mission,
)
from telemetry.link.piloting.procedures import Accepted, Procedures, ReadParameters, Spawn, change_mode
from telemetry.link.piloting.scripting import SUPERSEDED, Scripting
from telemetry.mavlink.autopilot_orders import HOLD_MODES, MISSION_MODES
from telemetry.mavlink.believing import is_in_the_air
from telemetry.mavlink.flight_keeper import FlightKeeper, item_of
from telemetry.topics.messages import FlightStatus
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.requests import (
    FlyManoeuvre,
    FlyRest,
    FlyWay,
    MayFlyManoeuvre,
    SetSpeed,
    StartAuto,
    StartGuided,
    TakeUp,
)
from telemetry.topics.vehicle import VehicleState


class Pilot:
    """Of one adopted vehicle. Every method raises RefusedError, SilentError or NotAllowedError."""

    def __init__(
        self,
        vehicle: AdoptedVehicle,
        flight: FlightKeeper,
        *,
        spawn: Spawn,
        read_parameters: ReadParameters,
        read_mission: ReadMission,
        alarm: Callable[[str], None],
    ) -> None:
        """``read_mission``: reads back what is on board; ``alarm``: tells at once what has gone wrong in flight."""
        self.vehicle, self.flight = vehicle, flight
        self.join: JoinMission | None = None
        self.avoidance = Avoidance(
            vehicle, remaining=self._remaining, on_engage=self._yield_to_avoidance, on_end=self._follow_avoidance
        )
        self._spawn, self._procedures = spawn, Procedures(spawn, flight.say)
        self._read_parameters, self._read_mission, self._alarm = read_parameters, read_mission, alarm
        self._scripting = Scripting(vehicle, self._procedures, read_parameters)
        self._flown: OnboardMission | None = None
        """What was on board in the last flight."""
        self._under_way = UnderWay(vehicle.onboard)

    @property
    def is_guided(self) -> bool:
        """The vehicle waits for, or flies to, places that this link hands over."""
        joins = self.join is not None and self.join.is_active
        return self._scripting.flies or joins or self.avoidance.is_engaged

    @property
    def flies_mission(self) -> bool:
        """Whether replacing the mission on board would change what is being flown, as far as is known."""
        state = self.vehicle.state
        if state.heartbeat_t_mono_s is None:
            return self.flight.is_under_way  # by what the node before this one knew
        in_mission = state.mode == MISSION_MODES.get(state.autopilot, "AUTO")
        return self.flight.status.phase == "arming" or (state.armed and (in_mission or self.flight.is_under_way))

    @property
    def started(self) -> Started:
        """For the link node after this one."""
        return self._under_way.started

    def inherit(self, started: Started) -> None:
        """Of the link node before this one, whose flight goes on."""
        self._under_way.inherit(started)

    def close(self) -> None:
        """The vehicle is given up: nothing more is sent."""
        self._end_current()

    # What the flight's status follows.

    def on_tick(self) -> None:
        state = self.vehicle.state
        if state.heartbeat_t_mono_s is None:
            return  # it has just been adopted: nobody knows yet whether it is armed
        self.avoidance.on_tick()
        self._under_way.on_state(state)
        if self.avoidance.is_engaged:
            self._follow_avoidance()
            return
        if (status := self._scripting.on_tick()) is not None:
            self.flight.script(status, armed=state.armed)
        if not self.flight.is_under_way:
            self._under_way.begin(None)
        elif self.vehicle.onboard.mission is not None:
            self._flown = self.vehicle.onboard.mission
        joining = self.join is not None and self.join.is_active
        if not self._scripting.is_there:
            self.flight.on_state(state, self.vehicle.onboard.mission, joining=joining)
        self._watch_mission(state)

    def replaces(self, *, places: bool = False) -> None:
        """What is on board is replaced in flight; ``places``: its fence or rally points. A way past an obstacle that is
        paused leads back to what is not there any more: it ends."""
        if self.flight.is_under_way:
            self.avoidance.stop()
            (self._under_way.replaces_places if places else self._under_way.replaces)()

    def uploaded(self, onboard: OnboardMission) -> None:
        """Where a flight broke off is a place of that flight's route; other heights are no other route."""
        if self._flown is None or not same_route(self._flown, onboard):
            self.flight.begin_anew()

    def _watch_mission(self, state: VehicleState) -> None:
        """A vehicle that flies by another mission than the one that was checked is stopped, once."""
        if self._under_way.turns_foreign(state):
            why = self._under_way.why_foreign
            self._alarm(why)
            self._spawn(self._stop_foreign_mission(why))

    async def _stop_foreign_mission(self, why: str) -> None:
        try:
            await self.pause()
        except TelemetryError as error:
            self._alarm(f"The vehicle does not hold: {error}")
        self.flight.say(why)

    def _follow_avoidance(self) -> None:
        before = self.flight.status
        status = self.avoidance.flight_status(before.since_utc_s)
        if status.way == before.way:  # it knows only those that are left
            status = replace(status, targets=before.targets)
        self.flight.script(status, armed=self.vehicle.state.armed)

    # Commands.

    async def arm(self) -> None:
        await self.vehicle.obey(self.vehicle.orders.arm())

    async def disarm(self) -> None:
        if is_in_the_air(self.vehicle.state):
            raise NotAllowedError("The vehicle is in the air: its motors are not stopped.", advice="Land it first.")
        self._end_current()
        await self.vehicle.obey(self.vehicle.orders.disarm())

    async def start_auto(self, request: StartAuto) -> None:
        check_may_start(self.vehicle.onboard, request)
        self._check_on_ground()
        self.join = None
        if request.from_item > 1:
            self.join = JoinMission(self.vehicle, request, self._read_mission)
        await self._procedures.take_over(lambda accepted: self._start_auto(request, accepted))

    async def start_guided(self, request: StartGuided) -> None:
        self._check_on_ground()
        if not request.targets:
            raise NotAllowedError("The script has no targets.", advice="Plan a mission first.")
        self.join = None
        await self._scripting.fly(request)

    async def fly_way(self, request: FlyWay) -> None:
        """From where the vehicle hovers. What was under way ends; a mission that was paused is not gone on with."""
        if not request.targets or any(not 0.0 < target.speed_m_s <= request.most_m_s for target in request.targets):
            raise NotAllowedError("The way has no targets, or is faster than certified.", advice="Ask for it again.")
        check_begins(request, self.vehicle.state)  # before anything ends that may hold the vehicle now
        self._end_current()
        self._under_way.begin(None)
        self.join = None
        await self._scripting.fly(request)

    async def set_speed(self, request: SetSpeed) -> None:
        self._scripting.set_speed(request)

    async def stop_motors(self) -> None:
        """Nothing is waited for or asked first."""
        self._end_current()
        await self.vehicle.obey(self.vehicle.orders.stop_motors())

    def check_manoeuvre(self, request: FlyManoeuvre | MayFlyManoeuvre) -> RemainingMission:
        """What would be flown after it. Raises NotAllowedError where it may not be flown now: what is refused here is
        not offered either."""
        self.avoidance.check_may_fly(request)
        if request.kind != "sidestep" or request.rejoin_item is not None:
            self._under_way.check_home()  # a sidestep that ends where it is counts its height from where the vehicle is
        return self._remaining_after(request)

    async def fly_manoeuvre(self, request: FlyManoeuvre) -> None:
        """Raises NotAllowedError as ``check_manoeuvre`` does."""
        self.avoidance.fly(request, self.check_manoeuvre(request))

    def fly_rest(self, request: FlyRest) -> None:
        self._under_way.check_home()
        self.avoidance.fly_rest(request)

    async def pause(self) -> None:
        if self.avoidance.is_engaged:
            self.avoidance.pause()
            return
        if self._scripting.pause():
            return
        state = self.vehicle.state
        starts = self.flight.is_under_way or self._procedures.is_under_way  # it may leave the ground any moment
        if not starts and (not state.armed or state.landed == "on_ground"):
            raise NotAllowedError("Nothing is being flown that could be paused.")
        await self._change_mode(*HOLD_MODES.get(state.autopilot, ("HOLD",)))

    @property
    def status(self) -> FlightStatus:
        """Of the flight, with what ``resume`` would be refused with now."""
        status = self.flight.status
        if status.phase != "paused":
            return status
        if self.vehicle.state.heartbeat_t_mono_s is None:
            return replace(status, not_resumed="The vehicle has not been heard yet.")
        try:
            self._check_resumes()
        except TelemetryError as error:
            return replace(status, not_resumed=f"{error.what} {error.advice}".strip())
        return status

    def _check_resumes(self) -> None:
        """Raises NotAllowedError and MissionUnknownError, by what is known without asking the vehicle."""
        self._under_way.check_home()
        if self.avoidance.is_engaged:
            return
        if self._scripting.flies:
            self._scripting.check_resumes()
            return
        if not self.vehicle.state.armed or self.flight.status.way != "auto" or not self.flight.is_under_way:
            raise NotAllowedError("There is no paused mission to go on with.", advice="Start the mission.")
        if (self.join is None or self.join.is_done) and not self._under_way.must_be_read:
            self._under_way.check_goes_on(self.vehicle.state)

    async def resume(self) -> None:
        self._check_resumes()
        if self.avoidance.is_engaged:
            self.avoidance.resume()
            return
        if self._scripting.flies:
            self._scripting.resume()
            return
        join = self.join
        if join is not None and not join.is_done:
            await self._procedures.take_over(join.go_on)
            return
        if self._under_way.must_be_read:
            await self._read_mission()
            if self.is_guided or not self.flight.is_under_way:
                raise NotAllowedError(SUPERSEDED, advice="Look at what is flown now.")
        self._under_way.check_goes_on(self.vehicle.state)
        if self._under_way.started.begins is None:
            await check_not_begun_anew(self.vehicle.firmware, self._read_parameters)
        await self._procedures.take_over(self._mission_mode)

    def check_holds(self) -> None:
        """Raises NotAllowedError unless the vehicle holds in the air, and nothing here leads it."""
        led = "being led past something" if self.avoidance.leads else self._scripting.led
        check_holds(self.vehicle.state, led=led)

    async def take_up(self, request: TakeUp) -> None:
        self.check_holds()
        check_begins(request, self.vehicle.state)
        check_same_mission(self.vehicle.onboard, request.digest)
        self._end_current()
        self._scripting.drop()
        self.join = None
        await first_item_next(self.vehicle)
        self._under_way.begin(request.digest, request)
        onboard = self.vehicle.onboard.mission
        self.flight.replaced(len(onboard.items) if onboard else 0, time.time())

    @contextlib.contextmanager
    def moving_home(self) -> Iterator[None]:
        """Around the order. What is paused is not gone on with from another home; where the vehicle refuses the order
        it may go on. Raises NotAllowedError unless it holds in the air."""
        self.check_holds()
        before, ordered = self._under_way.started, self._under_way.moves_home(perhaps=True)
        try:
            yield
        except BaseException as error:
            if isinstance(error, RefusedError):
                self._under_way.stays_home(before, ordered)
            else:
                self._end_current()
                self.join = None
            raise
        self._end_current()
        self.join = None
        self._under_way.moves_home()

    def home_was_moved(self) -> None:
        """By somebody else, in flight: what is flown or paused counts its heights from there, and is held."""
        self._under_way.moves_home()
        if self.avoidance.is_engaged or (self.join is not None and self.join.is_active):
            self._alarm(HOME_MOVED)
            self._spawn(self._stop_foreign_mission(HOME_MOVED))
        self.join = None

    async def return_home(self) -> None:
        await self._change_mode("RTL")

    async def land(self) -> None:
        await self._change_mode("LAND")

    async def hold(self) -> None:
        """Nobody watches any more: what this link hands over is stopped."""
        if self.avoidance.is_engaged:
            self.avoidance.pause()
        elif self._scripting.flies:
            self._scripting.pause()
        elif self.join is not None and self.join.is_active:
            await self.pause()

    # What avoidance takes over.

    def _remaining(self, state: VehicleState) -> RemainingMission | None:
        """What is left of the flight; None while nothing is flown that avoidance could go on with."""
        if self._scripting.flies:
            return self._scripting.remaining if self._scripting.flies_on else None
        if self.join is not None and self.join.is_active:
            return self.join.remaining
        return remaining_flight(self.vehicle.onboard.mission, state)

    def _remaining_after(self, request: FlyManoeuvre | MayFlyManoeuvre) -> RemainingMission:
        """What is flown after the way past an obstacle. Raises NotAllowedError where that cannot be flown."""
        remaining = self.avoidance.remaining or self._scripting.remaining
        onboard, firmware = self.vehicle.onboard.mission, self.vehicle.firmware
        return remaining_after(request, remaining, onboard, firmware, flies_way=self._scripting.most_m_s is not None)

    def _yield_to_avoidance(self) -> None:
        """What is under way sends nothing any more."""
        self._procedures.end()
        self.join = None
        self._scripting.drop()

    # How they are carried out.

    def _check_on_ground(self) -> None:
        if self.vehicle.state.armed and is_in_the_air(self.vehicle.state):
            raise NotAllowedError("The vehicle is already flying.", advice="Land it first, or resume what is paused.")

    async def _start_auto(self, request: StartAuto, accepted: Accepted) -> None:
        vehicle, items = self.vehicle, self.vehicle.onboard.mission
        self.flight.begin(len(items.items) if items else 0, time.time(), first=request.from_item)
        self._under_way.begin(request.digest)
        try:
            if self.join is not None:
                await self.join.take_off()
            else:
                await start_mission(vehicle, request.digest, self._read_mission)
        except (TelemetryError, asyncio.CancelledError) as error:
            self._start_ended(str(error) or SUPERSEDED)
            raise
        if self.join is not None:
            await self.join.go_on(accepted)

    def _start_ended(self, why: str) -> None:
        if self.flight.status.phase != "arming":
            return  # it is on its way, and seen to be
        if self.vehicle.state.armed and is_in_the_air(self.vehicle.state):
            self.flight.broke_off_start(why)
        else:
            self.flight.cancel(why)

    async def _mission_mode(self, accepted: Accepted) -> None:
        await self.vehicle.obey(self.vehicle.orders.mission_mode())
        accepted()
        if self.vehicle.firmware == "ardupilot":
            await set_speeds(self.vehicle, item_of(self.vehicle.state) or 1)

    async def _change_mode(self, *names: str) -> None:
        """To the first of ``names`` that is not refused. What was under way ends first and sends nothing any more."""
        self._end_current()
        await self._procedures.take_over(lambda accepted: change_mode(self.vehicle, names, accepted))

    def _end_current(self) -> None:
        self._procedures.end()
        self.avoidance.stop()
        self._scripting.stop()
