"""Who is in charge: one session at a time, a token that only grows, also across restarts (S10)."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.door.lease import GONE_S, Lease
from server.errors import NotInChargeError, status_of
from telemetry.topics.requests import Operator, highest_possible_token

ANNA, BEN = "a" * 64, "b" * 64


def test_the_first_one_has_it_and_the_next_one_has_to_take_it(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    assert lease.take_if_free(ANNA)
    assert not lease.take_if_free(BEN)
    assert lease.doc_for(ANNA).mine
    assert (lease.doc_for(BEN).holder, lease.doc_for(BEN).mine) == ("Operator aaaa", False)
    first = lease.operator(ANNA)
    before = lease.take(BEN, "Ben")
    assert before is not None
    assert before.session_key == ANNA
    assert lease.operator(BEN).name == "Ben"
    assert lease.operator(BEN).token > first.token


def test_an_observer_is_refused_with_words(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    with pytest.raises(NotInChargeError, match="Nobody is in charge"):
        lease.operator(ANNA)
    lease.take(BEN, "Ben")
    with pytest.raises(NotInChargeError, match="Ben is in charge") as refused:
        lease.operator(ANNA)
    assert status_of(refused.value) == 403


def test_letting_go_frees_it_and_takes_the_token_away(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.take(ANNA)
    held = lease.operator(ANNA).token
    assert not lease.release(BEN)
    assert lease.release(ANNA)
    assert lease.doc_for(ANNA).holder is None
    assert lease.server_operator().token > held


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_a_page_that_is_gone_loses_it_to_one_that_is_there(tmp_path: Path) -> None:
    clock, file = Clock(), tmp_path / "lease.json"
    lease = Lease(file, now_mono_s=clock)
    lease.take(ANNA, "Anna")
    held = lease.operator(ANNA).token
    lease.save()

    lease = Lease(file, now_mono_s=clock)  # after a restart
    clock.now_s += GONE_S - 0.1
    assert not lease.pass_on([BEN], in_flight=False)
    clock.now_s += 0.2
    assert not lease.pass_on([], in_flight=False)
    assert lease.pass_on([BEN], in_flight=False)
    assert lease.operator(BEN).token > held


def test_who_has_a_page_or_commands_or_flies_keeps_it(tmp_path: Path) -> None:
    clock = Clock()
    lease = Lease(tmp_path / "lease.json", now_mono_s=clock)
    lease.take(ANNA)
    for present, in_flight in (([BEN, ANNA], False), ([BEN], True)):
        clock.now_s += 2 * GONE_S
        assert not lease.pass_on(present, in_flight=in_flight)
    clock.now_s += 2 * GONE_S
    lease.operator(ANNA)
    assert not lease.pass_on([BEN], in_flight=False)
    assert lease.doc_for(ANNA).mine


def test_who_lets_go_on_purpose_does_not_get_it_back(tmp_path: Path) -> None:
    clock = Clock()
    lease = Lease(tmp_path / "lease.json", now_mono_s=clock)
    lease.take(ANNA)
    lease.release(ANNA)
    clock.now_s += 2 * GONE_S
    assert not lease.pass_on([ANNA, BEN], in_flight=False)


def test_a_restart_keeps_the_holder_and_never_lowers_the_token(tmp_path: Path) -> None:
    file = tmp_path / "lease.json"
    lease = Lease(file, clock_utc_s=lambda: 2000.0)
    lease.take(ANNA, "Anna")
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
    assert lease.take_if_free(ANNA)


def test_a_clock_set_back_by_years_does_not_leave_tokens_that_no_link_takes(tmp_path: Path) -> None:
    now, file = [2e9], tmp_path / "lease.json"
    lease = Lease(file, clock_utc_s=lambda: now[0])
    lease.take(ANNA, "Anna")
    lease.save()
    now[0] = 1e9
    for each in (lease, Lease(file, clock_utc_s=lambda: now[0])):
        assert each.operator(ANNA).token <= highest_possible_token(now[0])


def test_a_token_that_nobody_issued_is_topped_for_who_is_in_charge_alone(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.take(ANNA, "Anna")
    anna = lease.operator(ANNA)
    topped = lease.issue_above(anna, anna.token + 9)
    assert topped is not None
    assert topped == Operator("Anna", anna.token + 10)
    assert lease.operator(ANNA) == topped
    assert lease.issue_above(anna, anna.token + 9) == topped  # of two commands at once, the second
    lease.take(BEN, "Ben")
    assert lease.issue_above(topped, lease.operator(BEN).token) is None


@given(st.lists(st.tuples(st.sampled_from(["take", "release"]), st.sampled_from([ANNA, BEN]), st.floats(0, 80_000))))
def test_every_change_of_hands_raises_the_token(steps: list[tuple[str, str, float]]) -> None:
    now = [0.0]
    lease = Lease(Path("unused-and-missing") / "lease.json", clock_utc_s=lambda: now[0])
    for step, session, at in steps:
        now[0], before = at, lease.server_operator().token
        changed = lease.release(session) if step == "release" else (lease.take(session), True)[1]
        assert (lease.server_operator().token > before) == changed
