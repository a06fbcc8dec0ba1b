"""The link: every connection, who is heard on them, and the session with the one adopted vehicle.

It checks limits and the operator's right for every command itself (``answering.py``): nothing in front of it is
trusted with that.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from dataclasses import replace
from typing import Any

from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.audit import AUTOPILOT, Audit, CommandLog
from telemetry.link.heartbeat import Grace, Heartbeat, heartbeat
from telemetry.link.line import Line
from telemetry.link.onboard import Started
from telemetry.link.peers import Expected, Peers, Source, is_same_vehicle
from telemetry.link.publishing import StatePublisher, StatusTeller
from telemetry.link.session import Around, Session, Settings
from telemetry.link.signatures import KeyRing, Late
from telemetry.mavlink.actions import Message
from telemetry.mavlink.address import parse_address
from telemetry.mavlink.connections import Peer
from telemetry.mavlink.flight_keeper import FlightKeeper
from telemetry.mavlink.ranges import RangeReader
from telemetry.mavlink.reduce import is_vehicle_heartbeat
from telemetry.topics.messages import Candidate, FlightStatus, LinkStatus, Published, SigningStatus, Topic
from telemetry.topics.obstacles import AvoidanceStatus, AvoidBy, PerceptionSettings, PerceptionStatus
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.traffic import TrafficSettings

TICK_S = 0.05


_NOT_YET_AGAIN = "The link has restarted and has not heard the vehicle yet: nothing brakes by itself."


class Link:
    """Made by ``open_link``. ``publish`` is called on the event loop and must not wait."""

    def __init__(
        self,
        publish: Callable[[str, Published], None],
        tasks: asyncio.TaskGroup,
        *,
        grace_s: float = 10.0,
        server_age_s: Callable[[], float | None] = lambda: None,
        audit: Audit | None = None,
        keys: KeyRing | None = None,
    ) -> None:
        self._publish = publish
        self.peers, self.lines = Peers(), dict[str, Line]()
        self.keys = keys or KeyRing()
        self._late = Late()
        self.flight = FlightKeeper()
        self.session: Session | None = None
        self._tasks, self._running = tasks, dict[str, asyncio.Task[None]]()
        self._own_tasks: set[asyncio.Task[None]] = set()
        self.commands = CommandLog(audit, lambda record: publish(Topic.COMMAND, record), self.flight.say)
        self._grace, self._server_age_s = Grace(grace_s), server_age_s
        self._heartbeat = Heartbeat(self._beat, self._may_beat)
        self._states = StatePublisher(lambda state: publish(Topic.VEHICLE, state))
        self._teller = StatusTeller(lambda status: publish(Topic.LINK, status))
        self._told_flight: FlightStatus | None = None
        self._told_avoidance: AvoidanceStatus | None = None
        self._settings = Settings()
        self._expected: Expected | None = None
        self._around = Around(publish, self._states, self.flight, self.commands, self.spawn, self._tell, self.keys)
        self._ranges = RangeReader()

    # Connections and the vehicle.

    async def connect(self, address: str, *, adopt: bool, only: Candidate | None = None, as_way: bool = False) -> None:
        """Opens a connection and keeps it open; ``only``: adopt no other vehicle. ``as_way``: see ``Connect``."""
        parsed = parse_address(address)
        text = parsed.text
        self.peers.adopt_first_of(text, wanted=adopt, only=only)
        if as_way:
            self.peers.take_as_way(text)
        if text in self.lines:
            return
        taken = {line.number for line in self.lines.values()}
        line = Line(
            parsed,
            heard=self._heard,
            gone=self._gone,
            changed=self._connection_changed,
            clock=time.monotonic,
            seal=self._seal,
            number=next(number for number in range(256) if number not in taken),
        )
        self.lines[text] = line
        self._running[text] = self.spawn(line.connection.run())
        self._tell()

    def disconnect(self, address: str) -> None:
        text = parse_address(address).text
        if text not in self.lines:
            raise NotAllowedError(f"There is no connection {text}.")
        if self.session is not None and not self.session.vehicle.leave_way(text):
            self.release()
        self.peers.forget(text)
        del self.lines[text]
        self._running.pop(text).cancel()
        self._tell()

    def adopt(self, candidate: Candidate) -> None:
        if candidate in self.peers.places:
            return
        if self.session is not None and candidate == self.peers.again(time.monotonic()):
            self._go_on_from(self.session, candidate)
            return
        self.release(forget_wish=False)
        self.peers.adopt(candidate, time.monotonic())
        line = self.lines[candidate.address]
        self.session = Session(candidate, line, self._around, self._ranges, self._settings)
        self.session.begin()
        before, self._expected = self._expected, None
        if before is not None and is_same_vehicle(before.vehicle, candidate):
            self.session.pilot.inherit(before.started)
            if before.avoid_by is not None:
                self.session.avoid_again(before.avoid_by, was_in_flight=before.may_fly)

    def _go_on_from(self, session: Session, candidate: Candidate) -> None:
        """The vehicle that was lost is heard from elsewhere: what it flies, and what it was asked, stays."""
        self.peers.adopt(candidate, time.monotonic())
        session.vehicle.moved(candidate, self.lines[candidate.address])
        self._tell()

    @property
    def _waited_for(self) -> Expected | None:
        return None if self._expected is None or self._expected.is_given_up else self._expected

    @property
    def _lost_from_sight(self) -> Expected | None:
        """What may be in the air is a vehicle that is lost, not none: it stays in sight, and whoever looks is told."""
        expected = self._waited_for
        return expected if expected is not None and expected.may_fly else None

    @property
    def _avoidance_expected(self) -> AvoidanceStatus:
        """Without a vehicle: off, unless it was on for one that may be in the air and is not heard yet."""
        lost = self._lost_from_sight
        if lost is None or lost.avoid_by is None:
            return AvoidanceStatus()
        return AvoidanceStatus(enabled=True, state="lost", text=_NOT_YET_AGAIN, by=lost.avoid_by)

    @property
    def avoids_by(self) -> AvoidBy | None:
        """Of the adopted vehicle; of the one before this node's start until it is heard again."""
        if self.session is None:
            return None if self._expected is None else self._expected.avoid_by
        return self.session.pilot.avoidance.avoids_by

    @property
    def may_fly(self) -> bool:
        """The adopted vehicle, or the one that is waited for, is not known to be disarmed."""
        if self.session is None:
            return self._expected is None or self._expected.may_fly
        return self.session.vehicle.may_fly

    @property
    def started(self) -> Started:
        """The mission of the flight that is under way; of the one before this node's start until it is heard again."""
        if self.session is None:
            return Started() if self._expected is None else self._expected.started
        return self.session.pilot.started

    def expect(self, vehicle: Expected) -> None:
        self._expected = vehicle

    def give_up_expected(self) -> None:
        if self._expected is not None:
            self._expected = replace(self._expected, is_given_up=True)

    def release(self, *, forget_wish: bool = True) -> None:
        if self.session is not None:
            self.session.close()
        if forget_wish:
            self._expected = None
            self.peers.release()
        self.session = None
        self._tell()

    def need_session(self, *, live: bool = True) -> Session:
        """Raises NoVehicleError; ``live``: also when the link to the vehicle is lost."""
        if self._lost_from_sight is not None:
            what = "The link has restarted and has not heard the vehicle again yet."
            raise NoVehicleError(what, advice="Take the pilot's transmitter if it must act now.")
        if self.session is None:
            raise NoVehicleError("No vehicle is adopted.", advice="Connect to it and adopt it first.")
        vehicle = self.session.vehicle
        if live and vehicle.link_state == "lost":
            what = f"The link to the vehicle is lost: nothing was heard for {vehicle.silent_s:.0f} s."
            raise NoVehicleError(what, advice="Wait until it is heard again.")
        return self.session

    def spawn(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = self._tasks.create_task(coroutine)
        self._own_tasks.add(task)
        task.add_done_callback(self._own_tasks.discard)
        return task

    # What comes in.

    def _heard(self, line: Line, source: Source, message: Message) -> None:
        now_s, t_utc_s = time.monotonic(), time.time()
        frame = bytes(message.get_msgbuf())
        way, beside = self.peers.ways_of(source)
        proof = self.keys.judge(source.system_id, message.get_msgId(), frame, now_s, way=way, beside=beside)
        if proof != "good":
            if proof == "replayed" and is_vehicle_heartbeat(message):
                self._tell_time(line, source, now_s)
            return
        verdict = self.peers.hear(source, message, now_s)
        if verdict == "stranger" and self.peers.wants(source, message):
            candidate = self.peers.find(source.id, now_s)
            if candidate is not None:
                self.adopt(candidate)
                verdict = "adopted"
        session = self.session
        if session is None:
            return
        if verdict == "adopted":
            session.on_message(message, now_s, t_utc_s, line.text)
        elif verdict == "asked":
            session.vehicle.on_spare(message, line.text)
        elif verdict == "stranger":
            if self.peers.may_join(source, message, now_s):
                self._ask_way(session.vehicle, line, source, now_s)
            session.on_stranger(message, now_s, line.text)

    def _ask_way(self, vehicle: AdoptedVehicle, line: Line, source: Source, now_s: float) -> None:
        """Whether this is the adopted vehicle, reached another way."""
        candidate = self.peers.find(source.id, now_s)
        if candidate is not None and line is not vehicle.line:
            self.peers.ask(candidate, now_s)
            vehicle.ask_way(candidate, line)

    def _tell_time(self, line: Line, source: Source, now_s: float) -> None:
        """A vehicle without a clock learns the time from what it hears. A heartbeat does no harm if it is not it."""
        if self._late.is_to_be_told(line.text, source.peer, source.system_id, now_s):
            line.send(heartbeat(), source.peer)

    def _seal(self, line: Line, peer: Peer, frame: bytes) -> bytes:
        place = self.peers.place_at(line.text)
        if place is not None and place.peer == peer:
            return self.keys.seal(place.system_id, frame, line.number)
        return self.keys.seal(self._late.system_id(line.text, peer), frame, line.number)

    def on_perception(self, status: PerceptionStatus) -> None:
        """What a sensor's node says about the regions ahead."""
        if self.session is not None:
            self.session.pilot.avoidance.on_perception(status)

    def on_tracks(self, status: TracksStatus) -> None:
        """What moves or stands around, and how far away known ground is."""
        if self.session is not None:
            self.session.pilot.avoidance.on_tracks(status)

    def on_settings(self, settings: PerceptionSettings) -> None:
        """How deep the regions are, and how large the vehicle is."""
        self._settings = replace(self._settings, perception=settings)
        if self.session is not None:
            self.session.pilot.avoidance.on_settings(settings)

    def on_traffic_settings(self, settings: TrafficSettings) -> None:
        """Of which aircraft the pilot is warned."""
        self._settings = replace(self._settings, traffic=settings)
        if self.session is not None:
            self.session.traffic.on_settings(settings)

    def _connection_changed(self) -> None:
        self._heartbeat.beat_now()
        self._tell()

    def _gone(self, line: Line, peer: Peer) -> None:
        if self.peers.gone(line.text, peer) and self.session is not None:
            self.session.vehicle.way_gone(line.text)

    # What goes out by itself.

    def _beat(self, message: Message) -> bool:
        """To the far ends that the operator has named, and to the adopted vehicle over all ways; to nobody else."""
        session, expected, anyone = self.session, self._waited_for, False
        for line in self.lines.values():
            place = self.peers.place_at(line.text) if session else expected and expected.at(line.text)
            if place is None and not line.address.names_far_end:
                continue
            frame = line.send(message, place and place.peer)
            if frame is None:
                continue
            anyone = True
            if session is not None and session.vehicle.line is line:
                session.on_sent(frame)
            elif session is not None and place is not None:
                session.on_sent_spare(line.text, frame)
        return anyone

    @property
    def _is_guided(self) -> bool:
        return self.session is not None and self.session.pilot.is_guided

    def _may_beat(self) -> bool:
        return self._grace.may_beat(self._server_age_s(), guided=self._is_guided, now_s=time.monotonic())

    def _on_tick(self) -> None:
        if self.session is not None:
            self.session.on_tick()
            self.session.settle_ways(self.peers)
            if self._grace.wants_hold(self._server_age_s(), guided=self._is_guided, now_s=time.monotonic()):
                self.spawn(self.session.hold())
        flight = self.flight.status if self.session is None else self.session.pilot.status
        before, self._told_flight = self._told_flight, flight
        if flight != before:
            self._publish(Topic.FLIGHT, flight)
        self._tell_avoidance()
        self._tell()

    def _tell_avoidance(self) -> None:
        status = self._avoidance_expected if self.session is None else self.session.pilot.avoidance.status
        before, self._told_avoidance = self._told_avoidance, status
        if status == before:
            return
        self._publish(Topic.AVOIDANCE, status)
        if before is not None and before.state != status.state and self._is_guided:
            self.spawn(self.commands.record(AUTOPILOT, f"avoidance: {status.state}", must=False))

    def status(self) -> LinkStatus:
        now_s, vehicle, awaited = time.monotonic(), self.session and self.session.vehicle, self._lost_from_sight
        return LinkStatus(
            t_mono_s=now_s,
            connections=tuple(
                replace(line.status(), as_way=self.peers.is_as_way(text)) for text, line in self.lines.items()
            ),
            candidates=self.peers.candidates(now_s),
            adopted=vehicle.candidate if vehicle else awaited and awaited.vehicle,
            state=vehicle.link_state if vehicle else "lost" if awaited else "none",
            silent_s=vehicle.silent_s if vehicle else awaited and now_s - awaited.since_s,
            quality=vehicle.quality if vehicle else None,
            round_trip_s=vehicle.round_trip_s if vehicle else None,
            heartbeat_hz=self._heartbeat.hz(asyncio.get_running_loop().time()),
            mission_state=vehicle.onboard.state if vehicle else "unknown",
            mission_digest=vehicle.onboard.digest if vehicle else None,
            again=self.peers.again(now_s),
            signing=self.keys.status(vehicle.target[0]) if vehicle else SigningStatus(),
            warnings=(
                *(vehicle.believing.warnings(now_s) if vehicle else ()),
                *self.peers.warnings(now_s),
                *self.keys.warnings(vehicle.target[0] if vehicle else None, now_s),
                *([self.commands.trouble] if self.commands.trouble else []),
            ),
            audit_head=self.commands.head,
            audit_log=self.commands.log_id,
            ways=vehicle.ways.status(now_s) if vehicle else (),
        )

    def _tell(self) -> None:
        self._teller.offer(self.status())

    async def run_clock(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            self._on_tick()
            due_s = max(due_s + TICK_S, loop.time())
            await asyncio.sleep(due_s - loop.time())

    async def run_heartbeat(self) -> None:
        await self._heartbeat.run()

    def close(self) -> None:
        self._states.close()
        self.commands.close()
        self.release()
        for task in self._own_tasks:
            task.cancel()


@contextlib.asynccontextmanager
async def open_link(publish: Callable[[str, Published], None], **options: Any) -> AsyncIterator[Link]:
    """A link in this event loop for as long as the block lasts. ``options`` as ``Link`` takes them."""
    failure: Exception | None = None
    async with asyncio.TaskGroup() as tasks:
        link = Link(publish, tasks, **options)
        for running in (link.run_heartbeat(), link.run_clock(), link.keys.run(), link.commands.check()):
            link.spawn(running)
        try:
            yield link
        except Exception as error:  # Raised again below: the group would wrap it.
            failure = error
        finally:
            link.close()
    if failure is not None:
        raise failure
