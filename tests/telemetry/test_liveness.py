"""When a node hangs, and when it is only slow: seen by its proofs, its state and its processor time."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from telemetry.bus import liveness, node_lock
from telemetry.bus.liveness import BUSY_S, HUNG_S, SILENT_S, START_S, STARVED_S, Liveness
from telemetry.bus.node_lock import NodeFacts, NodeLock

PROVED_S = 1000.0


class Process:
    """What the system says of it: its processor time, and whether it waits for a processor or a disk."""

    def __init__(self) -> None:
        self.cpu_s, self.waits = 0.0, False


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> Process:
    made = Process()
    monkeypatch.setattr(liveness, "_cpu_s", lambda _: made.cpu_s)
    monkeypatch.setattr(liveness, "_is_waiting", lambda _: made.waits)
    return made


def facts(proved_s: float = PROVED_S) -> NodeFacts:
    return NodeFacts("link", 7, (), "1", replaceable=False, proved_t_mono_s=proved_s)


def given_up_s(observer: Liveness, process: Process, cpu_share: float = 0.0, *, works: bool = True) -> float:
    """How long after its last proof a node is given up; ``works``: it has begun its work before."""
    if works:
        observer.look(facts(PROVED_S - 0.5), PROVED_S - 0.1)
    for tenth in range(3000):
        silent_s = tenth / 10
        process.cpu_s = cpu_share * silent_s
        if observer.look(facts(), PROVED_S + silent_s).is_hung:
            return silent_s
    raise AssertionError("never")


@pytest.mark.parametrize(
    ("cpu_share", "waits", "limit_s"),
    [
        (0.0, False, HUNG_S),  # waits for what never comes, or was stopped
        (0.0, True, STARVED_S),  # would go on, but others have the processor or the disk
        (0.2, False, STARVED_S),  # works, with what little the others leave
        (0.9, True, BUSY_S),  # works on something long
    ],
)
def test_patience_goes_by_what_it_does(process: Process, cpu_share: float, waits: bool, limit_s: float) -> None:
    process.waits = waits
    assert given_up_s(Liveness(), process, cpu_share) == pytest.approx(limit_s, abs=0.15)


def test_before_its_first_proof_it_may_load_what_it_needs(process: Process) -> None:
    assert given_up_s(Liveness(), process, works=False) == pytest.approx(START_S, abs=0.15)


def test_the_wall_clocks_time_of_what_it_has_just_written_is_no_proof(process: Process) -> None:
    observer = Liveness()
    observer.look(facts(PROVED_S + 1e9), PROVED_S)  # before its first proof
    assert given_up_s(observer, process, works=False) == pytest.approx(START_S, abs=0.15)
    observer = Liveness()
    observer.look(facts(PROVED_S - 0.5), PROVED_S - 0.1)
    observer.look(facts(), PROVED_S)
    silences = [observer.look(facts(PROVED_S + 1e9), PROVED_S + tenth / 10) for tenth in range(40)]
    assert not silences[9].silent_s
    assert silences[11].silent_s == pytest.approx(1.1)
    assert silences[31].is_hung


def test_the_link_may_not_be_busy_for_long(process: Process) -> None:
    assert given_up_s(Liveness(busy_s=HUNG_S), process, 0.9) == pytest.approx(HUNG_S, abs=0.15)


def test_of_a_real_process_it_is_known_whether_it_works() -> None:
    began_s = liveness._cpu_s(os.getpid())
    until_s = time.process_time() + 0.05
    while time.process_time() < until_s:
        pass
    assert liveness._cpu_s(os.getpid()) > began_s
    assert liveness._is_waiting(os.getpid()), "this thread runs"
    sleeping = subprocess.Popen([sys.executable, "-c", "print(flush=True); input()"], stdin=-1, stdout=-1)
    with sleeping:
        assert sleeping.stdout is not None
        sleeping.stdout.readline()
        deadline_s = time.monotonic() + 30
        while liveness._is_waiting(sleeping.pid):
            assert time.monotonic() < deadline_s
        sleeping.kill()
    assert liveness._cpu_s(sleeping.pid) == 0.0
    assert not liveness._is_waiting(sleeping.pid)


def test_silence_is_told_before_it_is_too_long_and_ends_with_the_next_proof(process: Process) -> None:
    observer = Liveness()
    silences = [observer.look(facts(), PROVED_S + t / 10) for t in range(20)]
    assert [s.silent_s > 0 for s in silences] == [t / 10 >= SILENT_S for t in range(20)]
    assert not any(s.is_hung for s in silences)
    assert observer.look(facts(PROVED_S + 2.0), PROVED_S + 2.1).silent_s == 0


def test_an_observer_that_was_stopped_itself_blames_nobody(process: Process) -> None:
    observer = Liveness()
    observer.look(facts(), PROVED_S + 0.1)
    assert observer.look(facts(), PROVED_S + 60.0).silent_s == 0
    assert not observer.look(facts(), PROVED_S + 60.5).is_hung


def test_where_no_proof_can_be_kept_no_silence_counts(tmp_path: Path) -> None:
    assert asyncio.run(node_lock.silence_counts(tmp_path))
    assert not asyncio.run(node_lock.silence_counts(tmp_path / "gone"))


def test_a_node_that_proves_waits_for_no_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stalled, goes_on = threading.Event(), threading.Event()

    def stalls(*_: object, **__: object) -> None:
        stalled.set()
        assert goes_on.wait(60)

    with NodeLock(tmp_path, "link", ()) as lock:
        monkeypatch.setattr(node_lock.os, "utime", stalls)
        lock.prove_alive()
        assert stalled.wait(60)
        lock.prove_alive()
        goes_on.set()
