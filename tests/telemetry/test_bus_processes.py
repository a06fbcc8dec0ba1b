"""The bus between processes that are started in any order, killed, and started again."""

import asyncio
from collections.abc import Iterator
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.errors import BusError
from telemetry.topics.messages import ServerAlive
from tests.telemetry.bus_runs import Participant, run, short_folder

# Publishes a number made of its name again and again, answers calls with it, and prints whom it hears.
BODY = """
import asyncio, sys
from pathlib import Path
from telemetry.bus.bus import Bus
from telemetry.topics.messages import ServerAlive

async def main(name, folder):
    async def answer(request):
        return name
    async def listen(reader):
        async for _, message in reader:
            print("hears", message.pid, flush=True)
    async with await Bus.open(Path(folder), name) as bus, asyncio.TaskGroup() as group:
        await bus.serve(name, answer, ServerAlive)
        group.create_task(listen(bus.subscribe("server/*", keep_all=True)))
        while True:
            bus.publish("server/alive", ServerAlive(0.0, sum(name.encode())))
            await asyncio.sleep(0.1)

asyncio.run(main(*sys.argv[1:]))
"""


def hears(name: str) -> str:
    return f"hears {sum(name.encode())}"


@pytest.fixture
def folder() -> Iterator[Path]:
    with short_folder() as short:
        yield short / "run"


@pytest.fixture
def started() -> Iterator[list[Participant]]:
    participants: list[Participant] = []
    yield participants
    for participant in participants:
        participant.kill()


@pytest.mark.parametrize(
    "names", [("server", "link", "recorder", "replay", "simulator"), ("one", "two", "simulator", "four", "link")]
)
def test_five_processes_hear_each_other(folder: Path, started: list[Participant], names: tuple[str, ...]) -> None:
    async def whole() -> None:
        for name in names:
            started.append(Participant(BODY, name, folder))
        for participant in started:
            await participant.says(*(hears(name) for name in names))

    run(whole)
    assert len(started) == len(names)


@pytest.mark.parametrize(("killed", "staying"), [("link", "server"), ("server", "link"), ("guest", "link")])
def test_a_killed_node_is_found_again(folder: Path, started: list[Participant], killed: str, staying: str) -> None:
    async def whole() -> None:
        first = Participant(BODY, killed, folder)
        started.append(Participant(BODY, staying, folder))
        try:
            await started[0].says(hears(killed))
            await first.says(hears(staying))
        finally:
            first.kill()
        assert (folder / f"{killed}.sock").exists()  # left behind
        heard = len(started[0].lines)
        started.append(Participant(BODY, killed, folder))
        await started[1].says(hears(staying))
        while hears(killed) not in started[0].lines[heard:]:
            await asyncio.sleep(0.02)

    run(whole)


def test_a_guest_may_call_a_node_that_was_killed_before(folder: Path, started: list[Participant]) -> None:
    async def whole() -> None:
        first = Participant(BODY, "link", folder)
        async with await Bus.open(folder, "cli-5") as bus:
            try:
                assert await bus.call("link", ServerAlive(0.0, 1), result=str, timeout_s=60) == "link"
            finally:
                first.kill()
            started.append(Participant(BODY, "link", folder))
            assert await answered(bus) == "link"

    run(whole)


async def answered(bus: Bus) -> str:
    """The answer of the new one; a call may still go to the dead one, and then says so."""
    while True:
        try:
            return await bus.call("link", ServerAlive(0.0, 1), result=str, timeout_s=60)
        except BusError as error:
            if "ended before it answered" not in str(error):
                raise
