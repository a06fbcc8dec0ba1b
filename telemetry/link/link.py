"""The link: every connection, the one adopted vehicle, and the answers to all requests.

It checks limits and the operator's right for every command itself: nothing in front of it is trusted with that.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.link.audit import AUTOPILOT, Audit, CommandLog
from telemetry.link.heartbeat import Grace, Heartbeat
from telemetry.link.line import Line
from telemetry.link.peers import Peers, Source
from telemetry.link.publishing import StatePublisher, StatusTeller
from telemetry.link.session import Around, Session
from telemetry.mavlink.actions import Message
from telemetry.mavlink.address import parse_address
from telemetry.mavlink.connections import Peer
from telemetry.mavlink.flight_keeper import FlightKeeper
from telemetry.mavlink.ranges import RangeReader
from telemetry.topics.messages import Candidate, FlightStatus, LinkStatus, Published, Topic
from telemetry.topics.obstacles import AvoidanceStatus, PerceptionSettings, PerceptionStatus
from telemetry.topics.tracks import TracksStatus

TICK_S = 0.05
READ_BACK_AFTER_S = (0.0, 5.0, 15.0)
ALERT = 1
"""MAV_SEVERITY"""
AUTOPILOT = Operator("link", 0)
"""Who is named in the audit log for what the link does by itself."""


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
        right: OperatorRight | None = None,
    ) -> None:
        self.publish, self.right = publish, right or OperatorRight()
        self.peers, self.lines = Peers(), dict[str, Line]()
        self.flight = FlightKeeper()
        self.vehicle: AdoptedVehicle | None = None
        self.pilot: Pilot | None = None
        self.transfers: Transfers | None = None
        self._tasks, self._running = tasks, dict[str, asyncio.Task[None]]()
        self._own_tasks: set[asyncio.Task[None]] = set()
        self.trail = Trail(audit, lambda record: publish(Topic.COMMAND, record), self.flight.say)
        self._grace, self._server_age_s = Grace(grace_s), server_age_s
        self._heartbeat = Heartbeat(self._beat, self._may_beat)
        self._states = StatePublisher(lambda state: publish(Topic.VEHICLE, state))
        self._teller = StatusTeller(lambda status: publish(Topic.LINK, status))
        self._told_flight: FlightStatus | None = None
        self._told_avoidance: AvoidanceStatus | None = None
        self._settings: PerceptionSettings | None = None
        self._answering, self._ranges = Answering(self), RangeReader()

    # Requests.

    async def handle(self, request: LinkRequest) -> object:
        """What ``telemetry.requests`` promises for each; errors are DescribedErrors."""
        return await self._answering.answer(request)

    async def connect(self, address: str, *, adopt: bool, only: tuple[int, int] | None = None) -> None:
        """Opens a connection and keeps it open; ``only``: adopt no other system and component."""
        parsed = parse_address(address)
        text = parsed.text
        self.peers.adopt_first_of(text, wanted=adopt, only=only)
        if text in self.lines:
            return
        line = Line(parsed, heard=self._heard, gone=self._gone, changed=self._tell, clock=time.monotonic)
        self.lines[text] = line
        self._running[text] = self.spawn(line.connection.run())
        self._tell()

    def disconnect(self, address: str) -> None:
        text = parse_address(address).text
        if text not in self.lines:
            raise NotAllowedError(f"There is no connection {text}.")
        if self.vehicle is not None and self.vehicle.line.text == text:
            self.release()
        self.peers.forget(text)
        del self.lines[text]
        self._running.pop(text).cancel()
        self._tell()

    def adopt(self, candidate: Candidate) -> None:
        if self.vehicle is not None and self.vehicle.candidate == candidate:
            return
        self.release(forget_wish=False)
        self.peers.adopt(candidate, time.monotonic())
        telling = Telling(
            state=self._on_state,
            text=self._on_text,
            unsure=self._read_back,
            sent=self._on_sent,
            ordered=self._on_order,
        )
        vehicle = AdoptedVehicle(candidate, self.lines[candidate.address], telling, time.monotonic)
        self.vehicle = vehicle
        self.transfers = transfers = Transfers(vehicle, lambda status: self.publish(Topic.TRANSFER, status))

        async def read_parameter(name: str) -> float | None:
            return (await transfers.read_parameters((name,)))[name]

        self.pilot = Pilot(
            vehicle,
            self.flight,
            spawn=self.spawn,
            read_parameter=read_parameter,
            read_mission=lambda: transfers.download(own_idea=True),
            alarm=self._alarm,
        )
        if self._settings is not None:
            self.pilot.avoidance.on_settings(self._settings)
        vehicle.send_first()
        self._tell()
        self._read_back()

    def release(self, *, forget_wish: bool = True) -> None:
        if self.pilot is not None and self.vehicle is not None:
            self.pilot.close()
            self.vehicle.exchanges.give_up()
            self.flight.forget()
        if forget_wish:
            self.peers.release()
        self.vehicle = self.pilot = self.transfers = None
        self._tell()

    def need_vehicle(self, *, live: bool = True) -> tuple[AdoptedVehicle, Pilot, Transfers]:
        """Raises NoVehicleError; ``live``: also when the link to it is lost."""
        if self.vehicle is None or self.pilot is None or self.transfers is None:
            advice = "Connect to it and adopt it first."
            raise NoVehicleError("No vehicle is adopted.", advice=advice)
        if live and self.vehicle.link_state == "lost":
            what = f"The link to the vehicle is lost: nothing was heard for {self.vehicle.silent_s:.0f} s."
            raise NoVehicleError(what, advice="Wait until it is heard again.")
        return self.vehicle, self.pilot, self.transfers

    def spawn(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = self._tasks.create_task(coroutine)
        self._own_tasks.add(task)
        task.add_done_callback(self._own_tasks.discard)
        return task

    # What comes in.

    def _heard(self, line: Line, source: Source, message: Message) -> None:
        now_s, t_utc_s = time.monotonic(), time.time()
        verdict = self.peers.hear(source, message, now_s)
        if verdict == "stranger" and self.peers.wants(source, message):
            candidate = self.peers.find(source.id, now_s)
            if candidate is not None:
                self.adopt(candidate)
                verdict = "adopted"
        if verdict in ("adopted", "moved") and self.vehicle is not None:
            if verdict == "moved" and self.peers.adopted is not None:
                self.vehicle.moved(self.peers.adopted)
            self.publish(Topic.RAW, RawFrame(t_utc_s, False, line.text, bytes(message.get_msgbuf())))
            self.vehicle.on_message(message, t_utc_s)
            heading_rad = self.vehicle.state.heading_rad
            ranges = self._ranges.on_message(message, heading_rad=heading_rad, t_mono_s=now_s, t_utc_s=t_utc_s)
            if ranges is not None:
                self.publish(Topic.RANGE_FRAME, ranges)
            if self.pilot is not None:
                self.pilot.avoidance.on_message(message)
        elif verdict == "stranger" and self.vehicle is not None and line is self.vehicle.line:
            self.vehicle.on_foreign(message)

    def on_perception(self, status: PerceptionStatus) -> None:
        """What a sensor's node says about the regions ahead."""
        if self.pilot is not None:
            self.pilot.avoidance.on_perception(status)

    def on_tracks(self, status: TracksStatus) -> None:
        """What moves or stands around, and how far away known ground is."""
        if self.pilot is not None:
            self.pilot.avoidance.on_tracks(status)

    def on_settings(self, settings: PerceptionSettings) -> None:
        """How deep the regions are, and how large the vehicle is."""
        self._settings = settings
        if self.pilot is not None:
            self.pilot.avoidance.on_settings(settings)

    def _gone(self, line: Line, peer: Peer) -> None:
        self.peers.gone(line.text, peer)

    def _on_state(self, state: VehicleState) -> None:
        self._states.offer(state)
        if self.pilot is not None:
            self.pilot.avoidance.on_state(state)

    def _on_order(self, message: Message) -> None:
        if self.pilot is not None:
            self.pilot.avoidance.on_order(message)

    def _on_text(self, severity: int, text: str) -> None:
        self.publish(Topic.TEXT, VehicleText(time.time(), severity, text))

    def _alarm(self, text: str) -> None:
        """What the pilot must hear at once; what is done about it is written down."""
        self._on_text(ALERT, text)
        self.spawn(self.trail.record(AUTOPILOT, f"hold: {text}", must=False))

    def _on_sent(self, frame: bytes) -> None:
        assert self.vehicle is not None
        self.publish(Topic.RAW, RawFrame(time.time(), True, self.vehicle.line.text, frame))

    def _read_back(self) -> None:
        """What is on board is not known: say so, and find out, if nobody is flying by it."""
        self._tell()
        if self.transfers is not None and self.vehicle is not None and not self.vehicle.state.armed:
            self.spawn(self._read_back_quietly(self.transfers))

    async def _read_back_quietly(self, transfers: Transfers) -> None:
        """A vehicle that has just been switched on may not answer at first."""
        for pause_s in READ_BACK_AFTER_S:
            await asyncio.sleep(pause_s)
            if transfers is not self.transfers or transfers.is_busy or transfers.knows_mission:
                return
            # What goes wrong here is seen by mission_state, which stays unknown.
            with contextlib.suppress(TelemetryError):
                await transfers.download(own_idea=True)

    # What goes out by itself.

    def _beat(self, message: Message) -> bool:
        """To the far ends that the operator has named, and to the adopted vehicle; to nobody else."""
        vehicle = self.vehicle
        anyone = False
        for line in self.lines.values():
            peer = vehicle.candidate.peer if vehicle is not None and vehicle.line is line else None
            if peer is None and not line.address.names_far_end:
                continue
            frame = line.send(message, peer)
            if frame is not None:
                anyone = True
                if peer is not None:
                    self._on_sent(frame)
        return anyone

    @property
    def _is_guided(self) -> bool:
        return self.pilot is not None and self.pilot.is_guided

    def _may_beat(self) -> bool:
        return self._grace.may_beat(self._server_age_s(), guided=self._is_guided, now_s=time.monotonic())

    def _on_tick(self) -> None:
        if self.vehicle is not None and self.pilot is not None:
            self.vehicle.on_tick()
            self.pilot.on_tick()
            if self._grace.wants_hold(self._server_age_s(), guided=self._is_guided, now_s=time.monotonic()):
                self.spawn(self._hold(self.pilot))
        if self.flight.status != self._told_flight:
            self._told_flight = self.flight.status
            self.publish(Topic.FLIGHT, self.flight.status)
        self._tell_avoidance()
        self._tell()

    def _tell_avoidance(self) -> None:
        status = AvoidanceStatus() if self.pilot is None else self.pilot.avoidance.status
        before, self._told_avoidance = self._told_avoidance, status
        if status == before:
            return
        self.publish(Topic.AVOIDANCE, status)
        if before is not None and before.state != status.state and self._is_guided:
            self.spawn(self.trail.record(AUTOPILOT, f"avoidance: {status.state}", must=False))

    async def _hold(self, pilot: Pilot) -> None:
        with contextlib.suppress(TelemetryError):
            await self.trail.record(AUTOPILOT, "hold: the console is gone", must=False)
            await pilot.hold()

    def status(self) -> LinkStatus:
        now_s, vehicle = time.monotonic(), self.vehicle
        return LinkStatus(
            t_mono_s=now_s,
            connections=tuple(line.status() for line in self.lines.values()),
            candidates=self.peers.candidates(now_s),
            adopted=vehicle.candidate if vehicle else None,
            state=vehicle.link_state if vehicle else "none",
            silent_s=vehicle.silent_s if vehicle else None,
            quality=vehicle.quality if vehicle else None,
            round_trip_s=vehicle.round_trip_s if vehicle else None,
            heartbeat_hz=self._heartbeat.hz(asyncio.get_running_loop().time()),
            mission_state=vehicle.onboard.state if vehicle else "unknown",
            mission_digest=vehicle.onboard.digest if vehicle else None,
            warnings=self.peers.warnings(now_s),
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
        self.trail.close()
        self.release()
        for task in self._own_tasks:
            task.cancel()


@contextlib.asynccontextmanager
async def open_link(publish: Callable[[str, Published], None], **options: Any) -> AsyncIterator[Link]:
    """A link in this event loop for as long as the block lasts. ``options`` as ``Link`` takes them."""
    failure: Exception | None = None
    async with asyncio.TaskGroup() as tasks:
        link = Link(publish, tasks, **options)
        link.spawn(link.run_heartbeat())
        link.spawn(link.run_clock())
        try:
            yield link
        except Exception as error:  # Raised again below: the group would wrap it.
            failure = error
        finally:
            link.close()
    if failure is not None:
        raise failure
