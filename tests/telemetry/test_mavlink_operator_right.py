"""The fencing token: whoever was relieved can change nothing any more."""

import pytest

from telemetry.errors import NotAllowedError
from telemetry.link.answering import OperatorRight
from telemetry.topics.requests import Operator, highest_possible_token


def test_a_higher_token_takes_over_and_the_lower_one_is_refused() -> None:
    right = OperatorRight()
    right.check(Operator("Ann", 3))
    right.check(Operator("Ann", 3))
    right.check(Operator("Bob", 4))
    with pytest.raises(NotAllowedError, match="taken over by Bob") as caught:
        right.check(Operator("Ann", 3))
    assert "Take control" in caught.value.advice
    right.check(Operator("Bob", 4))


def test_the_highest_token_outlives_a_restart() -> None:
    with pytest.raises(NotAllowedError):
        OperatorRight(highest=9).check(Operator("Ann", 8))


@pytest.mark.parametrize("token", [2**61, 2**53, 2**64 - 1])
def test_a_token_far_ahead_of_the_clock_is_refused_and_forgotten(token: int) -> None:
    right = OperatorRight()
    right.check(Operator("Ann", 3))
    with pytest.raises(NotAllowedError, match="far ahead of the clock"):
        right.check(Operator("stranger", token))
    right.check(Operator("Ann", 3))
    poisoned = OperatorRight(highest=token)  # as an earlier version has written it down
    poisoned.check(Operator("Ann", 3))
    assert poisoned.highest == 3


def test_a_clock_set_back_shuts_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    right = OperatorRight()
    right.check(Operator("Ann", highest_possible_token() - 10))
    monkeypatch.setattr("time.time", lambda: 1e9)
    right.check(Operator("Ann", int(1e12)))
