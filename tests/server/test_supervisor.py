"""The supervisor, with a node that is a few lines long: started, found again, started anew, ended."""

import asyncio
import contextlib
import itertools
import os
import signal
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from server.work import node_process
from server.work.node_process import LOG_BYTES, bound_log
from server.work.supervisor import NodeState, Supervisor
from telemetry.bus.bus import Bus
from telemetry.bus.node_lock import NodeFacts, running_node, running_nodes

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 90.0

NODE = """
import asyncio, signal, sys, time
from pathlib import Path
from telemetry.bus.node import run_node

slow = Path(__file__).with_name("slow.txt")
if __name__ != "__main__" and slow.exists():  # a spare one that loads for long, and works at it
    until_s = time.process_time() + 1.5
    while time.process_time() < until_s:
        pass

async def work(bus, context):
    if "--fail" in sys.argv:
        raise KeyError("inside")
    if "--free" in sys.argv:
        context.set_replaceable(True)
    if "--deaf" in sys.argv:
        asyncio.get_running_loop().remove_signal_handler(signal.SIGTERM)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    print("a line of", sys.argv, flush=True)
    once = Path(sys.argv[2]) / "busy-once"
    if "--busy" in sys.argv and not once.exists():
        once.touch()
        for _ in range(0 if "--at-once" in sys.argv else 10):  # the first proof is that of its start
            context.is_needed()
            await asyncio.sleep(0.1)
        while True:
            pass
    while context.is_needed():
        await asyncio.sleep(0.1)

def main():
    return run_node(Path(__file__).stem, Path(sys.argv[2]), work)

if __name__ == "__main__":
    sys.exit(main())
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A runtime directory, and nodes called link and recorder in a package of their own. None of them is left."""
    package = tmp_path / "small_nodes"
    package.mkdir()
    for name in ("__init__", "link", "recorder"):
        (package / f"{name}.py").write_text(NODE if name != "__init__" else "")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    monkeypatch.setenv("HEDGEHOP_PASSWORD", "not for nodes")
    run = tmp_path / "run"
    yield run
    for facts in running_nodes(run):
        os.kill(facts.pid, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(facts.pid, 0)


class Watched:
    """A running supervisor and everything it told."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.told: list[list[NodeState]] = []
        self.supervisor = Supervisor(folder, changed=self.told.append, package="small_nodes")

    def state(self, name: str) -> NodeState | None:
        return next((state for state in self.supervisor.states if state.name == name), None)

    async def running(self, name: str, *, restarts: int = 0) -> NodeFacts:
        """Started anew at least so often: on a busy machine one that is slow to start may be ended once more."""
        await until(lambda: (s := self.state(name)) is not None and s.state == "running" and s.restarts >= restarts)
        facts = running_node(self.folder, name)
        assert facts is not None
        return facts


@asynccontextmanager
async def supervised(folder: Path) -> AsyncIterator[Watched]:
    watched = Watched(folder)
    task = asyncio.ensure_future(watched.supervisor.run())
    try:
        yield watched
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        await asyncio.sleep(0.02)


def lines(folder: Path, name: str) -> int:
    """How many nodes of that name have said that they work."""
    return (folder / f"{name}.log").read_text().count("a line of")


def run(whole: Callable[[], Awaitable[None]]) -> None:
    async def main() -> None:
        await whole()

    asyncio.run(main())


def test_a_node_is_started_in_a_session_of_its_own_and_stopped(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ["--a", "b"])
            facts = await watched.running("link")
            assert facts.arguments == ("--runtime", str(folder), "--a", "b")
            assert os.getsid(facts.pid) == facts.pid
            await watched.supervisor.start("link", ["--a", "b"])
            assert await watched.running("link") == facts
            await until(lambda: lines(folder, "link") == 1)  # before, nobody in it hears that it is to end
            await watched.supervisor.stop("link")
            assert running_node(folder, "link") is None
            # On a busy machine it may be silent for a moment.
            told = (states[0].state for states in watched.told if states[0].state != "silent")
            assert [state for state, _ in itertools.groupby(told)] == ["starting", "running", "stopped"]
            await watched.supervisor.start("link", [])
            assert (await watched.running("link")).arguments == ("--runtime", str(folder))
            await until(lambda: lines(folder, "link") == 2)
            await watched.supervisor.stop("link")
        log = (folder / "link.log").read_text()
        assert "a line of" in log
        assert "The link node has ended." in log

    run(whole)


def test_a_killed_node_is_started_again_and_the_page_is_told(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", [])
            await watched.supervisor.start("recorder", [])
            other = await watched.running("recorder")
            facts = await watched.running("link")
            os.kill(facts.pid, signal.SIGKILL)
            again = await watched.running("link", restarts=1)
            assert again.pid != facts.pid
            state = watched.state("link")
            assert state is not None
            assert state.text == "The link node ended (code -9) and was started again."
            assert await watched.running("recorder") == other
            assert "restarting" in [state.state for states in watched.told for state in states]
            await asyncio.gather(*(watched.supervisor.stop(name) for name in ("link", "recorder")))

    run(whole)


def test_a_node_that_fails_at_once_is_tried_again_and_again(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("recorder", ["--fail"])
            await until(lambda: (state := watched.state("recorder")) is not None and state.restarts >= 2)
            await watched.supervisor.stop("recorder")
            state = watched.state("recorder")
            assert state is not None
            assert state.state == "stopped"
        assert "The recorder node ended (code 1)." in [state.text for states in watched.told for state in states]
        assert "KeyError" in (folder / "recorder.log").read_text()

    run(whole)


def test_nodes_outlive_the_supervisor_and_the_next_one_takes_them_over(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as first:
            await first.supervisor.start("link", [])
            facts = await first.running("link")
        assert running_node(folder, "link") == facts
        async with supervised(folder) as second:
            assert await second.running("link") == facts
            await second.supervisor.start("link", [])
            assert await second.running("link") == facts
            state = second.state("link")
            assert state is not None
            assert state.text == "The link node was running already and was taken over."
            await second.supervisor.stop("link")
            assert running_node(folder, "link") is None

    run(whole)


def test_a_node_taken_over_is_started_again_when_it_dies(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as first:
            await first.supervisor.start("link", [])
            facts = await first.running("link")
        async with supervised(folder) as second:
            await second.running("link")
            os.kill(facts.pid, signal.SIGKILL)
            assert (await second.running("link", restarts=1)).pid != facts.pid
            state = second.state("link")
            assert state is not None
            assert state.text.endswith("and was started again.")
            await second.supervisor.stop("link")

    run(whole)


def test_a_node_that_is_still_being_taken_over_is_stopped(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def whole() -> None:
        async with supervised(folder) as first:
            await first.supervisor.start("recorder", [])
            await first.running("recorder")
        looks = asyncio.Event()

        async def found(*_: object) -> None:
            looks.set()
            await asyncio.Event().wait()

        monkeypatch.setattr(Supervisor, "_found", found)
        async with supervised(folder) as second:
            await looks.wait()
            await second.supervisor.stop("recorder")
            assert running_node(folder, "recorder") is None
            state = second.state("recorder")
            assert state is not None
            assert state.state == "stopped"

    run(whole)


def test_other_arguments_replace_a_node(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("recorder", ["--to", "a"])
            first = await watched.running("recorder")
            await watched.supervisor.start("recorder", ["--to", "b"])
            await until(lambda: (facts := running_node(folder, "recorder")) is not None and facts.pid != first.pid)
            assert (await watched.running("recorder")).arguments[-1] == "b"
            await watched.supervisor.stop("recorder")

    run(whole)


def test_a_link_node_is_kept_until_it_says_that_it_may_go(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ["--a"])
            first = await watched.running("link")
            await watched.supervisor.start("link", ["--b"])
            await until(lambda: "kept while its vehicle may be armed" in watched.supervisor.states[0].text)
            assert await watched.running("link") == first
            await watched.supervisor.stop("link")
            await watched.supervisor.start("link", ["--free", "--a"])
            await until(lambda: (facts := running_node(folder, "link")) is not None and facts.replaceable)
            await watched.supervisor.start("link", ["--b"])
            await until(lambda: (facts := running_node(folder, "link")) is not None and facts.arguments[-1] == "--b")
            await watched.supervisor.stop("link")

    run(whole)


def test_a_node_holds_nothing_of_the_server_that_started_it(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "server"), supervised(folder) as watched:
            await watched.supervisor.start("link", [])
            facts = await watched.running("link")
            await until(lambda: lines(folder, "link") == 1)  # it has opened what it holds
            held = list[str]()
            for path in Path(f"/proc/{facts.pid}/fd").iterdir():
                with contextlib.suppress(FileNotFoundError):
                    held.append(os.readlink(path))
            assert [path for path in held if "server" in path] == []
        async with await Bus.open(folder, "server"), supervised(folder) as watched:  # of a server that comes later
            assert await watched.running("link") == facts
            await watched.supervisor.stop("link")

    run(whole)


@pytest.mark.slow
def test_a_node_that_does_not_listen_is_killed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_process, "_END_WITHIN_S", within_s := 2.0)

    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("recorder", ["--deaf"])
            await watched.running("recorder")
            await until(lambda: lines(folder, "recorder") == 1)
            asked_s = time.monotonic()
            await watched.supervisor.stop("recorder")
            assert time.monotonic() - asked_s >= within_s
            assert running_node(folder, "recorder") is None

    run(whole)


def test_nodes_do_not_get_the_servers_secrets(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("recorder", [])
            facts = await watched.running("recorder")
            environment = Path(f"/proc/{facts.pid}/environ").read_bytes()
            assert b"PYTHONPATH" in environment
            assert b"HEDGEHOP" not in environment
            await watched.supervisor.stop("recorder")

    run(whole)


def test_a_log_keeps_its_newest_part(tmp_path: Path) -> None:
    log = tmp_path / "link.log"
    with log.open("ab") as node:
        node.write(b"a line of twenty by\n" * (LOG_BYTES // 20 + 1))
        node.flush()
        bound_log(log)
        node.write(b"the last line\n")
        node.flush()
    content = log.read_bytes()
    assert len(content) <= LOG_BYTES // 2 + 20
    assert content.startswith(b"a line")
    assert content.endswith(b"\nthe last line\n")
