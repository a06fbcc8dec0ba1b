"""Avoidance with the simulated vehicle in virtual time where frames stop, come late or show nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.telemetry.avoiding_bench import Craft, Sense, Wall, craft, state


def test_frames_that_stop_while_it_climbs_make_it_hold_until_they_come_again() -> None:
    it = craft(Wall(25, 18))
    it.until(lambda: it.avoiding.detour.phase == "climbing" and it.truth[2] > 10.0)
    it.senses[0].silent = True
    it.until(lambda: state(it) == "holding")
    it.advance(3.0)
    assert it.state.mode == "BRAKE"
    held_m = it.truth[2]
    assert held_m < 13.5
    assert "vision" in it.avoiding.status.text
    assert it.avoiding.flight_status().phase == "paused"
    it.advance(4.0)
    assert it.truth[2] == pytest.approx(held_m, abs=0.1)
    it.senses[0].silent = False
    it.until(lambda: state(it) == "offset")
    assert it.truth[2] > 18.5


def silenced_on_the_rest(sense: Sense) -> Craft:
    """It saw the building; its frames stop on the way on at the new height."""
    it = craft(Wall(25, 14), senses=[sense])
    it.until(lambda: state(it) == "offset" and it.truth[0] > 26)
    sense.silent = True
    it.until(lambda: state(it) == "holding", 3)
    it.until(lambda: it.state.mode == "BRAKE" and (it.state.ground_speed_m_s or 0.0) < 0.2, 10)
    return it


@pytest.mark.parametrize(
    "sense", [Sense("vision", 7.0, 0.2), Sense("radar", 10.0, 0.1)], ids=lambda sense: sense.sensor
)
def test_frames_that_stop_on_the_rest_of_the_flight_make_it_brake_until_they_come_again(sense: Sense) -> None:
    it = silenced_on_the_rest(replace(sense))
    assert it.avoiding.status.text.startswith(f"No frames from {sense.sensor}.")
    held_m = it.truth[0]
    it.advance(10.0)
    assert it.truth[0] - held_m < 0.3
    it.senses[0].silent = False
    it.until(lambda: state(it) == "offset", 5)
    it.until(lambda: it.state.mode == "RTL")


def test_without_its_frames_the_rest_is_flown_when_the_operator_says_so() -> None:
    it = silenced_on_the_rest(Sense("vision", 7.0, 0.2))
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: state(it) == "offset", 5)
    it.until(lambda: it.state.mode == "RTL")


def test_switched_off_the_rest_is_flown_without_frames() -> None:
    it = silenced_on_the_rest(Sense("radar", 10.0, 0.1))
    it.perform(it.avoiding.disable(it.now_s))
    it.until(lambda: state(it) == "offset", 5)
    it.until(lambda: it.state.mode == "RTL")


def test_a_radar_that_sees_nothing_sends_empty_frames_and_does_not_stop_the_rest_of_the_flight() -> None:
    it = craft(Wall(25, 14), senses=[Sense("radar", 10.0, 0.1)])
    it.until(lambda: it.state.mode == "RTL")
    assert "holding" not in it.states


def test_a_camera_that_sees_nothing_in_the_open_sky_does_not_stop_the_rest_of_the_flight() -> None:
    it = craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 26)
    it.senses[0].state = "blind"
    it.until(lambda: it.state.mode == "RTL")
    assert "holding" not in it.states


@pytest.mark.parametrize("late_s", [0.6, 1.0, 1.5])
@pytest.mark.parametrize(("sensor", "depth_m", "period_s"), [("radar", 10.0, 0.1), ("vision", 7.0, 0.2)])
def test_frames_that_come_late_make_it_slower_and_stop_it_before_what_they_saw(
    sensor: Any, depth_m: float, period_s: float, late_s: float
) -> None:
    it = craft(Wall(40, 15), senses=[Sense(sensor, depth_m, period_s, late_s=late_s)])
    it.until(lambda: state(it) == "holding", 60)
    it.advance(10.0)
    assert state(it) == "holding", "what is seen late is not seen to be clear"
    assert max(n for _, n, u in it.trail if u < 15.5) < 40.0 - 1.0
    late = (
        f"{sensor.capitalize()}: over 0.5 s late. It brakes that much later, and then holds; end what else runs here."
    )
    assert late in it.texts
    if it.avoiding.slowed_to_m_s is not None:
        assert any(text.startswith("Slowed to ") and text.endswith(f", and came late. {late}") for text in it.texts)
    waits = f"Frames from {sensor} come over 0.5 s late. It climbs on by itself once they come in time. Or return home."
    assert it.avoiding.status.text == waits
    it.senses[0].silent = True
    it.until(lambda: it.avoiding.status.text.startswith(f"Nothing new from {sensor}. "), 3)
    it.senses[0].silent, it.senses[0].late_s = False, 0.05
    it.until(lambda: state(it) == "offset", 60)
    assert max(n for _, n, u in it.trail if u < 15.5) < 40.0 - 0.6


@pytest.mark.parametrize("late_s", [0.3, 0.4, 0.48])
@pytest.mark.parametrize(("sensor", "depth_m", "period_s"), [("radar", 10.0, 0.1), ("vision", 7.0, 0.2)])
def test_a_sensor_that_is_a_little_late_does_not_make_it_stop_and_go(
    sensor: Any, depth_m: float, period_s: float, late_s: float
) -> None:
    it = craft(Wall(40, 15), senses=[Sense(sensor, depth_m, period_s, late_s=late_s)])
    it.until(lambda: state(it) == "offset", 90)
    assert max(n for _, n, u in it.trail if u < 15.5) < 40.0 - 0.6
    it.advance(10.0)
    assert len(it.modes()) <= 3
    assert "holding" not in it.states


def test_a_late_sensor_beside_one_in_time_does_not_keep_it_from_climbing_on() -> None:
    late = Sense("vision", 7.0, 0.2, late_s=0.8)
    it = craft(Wall(40, 15), senses=[Sense("radar", 10.0, 0.1), late])
    it.until(lambda: state(it) == "offset", 90)
    assert "holding" not in it.states
    assert max(n for _, n, u in it.trail if u < 15.5) < 40.0 - 0.6


def test_without_a_frame_it_says_that_it_is_blind_and_as_soon_as_frames_stop() -> None:
    it = craft(senses=[Sense("radar", 10.0, 0.1)])
    it.advance(1.0)
    assert state(it) == "watching"
    (eye,) = it.avoiding.status.eyes
    assert (eye.sensor, eye.depth_m) == ("radar", 10.0)
    assert 3.5 < eye.largest_speed_m_s < 4.5
    it.senses[0].silent = True
    it.until(lambda: state(it) == "blind", 1.2)
    assert it.avoiding.status.text == "No sensor sees ahead: nothing brakes by itself."
    assert it.avoiding.status.eyes == ()
    it.senses[0].silent = False
    it.until(lambda: state(it) == "watching", 0.5)
    assert it.avoiding.status.eyes[0].since_t_mono_s > eye.since_t_mono_s
