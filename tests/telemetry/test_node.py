"""A node: one of its name, a clean end, exit codes, and what it knows of its server."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.bus.node import GIVEN_UP_S, UNATTENDED_S, NodeContext
from telemetry.bus.node_lock import NodeLock, running_node, running_nodes
from telemetry.topics.messages import ServerAlive, Topic

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 60.0

BODY = """
import asyncio, sys
from pathlib import Path
from telemetry.errors import ConnectionFailedError
from telemetry.bus import node
from telemetry.bus.node import run_node

async def main(bus, context):
    what = sys.argv[3]
    if what == "refuse":
        raise ConnectionFailedError("Port 5 is in use.", advice="Take another.")
    if what == "fail":
        raise KeyError("inside")
    if what == "return":
        return
    if what == "replaceable":
        context.set_replaceable(True)
    if what == "unattended":
        node.UNATTENDED_S = 0.5
        while context.is_needed():
            print("needed", flush=True)
            await asyncio.sleep(0.05)
        return
    try:
        while True:
            seen_s = context.server_seen_s()
            print("server", seen_s is not None and 0 <= seen_s < 60, context.unattended_s() >= 0, flush=True)
            await asyncio.sleep(0.05)
    finally:
        print("cleaned up", flush=True)

sys.exit(run_node(sys.argv[1], Path(sys.argv[2]), main))
"""


class Nodes:
    """Starts nodes whose main part is a few lines long, and ends what is left of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "run"
        self._script = folder / "node.py"
        self._script.write_text(BODY)
        self._started: list[subprocess.Popen[str]] = []

    def start(self, name: str, what: str = "wait") -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, self._script, name, self.folder, what],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        self._started.append(process)
        return process

    def end(self) -> None:
        for process in self._started:
            process.kill()
            process.communicate()


@pytest.fixture
def nodes(tmp_path: Path) -> Iterator[Nodes]:
    started = Nodes(tmp_path)
    yield started
    started.end()


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_asked_to_end_it_cleans_up_and_ends_without_error(nodes: Nodes) -> None:
    process = nodes.start("recorder")
    assert process.stdout is not None
    assert process.stdout.readline() == "server False True\n"
    process.send_signal(signal.SIGTERM)
    out, log = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert out.endswith("cleaned up\n")
    assert "The recorder node has ended." in log
    assert running_node(nodes.folder, "recorder") is None


@pytest.mark.parametrize(
    ("what", "code", "log"),
    [
        ("return", 0, "has ended"),
        ("refuse", 2, "cannot go on. Port 5 is in use. Take another."),
        ("fail", 1, "KeyError"),
    ],
)
def test_the_exit_code_says_how_it_ended(nodes: Nodes, what: str, code: int, log: str) -> None:
    process = nodes.start("recorder", what)
    _, found = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == code
    assert log in found


def test_a_second_node_of_the_name_refuses_to_start(nodes: Nodes) -> None:
    first = nodes.start("link")
    wait_for(lambda: running_node(nodes.folder, "link") is not None)
    second = nodes.start("link")
    _, log = second.communicate(timeout=PATIENCE_S)
    assert second.returncode == 3
    assert f"The link node is running already (process {first.pid})." in log
    assert first.poll() is None


def test_a_running_node_says_who_it_is(nodes: Nodes) -> None:
    process = nodes.start("link", "wait")
    wait_for(lambda: running_node(nodes.folder, "link") is not None)
    facts = running_node(nodes.folder, "link")
    assert facts is not None
    assert (facts.name, facts.pid) == ("link", process.pid)
    assert facts.arguments == ("link", str(nodes.folder), "wait")
    assert not facts.replaceable
    nodes.start("recorder")
    wait_for(lambda: [node.name for node in running_nodes(nodes.folder)] == ["link", "recorder"])
    assert running_nodes(nodes.folder)[1].replaceable


def test_a_link_node_may_say_that_it_can_be_replaced(nodes: Nodes) -> None:
    nodes.start("link", "replaceable")
    wait_for(lambda: (facts := running_node(nodes.folder, "link")) is not None and facts.replaceable)
    content = json.loads((nodes.folder / "link.lock").read_text())
    assert content["replaceable"] is True


def test_a_killed_node_is_gone_at_once_and_can_be_started_again(nodes: Nodes) -> None:
    first = nodes.start("link")
    wait_for(lambda: running_node(nodes.folder, "link") is not None)
    first.kill()
    first.communicate()
    assert running_node(nodes.folder, "link") is None
    second = nodes.start("link")
    wait_for(lambda: (facts := running_node(nodes.folder, "link")) is not None and facts.pid == second.pid)
    assert second.poll() is None


def test_it_knows_that_a_server_lives(nodes: Nodes) -> None:
    process = nodes.start("recorder")
    assert process.stdout is not None
    stdout = process.stdout

    async def whole() -> None:
        async with await Bus.open(nodes.folder, "server") as bus, asyncio.timeout(PATIENCE_S):
            bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), 1))
            while await asyncio.to_thread(stdout.readline) != "server True True\n":
                pass

    asyncio.run(whole())
    assert process.poll() is None


def test_without_a_server_it_ends_by_itself(nodes: Nodes) -> None:
    process = nodes.start("sensors", "unattended")
    out, log = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (0, "needed\n" * (len(out) // 7))
    assert "The sensors node has ended." in log


def test_a_flight_goes_on_without_a_server_while_its_vehicle_is_heard(tmp_path: Path, monkeypatch) -> None:
    now_s = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    tmp_path.chmod(0o700)
    with NodeLock(tmp_path, "link", []) as lock:
        context = NodeContext(lock)
        now_s += UNATTENDED_S - 1
        assert context.is_needed()
        now_s += 2
        assert not context.is_needed()
        assert context.is_needed(now_s)
        heard_s = now_s
        now_s += GIVEN_UP_S - 1
        assert context.is_needed(heard_s)
        now_s += 2
        assert not context.is_needed(heard_s)
        context.note_server(ServerAlive(now_s, 1))
        assert context.is_needed()


@pytest.mark.parametrize("name", ["link", "recorder"])
def test_what_is_started_anew_in_flight_loads_nothing_that_takes_long(name: str) -> None:
    heavy = "{'numba', 'scipy', 'pyproj', 'rasterio', 'skimage', 'fastapi'}"
    code = f"import sys, telemetry.nodes.{name}; print(*sorted({heavy} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == ""
