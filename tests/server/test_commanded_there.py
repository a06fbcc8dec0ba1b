"""A request that names another station's vehicle: refused with who commands it there, and nothing is done."""

from __future__ import annotations

from dataclasses import replace

import pytest

from server.errors import BadRequestError, OtherStationError, status_of
from server.flying.apart.commanded_there import own_number
from server.flying.apart.others_heard import NODE_SILENT_S
from telemetry.topics.station_vehicles import OtherStation, StationsStatus
from tests.server.test_other_stations import NOW_S, heard, other

BRAVO = OtherStation("Bravo", "live", NOW_S, 0.0, 1, hears_us=True, sent_t_mono_s=NOW_S)
HEARD = heard(BRAVO, other(in_charge="Anna"))


def refusal(words: str, status: StationsStatus | None = HEARD, now_s: float = NOW_S) -> OtherStationError:
    with pytest.raises(OtherStationError) as refused:
        own_number(words, "Alpha", status, now_s)
    assert status_of(refused.value) == 403
    assert "nothing of this was done" in refused.value.what
    return refused.value


@pytest.mark.parametrize("words", ["Bravo/1", "Bravo 1"])
def test_who_commands_it_and_whom_to_call(words: str) -> None:
    error = refusal(words)
    assert error.what.startswith("Wasp (Bravo 1) is commanded by Bravo alone")
    assert error.advice == "Anna is in charge of it there. Call Bravo."


def test_nobody_and_somebody_who_is_silent_are_told_as_such() -> None:
    assert refusal("Bravo/1", heard(BRAVO, other())).advice == "Nobody is in charge of it there. Call Bravo."
    silent = heard(BRAVO, other(in_charge="Anna", in_charge_silent=True))
    assert "Anna is in charge of it there, and nothing was heard of them." in refusal("Bravo/1", silent).advice


@pytest.mark.parametrize(
    ("status", "now_s"),
    [
        (heard(replace(BRAVO, state="lost"), other(in_charge="Anna")), NOW_S + 20.0),
        (HEARD, NOW_S + max(20.0, NODE_SILENT_S + 1.0)),
    ],
)
def test_what_is_no_longer_heard_is_told_as_past(status: StationsStatus, now_s: float) -> None:
    assert refusal("Bravo/1", status, now_s).advice == (
        "Anna was in charge of it there when it was last heard, 20 s ago. Call Bravo."
    )


@pytest.mark.parametrize(
    ("words", "status", "what"),
    [
        ("Bravo/7", HEARD, "Bravo tells of no vehicle 7"),
        ("Delta/1", HEARD, "No station Delta is heard here"),
        ("Bravo/1", None, "No station Bravo is heard here"),
    ],
)
def test_what_nobody_tells_of_is_not_taken_for_ones_own(words: str, status: StationsStatus | None, what: str) -> None:
    error = refusal(words, status)
    assert error.what.startswith(what)
    assert "by its number" in error.advice


def test_ones_own_may_be_named_with_its_station_and_a_number_alone_is_ones_own() -> None:
    assert own_number("Alpha/2", "Alpha", HEARD, NOW_S) == "2"
    for words in ("1", "", "2 ", "Bravo", "Bravo/", "Bravo/0", "Bravo/01", "Bravo/1/2", "../1", "Bravo/\u0661", "-1"):
        assert own_number(words, "Alpha", HEARD, NOW_S) is None


def test_while_its_own_name_is_not_known_only_a_number_is_ones_own() -> None:
    for words, status in (("Alpha/1", HEARD), ("Delta/1", None)):
        with pytest.raises(BadRequestError, match="own name is not known") as refused:
            own_number(words, "", status, NOW_S)
        assert status_of(refused.value) == 422
        assert refused.value.advice == "Name one of its vehicles by the number alone."
    assert own_number("1", "", HEARD, NOW_S) is None
    with pytest.raises(OtherStationError, match="commanded by Bravo alone"):
        own_number("Bravo/1", "", HEARD, NOW_S)
