"""Ways over which the vehicle hears nothing, though it is heard; with clocks of the test's own."""

from __future__ import annotations

import pytest

from telemetry.link.ways.choosing import SETTLE_S
from tests.telemetry.way_carriers import LTE, TICK_S, WIFI, Carrier, Field


@pytest.mark.parametrize("routed", [False, True])
def test_a_way_over_which_the_vehicle_hears_nothing_is_left_and_not_used_again_before_it_does(routed: bool) -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(delay_s=0.15), routed=routed)
    field_.run(10.0)
    assert field_.used == WIFI
    field_.carriers[WIFI].deaf = True
    field_.run(5.0)
    ((_, change),) = field_.changes
    assert (field_.used, change.is_loss) == (LTE, True)
    assert "unanswered" in change.why
    deaf, heard_ = field_.ways.status(field_.now_s)
    assert (deaf.address, deaf.round_trip_s, deaf.quality) == (WIFI, None, pytest.approx(1.0, abs=0.1))
    assert heard_.round_trip_s == pytest.approx(0.3, abs=2 * TICK_S)
    field_.run(30.0)
    assert len(field_.changes) == 1
    field_.carriers[WIFI].deaf, back_s = False, field_.now_s
    field_.run(30.0)
    assert field_.used == WIFI
    assert field_.changes[-1][0] - back_s >= SETTLE_S


def test_over_a_way_that_is_deaf_the_state_is_still_better_than_none() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    field_.run(5.0)
    field_.carriers[LTE].deaf = True
    field_.run(6.0)
    field_.carriers[WIFI].cut = True
    field_.run(2.0)
    assert field_.used == LTE


def test_a_vehicle_that_answers_no_question_any_more_stays_on_its_way() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(hz=9.0, delay_s=0.2))
    field_.run(10.0)
    field_._answers = False
    field_.run(30.0)
    assert (field_.used, field_.changes) == (WIFI, [])
    silent = Field(wifi=Carrier(), answers=False)
    silent.run(30.0)
    (shown,) = silent.ways.status(silent.now_s)
    assert (shown.round_trip_s, shown.quality) == (None, 1.0)


def test_what_is_lost_both_ways_is_hardly_ever_taken_for_deafness() -> None:
    whys: list[str] = []
    for seed in range(6):
        field_ = Field(seed, radio=Carrier(loss=0.3, delay_s=0.1), lte=Carrier(loss=0.3, delay_s=0.1))
        field_.run(60.0)
        whys += [change.why for _, change in field_.changes]
    assert sum("unanswered" in why for why in whys) <= 1, "in six minutes"


def test_behind_a_router_each_way_takes_its_own_answer() -> None:
    field_ = Field(wifi=Carrier(delay_s=0.01), radio=Carrier(hz=5.0, delay_s=0.4), routed=True)
    field_.run(8.0)
    wifi, radio = field_.ways.status(field_.now_s)
    assert wifi.round_trip_s == pytest.approx(0.02, abs=2 * TICK_S)
    assert radio.round_trip_s == pytest.approx(0.8, abs=2 * TICK_S)
    assert radio.identity == "known"
