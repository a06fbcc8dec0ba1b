"""A spare node, loaded and waiting: it takes the place of one that dies, or another one is started."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from server.work import supervisor
from server.work.node_process import SpareNode
from telemetry.bus.node_lock import running_node
from tests.server.test_supervisor import PATIENCE_S, Watched, folder, run, supervised, until

__all__ = ["folder"]
ARGUMENTS = ["--free", "a word with a space"]


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "_STEADY_S", 0.0)
    monkeypatch.setattr(supervisor, "_TAKES_OVER_S", PATIENCE_S)
    monkeypatch.setattr(supervisor, "LINK_HUNG_S", PATIENCE_S)


async def spare_of(watched: Watched) -> SpareNode:
    node = watched.supervisor._nodes["link"]
    await until(lambda: node.spare is not None)
    assert node.spare is not None
    return node.spare


async def killed(watched: Watched) -> int:
    """The link. The process that runs in its place."""
    facts = await watched.running("link")
    os.kill(facts.pid, signal.SIGKILL)
    again = await watched.running("link", restarts=1)
    assert again.pid != facts.pid
    assert again.arguments == facts.arguments
    assert again.arguments[2:] == tuple(ARGUMENTS)
    return again.pid


def is_there(pid: int) -> bool:
    """A process that has ended and that nobody has waited for counts as gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_it_takes_the_place_of_one_that_is_killed(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            for restarts in (1, 2):
                facts = await watched.running("link", restarts=restarts - 1)
                spare = await spare_of(watched)
                os.kill(facts.pid, signal.SIGKILL)
                again = await watched.running("link", restarts=restarts)
                assert again.pid == spare.process.pid
                assert again.arguments == facts.arguments == ("--runtime", str(folder), *ARGUMENTS)
            await watched.supervisor.stop("link")

    run(whole)


def test_one_that_does_not_take_over_is_killed_and_another_one_started(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "_TAKES_OVER_S", 0.2)

    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            spare = await spare_of(watched)
            os.kill(spare.process.pid, signal.SIGSTOP)
            assert await killed(watched) != spare.process.pid
            assert not is_there(spare.process.pid)
            await watched.supervisor.stop("link")

    run(whole)


def test_a_node_that_is_stopped_while_a_spare_one_takes_over_is_stopped(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            facts = await watched.running("link")
            spare = await spare_of(watched)
            os.kill(spare.process.pid, signal.SIGSTOP)
            os.kill(facts.pid, signal.SIGKILL)
            node = watched.supervisor._nodes["link"]
            await until(lambda: node.process is spare.process)
            os.kill(spare.process.pid, signal.SIGCONT)
            await watched.supervisor.stop("link")
            assert not is_there(spare.process.pid)
            assert running_node(folder, "link") is None

    run(whole)


def test_one_that_still_loads_is_waited_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "_TAKES_OVER_S", 0.5)
    (folder.parent / "small_nodes" / "slow.txt").touch()

    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            facts = await watched.running("link")
            spare = await spare_of(watched)
            os.kill(facts.pid, signal.SIGKILL)
            assert (await watched.running("link", restarts=1)).pid == spare.process.pid
            await watched.supervisor.stop("link")

    run(whole)


def test_one_that_died_is_replaced_later_and_missed_by_nobody(folder: Path) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            spare = await spare_of(watched)
            os.kill(spare.process.pid, signal.SIGKILL)
            node = watched.supervisor._nodes["link"]
            await until(lambda: node.spare is not spare)
            assert node.spare is None
            assert await killed(watched) != spare.process.pid
            node.spare_again_s = 0.0
            assert await spare_of(watched) is not spare
            await watched.supervisor.stop("link")

    run(whole)


@pytest.mark.parametrize("how", ["the node is stopped", "the supervisor ends"])
def test_it_ends_with_what_it_is_for(folder: Path, how: str) -> None:
    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", ARGUMENTS)
            pid = (await spare_of(watched)).process.pid
            assert is_there(pid)
            if how == "the node is stopped":
                await watched.supervisor.stop("link")
                assert not is_there(pid)
        await until(lambda: not is_there(pid))

    run(whole)


def test_it_ends_where_nobody_is_left_who_would_need_it() -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "telemetry.bus.spare_node", "telemetry.nodes.link"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, b"", b"")
