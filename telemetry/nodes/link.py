"""The link node: ``python -m telemetry.nodes.link --runtime DIR [--link ADDRESS]... [--grace-s S] [--data DIR]``.

It outlives the server: vehicles keep their heartbeat for the grace time, and a new server finds everything as it was.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from telemetry.bus.bus import Bus
from telemetry.bus.node import GIVEN_UP_S, LOOK_EVERY_S, NodeContext, run_node
from telemetry.link.answering import Answering, OperatorRight
from telemetry.link.audit import AUDIT_FILE, open_audit
from telemetry.link.keys import audit_key_file, signing_key_file
from telemetry.link.link import Link, open_link
from telemetry.link.onboard import Started
from telemetry.link.peers import Expected
from telemetry.link.signatures import KeyRing
from telemetry.topics.messages import Candidate, FlightStatus, Topic
from telemetry.topics.obstacles import AvoidBy, PerceptionSettings, PerceptionStatus
from telemetry.topics.requests import LinkRequest, SetAvoidance, StartAuto, TakeUp
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.traffic import TrafficSettings

PERCEPTION = (Topic.PERCEPTION_RADAR, Topic.PERCEPTION_VISION, Topic.PERCEPTION_RANGES)
FIND_AGAIN_S = 30.0
"""After a restart: how long the vehicle that was adopted may take to be heard before it counts as gone."""


@dataclass(frozen=True, slots=True)
class Wanted:
    address: str
    adopt: bool
    """The first autopilot heard there is to be adopted."""
    as_way: bool = False
    """It may be another way to the adopted vehicle."""


@dataclass(frozen=True, slots=True)
class Memory:
    """What a link node writes down so that the next one, after a crash, takes up where it ended."""

    connections: tuple[Wanted, ...] = ()
    adopted: Candidate | None = None
    flight: FlightStatus = field(default_factory=FlightStatus)
    highest_token: int = 0
    may_fly: bool = True
    """The vehicle was not known to be disarmed."""
    avoid_by: AvoidBy | None = None
    """Avoidance is on for the adopted vehicle, its operator has consented; None: off, or its pilot has taken over."""
    ways: tuple[Candidate, ...] = ()
    """Where the adopted vehicle was reached, one for each connection."""
    started: Started = field(default_factory=Started)
    """The mission of the flight that is under way."""


def read_memory(file: Path) -> Memory:
    """An empty one when there is none that can be read: then the operator connects again."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Memory)
    except (OSError, msgspec.MsgspecError):
        return Memory()


def write_memory(file: Path, memory: Memory) -> None:
    """Whole or not at all. A disk that is full costs the memory of a crash, nothing else."""
    new = file.with_suffix(".new")
    with contextlib.suppress(OSError):
        new.write_bytes(msgspec.json.encode(memory))
        os.replace(new, file)


