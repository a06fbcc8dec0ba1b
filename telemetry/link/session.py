"""With the one adopted vehicle: what it is, who flies it and what is transferred, as long as it is adopted.

A frame comes to ``on_message`` and goes on to ``AdoptedVehicle``, which reduces it; a request comes to ``pilot`` or
``transfers``, which run a protocol machine of ``telemetry.mavlink`` against the vehicle.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TelemetryError
from telemetry.flight.guided.beginning import check_stands_there
from telemetry.flight.home_watch import HomePlace, HomeWatch, home_of, is_there
from telemetry.link.adopted import ALERT, WARNING, AdoptedVehicle, Telling
from telemetry.link.audit import AUTOPILOT, CommandLog
from telemetry.link.line import Line
from telemetry.link.log_reading import LogReading
from telemetry.link.peers import REFUSED_S, Peers
from telemetry.link.piloting.pilot import Pilot
from telemetry.link.piloting.procedures import Spawn
from telemetry.link.publishing import StatePublisher
from telemetry.link.signatures import KeyRing
from telemetry.link.transferring import Transfers
from telemetry.mavlink.actions import Message
from telemetry.mavlink.believing import is_in_the_air
from telemetry.mavlink.flight_keeper import FlightKeeper
from telemetry.mavlink.ranges import RangeReader
from telemetry.mavlink.signing import KEY_BYTES
from telemetry.topics.messages import Candidate, Published, RawFrame, Topic, VehicleText
from telemetry.topics.obstacles import AvoidBy, PerceptionSettings
from telemetry.topics.requests import SetHome
from telemetry.topics.traffic import TrafficSettings
from telemetry.topics.vehicle import VehicleState
from telemetry.traffic.traffic_picture import TrafficPicture

SETUP_TIMES, SETUP_EVERY_S = 5, 1.0
OTHER_VEHICLE = (
    "another vehicle with the same number is heard: its clock or its place differs. Nothing of it is used, and it is "
    f"asked again after {REFUSED_S:.0f} s."
)
READ_BACK_AFTER_S = (0.0, 5.0, 15.0)
HOME_SHOWS_S = 6.0
"""Vehicles tell their home every two seconds, or when it changes."""
AVOIDS_AGAIN = (
    "The link has restarted: nothing avoided obstacles meanwhile. Avoidance is on again. Look where the vehicle is."
)


@dataclass(frozen=True, slots=True)
class Around:
    """What the link lends its sessions. ``changed``: something in the link's status may be another."""

    publish: Callable[[str, Published], None]
    states: StatePublisher
    flight: FlightKeeper
    commands: CommandLog
    spawn: Spawn
    changed: Callable[[], None]
    keys: KeyRing


@dataclass(frozen=True, slots=True)
class Settings:
    """What the server has told the link; None: nothing yet."""

    perception: PerceptionSettings | None = None
    traffic: TrafficSettings | None = None


