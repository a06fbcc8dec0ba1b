"""The camera's map of the whole flight: it keeps what the local one forgets, on one path at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import quaternions
from mapping.perceiving.camera_path import PathWatch
from mapping.perceiving.flight_map import FlightMap
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.vision_perception import VisionPerception
from mapping.sensor_frames import SlamPose
from tests.mapping.flights import Flight
from tests.mapping.test_vision_perception import floor, flying, pole, slam_of

STILL = np.zeros(3)


def vision(flight: Flight) -> VisionPerception:
    assert isinstance(flight.perception, VisionPerception)
    return flight.perception


def seen(flight: Flight, north_m: float, *, drift: np.ndarray = STILL) -> None:
    """One frame with a pole there."""
    flight.camera(pole(north_m), slam=slam_of(flight, turn=0.7, drift=drift))
    flight.perception.accumulate()


def fly(flight: Flight, frames: int, *, drift: np.ndarray = STILL) -> None:
    for _ in range(frames):
        flight.move()
        seen(flight, 30.0, drift=drift)


def occupied(flight: Flight, north_m: float) -> tuple[bool, bool]:
    """(in the local map, in that of the flight)"""
    maps = flight.perception.map, vision(flight).flight.map
    local, whole = (bool(m.probability([[0.1, north_m, 0.0]])[0] > 0.5) for m in maps)
    return local, whole


def test_what_the_local_map_forgets_is_kept() -> None:
    flight = flying()
    flight.move()
    seen(flight, 12.25)
    flight.move()
    seen(flight, 16.25)
    assert occupied(flight, 12.25) == (False, True)
    assert occupied(flight, 16.25) == (True, True)


def test_a_frame_goes_in_after_it_was_told() -> None:
    flight = flying()
    flight.move()
    flight.camera(pole(12.0))
    assert vision(flight).flight.map.occupied_count == 0
    flight.perception.accumulate()
    once = vision(flight).flight.map.revision
    flight.perception.accumulate()
    assert vision(flight).flight.map.revision == once > 0


def test_known_ground_stays_known_and_alarms_of_nothing() -> None:
    flight = flying()
    for _ in range(20):
        flight.move()
        flight.camera(floor(flight.north_m))
        flight.perception.accumulate()
    whole = vision(flight).flight.map
    assert len(whole.occupied(explained=True)) > len(flight.perception.map.occupied(explained=True))
    assert not flight.begun()


@pytest.mark.parametrize("jump", [np.array([1.2, 0.0, 0.0]), np.array([0.0, 0.0, -40.0])], ids=["1 m", "40 m"])
def test_a_jump_of_the_cameras_path_begins_a_new_part(jump: np.ndarray) -> None:
    flight = flying()
    fly(flight, 20)
    fly(flight, 150, drift=jump)
    whole = vision(flight).flight
    assert whole.part == 2
    assert whole.why == f"The camera's path jumped by {np.linalg.norm(jump):.1f} m"
    centres = whole.map.occupied()
    np.testing.assert_allclose(centres[:, 0].mean(), 0.1 + jump[0], atol=0.4)
    assert np.ptp(centres[:, 0]) < 1.1, "what was seen before the jump stands beside it"


def test_a_flight_that_turns_brakes_and_drifts_is_one_part() -> None:
    flight = flying()
    for k in range(200):
        flight.heading_rad = 1.5 * math.sin(k / 15)
        flight.speed_m_s = 4.0 + 3.0 * math.sin(k / 20)
        flight.move()
        seen(flight, flight.north_m + 9.0, drift=np.array([0.02 * k, 0.0, 0.0]))
    assert vision(flight).flight.part == 1


def test_a_path_that_was_lost_begins_a_new_part() -> None:
    flight = flying()
    fly(flight, 10)
    vision(flight).feed_camera(SlamPose(flight.t_s, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), "lost"))
    fly(flight, 10)
    assert vision(flight).flight.part == 2
    assert "lost its way" in vision(flight).flight.why


def test_before_the_first_position_it_is_kept_and_moves_with_the_frame() -> None:
    flight = flying()
    for k in range(30):
        flight.move(has_fix=k >= 20)
        if k < 15:
            flight.perception.track.clear()
        seen(flight, 30.0)
    whole = vision(flight).flight
    assert whole.part == 1
    centres = whole.map.occupied()
    np.testing.assert_allclose(centres[:, :2].mean(axis=0), [0.1, 30.0], atol=0.5)
    assert len(centres) < 4 * len(flight.perception.map.occupied())


def test_a_moved_map_is_as_sure_as_before() -> None:
    whole = FlightMap(Settings(resolution_m=0.5))
    centres = np.array([[0.25, 0.25, 0.25], [10.25, 0.25, 0.25]])
    for hits in (centres, centres[:1], centres[:1]):
        whole.take(hits, np.array([True, False])[: len(hits)])
        whole.put_in()
    before = whole.map.probability(centres)
    quarter = quaternions.rotation(quaternions.from_attitude(math.pi / 2, 0.0, 0.0))
    whole.move(quarter, np.array([100.0, 0.0, 5.0]))
    moved = centres @ quarter.T + [100.0, 0.0, 5.0]
    np.testing.assert_allclose(whole.map.probability(moved), before, atol=1e-6)
    assert whole.map.explained(moved).tolist() == [True, False]
    assert whole.map.occupied_count == 2


def test_a_new_part_is_another_map_so_that_what_the_one_before_held_is_not_taken_for_gone() -> None:
    whole = FlightMap(Settings(resolution_m=0.5))
    first = whole.map
    whole.begin_part("The camera's path jumped by 3.0 m", 1.0)
    assert whole.map is first, "nothing was seen yet"
    whole.take(np.array([[0.25, 0.25, 0.25]]), None)
    whole.put_in()
    whole.begin_part("The camera's path jumped by 3.0 m", 2.0)
    assert (whole.part, whole.map.occupied_count, first.occupied_count) == (2, 0, 1)
    assert whole.map is not first


def test_it_is_emptied_and_begun_anew_with_the_local_one() -> None:
    flight = flying()
    fly(flight, 5)
    flight.perception.clear()
    assert vision(flight).flight.map.occupied_count == 0
    fly(flight, 5)
    flight.perception.set_settings(Settings(resolution_m=0.25, memory_limit_bytes=2_000_000))
    assert vision(flight).flight.map.occupied_count == 0
    assert vision(flight).flight.map.resolution_m == 0.25


def test_its_memory_is_bounded_and_what_is_left_out_counted() -> None:
    whole = FlightMap(Settings(resolution_m=0.5, memory_limit_bytes=200_000))
    for k in range(200):
        row = [[8.0 * n, 8.0 * k, 0.0] for n in range(60)]
        whole.take(np.array(row, np.float64), None)
        whole.put_in()
    assert whole.map.is_full
    assert whole.map.size_bytes <= 200_000
    assert whole.map.refused_updates > 1000


def test_a_jump_is_told_from_a_gap_and_from_noise() -> None:
    watch, rng, t_s = PathWatch(), np.random.default_rng(3), 0.0
    level = np.array([1.0, 0.0, 0.0, 0.0])
    for k in range(300):
        t_s += 0.05 if k != 150 else 1.5
        found = watch.add(t_s, np.array([8.0 * t_s, 0.0, 0.0]) + rng.normal(0, 0.03, 3), level)
        assert found is None, k
    turned = quaternions.from_attitude(math.radians(30), 0.0, 0.0)
    found = watch.add(t_s + 0.05, np.array([8.0 * (t_s + 0.05), 0.0, 0.0]), turned)
    assert found is not None
    assert (found.after_t_s, found.from_t_s) == (t_s, t_s + 0.05)
    assert "30 degrees" in found.why
