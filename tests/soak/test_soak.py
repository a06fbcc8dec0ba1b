"""What is judged wrong and what is not; and one short flight of the real station."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.soak.faults import Done, Fault, drawn
from tests.soak.flight import Flown, fly, records_again
from tests.soak.page import Page, Told
from tests.soak.verdict import broken

KILLED_LINK = Fault(1.0, "link", "stop")
ONBOARD, MINE = {"fly": {"onboard": {"digest": "d"}}}, {"lease": {"mine": True}}


def told(t_s: float, kind: str, **fields: Any) -> Told:
    return Told(t_s, {"type": kind, **fields})


def avoidance(t_s: float, state: str) -> Told:
    return told(t_s, "obstacles", source="live", obstacles={"avoidance": {"state": state}})


def flown(*said: Told, faults: tuple[str, ...] = (), text: str = "", back_s: float = 115.0) -> Flown:
    whole = [told(1.0, "fly", **ONBOARD), told(1.0, "lease", **MINE), told(199.0, "vehicle"), *said]
    page = SimpleNamespace(told=whole)
    page.since = lambda *args: Page.since(cast(Page, page), *args)
    log = SimpleNamespace(texts=[SimpleNamespace(text=text)], faults=faults)
    done = Done(KILLED_LINK, 1, 100.0, 100.0, back_s)
    return Flown(cast(Any, page), (done,), 90.0, 200.0, "d", cast(Any, (log,)))


NODES = told(101.2, "nodes", nodes=[{"name": "link", "state": "silent", "restarts": 0}])
LOST = avoidance(102.0, "lost")


def test_a_fault_that_is_told_and_mended_breaks_nothing() -> None:
    assert broken(flown(NODES, LOST, avoidance(101.0, "watching"), avoidance(116.0, "watching"))) == []


def test_what_the_next_link_says_before_it_is_seen_to_run_is_no_wrong_word() -> None:
    back = told(108.0, "nodes", nodes=[{"name": "link", "state": "running", "restarts": 1}])
    assert broken(flown(NODES, LOST, avoidance(107.9, "watching"), back)) == []
    assert broken(flown(NODES, LOST, avoidance(106.0, "watching"), back)) != []


def test_a_node_that_a_spare_one_replaced_at_once_was_told_of_by_its_restart() -> None:
    running = {"name": "link", "state": "running"}
    before, after = (told(t_s, "nodes", nodes=[{**running, "restarts": n}]) for t_s, n in ((99.0, 1), (100.2, 2)))
    assert broken(flown(before, LOST, after)) == []
    again = told(100.2, "nodes", nodes=[{**running, "restarts": 1}])
    assert any("does not work" in sentence for sentence in broken(flown(before, LOST, again)))


@pytest.mark.parametrize(("flight", "words"), [
    (flown(LOST), "no page was told that the link node does not work"),
    (flown(NODES), "avoidance is lost"),
    (flown(NODES, LOST, avoidance(110.0, "watching")), '"watching" 10.0 s after'),
    (flown(NODES, LOST, told(110.0, "link", link={"state": "live"})), '"live" 10.0 s after'),
    (flown(NODES, LOST, back_s=140.0), "did not work again"),
    (flown(NODES, LOST, text="Crash: Disarming: hit New building"), "Contact"),
    (flown(NODES, LOST, faults=("Two bytes are missing.",)), "Two bytes are missing"),
    (flown(NODES, LOST, told(150.0, "lease", lease={"mine": False})), "not in charge any more"),
    (flown(NODES, LOST, told(150.0, "fly", fly={"onboard": {"digest": None}})), "mission on board"),
])  # fmt: skip
def test_what_must_not_be_is_said(flight: Flown, words: str) -> None:
    assert [sentence for sentence in broken(flight) if words in sentence]


def test_a_recorder_is_back_once_it_says_that_it_has_written() -> None:
    """What it said before it died may come late."""
    done = Done(Fault(1.0, "recorder", "kill"), 1, 100.0, 100.0)

    def says(at_s: float, **status: Any) -> Told:
        return told(101.0, "recorder", recorder={"t_mono_s": at_s, "recording": True, "messages": 7} | status)

    late, idle, not_yet = says(99.9), says(100.9, recording=False), says(100.9, messages=0)
    page = flown(late, idle, not_yet).page
    assert not records_again(page, done)
    assert records_again(flown(late, idle, not_yet, says(100.9)).page, done)


def test_faults_follow_from_their_seed() -> None:
    first, again, other = (drawn(seed, first_s=3.0, last_s=600.0, every_s=15.0) for seed in (1, 1, 2))
    assert first == again != other
    assert {fault.how for fault in first} == {"kill", "stop", "pause", "starve"}


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_a_flight_goes_on_without_its_link_and_recorder_for_a_while() -> None:
    started_s = time.monotonic()
    flight = fly((Fault(1.0, "link", "stop"), Fault(8.0, "recorder", "kill")), 12.0)
    assert len(flight.done) == 2
    assert flight.begun_s > started_s
    assert broken(flight) == []
