"""The row of the check before a start: passed only while all that is known of is heard, and stands."""

from __future__ import annotations

from dataclasses import replace

import pytest

from server.flying.apart.others_heard import LISTENED_S, NODE_SILENT_S, VEHICLE_SILENT_S, row_of_others
from telemetry.topics.station_vehicles import OtherStation, StationsStatus
from tests.server.test_other_stations import NOW_S, heard, other

BRAVO = OtherStation("Bravo", "live", NOW_S, 0.0, 2, hears_us=True)
STANDS = other(in_air=False, armed=False, link="live"), other(in_air=False, armed=False, link="none", number=2)
GOOD = heard(BRAVO, *STANDS)
CHARLIE = OtherStation("Charlie", "live", NOW_S, 0.0, 0, hears_us=True)


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
            heard(BRAVO, STANDS[0], replace(STANDS[1], heard_t_mono_s=NOW_S - VEHICLE_SILENT_S - 0.1)),
            "not heard: Wasp (Bravo 2)",
        ),
        (heard(BRAVO, STANDS[0], other(number=2, link="live")), "In the air, and no plan tells where it will be"),
    ],
)
def test_before_a_start_nothing_that_is_not_heard_is_taken_for_clear(status: StationsStatus | None, words: str) -> None:
    row = row_of_others(status, NOW_S)
    assert (row.state, row.mend) == ("accept", "Agree with whoever flies there.")
    assert words in row.text
