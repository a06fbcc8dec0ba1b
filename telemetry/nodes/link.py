"""The link node: ``python -m telemetry.nodes.link --runtime DIR [--link ADDRESS]... [--grace-s S] [--audit FILE]``.

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

from telemetry.bus import Bus
from telemetry.bus.node import GIVEN_UP_S, LOOK_EVERY_S, NodeContext, run_node
from telemetry.link.answering import Answering, OperatorRight
from telemetry.link.audit import AuditLog
from telemetry.link.link import Link, open_link
from telemetry.topics.messages import Candidate, FlightStatus, Topic
from telemetry.topics.obstacles import PerceptionSettings, PerceptionStatus
from telemetry.topics.requests import LinkRequest
from telemetry.topics.tracks import TracksStatus

LOOK_EVERY_S = 0.5
PERCEPTION = (Topic.PERCEPTION_RADAR, Topic.PERCEPTION_VISION, Topic.PERCEPTION_RANGES)
UNATTENDED_S = 60.0
GIVEN_UP_S = 600.0
"""Without a server, and without a word of a vehicle that was armed."""
FIND_AGAIN_S = 30.0
"""After a restart: how long the vehicle that was adopted may take to be heard before it counts as gone."""


class LinkNode:
    def __init__(self, link: Link, context: NodeContext, file: Path) -> None:
        self._link, self._context, self._file = link, context, file
        self._memory = Memory()
        self._started_s = time.monotonic()
        self._expected = False

    async def take_up(self, memory: Memory, links: list[str]) -> None:
        """What the node before this one had; then what this one was started with."""
        adopted = memory.adopted
        for wanted in memory.connections:
            was_there = adopted is not None and adopted.address == wanted.address
            only = (adopted.system_id, adopted.component_id) if adopted is not None and was_there else None
            await self._link.connect(wanted.address, adopt=wanted.adopt or was_there, only=only)
        for address in links:
            if address not in self._link.lines:
                await self._link.connect(address, adopt=True)
        self._memory, self._expected = memory, adopted is not None
        self._link.flight.take_up(memory.flight)

    async def run(self) -> None:
        """Until nobody needs it any more: no server for a minute, and no armed vehicle that can be heard."""
        while True:
            may_end = self._may_end()
            self._context.set_replaceable(may_end)
            if self._context.unattended_s() > (UNATTENDED_S if may_end else self._patience_s()):
                return
            await self._remember()
            await asyncio.sleep(LOOK_EVERY_S)

    def _may_end(self) -> bool:
        vehicle = self._link.vehicle
        if vehicle is not None and vehicle.state.heartbeat_t_mono_s is not None:
            self._expected = False
            return not vehicle.state.armed
        return not self._is_expected

    def _patience_s(self) -> float:
        """With an armed vehicle: for ever while it is heard."""
        vehicle = self._link.vehicle
        heard_s = None if vehicle is None else vehicle.state.heartbeat_t_mono_s
        return GIVEN_UP_S if heard_s is None or time.monotonic() - heard_s > GIVEN_UP_S else math.inf

    @property
    def _is_expected(self) -> bool:
        """The vehicle of the node before this one has not been heard yet; it may be flying."""
        return self._expected and time.monotonic() - self._started_s < FIND_AGAIN_S

    async def _remember(self) -> None:
        link = self._link
        wanted = tuple(Wanted(address, link.peers.adopts_first_of(address)) for address in link.lines)
        adopted = link.peers.adopted
        if adopted is None and self._is_expected:
            adopted = self._memory.adopted
        memory = Memory(wanted, adopted, link.flight.status, link.right.highest)
        if memory != self._memory:
            self._memory = memory
            await asyncio.to_thread(write_memory, self._file, memory)


async def live(bus: Bus, context: NodeContext, *, links: list[str], grace_s: float, runtime: Path, audit: Path) -> None:
    """The whole node on an open bus."""
    file = runtime / "link.json"
    memory = await asyncio.to_thread(read_memory, file)
    right = OperatorRight(memory.highest_token)
    log = await asyncio.to_thread(AuditLog, audit)
    try:
        async with open_link(
            bus.publish, grace_s=grace_s, server_age_s=context.unattended_s, audit=log, right=right
        ) as link:
            node = LinkNode(link, context, file)
            await node.take_up(memory, links)
            await bus.serve("link", link.handle, LinkRequest)
            for topic in (*PERCEPTION, Topic.TRACKS, Topic.PERCEPTION_SETTINGS):
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
    finally:
        subscription.close()


def main() -> int:
    parser = argparse.ArgumentParser(prog="link", description="Connects to vehicles over MAVLink.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    parser.add_argument("--link", action="append", default=[], metavar="ADDRESS", help="connection to open")
    parser.add_argument("--grace-s", type=float, default=10.0, help="heartbeats go on so long without a server")
    parser.add_argument("--audit", type=Path, help="file in which every command is written down")
    options = parser.parse_args()
    runtime: Path = options.runtime
    audit: Path = options.audit or runtime.parent / "audit.jsonl"

    async def node(bus: Bus, context: NodeContext) -> None:
        await live(bus, context, links=options.link, grace_s=options.grace_s, runtime=runtime, audit=audit)

    return run_node("link", runtime, node)


if __name__ == "__main__":
    sys.exit(main())
