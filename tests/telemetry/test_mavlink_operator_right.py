"""The fencing token: whoever was relieved can change nothing any more."""

import pytest

from telemetry.errors import NotAllowedError
from telemetry.link.answering import OperatorRight
from telemetry.topics.requests import Operator


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
