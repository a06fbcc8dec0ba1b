"""Alerts: latched per obstacle, over only after a while."""

import math

from hypothesis import given
from hypothesis import strategies as st

from mapping.perceiving.alerts import AlertBook, AlertEvent
from mapping.perceiving.obstacles import Found


def seen_at(east: float, north: float, *, up: float = 0.0, size: float = 1.0) -> Found:
    away = math.hypot(east, north)
    bearing = math.atan2(east, north)
    return Found(
        "roi",
        away,
        bearing % (2 * math.pi),
        bearing,
        up + 0.5,
        2.0,
        (east, north, up),
        (east - size / 2, north - size / 2, up - 0.5),
        (east + size / 2, north + size / 2, up + 0.5),
        1,
    )


def phases(events: list[AlertEvent]) -> list[str]:
    return [event.phase for event in events]


def test_one_obstacle_from_begin_to_end() -> None:
    book = AlertBook("radar", prefix="radar-7")
    told = [(k / 10, event) for k in range(30) for event in book.observe([seen_at(0, 10 - k / 10)], k / 10)]
    assert [(t, e.phase, e.id) for t, e in told] == [
        (0.0, "begins", "radar-7-1"),
        (1.0, "goes_on", "radar-7-1"),
        (2.0, "goes_on", "radar-7-1"),
    ]
    assert told[0][1].text == "radar: obstacle 10 m ahead, its top level with the vehicle, contact in 2.0 s"
    assert book.observe([], 3.0) == []
    assert phases(book.observe([], 4.5)) == ["ends"]
    assert book.end_all(5.0) == []


def test_a_gap_shorter_than_the_hysteresis_ends_nothing() -> None:
    book = AlertBook("radar")
    book.observe([seen_at(0, 10)], 0.0)
    assert book.observe([], 1.0) == []
    assert phases(book.observe([seen_at(0, 10)], 1.4)) == ["goes_on"]
    assert book.observe([], 2.5) == []


def test_a_building_seen_in_pieces_is_one_alert_and_a_far_mast_another() -> None:
    book = AlertBook("radar")
    pieces = [seen_at(-3, 10), seen_at(0, 10), seen_at(3, 10)]
    assert phases(book.observe(pieces, 0.0)) == ["begins"]
    assert phases(book.observe([*pieces, seen_at(15, 10)], 0.1)) == ["begins"]
    assert len(book.end_all(0.2)) == 2


def test_a_column_is_one_obstacle_at_whatever_height_it_is_seen() -> None:
    book = AlertBook("radar")
    book.observe([seen_at(0, 10)], 0.0)
    assert book.observe([seen_at(0, 10, up=25)], 0.1) == []


def test_a_sensor_s_own_troubles_are_alerts_too() -> None:
    book = AlertBook("vision")
    assert book.say("divergence", False, "", 0.0) == []
    (begins,) = book.say("divergence", True, "5 m apart", 1.0)
    assert (begins.phase, begins.kind, begins.obstacle) == ("begins", "divergence", None)
    assert book.observe([], 10.0) == [], "obstacles' silence does not end it"
    assert phases(book.say("divergence", True, "6 m apart", 11.0)) == ["goes_on"]
    assert phases(book.say("divergence", False, "3 m apart", 12.0)) == ["ends"]


def test_all_end_when_the_map_is_emptied() -> None:
    book = AlertBook("radar")
    book.observe([seen_at(0, 10), seen_at(30, 10)], 0.0)
    assert phases(book.end_all(1.0)) == ["ends", "ends"]
    assert book.pass_time(9.0) == []


looks = st.lists(st.lists(st.tuples(st.floats(-40, 40), st.floats(-40, 40)), max_size=5), min_size=1, max_size=40)


@given(looks)
def test_every_alert_begins_once_and_ends_once(sequence: list[list[tuple[float, float]]]) -> None:
    book = AlertBook("radar")
    told: dict[str, list[str]] = {}
    t = 0.0
    for look in sequence:
        t += 0.4
        for event in book.observe([seen_at(e, n) for e, n in look], t):
            told.setdefault(event.id, []).append(event.phase)
        if look:
            assert any(history[-1] != "ends" for history in told.values()), "what is in a region is alarmed"
    for event in book.pass_time(t + 10):
        told.setdefault(event.id, []).append(event.phase)
    for history in told.values():
        assert history[0] == "begins"
        assert history[-1] == "ends"
        assert set(history[1:-1]) <= {"goes_on"}