class LinkNode:
    def __init__(self, link: Link, right: OperatorRight, context: NodeContext, file: Path) -> None:
        self._link, self._right, self._context, self._file = link, right, context, file
        self._memory = Memory()
        self._started_s = time.monotonic()
        self._expected = False

    async def take_up(self, memory: Memory, links: list[str]) -> None:
        """What the node before this one had; then what this one was started with. Whoever else is heard first while a
        vehicle is missed is not adopted in its stead.
        """
        adopted = memory.adopted
        if adopted is not None:
            now_s = time.monotonic()
            expected = Expected(adopted, now_s, memory.may_fly, memory.avoid_by, memory.ways, memory.started)
            self._link.expect(expected)
        before = {place.address: place for place in (*([adopted] if adopted else []), *memory.ways)}
        for wanted in memory.connections:
            only = before.get(wanted.address)
            adopt = wanted.adopt if adopted is None else only is not None
            await self._link.connect(wanted.address, adopt=adopt, only=only, as_way=wanted.as_way)
        for address in links:
            if address not in self._link.lines:
                await self._link.connect(address, adopt=adopted is None, as_way=len(links) > 1)
        self._memory, self._expected = memory, adopted is not None
        self._link.flight.take_up(memory.flight)

    async def run(self) -> None:
        """Until nobody needs it any more: no server for a minute, and no armed vehicle that can be heard."""
        remembering = self._link.spawn(self._keep_remembering())
        while self._is_needed():
            await asyncio.sleep(LOOK_EVERY_S)
        remembering.cancel()

    async def _keep_remembering(self) -> None:
        """Beside what proves that the node is alive: a slow disk holds up no more than this."""
        while True:
            await self.remember()
            await asyncio.sleep(LOOK_EVERY_S)

    def _is_needed(self) -> bool:
        """With an armed vehicle: for ever while it is heard, and for long when it is not."""
        may_end, session = self._may_end(), self._link.session
        self._context.set_replaceable(may_end)
        if may_end:
            return self._context.is_needed()
        heard_s = None if session is None else session.vehicle.state.heartbeat_t_mono_s
        return self._context.is_needed(heard_s) or self._context.unattended_s() < GIVEN_UP_S

    def _may_end(self) -> bool:
        session = self._link.session
        if session is not None and session.vehicle.state.heartbeat_t_mono_s is not None:
            self._expected = False
            return not session.vehicle.state.armed
        return not self._is_expected

    @property
    def _is_expected(self) -> bool:
        """The vehicle of the node before this one has not been heard yet; it may be flying."""
        return self._expected and time.monotonic() - self._started_s < FIND_AGAIN_S

    async def remember(self) -> None:
        link = self._link
        peers = link.peers
        wanted = tuple(
            Wanted(address, peers.adopts_first_of(address), peers.is_as_way(address)) for address in link.lines
        )
        adopted, ways = peers.adopted, peers.places
        if adopted is None and self._is_expected:
            adopted, ways = self._memory.adopted, self._memory.ways
        elif adopted is None:
            self._link.give_up_expected()
        memory = Memory(
            wanted,
            adopted,
            link.flight.status,
            self._right.highest,
            link.may_fly,
            link.avoids_by,
            ways,
            link.started,
        )
        if memory != self._memory:
            self._memory = memory
            await asyncio.to_thread(write_memory, self._file, memory)


async def live(bus: Bus, context: NodeContext, *, links: list[str], grace_s: float, runtime: Path, data: Path) -> None:
    """The whole node on an open bus."""
    file = runtime / "link.json"
    memory = await asyncio.to_thread(read_memory, file)
    right = OperatorRight(memory.highest_token)
    log = await asyncio.to_thread(open_audit, data / AUDIT_FILE, audit_key_file(data))
    keys = await asyncio.to_thread(KeyRing, signing_key_file(data))
    try:
        async with open_link(
            bus.publish, grace_s=grace_s, server_age_s=context.unattended_s, audit=log, keys=keys
        ) as link:
            node = LinkNode(link, right, context, file)
            await node.take_up(memory, links)
            answering = Answering(link, right)

            async def answer(request: LinkRequest) -> object:
                answered = await answering.answer(request)
                if isinstance(request, SetAvoidance | StartAuto | TakeUp):
                    await node.remember()  # what protects the vehicle outlives this node from now on
                return answered

            await bus.serve("link", answer, LinkRequest)
            for topic in (*PERCEPTION, Topic.TRACKS, Topic.PERCEPTION_SETTINGS, Topic.TRAFFIC_SETTINGS):
                link.spawn(_listen(bus, link, topic))
            await node.run()
    finally:
        log.close()


async def _listen(bus: Bus, link: Link, topic: str) -> None:
    """The newest word of each sensor: what is older says nothing any more."""
    subscription = bus.subscribe(topic)
    try:
        async for _, message in subscription:
            if isinstance(message, PerceptionStatus):
                link.on_perception(message)
            elif isinstance(message, TracksStatus):
                link.on_tracks(message)
            elif isinstance(message, PerceptionSettings):
                link.on_settings(message)
            elif isinstance(message, TrafficSettings):
                link.on_traffic_settings(message)
    finally:
        subscription.close()


def main() -> int:
    parser = argparse.ArgumentParser(prog="link", description="Connects to vehicles over MAVLink.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    parser.add_argument("--link", action="append", default=[], metavar="ADDRESS", help="connection to open")
    parser.add_argument("--grace-s", type=float, default=10.0, help="heartbeats go on so long without a server")
    parser.add_argument("--data", type=Path, help="where keys and the log of commands are; else beside the runtime")
    options = parser.parse_args()
    runtime: Path = options.runtime
    data: Path = options.data or runtime.parent

    async def node(bus: Bus, context: NodeContext) -> None:
        await live(bus, context, links=options.link, grace_s=options.grace_s, runtime=runtime, data=data)

    return run_node("link", runtime, node)


if __name__ == "__main__":
    sys.exit(main())
