"""The bus as one process sees it: publishing, subscribing, who gets what, and no open port."""

import asyncio
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.errors import BusError
from telemetry.topics.messages import PlanRecord, RawFrame, ServerAlive, Topic, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.bus_runs import run, short_folder


@pytest.fixture
def folder() -> Iterator[Path]:
    with short_folder() as short:
        yield short / "run"


def state(system_id: int) -> VehicleState:
    return VehicleState(system_id=system_id, component_id=1)


def text(number: int) -> VehicleText:
    return VehicleText(float(number), 6, f"text {number}")


def plan(size: int) -> PlanRecord:
    return PlanRecord(0.0, "name", "w" * size, "", "px4", "", "", "", None, None, "", "")


def open_inet_sockets() -> set[str]:
    """Inodes of this process's TCP and UDP sockets."""
    mine = set()
    for fd in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{fd}")
        except OSError:
            continue
        if target.startswith("socket:["):
            mine.add(target[8:-1])
    tables = [Path("/proc/net") / name for name in ("tcp", "tcp6", "udp", "udp6", "raw", "raw6")]
    rows = [row.split() for table in tables if table.exists() for row in table.read_text().splitlines()[1:]]
    return mine & {row[9] for row in rows}


def test_a_message_reaches_every_subscriber(folder: Path) -> None:
    async def whole() -> None:
        async with (
            await Bus.open(folder, "link") as link,
            await Bus.open(folder, "server") as server,
            await Bus.open(folder, "cli-1") as command,
        ):
            readers = [server.subscribe("vehicle/*"), command.subscribe("**"), link.subscribe(Topic.VEHICLE)]
            link.publish(Topic.VEHICLE, state(7))
            for reader in readers:
                assert await anext(reader) == (Topic.VEHICLE, state(7))

    run(whole)


@pytest.mark.parametrize("names", [("link", "server"), ("server", "link"), ("cli-1", "link"), ("a", "b")])
def test_publisher_and_subscriber_may_come_in_any_order(folder: Path, names: tuple[str, str]) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, names[0]) as first:
            before = first.subscribe(Topic.VEHICLE)
            first.publish(Topic.PLAN, plan(10))
            async with await Bus.open(folder, names[1]) as second:
                second.publish(Topic.VEHICLE, state(3))
                late = second.subscribe("plan/*")
                assert await anext(before) == (Topic.VEHICLE, state(3))
                assert await anext(late) == (Topic.PLAN, plan(10))

    run(whole)


async def acquainted(one: Bus, other: Bus) -> None:
    """Until each knows what the other hears: before that, all is sent to who has just joined."""
    meetings = (one, other, Topic.PLAN, plan(1)), (other, one, Topic.SERVER, ServerAlive(0.0, 1))
    for here, there, topic, message in meetings:
        heard = there.subscribe(topic)
        here.publish(topic, message)
        assert await anext(heard) == (topic, message)
        heard.close()


def test_a_late_subscriber_gets_the_last_value_once_and_no_old_events(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "recorder") as recorder:
            await acquainted(link, recorder)
            link.publish(Topic.VEHICLE, state(1))
            link.publish(Topic.TEXT, text(1))
            link.publish(Topic.VEHICLE, state(2))
            late = recorder.subscribe("vehicle/*", keep_all=True)
            assert await anext(late) == (Topic.VEHICLE, state(2))
            link.publish(Topic.TEXT, text(2))
            assert await anext(late) == (Topic.TEXT, text(2))

    run(whole)


def test_a_replay_has_names_of_its_own(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "replay") as replay, await Bus.open(folder, "server") as server:
            live, played = server.subscribe("vehicle/*"), server.subscribe("replay/**")
            replay.publish("replay/vehicle/state", state(4))
            assert await anext(played) == ("replay/vehicle/state", state(4))
            replay.publish(Topic.VEHICLE, state(5))
            assert await anext(live) == (Topic.VEHICLE, state(5))

    run(whole)


def test_latest_wins_for_who_reads_slowly(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "server") as server:
            slow = server.subscribe(Topic.VEHICLE)
            through = server.subscribe(Topic.VEHICLE, keep_all=True)
            for number in range(100):
                link.publish(Topic.VEHICLE, state(number))
            async for _, message in through:
                if message == state(99):
                    break
            # Both subscriptions have threads of their own: what waits is the newest at some moment, and one only.
            found = []
            while not found or found[-1] != state(99):
                found.append((await anext(slow))[1])
            assert len(found) < 100

    run(whole)


