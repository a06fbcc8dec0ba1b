"""A recorded flight through the link's own code: the frames that the vehicle sent then, at the times they came.

What the link asks is answered by the recording; what it asks of the mission on board, by the mission that was on board.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from unittest.mock import patch

from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.basics.plan_model import Firmware, Mission
from planning.formats.wpl import read_wpl
from telemetry.errors import NotAllowedError
from telemetry.flight.guided.script_targets import guided_plan
from telemetry.link.answering import Answering, OperatorRight
from telemetry.link.line import Line
from telemetry.link.link import TICK_S, Link
from telemetry.link.peers import Source
from telemetry.link.piloting.procedures import OPTIONS, STRAIGHT_LEGS
from telemetry.mavlink.address import parse_address
from telemetry.mavlink.codec import Packer, Parser
from telemetry.mavlink.items import item_message, items_from_mission
from telemetry.mavlink.verify import digest
from telemetry.recording.mcap_files.reader import Entry, open_recording
from telemetry.topics.messages import (
    CommandRecord,
    ConnectionStatus,
    FlightStatus,
    PlanRecord,
    Published,
    RawFrame,
    Topic,
)
from telemetry.topics.obstacles import AvoidanceStatus, PerceptionSettings, PerceptionStatus
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.requests import Operator, SetAvoidance, StartAuto, StartGuided
from telemetry.topics.vehicle import VehicleState

ADDRESS, PEER = "udpin:127.0.0.1:14550", "127.0.0.1:14551"
ME = Operator("Ann", 1)
TURNS = 12
"""So often the event loop goes round after each frame: what waits for an answer has asked its next question by then."""
REPLAYED = frozenset(
    {Topic.RAW, Topic.COMMAND, Topic.PLAN, Topic.PERCEPTION_SETTINGS, Topic.AVOIDANCE, Topic.PERCEPTION_RADAR}
)


class RecordedLine:
    """Stands for the connection; answers what is asked of the mission on board."""

    def __init__(self, text: str) -> None:
        self.address, self.text = parse_address(text), text
        self.sent: list[Any] = []
        self.answers: list[Any] = []
        self.onboard: OnboardMission | None = None
        self._packer = Packer()

    def send(self, message: Any, peer: Any = None) -> bytes | None:
        self.sent.append(message)
        self.answers += self._answer(message)
        return self._packer.pack(message)

    def status(self) -> ConnectionStatus:
        return ConnectionStatus(self.text, "open")

    def _answer(self, message: Any) -> list[Any]:
        items = self.onboard.items if self.onboard else ()
        kind, station = message.get_type(), (255, wire.MAV_COMP_ID_MISSIONPLANNER)
        if kind == "MISSION_REQUEST_LIST":
            return [wire.MAVLink_mission_count_message(*station, len(self._rows(items)), 0)]
        if kind == "MISSION_REQUEST_INT":
            row = self._rows(items)[message.seq]
            firmware: Firmware = "ardupilot" if self.has_home_row else "px4"
            return [item_message(row, message.seq, target=station, number=message.seq, firmware=firmware)]
        if kind == "PARAM_REQUEST_READ" and message.param_id.rstrip("\0") == OPTIONS:
            # In GUIDED the recorded vehicles were sent places alone.
            name, number = OPTIONS.encode(), wire.MAV_PARAM_TYPE_INT32
            return [wire.MAVLink_param_value_message(name, STRAIGHT_LEGS, number, 1, 0)]
        return []

    def _rows(self, items: tuple[Item, ...]) -> tuple[Item, ...]:
        return (Item(16, 0, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0), *items) if self.has_home_row and items else items

    has_home_row = True


class ReplayedLink:
    """``told``: when the flight's status changed, in seconds from the recording's start, and to what."""

    def __init__(self) -> None:
        self.told: list[tuple[float, FlightStatus]] = []
        self.states: list[tuple[float, VehicleState]] = []
        self.failures: list[BaseException] = []
        self.now_s = self.start_utc_s = self.mono_minus_utc_s = 0.0
        self.line = RecordedLine(ADDRESS)
        self.link: Link
        self._mission: Mission | None = None
        self._avoids = False
        self._parser, self._ticked_s = Parser(datagrams=True), 0.0
        self._packer = Packer(1, 1)
        self._tasks: set[asyncio.Task[Any]] = set()

    @property
    def flight(self) -> FlightStatus:
        return self.link.flight.status

    def publish(self, topic: str, message: Published) -> None:
        if isinstance(message, FlightStatus):
            self.told.append((self.now_s - self.start_utc_s, message))
        elif isinstance(message, VehicleState):
            self.states.append((self.now_s - self.start_utc_s, message))

    async def replay(self, path: Path) -> None:
        with open_recording(path) as recording:
            self.now_s = self.start_utc_s = recording.start_utc_s
            self.mono_minus_utc_s = recording.mono_minus_utc_s
            async with self._linked():
                for entry in recording.entries(REPLAYED):
                    await self._until(entry.t_utc_s)
                    self._take(entry)
                    await self._turn()
                await self._until(self.now_s + 5 * TICK_S)

    @contextlib.asynccontextmanager
    async def _linked(self) -> AsyncIterator[None]:
        monotonic_s = lambda: self.now_s + self.mono_minus_utc_s  # noqa: E731
        with patch("time.monotonic", monotonic_s), patch("time.time", lambda: self.now_s):
            async with asyncio.TaskGroup() as tasks:
                self.link = Link(self.publish, tasks)
                self.link.lines[ADDRESS] = cast(Line, self.line)
                self.link.peers.adopt_first_of(ADDRESS, wanted=True)
                yield
                for task in self._tasks:
                    task.cancel()
                self.link.close()

    async def _until(self, t_utc_s: float) -> None:
        self.now_s = max(self.now_s, t_utc_s)
        if self.now_s - self._ticked_s >= TICK_S:
            self._ticked_s = self.now_s
            if self._avoids and self.link.session is not None:  # it had been switched on before the recording began
                # The vehicle obeyed the avoidance of then: today's may take what it did for the pilot's doing.
                with contextlib.suppress(NotAllowedError):
                    self.link.session.pilot.avoidance.enable()
                self._avoids = False
            self.link._on_tick()
            await self._turn()

    async def _turn(self) -> None:
        """Until what is under way waits for the recording again."""
        for _ in range(TURNS):
            answers, self.line.answers = self.line.answers, []
            for answer in answers:
                self._hear(self._packer.pack(answer))
            await asyncio.sleep(0)

    def _take(self, entry: Entry) -> None:
        message = entry.message
        if isinstance(message, RawFrame):
            if not message.sent:
                self._hear(message.frame)
        elif isinstance(message, PlanRecord):
            self._take_plan(message)
        elif isinstance(message, CommandRecord):
            self._command(message.words)
        elif isinstance(message, PerceptionSettings):
            self.link.on_settings(message)
        elif isinstance(message, PerceptionStatus):
            self.link.on_perception(message)
        elif isinstance(message, AvoidanceStatus):
            self._avoids |= message.state == "watching"

    def _hear(self, frame: bytes) -> None:
        for message in self._parser.feed(frame):
            source = Source(ADDRESS, PEER, message.get_srcSystem(), message.get_srcComponent())
            self.link._heard(cast(Line, self.line), source, message)

    def _take_plan(self, plan: PlanRecord) -> None:
        """Written down when the mission had been uploaded and read back."""
        self._mission = replace(read_wpl(plan.mission_wpl), firmware=plan.firmware)
        items = items_from_mission(self._mission)
        self.line.onboard = OnboardMission(items, None, None, None, digest(items))
        self.line.has_home_row = plan.firmware == "ardupilot"
        assert self.link.session is not None
        self.link.session.vehicle.onboard.transfer_ends(self.line.onboard, self.now_s + self.mono_minus_utc_s)

    def _command(self, words: str) -> None:
        if words.startswith("start mission"):
            assert self.line.onboard is not None
            self._ask(StartAuto(ME, self.line.onboard.digest, from_item=int(words.split()[-1])))
        elif "targets in GUIDED" in words:
            assert self._mission is not None
            plan = guided_plan(self._mission)
            self._ask(StartGuided(ME, plan.targets, plan.takeoff_alt_rel_home_m, end=plan.end))
        elif words.startswith("avoidance on"):
            self._ask(SetAvoidance(ME, enabled=True, consent=True))

    def _ask(self, request: Any) -> None:
        task = asyncio.get_running_loop().create_task(Answering(self.link, OperatorRight()).answer(request))
        self._tasks.add(task)
        task.add_done_callback(self._note)

    def _note(self, task: asyncio.Task[Any]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self.failures.append(error)


def replayed(path: Path) -> ReplayedLink:
    link = ReplayedLink()
    asyncio.run(link.replay(path))
    return link


def received(path: Path) -> Iterator[tuple[float, Any]]:
    """What the vehicle sent, with seconds from the recording's start: the truth that the link's words are held to."""
    parser = Parser(datagrams=True)
    with open_recording(path) as recording:
        for entry in recording.entries({Topic.RAW}):
            assert isinstance(entry.message, RawFrame)
            if not entry.message.sent:
                for message in parser.feed(entry.message.frame):
                    yield entry.t_utc_s - recording.start_utc_s, message