class Session:
    def __init__(
        self, candidate: Candidate, line: Line, around: Around, ranges: RangeReader, settings: Settings
    ) -> None:
        self._around, self._ranges, self._is_over = around, ranges, False
        self.traffic, self._home = TrafficPicture(settings.traffic), HomeWatch()
        telling = Telling(
            state=self._on_state,
            text=self._on_text,
            unsure=self._read_back,
            sent=self.on_sent,
            ordered=self._on_order,
            sent_spare=self.on_sent_spare,
            changed_over=self._on_change_over,
        )
        self.vehicle = AdoptedVehicle(candidate, line, telling, time.monotonic, flies=around.flight.is_under_way)
        self.logs = LogReading(self.vehicle)
        self.transfers = Transfers(self.vehicle, lambda status: around.publish(Topic.TRANSFER, status), self.logs)
        self.pilot = Pilot(
            self.vehicle,
            around.flight,
            spawn=around.spawn,
            read_parameters=self.transfers.read_parameters,
            read_mission=self.transfers.read_back,
            alarm=self._alarm,
        )
        if settings.perception is not None:
            self.pilot.avoidance.on_settings(settings.perception)

    def begin(self) -> None:
        self.vehicle.send_first()
        self._around.changed()
        self._read_back()

    def avoid_again(self, by: AvoidBy, *, was_in_flight: bool) -> None:
        """It was on, with its operator's consent, when the link before this one ended."""
        self.pilot.avoidance.enable(by)
        if was_in_flight:
            self._on_text(ALERT, AVOIDS_AGAIN)
        self._around.spawn(self._around.commands.record(AUTOPILOT, "avoidance on again", must=False))

    def close(self) -> None:
        self._is_over = True
        self.pilot.close()
        self.vehicle.exchanges.give_up()
        self._around.flight.forget()

    # What comes in.

    def on_message(self, message: Message, now_s: float, t_utc_s: float, address: str) -> None:
        """Any of the vehicle's system, over any way."""
        vehicle = self.vehicle
        is_used = vehicle.ways.takes(address, message, now_s)
        frame = RawFrame(t_utc_s, False, address, bytes(message.get_msgbuf()), spare=not is_used)
        self._around.publish(Topic.RAW, frame)
        if not is_used:
            vehicle.on_spare(message, address)
            return
        for believed in vehicle.on_message(message, t_utc_s, address=address):
            self._on_believed(believed, now_s, t_utc_s)

    def on_stranger(self, message: Message, now_s: float, address: str) -> None:
        """Of somebody else on a connection that leads to the vehicle: a radio, another ground station, aircraft."""
        vehicle, way = self.vehicle, self.vehicle.ways.get(address)
        if way is None:
            return
        if message.get_type() == "RADIO_STATUS":
            way.hear_radio(message, now_s)
        if self.signs or way.identity != "known":
            return
        vehicle.on_foreign(message)  # a vehicle that demands signatures does not listen to it
        if vehicle.ways.is_prompt(address, now_s):
            self.traffic.on_message(message, vehicle.state, now_s)

    def settle_ways(self, peers: Peers) -> None:
        """What the comparison of the clocks has found."""
        for way in self.vehicle.part_ways():
            is_other = way.identity == "other"
            peers.part(way.address, time.monotonic(), refused=is_other)
            if is_other:
                self.vehicle.tell(WARNING, f"Link: over {way.address} {OTHER_VEHICLE}")
        for way in self.vehicle.ways:
            peers.know(way.address, is_known=way.identity == "known")

    def _on_believed(self, message: Message, now_s: float, t_utc_s: float) -> None:
        heading_rad = self.vehicle.state.heading_rad
        ranges = self._ranges.on_message(message, heading_rad=heading_rad, t_mono_s=now_s, t_utc_s=t_utc_s)
        if ranges is not None:
            self._around.publish(Topic.RANGE_FRAME, ranges)
        self.traffic.on_message(message, self.vehicle.state, now_s)
        self.pilot.avoidance.on_message(message)

    def on_tick(self) -> None:
        self.vehicle.on_tick()
        self.pilot.on_tick()
        told = self.traffic.on_tick(self.vehicle.state, time.monotonic(), time.time())
        if told is not None:
            self._around.publish(Topic.TRAFFIC, told.status)
            for alert in told.alerts:
                self._around.publish(Topic.ALERT, alert)

    def on_sent(self, frame: bytes) -> None:
        self._around.publish(Topic.RAW, RawFrame(time.time(), True, self.vehicle.line.text, frame))

    def on_sent_spare(self, address: str, frame: bytes) -> None:
        self._around.publish(Topic.RAW, RawFrame(time.time(), True, address, frame, spare=True))

    # Signing.

    @property
    def signs(self) -> bool:
        """Nothing unsigned is accepted in its name."""
        return self._around.keys.status(self.vehicle.target[0]).mode == "on"

    async def set_signing(self, enabled: bool) -> None:
        """Raises NotAllowedError, SilentError. Switching off is heard here in any case, by the vehicle perhaps."""
        keys, system_id = self._around.keys, self.vehicle.target[0]
        keyed = keys.of(system_id)
        if not enabled:
            if keyed is not None:
                for _ in range(SETUP_TIMES):
                    self._give_key(bytes(KEY_BYTES), 0)
                keyed.mode = "let"
                await keys.save()
            return
        keyed = keys.new_key(system_id)
        await keys.save()
        for _ in range(SETUP_TIMES):
            self._give_key(keyed.signing.key, keyed.signing.newest)
            await asyncio.sleep(SETUP_EVERY_S)
            if keyed.mode == "on":
                await keys.save()
                return
        what = "The vehicle was given a key, and has not begun to sign with it."
        advice = "It may not know signing, or refuse it on this link: PX4 needs MAV_SIGN_CFG. Read its messages."
        raise SilentError(what, advice=advice)

    async def set_home(self, request: SetHome) -> None:
        """Raises NotAllowedError, RefusedError, and SilentError where the vehicle does not tell that home."""
        vehicle, wanted = self.vehicle, HomePlace(request.lat_deg, request.lon_deg, request.alt_amsl_m)
        if is_in_the_air(vehicle.state):
            with self.pilot.moving_home():
                await self._order_home(wanted)
            return
        check_stands_there(vehicle.state, wanted, time.monotonic())
        await self._order_home(wanted)

    async def _order_home(self, wanted: HomePlace) -> None:
        vehicle = self.vehicle
        self._home.expect(wanted)
        try:
            await vehicle.obey(vehicle.orders.set_home(wanted.lat_deg, wanted.lon_deg, wanted.alt_amsl_m))
            await vehicle.wait_until(
                lambda state: is_there(home_of(state), wanted),
                timeout_s=HOME_SHOWS_S,
                what="tell the home that was set",
            )
        finally:
            self._home.expect(None)

    def _give_key(self, key: bytes, timestamp: int) -> None:
        """Never through ``on_sent``: a recording must not hold the key."""
        message = mavlink.MAVLink_setup_signing_message(*self.vehicle.target, list(key), timestamp)
        self.vehicle.line.send(message, self.vehicle.ways.chosen.candidate.peer)

    def _on_state(self, state: VehicleState) -> None:
        self._around.states.offer(state)
        if (moved := self._home.on_state(state)) is not None:
            self._on_text(ALERT, moved)
            self._around.spawn(self._around.commands.record(AUTOPILOT, moved, must=False))
            if self._home.is_elsewhere:
                self.pilot.home_was_moved()
        self.pilot.avoidance.on_state(state)

    def _on_order(self, message: Message) -> None:
        self.pilot.avoidance.on_order(message)

    def _on_text(self, severity: int, text: str) -> None:
        self._around.publish(Topic.TEXT, VehicleText(time.time(), severity, text))

    def _on_change_over(self, text: str) -> None:
        self._around.changed()
        self._around.spawn(self._around.commands.record(AUTOPILOT, text, must=False))

    # What goes out by itself.

    def _alarm(self, text: str) -> None:
        """What the pilot must hear at once; what is done about it is written down."""
        self._on_text(ALERT, text)
        self._around.spawn(self._around.commands.record(AUTOPILOT, f"hold: {text}", must=False))

    async def hold(self) -> None:
        with contextlib.suppress(TelemetryError):
            await self._around.commands.record(AUTOPILOT, "hold: the console is gone", must=False)
            await self.pilot.hold()

    def _read_back(self) -> None:
        """What is on board is not known: say so, and find out, if nobody is flying by it."""
        self._around.changed()
        if not self.vehicle.state.armed:
            self._around.spawn(self._read_back_quietly())

    async def _read_back_quietly(self) -> None:
        """A vehicle that has just been switched on may not answer at first."""
        for pause_s in READ_BACK_AFTER_S:
            await asyncio.sleep(pause_s)
            if self._is_over or self.transfers.is_busy or self.transfers.knows_mission:
                return
            # What goes wrong here is seen by mission_state, which stays unknown.
            with contextlib.suppress(TelemetryError):
                await self.transfers.read_back()