def test_keep_all_is_bounded_drops_the_oldest_and_counts(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "recorder") as recorder:
            small, large = (recorder.subscribe(Topic.TEXT, keep_all=True, limit=limit) for limit in (10, 1000))
            link.publish(Topic.VEHICLE, state(1))
            # Declared after them: once it hears anything they are known, too. A kept message may come twice.
            assert (await anext(recorder.subscribe(Topic.VEHICLE)))[0] == Topic.VEHICLE
            for number in range(200):
                link.publish(Topic.TEXT, text(number))
            assert [(await anext(large))[1] for _ in range(200)] == [text(number) for number in range(200)]
            assert large.dropped == 0
            while small.dropped < 190:
                await asyncio.sleep(0.01)
            assert [(await anext(small))[1] for _ in range(10)] == [text(number) for number in range(190, 200)]
            assert small.dropped == 190

    run(whole)


def test_a_large_message_arrives_and_does_not_hold_up_its_publisher(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "server") as server, await Bus.open(folder, "recorder") as recorder:
            before = recorder.subscribe("**", keep_all=True)
            server.publish(Topic.PLAN, plan(20_000_000))
            assert await anext(before) == (Topic.PLAN, plan(20_000_000))
            late = recorder.subscribe(Topic.PLAN)
            assert await anext(late) == (Topic.PLAN, plan(20_000_000))

    run(whole)


def test_thousands_of_small_messages_arrive_in_order(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "recorder") as recorder:
            reader = recorder.subscribe("**", keep_all=True, limit=10_000)
            # Frames are not kept for late readers: a kept message shows that the way to this one is open.
            link.publish(Topic.VEHICLE, state(1))
            await anext(reader)
            for number in range(4000):
                link.publish(Topic.RAW, RawFrame(float(number), False, "udp", bytes(60)))
                if number % 100 == 0:
                    await asyncio.sleep(0)
            frames = []
            while len(frames) < 4000:
                name, message = await anext(reader)
                # The kept message may come once more, as the answer to who came late.
                frames += [message] if name == Topic.RAW else []
            assert frames == [RawFrame(float(number), False, "udp", bytes(60)) for number in range(4000)]

    run(whole)


def test_it_opens_no_port(folder: Path) -> None:
    before = open_inet_sockets()

    async def whole() -> set[str]:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "server") as server:
            reader = server.subscribe("**")
            link.publish(Topic.VEHICLE, state(1))
            await anext(reader)
            return open_inet_sockets()

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as seen:
        seen.bind(("127.0.0.1", 0))
        assert len(open_inet_sockets() - before) == 1  # so it would be noticed
    assert run(whole) <= before


def test_its_directory_is_private(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link"):
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        folder.chmod(0o755)
        with pytest.raises(BusError, match=r"Other users can enter .* chmod 700"):
            await Bus.open(folder, "link")

    run(whole)


def test_a_name_is_taken_only_once(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link"):
            with pytest.raises(BusError, match="'link' on the bus is taken"):
                await Bus.open(folder, "link")
        async with await Bus.open(folder, "link"):
            pass

    run(whole)


@pytest.mark.parametrize("name", ["", "../link", "a/b", "a" * 21, "näme", "*"])
def test_a_name_must_be_plain(folder: Path, name: str) -> None:
    with pytest.raises(BusError, match="cannot be a name"):
        run(lambda: Bus.open(folder, name))


def test_a_topic_carries_its_type_only(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "link") as link:
            with pytest.raises(BusError, match="vehicle/state carries VehicleState, not VehicleText"):
                link.publish(Topic.VEHICLE, text(1))
            with pytest.raises(BusError, match="no topic 'vehicle/altitude'"):
                link.publish("vehicle/altitude", text(1))

    run(whole)


def test_closing_ends_what_waits(folder: Path) -> None:
    async def whole() -> None:
        bus = await Bus.open(folder, "link")
        async with asyncio.TaskGroup() as group:
            waiting = group.create_task(_read_to_the_end(bus))
            await asyncio.sleep(0)
            await bus.close()
        assert waiting.result() == 0
        await bus.close()
        with pytest.raises(BusError, match="link has left the bus"):
            bus.publish(Topic.SERVER, ServerAlive(0.0, 1))

    run(whole)


def test_a_guest_leaves_nothing_behind(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "cli-99"):
            assert (folder / "cli-99.sock").exists()

    run(whole)
    assert list(folder.iterdir()) == []


async def _read_to_the_end(bus: Bus) -> int:
    return len([message async for message in bus.subscribe("**")])
