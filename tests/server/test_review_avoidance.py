"""Review of flights of which avoidance flew a part."""

from __future__ import annotations

from dataclasses import replace

import pytest

from server.cli.review_command import figure_lines, summary
from server.flying.review import review
from server.flying.review_flight import detours_of
from server.schemas.flight_docs import RecordingDoc
from server.schemas.review_docs import ReviewDoc
from telemetry.recording.frame_facts import SentTarget
from telemetry.recording.recorded_flight import FlightLog
from telemetry.topics.obstacles import AvoidanceStatus
from tests.server.flight_logs import PLAIN, ROUTE, START_UTC_S, degrees, log_of, mission, positions

RECORDING = RecordingDoc(
    id="x", name="x", kind="hedgehop", started_utc="2027-01-15T08:00:00.000Z", duration_s=1.0, bytes=1
)
TAKEN_OVER_S, HOME_S = 20.0, 61.0
"""After the start of the recording: 40 m behind the first waypoint, just behind the last one."""
HIGHER_M = 9.0


def states(*changes: tuple[float, str]) -> tuple[tuple[float, AvoidanceStatus], ...]:
    return tuple((START_UTC_S + t, AvoidanceStatus(enabled=True, state=state)) for t, state in changes)  # type: ignore[arg-type]


def modes(*changes: tuple[float, str]) -> tuple[tuple[float, str], ...]:
    return tuple((START_UTC_S + t, mode) for t, mode in changes)


def climbed_over(*, home_s: float = HOME_S) -> FlightLog:
    """Flown in AUTO, then ``HIGHER_M`` higher in GUIDED, then home."""
    taken_over, left = round(5 * TAKEN_OVER_S), round(5 * home_s)
    places = positions()
    places = [
        *places[:taken_over],
        *((x, y, z + HIGHER_M) for x, y, z in places[taken_over:left]),
        *(places[left:] if home_s == HOME_S else []),
    ]
    ((lat, lon),) = degrees([ROUTE[-1][:2]]).tolist()
    lat_here, lon_here = degrees([(110.0, 150.0)])[0].tolist()
    above = SentTarget(START_UTC_S + TAKEN_OVER_S + 3.0, lat_here, lon_here, 29.0, 6)
    return replace(
        log_of(places, flown=mission(ROUTE)),
        modes=modes((0.0, "AUTO"), (TAKEN_OVER_S, "BRAKE"), (TAKEN_OVER_S + 2.0, "GUIDED"), (home_s, "RTL")),
        avoidance=states((0.0, "watching"), (TAKEN_OVER_S, "climbing"), (30.0, "offset"), (home_s, "watching")),
        targets=(above, SentTarget(START_UTC_S + 30.0, lat, lon, 29.0, 6)),
    )


def reviewed(log: FlightLog) -> ReviewDoc:
    return review(log, RECORDING, dsm=PLAIN)


def test_a_flight_that_avoidance_took_over_is_completed_higher() -> None:
    doc = reviewed(climbed_over())
    assert doc.figures is not None
    assert doc.figures.completed
    assert doc.figures.higher_m == pytest.approx(HIGHER_M, abs=0.2)
    assert doc.figures.higher_from_item == 3
    assert doc.figures.height_error_max_m == pytest.approx(0.0, abs=0.1)
    assert doc.last_waypoint_t_s == pytest.approx(60.0, abs=0.6)
    assert not any("not reached" in note or "not those of the mission" in note for note in doc.notes)
    assert any("Avoidance flew a part" in note for note in doc.notes)


def test_the_command_line_says_so_and_keeps_its_keys() -> None:
    doc = reviewed(climbed_over())
    assert figure_lines(doc)[0] == "COMPLETED, up to 9 m higher from item 3"
    assert summary(doc)["completed"] is True
    assert summary(doc)["higher_from_item"] == 3


def test_one_that_was_called_home_is_not_completed() -> None:
    doc = reviewed(climbed_over(home_s=45.0))
    assert doc.figures is not None
    assert not doc.figures.completed
    assert figure_lines(doc)[0] == "NOT COMPLETED, up to 9 m higher from item 3"
    assert doc.last_waypoint_t_s is None


def test_a_pilot_who_took_over_flies_no_part_of_the_mission() -> None:
    log = climbed_over()
    released = states((0.0, "watching"), (TAKEN_OVER_S, "climbing"), (30.0, "released"))
    doc = reviewed(replace(log, avoidance=released))
    assert doc.figures is not None
    assert not doc.figures.completed


def test_what_is_avoided_on_the_way_home_is_no_part_of_the_mission() -> None:
    log = replace(
        climbed_over(),
        modes=modes((0.0, "AUTO"), (TAKEN_OVER_S - 1.0, "RTL"), (TAKEN_OVER_S, "BRAKE"), (30.0, "GUIDED")),
    )
    assert detours_of(log) == ()
    assert len(detours_of(climbed_over())) == 1
