"""Radar frames that cannot be used: what was followed is forgotten in time, and why is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import VehicleState
from telemetry.tracking.object_tracking import KEEP_S
from tests.telemetry import perception_flights as flights
from tests.telemetry.moving_flights import T0_MONO_S, T0_UTC_S, Flight, frame, shows_nothing, straight

HEAD_ON = straight((0.0, 80.0), (0.0, -4.0))


def go_on(
    flight: Flight, from_s: float, to_s: float, *, state: Callable[[float], VehicleState], made: Any = None
) -> list[TracksStatus]:
    """Frames go on, all refused, with the vehicle's states of their times; what is told of it."""
    begin = len(flight.told)
    for k in range(round(from_s * 10), round(to_s * 10)):
        flight.following.perceiver.on_state(state(k / 10))
        flight.frame(k / 10, HEAD_ON, made=made)
    assert not any(told.accepted for told in flight.told[begin:])
    return [told.status for told in flight.told[begin:]]


def state_at(t_s: float, **changes: Any) -> VehicleState:
    return flights.state_at(t_s, T0_MONO_S, T0_UTC_S, **changes)


def test_what_is_refused_keeps_no_danger_and_no_proposal_alive() -> None:
    """Positions go on and attitudes stop: no frame can be placed any more."""
    flight = Flight()
    assert flight.fly(0.0, 7.0, HEAD_ON).status.proposal is not None
    statuses = go_on(flight, 7.2, 9.5, state=lambda t_s: state_at(t_s, attitude_t_mono_s=T0_MONO_S + 6.95))
    followed_s = max(told.status.t_mono_s for told in flight.told if told.accepted)
    assert {status.t_mono_s for status in statuses} == {followed_s}
    assert statuses[-1].t_utc_s == pytest.approx(followed_s - T0_MONO_S + T0_UTC_S, abs=1e-3)
    assert all(shows_nothing(status) for status in statuses if status.done_t_mono_s > followed_s + KEEP_S)
    assert statuses[-1].state == "frozen"
    assert statuses[-1].text == "No attitude from the vehicle: nothing is followed."
    assert flight.phases[-1] == "ends"
    assert "no longer in sight: look out" in flight.texts[-1]


def test_broken_frames_are_as_good_as_none() -> None:
    flight = Flight()
    flight.fly(0.0, 7.0, HEAD_ON)
    last = go_on(flight, 7.0, 9.5, state=state_at, made=replace(frame(7.0, 1, [HEAD_ON]), snr_db=bytes(7)))[-1]
    assert last.state == "stale"
    assert shows_nothing(last)
    assert last.t_mono_s == pytest.approx(T0_MONO_S + 6.9)
    assert flight.phases[-1] == "ends"


def half_a_second_late(t_s: float) -> VehicleState:
    """Too late to place a frame, and not old enough to say that the vehicle's states have stopped."""
    return state_at(t_s - 0.5)


def test_frames_that_cannot_be_placed_any_more_are_not_running() -> None:
    flight = Flight()
    flight.fly(0.0, 7.0, HEAD_ON)
    last = go_on(flight, 7.5, 9.5, state=half_a_second_late)[-1]
    assert last.state == "stale"
    assert last.text == "No radar frame could be used for 3 s. Check the sensor and the vehicle."
    assert shows_nothing(last)


def test_frames_that_could_never_be_placed_are_not_running_either() -> None:
    last = go_on(Flight(), 0.5, 1.5, state=half_a_second_late)[-1]
    assert last.state == "stale"
    assert last.text.startswith("No radar frame could be used yet. Check the sensor and the vehicle.")
    assert shows_nothing(last)
