"""Why avoidance holds, in words that say what to do; and that what they say is so."""

from __future__ import annotations

import pytest

from telemetry.flight.avoidance.regions import Regions
from telemetry.flight.avoidance.trusted_sensors import TrustedSensors
from telemetry.topics.obstacles import PerceptionSettings, PerceptionStatus, Region, Sensor
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.avoiding_bench import Wall, craft, state

OCCUPIED = Region((0.0, 0.0, 0.0), 0.0, 7.0, 0.4, 2.0, occupied=True)
NEW = VehicleState(1, 1, position_t_mono_s=20.0)
OLD = VehicleState(1, 1, position_t_mono_s=19.0)


def who_saw(sensor: Sensor, t_s: float) -> TrustedSensors:
    regions = Regions(PerceptionSettings())
    regions.take(PerceptionStatus(sensor, "running", "", t_s, 0.0, t_s, region=OCCUPIED), t_s)
    trusted = TrustedSensors(regions)
    trusted.join(t_s)
    return trusted


def test_while_all_is_new_there_is_nothing_to_say() -> None:
    assert who_saw("radar", 20.0).blind(NEW, 20.0) == who_saw("radar", 20.0).silent(NEW, 20.0) == ""


@pytest.mark.parametrize(("sensor", "word"), [("vision", "vision"), ("ranges", "range sensors")])
def test_a_sensor_that_is_missing_on_the_climb_is_named_with_what_follows(sensor: Sensor, word: str) -> None:
    said = who_saw(sensor, 19.0).blind(NEW, 20.0)
    assert said == f"Nothing new from {word}. It climbs on by itself once something comes. Or return home."


def test_a_position_that_is_too_old_says_what_follows() -> None:
    said = "The vehicle's position is too old. It goes on by itself with a new one. Or return home."
    trusted = who_saw("radar", 20.0)
    assert trusted.blind(OLD, 20.0) == trusted.silent(OLD, 20.0) == said


def test_on_the_climb_only_new_frames_end_the_hold_and_not_resume() -> None:
    it = craft(Wall(25, 18))
    it.until(lambda: it.avoiding.detour.phase == "climbing" and it.truth[2] > 10.0)
    it.senses[0].silent = True
    it.until(lambda: state(it) == "holding")
    it.perform(it.avoiding.resume(it.now_s))
    it.advance(2.0)
    assert state(it) == "holding"
    it.senses[0].silent = False
    it.until(lambda: state(it) == "climbing")
