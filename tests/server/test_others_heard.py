"""The row of the check before a start: passed only while all that is known of is heard, and stands."""

from __future__ import annotations

from dataclasses import replace

import pytest

from server.flying.apart.others_heard import LISTENED_S, NODE_SILENT_S, VEHICLE_SILENT_S, row_of_others, with_missing
from telemetry.topics.station_vehicles import OtherStation, StationsStatus
from tests.server.test_other_stations import NOW_S, heard, other

BRAVO = OtherStation("Bravo", "live", NOW_S, 0.0, 2, hears_us=True, sent_t_mono_s=NOW_S)
STANDS = other(in_air=False, armed=False, link="live"), other(in_air=False, armed=False, link="none", number=2)
GOOD = heard(BRAVO, *STANDS)
CHARLIE = OtherStation("Charlie", "live", NOW_S, 0.0, 0, hears_us=True, sent_t_mono_s=NOW_S)


def test_before_a_start_all_that_is_known_of_is_heard_and_stands() -> None:
    row = row_of_others(GOOD, NOW_S)
    assert (row.state, row.mend) == ("good", "")


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (None, "not heard"),
        (replace(GOOD, t_mono_s=NOW_S - NODE_SILENT_S - 0.1), "not heard"),
        (replace(GOOD, router="lost"), "not heard"),
        (replace(GOOD, listens_since_t_mono_s=None), "only just"),
        (replace(GOOD, listens_since_t_mono_s=NOW_S - LISTENED_S + 0.1), "only just"),
        (replace(GOOD, leaves_out="There are more."), "There are more."),
        (replace(GOOD, stations=(), vehicles=()), "No other station is heard"),
        (replace(GOOD, stations=(BRAVO, replace(CHARLIE, state="lost"))), "Charlie is not heard"),
        (replace(GOOD, stations=(BRAVO, replace(CHARLIE, is_double=True))), "two stations called Charlie"),
        (replace(GOOD, stations=(BRAVO, replace(CHARLIE, hears_us=False))), "by Charlie"),
        (replace(GOOD, stations=(BRAVO, replace(CHARLIE, vehicles=1))), "1 vehicles, and 0 of them"),
        (heard(BRAVO, STANDS[0]), "2 vehicles, and 1 of them"),
        (heard(BRAVO, STANDS[0], other(in_air=False, link="lost", number=2)), "not heard: Wasp (Bravo 2)"),
        (heard(BRAVO, STANDS[0], other(in_air=False, link="stale", number=2)), "not heard: Wasp (Bravo 2)"),
        (
            heard(BRAVO, STANDS[0], replace(STANDS[1], sent_t_mono_s=NOW_S - VEHICLE_SILENT_S - 0.1)),
            "not heard: Wasp (Bravo 2)",
        ),
        (heard(BRAVO, STANDS[0], replace(STANDS[1], sent_t_mono_s=None)), "not heard: Wasp (Bravo 2)"),
        (heard(BRAVO, STANDS[1], other(in_air=False, link="live", age_s=None)), "not heard: Wasp (Bravo 1)"),
        (heard(BRAVO, STANDS[1], other(in_air=False, link="live", age_s=VEHICLE_SILENT_S + 0.1)), "not heard: Wasp"),
        (heard(replace(BRAVO, sent_t_mono_s=None), *STANDS), "clock of Bravo is not compared yet"),
        (heard(replace(BRAVO, sent_t_mono_s=NOW_S - 20.0), *STANDS), "what Bravo says comes 20 s late"),
        (heard(replace(BRAVO, is_new=True), *STANDS), "Bravo has only just started again"),
        (heard(BRAVO, STANDS[0], other(number=2, link="live")), "In the air, and nothing tells all that it will fly"),
    ],
)
def test_before_a_start_nothing_that_is_not_heard_is_taken_for_clear(status: StationsStatus | None, words: str) -> None:
    row = row_of_others(status, NOW_S)
    assert (row.state, row.mend) == ("accept", "Agree with whoever flies there.")
    assert words in row.text


BOTH = other(in_air=False, link="live"), other(in_air=False, link="live", number=2)
UNKNOWN = other(in_air=False, link="none", number=2, lat_deg=None, position_t_mono_s=None)


@pytest.mark.parametrize(
    "now",
    [
        pytest.param(heard(BRAVO, BOTH[0], UNKNOWN), id="its station does not know it any more"),
        pytest.param(heard(replace(BRAVO, vehicles=1), BOTH[0]), id="nor tells of it"),
    ],
)
def test_a_vehicle_that_was_heard_and_is_no_longer_is_not_taken_for_clear(now: StationsStatus) -> None:
    kept = with_missing(heard(BRAVO, *BOTH), now)
    assert row_of_others(with_missing(None, heard(BRAVO, *BOTH)), NOW_S).state == "good"
    for _ in range(3):
        later_s = NOW_S + VEHICLE_SILENT_S + 1.0
        told = tuple(replace(each, sent_t_mono_s=later_s, oldest_t_mono_s=later_s) for each in now.vehicles)
        bravo = replace(now.stations[0], sent_t_mono_s=later_s)
        kept = with_missing(kept, replace(now, t_mono_s=later_s, stations=(bravo,), vehicles=told))
        row = row_of_others(kept, later_s)
        assert (row.state, "not heard: Wasp (Bravo 2)" in row.text) == ("accept", True)
    # Heard again on the ground: it is over.
    assert row_of_others(with_missing(kept, heard(BRAVO, *BOTH)), NOW_S).state == "good"


def test_one_in_the_air_of_which_no_place_was_told_does_not_vanish() -> None:
    flies = other(number=2, link="live", lat_deg=None, position_t_mono_s=None)
    kept = with_missing(heard(BRAVO, BOTH[0], flies), heard(BRAVO, BOTH[0], UNKNOWN))
    assert row_of_others(kept, NOW_S).state == "accept"
    assert kept.vehicles[1].it.in_air
    assert row_of_others(with_missing(kept, heard(BRAVO, *BOTH)), NOW_S).state == "good"


@pytest.mark.parametrize("more", [{"is_new": True}, {"is_double": True}])
def test_another_process_under_the_same_name_takes_nothing_out_of_the_air(more: dict[str, bool]) -> None:
    before = heard(BRAVO, replace(other(30.0, link="live"), run=1), BOTH[1])
    stands = tuple(replace(each, run=2) for each in BOTH)
    kept = with_missing(before, heard(replace(BRAVO, **more), *stands))
    assert (kept.vehicles[0].it.in_air, row_of_others(kept, NOW_S).state) == (True, "accept")
    # It was the same station, which has started again.
    kept = with_missing(kept, heard(BRAVO, *stands))
    assert (kept.vehicles[0].it.in_air, row_of_others(kept, NOW_S).state) == (False, "good")


def test_a_place_that_is_known_to_no_better_than_anywhere_is_none() -> None:
    vague = other(number=2, link="live", within_m=1e5)
    first = with_missing(None, heard(BRAVO, BOTH[0], vague))
    assert (first.vehicles[1].it.lat_deg, row_of_others(first, NOW_S).state) == (None, "accept")
    # Where it was seen before counts on, until that is too old.
    seen = with_missing(heard(BRAVO, BOTH[0], other(number=2, link="live", within_m=5.0)), heard(BRAVO, BOTH[0], vague))
    assert seen.vehicles[1].it.lat_deg is not None
    assert row_of_others(seen, NOW_S).state == "accept"
