"""When a node hangs, and when it is only slow: seen by its proofs, its state and its processor time."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from telemetry.bus import liveness
from telemetry.bus.liveness import BUSY_S, HUNG_S, SILENT_S, STARVED_S, Liveness
from telemetry.bus.node_lock import NodeFacts

PROVED_S = 1000.0


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, float], None]:
    """What the system says of every process from now on: its state, and its processor time in s."""
    said: list[object] = ["S", 0.0]
    monkeypatch.setattr(liveness, "_state_of", lambda _: tuple(said))

    def say(state: str, cpu_s: float) -> None:
        said[:] = [state, cpu_s]

    return say


def facts(proved_s: float = PROVED_S) -> NodeFacts:
    return NodeFacts("link", 7, (), "1", replaceable=False, proved_t_mono_s=proved_s)


def given_up_s(observer: Liveness, process: Callable[[str, float], None], state: str, cpu_share: float) -> float:
    """How long after its last proof a node is given up."""
    process(state, 0.0)
    for tenth in range(3000):
        silent_s = tenth / 10
        if observer.look(facts(), PROVED_S + silent_s).is_hung:
            return silent_s
        process(state, cpu_share * (silent_s + 0.1))
    raise AssertionError("never")


@pytest.mark.parametrize(
    ("state", "cpu_share", "limit_s"),
    [
        ("S", 0.0, HUNG_S),  # waits for what never comes
        ("T", 0.0, HUNG_S),  # stopped
        ("R", 0.1, STARVED_S),  # would run, but others do
        ("D", 0.0, STARVED_S),  # waits for a disk
        ("R", 0.9, BUSY_S),  # works on something long
    ],
)
def test_patience_goes_by_what_it_does(
    process: Callable[[str, float], None], state: str, cpu_share: float, limit_s: float
) -> None:
    assert given_up_s(Liveness(), process, state, cpu_share) == pytest.approx(limit_s, abs=0.15)


def test_the_link_may_not_be_busy_for_long(process: Callable[[str, float], None]) -> None:
    assert given_up_s(Liveness(busy_s=HUNG_S), process, "R", 0.9) == pytest.approx(HUNG_S, abs=0.15)


def test_silence_is_told_before_it_is_too_long_and_ends_with_the_next_proof(
    process: Callable[[str, float], None],
) -> None:
    process("S", 0.0)
    observer = Liveness()
    silences = [observer.look(facts(), PROVED_S + t / 10) for t in range(20)]
    assert [s.silent_s > 0 for s in silences] == [t / 10 >= SILENT_S for t in range(20)]
    assert not any(s.is_hung for s in silences)
    assert observer.look(facts(PROVED_S + 2.0), PROVED_S + 2.1).silent_s == 0


def test_an_observer_that_was_stopped_itself_blames_nobody(process: Callable[[str, float], None]) -> None:
    process("S", 0.0)
    observer = Liveness()
    observer.look(facts(), PROVED_S + 0.1)
    assert observer.look(facts(), PROVED_S + 60.0).silent_s == 0
    assert not observer.look(facts(), PROVED_S + 60.5).is_hung
