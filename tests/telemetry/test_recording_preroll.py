"""What a recording begins with."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from telemetry.recording.trigger import SECONDS, Preroll, Stamped
from telemetry.topics.messages import FlightStatus, Topic, VehicleText
from tests.telemetry.recordings import PLAN, state_at


def test_states_of_long_ago_come_first_with_the_time_of_the_beginning() -> None:
    preroll = Preroll()
    preroll.add(Stamped(0.0, Topic.PLAN, PLAN))
    preroll.add(Stamped(1.0, Topic.TEXT, VehicleText(1.0, 6, "old")))
    preroll.add(Stamped(2.0, Topic.FLIGHT, FlightStatus()))
    preroll.add(Stamped(97.0, Topic.VEHICLE, state_at(97.0)))
    preroll.add(Stamped(98.0, Topic.TEXT, VehicleText(98.0, 6, "new")))
    taken = preroll.take(100.0)
    assert [(s.t_mono_s, s.topic) for s in taken] == [
        (97.0, Topic.PLAN),
        (97.0, Topic.FLIGHT),
        (97.0, Topic.VEHICLE),
        (98.0, Topic.TEXT),
    ]


def test_after_a_long_silence_only_the_states_are_left() -> None:
    preroll = Preroll()
    preroll.add(Stamped(0.0, Topic.PLAN, PLAN))
    preroll.add(Stamped(0.5, Topic.TEXT, VehicleText(0.5, 6, "old")))
    assert preroll.take(60.0) == [Stamped(60.0, Topic.PLAN, PLAN)]
    assert Preroll().take(60.0) == []


@given(st.lists(st.floats(0, 3), max_size=60))
def test_it_holds_the_last_seconds_in_order(gaps: list[float]) -> None:
    preroll, now_s, sent = Preroll(), 0.0, []
    for gap in gaps:
        now_s += gap
        sent.append(Stamped(now_s, Topic.TEXT, VehicleText(now_s, 6, "x")))
        preroll.add(sent[-1])
    assert preroll.take(now_s) == [s for s in sent if s.t_mono_s >= now_s - SECONDS]
