"""Several ways to one vehicle, with clocks of the test's own: which is in use, and whose vehicle it is."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.ways.choosing import SETTLE_S, Ways
from telemetry.link.ways.way import SILENT_S, TELLS_S, LinkWay
from telemetry.topics.messages import LOST_S, STALE_S
from tests.telemetry.frames import attitude, heard, heartbeat
from tests.telemetry.way_carriers import LTE, RADIO, TICK_S, WIFI, Carrier, Field, candidate


def position(lat_deg: float) -> Any:
    return mavlink.MAVLink_global_position_int_message(0, round(lat_deg * 1e7), 89_000_000, 0, 0, 0, 0, 0, 0)


def test_the_same_clock_makes_a_way_of_whoever_has_the_numbers() -> None:
    field_ = Field(wifi=Carrier(), radio=Carrier(hz=2.0, loss=0.3, delay_s=0.2))
    assert not field_.ways.is_known(RADIO)
    field_.run(20.0)
    assert field_.ways.is_known(RADIO)
    assert (field_.used, field_.changes) == (WIFI, [])


@pytest.mark.parametrize("apart_s", [-3600.0, -1.0, 1.0, 25.0])
def test_another_clock_is_another_vehicle_and_never_used(apart_s: float) -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(boot_s=-90.0 + apart_s, delay_s=0.01))
    field_.run(6.0)
    assert [way.address for way in field_.ways.part(field_.now_s)] == [LTE]
    field_.carriers[WIFI].cut = True
    field_.run(5.0)
    assert (field_.used, field_.changes) == (WIFI, [])
    assert field_.ways.part(field_.now_s) == []


def test_round_trips_that_are_too_long_tell_nothing() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(delay_s=TELLS_S))
    field_.run(15.0)
    way = field_.ways.get(LTE)
    assert way is not None
    assert way.clock.round_trip_s == pytest.approx(2 * TELLS_S, abs=2 * TICK_S)
    assert way.identity == "asked"


def test_a_vehicle_that_is_elsewhere_is_another_one_whatever_its_clock_says() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    for _ in range(6):
        field_.run(1.0)
        field_.ways.hear(WIFI, heard(position(47.0)), field_.now_s)
        field_.ways.hear(LTE, heard(position(47.01)), field_.now_s)
    assert [way.address for way in field_.ways.part(field_.now_s)] == [LTE]


def test_one_that_was_known_and_differs_from_now_on_is_parted_with() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(delay_s=0.1))
    field_.run(5.0)
    assert field_.ways.is_known(LTE)
    field_.carriers[LTE].boot_s = -10.0
    field_.run(6.0)
    assert [way.address for way in field_.ways.part(field_.now_s)] == [LTE]


def test_who_comes_back_after_a_long_silence_is_compared_again_before_it_is_used() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    field_.run(5.0)
    carrier = field_.carriers[LTE]
    carrier.cut = True
    field_.run(LOST_S + 1.0)
    carrier.cut, carrier.boot_s = False, -10.0
    field_.run(1.0)
    assert not field_.ways.is_known(LTE)
    assert not field_.ways.takes(LTE, heard(heartbeat()), field_.now_s)
    carrier.boot_s = -90.0
    field_.run(5.0)
    assert field_.ways.is_known(LTE)


def test_one_that_took_over_after_its_own_silence_is_no_witness_against_the_one_before() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    field_.run(5.0)
    wifi, lte = field_.carriers[WIFI], field_.carriers[LTE]
    wifi.cut = lte.cut = True
    field_.run(LOST_S + 2.0)
    lte.cut, lte.boot_s = False, -10.0
    field_.run(2.0)
    assert field_.used == LTE
    wifi.cut = False
    field_.run(10.0)
    assert field_.ways.part(field_.now_s) == []
    assert not field_.ways.is_known(WIFI), "which of the two is the vehicle is not known"
    lte.boot_s = -90.0
    field_.run(5.0)
    assert field_.ways.is_known(WIFI)


def test_a_restart_of_the_vehicle_parts_nothing() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(delay_s=0.2))
    field_.run(5.0)
    for carrier in field_.carriers.values():
        carrier.boot_s = -field_.now_s
    field_.run(8.0)
    assert field_.ways.is_known(LTE)
    assert field_.ways.part(field_.now_s) == []


def test_what_nothing_can_be_compared_with_any_more_is_left_to_the_operator() -> None:
    field_ = Field(wifi=Carrier(cut=True), lte=Carrier())
    field_.run(LOST_S + 0.5)
    assert [(way.address, way.identity) for way in field_.ways.part(field_.now_s)] == [(LTE, "asked")]


@given(hz=st.floats(8.0, 60.0), spare_hz=st.floats(2.0, 20.0), seed=st.integers(0, 99))
@settings(max_examples=12)
def test_when_the_one_in_use_falls_silent_another_takes_over_within_a_second(
    hz: float, spare_hz: float, seed: int
) -> None:
    field_ = Field(seed, wifi=Carrier(hz=hz), lte=Carrier(hz=spare_hz, delay_s=0.1))
    field_.run(8.0 + seed / 100)
    assert field_.used == WIFI
    field_.carriers[WIFI].cut, cut_s = True, field_.now_s
    field_.carriers[WIFI].underway.clear()
    field_.run(1.0 + TICK_S)
    ((at_s, change),) = field_.changes
    assert (field_.used, change.is_loss) == (LTE, True)
    assert SILENT_S - 1 / hz - 2 * TICK_S <= at_s - cut_s <= 1.0 + TICK_S
    assert "silent for" in change.why


def test_one_message_a_second_is_no_silence() -> None:
    field_ = Field(wifi=Carrier(hz=1.0), lte=Carrier(hz=50.0))
    field_.run(30.0)
    assert not any(change.is_loss for _, change in field_.changes)


def test_a_better_one_is_used_after_it_has_been_better_for_long_enough_and_then_it_stays() -> None:
    field_ = Field(radio=Carrier(loss=0.3, delay_s=0.3), wifi=Carrier())
    field_.run(30.0)
    ((at_s, change),) = field_.changes
    assert at_s >= 100.0 + SETTLE_S
    assert (change.before.address, change.now.address, change.is_loss) == (RADIO, WIFI, False)
    assert "instead of" in change.why


def test_a_short_silence_begins_the_time_to_settle_anew() -> None:
    field_ = Field(wifi=Carrier(), radio=Carrier(loss=0.3, delay_s=0.2))
    field_.run(10.0)
    field_.carriers[WIFI].cut = True
    while field_.used == WIFI:
        field_.run(TICK_S)
    field_.run(0.3)
    field_.carriers[WIFI].cut, back_s = False, field_.now_s
    field_.run(30.0)
    assert [change.now.address for _, change in field_.changes] == [RADIO, WIFI]
    assert field_.changes[-1][0] - back_s >= SETTLE_S


def test_after_a_silence_the_better_one_comes_back_once() -> None:
    field_ = Field(wifi=Carrier(), radio=Carrier(loss=0.3, delay_s=0.2))
    field_.run(10.0)
    field_.carriers[WIFI].cut = True
    field_.run(6.0)
    assert field_.used == RADIO
    field_.carriers[WIFI].cut, back_s = False, field_.now_s
    field_.run(30.0)
    assert [change.now.address for _, change in field_.changes] == [RADIO, WIFI]
    assert field_.changes[-1][0] - back_s >= SETTLE_S


@given(
    losses=st.tuples(st.floats(0, 0.5), st.floats(0, 0.5), st.floats(0, 0.5)),
    delays=st.tuples(st.floats(0.01, 0.3), st.floats(0.01, 0.3), st.floats(0.01, 0.3)),
    seed=st.integers(0, 999),
)
@settings(max_examples=8)
def test_between_changes_for_the_better_lies_the_time_to_settle(
    losses: tuple[float, ...], delays: tuple[float, ...], seed: int
) -> None:
    names = ("radio", "wifi", "lte")
    carriers: dict[str, Any] = {
        n: Carrier(loss=loss, delay_s=d) for n, loss, d in zip(names, losses, delays, strict=True)
    }
    field_ = Field(seed, **carriers)
    field_.run(25.0)
    for (before_s, _), (after_s, after) in zip(field_.changes, field_.changes[1:], strict=False):
        assert after.is_loss or after_s - before_s >= SETTLE_S
    assert len(field_.changes) <= 6


def test_when_all_fall_silent_nothing_goes_back_and_forth() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier(hz=7.0), radio=Carrier(hz=3.0))
    field_.run(10.0)
    before = len(field_.changes)
    for carrier in field_.carriers.values():
        carrier.cut = True
    field_.run(20.0)
    assert len(field_.changes) - before <= 2
    used = field_.used
    field_.run(20.0)
    assert field_.used == used


def test_who_hangs_up_is_not_waited_for() -> None:
    field_ = Field(lte=Carrier(), wifi=Carrier())
    field_.run(5.0)
    field_.carriers[LTE].cut = True
    field_.carriers[LTE].underway.clear()
    field_.ways.chosen.gone()
    field_.run(TICK_S)
    assert field_.used == WIFI
    assert field_.changes[-1][1].why == "the far end hung up"


def test_the_one_in_use_can_be_taken_away_in_flight() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    field_.run(5.0)
    assert field_.ways.has_other_live(WIFI, field_.now_s)
    change = field_.ways.remove(WIFI, field_.now_s)
    assert change is not None
    assert (field_.used, change.why) == (LTE, "it was taken away")
    assert not field_.ways.has_other_known(LTE)


def test_state_comes_from_the_way_in_use_and_answers_from_all_once() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    ack = heard(mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 190))
    assert not field_.ways.takes(LTE, ack, field_.now_s), "not known yet"
    field_.run(5.0)
    takes = field_.ways.takes
    assert takes(WIFI, heard(heartbeat()), field_.now_s)
    assert not takes(LTE, heard(heartbeat()), field_.now_s)
    assert takes(LTE, ack, field_.now_s)
    assert not takes(WIFI, ack, field_.now_s)
    assert takes(WIFI, ack, field_.now_s), "it was said a second time"
    assert not takes(LTE, ack, field_.now_s)
    assert not takes("udpin:0.0.0.0:1", ack, field_.now_s)


def test_what_a_stalled_way_held_back_is_not_taken_for_something_new() -> None:
    field_ = Field(wifi=Carrier(), lte=Carrier())
    field_.run(5.0)
    carrier, said = field_.carriers[LTE], heard(mavlink.MAVLink_mission_ack_message(255, 190, 0))
    carrier.delay_s = 2.8
    field_.run(2.7)
    assert field_.ways.is_known(LTE)
    assert not field_.ways.takes(LTE, said, field_.now_s)
    assert field_.ways.takes(WIFI, said, field_.now_s)
    field_.run(10.0)
    assert not field_.ways.takes(LTE, said, field_.now_s), "its answers come, but late"
    carrier.delay_s = 0.1
    carrier.underway.clear()
    field_.run(3.0)
    assert field_.ways.is_known(LTE)
    other = heard(mavlink.MAVLink_mission_ack_message(255, 190, 1))
    assert field_.ways.takes(LTE, other, field_.now_s)


def test_with_one_way_everything_counts() -> None:
    ways = Ways(candidate(WIFI), 0.0)
    ack = heard(mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 190))
    assert all(ways.takes(WIFI, message, 0.0) for message in [ack, ack, heard(heartbeat())])


def test_what_is_shown_of_a_way() -> None:
    way = LinkWay(candidate(RADIO), identity="known")
    assert way.status(0.0, in_use=False).silent_s is None
    for sequence in (0, 1, 4):
        way.hear(heard(attitude(), sequence=sequence), 1.0)
    radio = mavlink.MAVLink_radio_status_message(188, 180, 100, 40, 45, 0, 0)
    way.hear_radio(heard(radio, system=51, component=68), 1.0)
    shown = way.status(1.5, in_use=True)
    assert (shown.in_use, shown.silent_s, shown.quality) == (True, 0.5, pytest.approx(0.6))
    assert shown.signal is not None
    assert (shown.signal.rssi, shown.signal.remote_rssi) == (188, 180)
    assert (shown.signal.noise, shown.signal.remote_noise) == (40, 45)
    assert way.status(60.0, in_use=True).signal is None
    assert not way.is_ready(1.0 + STALE_S + 0.1)
