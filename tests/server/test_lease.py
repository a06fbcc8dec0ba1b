"""Who is in charge: one session at a time, a token that only grows, also across restarts (S10)."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.door.lease import ANSWER_S, SILENT_S, Holder, Lease
from server.errors import ConflictError, NotInChargeError, status_of
from server.schemas import LeaseDoc
from telemetry.topics.requests import Operator, highest_possible_token

ANNA, BEN, CARL = "a" * 64, "b" * 64, "c" * 64


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_it_is_taken_by_a_press_and_then_only_with_consent(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    assert lease.holder is None
    assert lease.press(ANNA, "Anna") is None
    assert lease.doc_for(ANNA).mine
    first = lease.operator(ANNA)
    assert lease.press(BEN, "Ben") is None
    assert lease.doc_for(ANNA) == LeaseDoc(holder="Anna", mine=True, asks="Ben")
    assert lease.doc_for(BEN) == LeaseDoc(holder="Anna", mine=False, waits=True)
    with pytest.raises(ConflictError, match="Ben is asking"):
        lease.press(CARL, "Carl")
    with pytest.raises(NotInChargeError):
        lease.hand_over(BEN)
    assert lease.keep(ANNA) == Holder(BEN, "Ben")
    assert lease.operator(ANNA) == first
    with pytest.raises(ConflictError, match="Nobody asks"):
        lease.hand_over(ANNA)
    lease.press(BEN, "Ben")
    assert lease.hand_over(ANNA) == Holder(BEN, "Ben")
    assert lease.operator(BEN).name == "Ben"
    assert lease.operator(BEN).token > first.token
    assert lease.press(BEN, "Ben") is None
    assert lease.doc_for(BEN).mine


def test_a_question_without_an_answer_ends_and_can_be_taken_back(tmp_path: Path) -> None:
    clock = Clock()
    lease = Lease(tmp_path / "lease.json", now_mono_s=clock)
    lease.press(ANNA, "Anna")
    lease.press(BEN, "Ben")
    clock.now_s += ANSWER_S - 0.1
    assert lease.look({ANNA, BEN}) is None
    clock.now_s += 0.2
    assert lease.look({ANNA, BEN}) == Holder(BEN, "Ben")
    assert lease.look({ANNA, BEN}) is None
    assert lease.doc_for(ANNA).asks is None
    lease.press(BEN, "Ben")
    assert lease.release(BEN)
    assert lease.doc_for(ANNA) == LeaseDoc(holder="Anna", mine=True)


def test_an_observer_is_refused_with_words(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    with pytest.raises(NotInChargeError, match="Nobody is in charge"):
        lease.operator(ANNA)
    lease.press(BEN, "Ben")
    with pytest.raises(NotInChargeError, match="Ben is in charge") as refused:
        lease.operator(ANNA)
    assert status_of(refused.value) == 403


def test_letting_go_frees_it_and_takes_the_token_away(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.press(ANNA, "Anna")
    held = lease.operator(ANNA).token
    assert not lease.release(BEN)
    assert lease.release(ANNA)
    assert lease.doc_for(ANNA).holder is None
    assert lease.server_operator().token > held


def test_who_is_silent_keeps_it_until_somebody_presses(tmp_path: Path) -> None:
    clock, file = Clock(), tmp_path / "lease.json"
    lease = Lease(file, now_mono_s=clock)
    lease.press(ANNA, "Anna")
    held = lease.operator(ANNA).token
    lease.save()

    lease = Lease(file, now_mono_s=clock)  # after a restart
    clock.now_s += SILENT_S - 0.1
    lease.look({BEN})
    assert not lease.is_silent
    clock.now_s += 0.2
    lease.look({BEN})
    assert lease.is_silent
    assert lease.operator(ANNA).token > held  # a command is a sign of life as well
    clock.now_s += 10 * SILENT_S
    lease.look({BEN})
    assert lease.doc_for(BEN) == LeaseDoc(holder="Anna", mine=False, silent=True)
    assert lease.press(BEN, "Ben") == Holder(ANNA, "Anna")
    assert lease.operator(BEN).token > held


def test_whose_page_is_heard_is_asked(tmp_path: Path) -> None:
    clock = Clock()
    lease = Lease(tmp_path / "lease.json", now_mono_s=clock)
    lease.press(ANNA, "Anna")
    for _ in range(20):
        clock.now_s += 1.0
        lease.look({ANNA, BEN})
    assert lease.press(BEN, "Ben") is None
    assert lease.doc_for(ANNA).mine


def test_a_restart_keeps_the_holder_and_never_lowers_the_token(tmp_path: Path) -> None:
    file = tmp_path / "lease.json"
    lease = Lease(file, clock_utc_s=lambda: 2000.0)
    lease.press(ANNA, "Anna")
    lease.save()
    again = Lease(file, clock_utc_s=lambda: 1000.0)
    assert again.doc_for(ANNA).mine
    assert again.operator(ANNA).name == "Anna"
    assert again.operator(ANNA).token > lease.operator(ANNA).token


@pytest.mark.parametrize("text", ["", "{", "[]", '{"token": "x", "holder": null}', '{"token": 1, "holder": ["a"]}'])
def test_a_damaged_file_costs_pressing_a_button(tmp_path: Path, text: str) -> None:
    file = tmp_path / "lease.json"
    file.write_text(text)
    lease = Lease(file)
    assert lease.holder is None
    lease.press(ANNA, "Anna")
    assert lease.doc_for(ANNA).mine


def test_a_clock_set_back_by_years_does_not_leave_tokens_that_no_link_takes(tmp_path: Path) -> None:
    now, file = [2e9], tmp_path / "lease.json"
    lease = Lease(file, clock_utc_s=lambda: now[0])
    lease.press(ANNA, "Anna")
    lease.save()
    now[0] = 1e9
    for each in (lease, Lease(file, clock_utc_s=lambda: now[0])):
        assert each.operator(ANNA).token <= highest_possible_token(now[0])


def test_a_token_that_nobody_issued_is_topped_for_who_is_in_charge_alone(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.press(ANNA, "Anna")
    anna = lease.operator(ANNA)
    topped = lease.issue_above(anna, anna.token + 9)
    assert topped is not None
    assert topped == Operator("Anna", anna.token + 10)
    assert lease.operator(ANNA) == topped
    assert lease.issue_above(anna, anna.token + 9) == topped  # of two commands at once, the second
    lease.press(BEN, "Ben")
    lease.hand_over(ANNA)
    assert lease.issue_above(topped, lease.operator(BEN).token) is None


@given(st.lists(st.tuples(st.sampled_from(["take", "release"]), st.sampled_from([ANNA, BEN]), st.floats(0, 80_000))))
def test_every_change_of_hands_raises_the_token(steps: list[tuple[str, str, float]]) -> None:
    now = [0.0]
    lease = Lease(Path("unused-and-missing") / "lease.json", clock_utc_s=lambda: now[0])
    for step, session, at in steps:
        now[0], before, holder = at, lease.server_operator().token, lease.holder
        if step == "release":
            lease.release(session)
        else:
            lease.press(session, session[:4])
        if lease.doc_for(ANNA if session == BEN else BEN).asks:
            lease.hand_over(ANNA if session == BEN else BEN)
        assert (lease.server_operator().token > before) == (lease.holder != holder)
