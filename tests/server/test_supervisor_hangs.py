"""A node that hangs is said to, killed and started again; one that is silent for a moment goes on."""

import asyncio
import os
import re
import signal
import time
from pathlib import Path

import pytest

from server.work import supervisor
from server.work.supervisor import LINK_HUNG_S
from telemetry.bus.liveness import HUNG_S, START_S
from telemetry.bus.node_lock import running_node
from tests.server.test_supervisor import PATIENCE_S, folder, run, supervised, until

__all__ = ["folder"]


@pytest.mark.parametrize("how", ["stopped", "busy", "busy from its start on"])
def test_a_link_that_hangs_is_said_then_killed_and_started_again(
    folder: Path, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "STARVED_S", start_s := 5.0)
    arguments = {"stopped": [], "busy": ["--busy"], "busy from its start on": ["--busy", "--at-once"]}[how]

    async def whole() -> None:
        async with supervised(folder) as watched:
            since_s = time.monotonic()
            await watched.supervisor.start("link", arguments)
            restarts = 0
            if how == "stopped":
                # On a busy machine one that is only slow to start may have been ended before.
                await until(lambda: (s := watched.state("link")) is not None and s.state == "running")
                await proved(folder)
            await until(lambda: running_node(folder, "link") is not None)
            first = running_node(folder, "link")
            assert first is not None
            if how == "stopped":
                state = watched.state("link")
                assert state is not None
                restarts = state.restarts
                os.kill(first.pid, signal.SIGSTOP)
            await until(lambda: any(s.name == "link" and s.state == "silent" for told in watched.told for s in told))
            again = await watched.running("link", restarts=restarts + 1)
            assert again.pid != first.pid
            hung_s = LINK_HUNG_S if how == "stopped" else HUNG_S
            assert time.monotonic() - since_s >= hung_s
            state = watched.state("link")
            assert state is not None
            # One that is busy counts as starved where others leave it less than half of a processor; on a machine that
            # is busy itself, its proof may not have been written before it hung, and who looks at it is late.
            least_s = start_s if how == "busy from its start on" else hung_s
            waited = re.search(r"was ended after it had not answered for ([\d.]+) s and was started again", state.text)
            assert waited is not None
            assert least_s <= float(waited[1]) < START_S / 2
            await watched.supervisor.stop("link")

    run(whole)


def test_a_node_that_is_silent_for_a_moment_goes_on(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A busy machine may make more than the moment of it that is meant.
    monkeypatch.setattr(supervisor, "LINK_HUNG_S", PATIENCE_S)

    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", [])
            facts = await watched.running("link")
            await proved(folder)
            os.kill(facts.pid, signal.SIGSTOP)
            await until(lambda: (s := watched.state("link")) is not None and s.state == "silent")
            os.kill(facts.pid, signal.SIGCONT)
            assert (await watched.running("link")).pid == facts.pid
            await watched.supervisor.stop("link")

    run(whole)


def test_a_link_that_works_again_while_the_disk_is_asked_is_not_killed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a busy machine one that works again may seem to hang once more: it is looked at by its first proof.
    looked = asyncio.Event()

    async def works_again(_: Path) -> bool:
        facts = running_node(folder, "link")
        assert facts is not None
        os.kill(facts.pid, signal.SIGCONT)
        await proved(folder)
        looked.set()
        return True

    async def whole() -> None:
        async with supervised(folder) as watched:
            await watched.supervisor.start("link", [])
            await watched.running("link")
            await proved(folder)
            state = watched.state("link")
            facts = running_node(folder, "link")
            assert state is not None
            assert facts is not None
            monkeypatch.setattr(supervisor, "silence_counts", works_again)
            os.kill(facts.pid, signal.SIGSTOP)
            await asyncio.wait_for(looked.wait(), PATIENCE_S)
            assert (await watched.running("link", restarts=state.restarts)).pid == facts.pid
            await watched.supervisor.stop("link")

    run(whole)


async def proved(folder: Path) -> None:
    """Until the link has proved from now on that it works."""
    since_s = time.monotonic()

    def has_proved() -> bool:
        facts = running_node(folder, "link")
        return facts is not None and since_s < facts.proved_t_mono_s <= time.monotonic()

    await until(has_proved)
