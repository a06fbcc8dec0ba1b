"""What has only passed by is taken back, and nothing else is."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.poses import Pose
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.radar_passing import Passing, PassingParams
from mapping.perceiving.radar_perception import RadarPerception
from tests.mapping.flights import Flight, flat_ground, radar_frame, snr_db

NONE = (np.empty((0, 3)), np.empty(0, np.bool_))


HERE = Pose(0.0, np.zeros(3), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


def taken(
    passing: Passing, t_s: float, points: np.ndarray | None = None, moving: bool = True, radial_m_s: float = 0.0
) -> list[list[int]]:
    where, moves = NONE if points is None else (points, np.full(len(points), moving))
    speeds = np.full(int(moves.sum()), radial_m_s)
    passing.remember(t_s, where[moves], speeds, speeds, HERE)
    return passing.observe(t_s, where, moves, 1.0)[0].tolist()


def taken_back_of(passing: Passing, way_m_s: float, radial_m_s: float) -> list[list[int]]:
    """Of what comes from the north at the first speed and is said to have the second."""
    for k in range(20):
        assert taken(passing, 0.1 * k, np.array([[0.5, 30.5 + 0.1 * k * way_m_s, 5.5]]), radial_m_s=radial_m_s) == []
    return [key for t_s in np.arange(2.0, 6.0, 0.1) for key in taken(passing, float(t_s))]


def test_what_moved_through_is_taken_back_a_moment_later() -> None:
    passing = Passing()
    later = taken_back_of(passing, -5.0, -5.0)
    assert sorted(key[1] for key in later) == list(range(21, 31))
    assert taken(passing, 9.0) == []


@pytest.mark.parametrize("radial_m_s", [5.0, -1.5, -9.0], ids=["away", "slower", "faster"])
def test_what_moved_otherwise_than_its_radial_speed_says_stays(radial_m_s: float) -> None:
    assert taken_back_of(Passing(), -5.0, radial_m_s) == []


def test_nothing_is_taken_back_for_a_radar_that_tells_faster_speeds_than_assumed() -> None:
    passing = Passing()
    passing.look_at_speeds(np.array([0.0, -14.0]))
    assert taken_back_of(passing, -5.0, -5.0) == []
    passing.clear()
    assert taken_back_of(passing, -5.0, -5.0) == []


def test_what_stands_there_keeps_its_voxels_whenever_it_was_seen() -> None:
    for first in (True, False):
        passing = Passing()
        place = np.array([[0.5, 20.5, 5.5]])
        taken(passing, 0.0, place, moving=first)
        taken(passing, 0.1, place, moving=not first)
        assert taken(passing, 5.0) == []


def test_what_is_seen_for_long_stands_there_whatever_its_radial_speed_is_said_to_be() -> None:
    """Radars without a Doppler say 0 of everything."""
    passing, place = Passing(), np.array([[0.5, 20.5, 5.5]])
    for k in range(25):
        assert taken(passing, 0.1 * k, place) == []
    assert taken(passing, 20.0) == []


PLACES = st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), max_size=30)


@given(PLACES, PLACES)
def test_only_voxels_that_were_seen_moving_and_away_from_what_stands_are_taken_back(
    fixed: list[tuple[int, int]], moving: list[tuple[int, int]]
) -> None:
    passing, gone = Passing(PassingParams(gone_s=0.5)), []
    for east, north in fixed:
        gone += taken(passing, 0.0, np.array([[east + 0.5, north + 0.5, 0.5]]), moving=False)
    for k, (east, north) in enumerate(moving):
        gone += taken(passing, 0.1 * k, np.array([[east + 0.5, north + 0.5, 0.5]]))
    gone += taken(passing, 100.0)
    assert {(east, north) for east, north, _ in gone} <= set(moving)
    assert all(max(abs(e - east), abs(n - north)) > 2 for e, n, _ in gone for east, north in fixed)


def frame(flight: Flight, east_m: float, north_m: float, over_ground_m_s: float) -> None:
    """Something level with the vehicle, with that radial speed over ground."""
    flight.move()
    xyz = flight.body(np.array([[east_m, north_m, flight.up_m + 0.5]]))
    away = float(np.linalg.norm(xyz))
    speed = -flight.speed_m_s * xyz[:, 1] / away + over_ground_m_s
    flight.number += 1
    scan = radar_frame(flight.t_s, flight.number, xyz, speed, np.array([snr_db(3.0, away)]))
    assert isinstance(flight.perception, RadarPerception)
    flight.results.append(flight.perception.on_frame(scan, flight.t_s + 0.02))


@pytest.fixture
def flight() -> Flight:
    made = Flight(RadarPerception(Settings(depth_m=20.0)), speed_m_s=1.0)
    made.perception.set_ground(flat_ground())
    return made


def believed(flight: Flight) -> int:
    return len(flight.perception.map.occupied(explained=False))


def test_a_drone_that_comes_near_alarms_and_leaves_no_trail(flight: Flight) -> None:
    for k in range(70):
        frame(flight, 0.0, 45.0 - 0.4 * k, -4.0)
    assert "obstacle" in flight.begun()
    assert believed(flight) > 3
    for _ in range(40):
        frame(flight, 30.0, 60.0, 0.0)
    centres = flight.perception.map.occupied(explained=False)
    assert np.all(np.abs(centres[:, 0]) > 10.0)
    assert "ends" in [e.phase for result in flight.results for e in result.alerts]
    assert len(flight.perception.map.occupied(explained=True)) > 3


def test_a_mast_stays_also_when_a_drone_flies_past_it(flight: Flight) -> None:
    for _ in range(10):
        frame(flight, 0.0, 30.0, 0.0)
    for k in range(60):
        frame(flight, 0.2, 40.0 - 0.4 * k, -4.0)
    for _ in range(40):
        frame(flight, 30.0, 60.0, 0.0)
    centres = flight.perception.map.occupied(explained=False)
    assert np.any(np.hypot(centres[:, 0], centres[:, 1] - 30.0) < 1.5)


def test_a_mast_stays_for_a_radar_that_knows_no_speeds(flight: Flight) -> None:
    flight.speed_m_s = 3.0
    for _ in range(50):
        frame(flight, 0.0, 40.0, 3.0)
    before = believed(flight)
    assert before > 0
    for _ in range(60):
        frame(flight, 40.0, 90.0, 0.0)
    centres = flight.perception.map.occupied(explained=False)
    assert np.any(np.hypot(centres[:, 0], centres[:, 1] - 40.0) < 1.5)


def past_a_mast(
    seed: int,
    mast_enu_m: tuple[float, float],
    speed_m_s: Callable[[float], float],
    heading_rad: Callable[[float], float],
    *,
    folded_m_s: float = 67 * 0.31,
    late_s: float = 0.0,
) -> tuple[int, int]:
    """Most voxels ever believed of it, and those left at the end, when it has long been out of sight."""
    random, perception = np.random.default_rng(seed), RadarPerception(Settings())
    perception.set_flying(True)
    north_m, most = 0.0, 0
    for k in range(100):
        t_s = 0.1 * k
        north_m += 0.1 * speed_m_s(t_s - 0.05)
        perception.feed_position(100 + t_s, (0.0, north_m, 20.0), (0.0, speed_m_s(max(t_s - late_s, 0.0)), 0.0))
        perception.feed_attitude(100 + t_s, 0.0, 0.0, heading_rad(t_s))
        east, north = mast_enu_m[0], mast_enu_m[1] - north_m
        away, azimuth = math.hypot(east, north), math.remainder(math.atan2(east, north) - heading_rad(t_s), math.tau)
        seen = abs(azimuth) < math.radians(45.0)
        azimuth += random.normal() * math.radians(1.0) / max(math.cos(azimuth), 0.3)
        measured_m = away + 0.15 * random.normal()
        place = measured_m * np.array([[math.sin(azimuth), math.cos(azimuth), 0.05]])
        radial = 0.31 * round(math.remainder(-speed_m_s(t_s) * north / away, folded_m_s) / 0.31)
        scan = radar_frame(100 + t_s, k, place[:seen], np.array([radial])[:seen], np.array([45.0])[:seen])
        perception.on_frame(scan, 100.02 + t_s)
        most = max(most, len(perception.map.occupied(explained=False)))
    return most, len(perception.map.occupied(explained=False))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("folded_m_s", [7.0, 10.0, 14.0])
def test_a_mast_stays_for_a_radar_that_folds_speeds_elsewhere(seed: int, folded_m_s: float) -> None:
    """Beside the way, and lost from sight by a turn."""
    for mast, turn_rad_s in (((20.0, 30.0), 0.0), ((8.0, 50.0), -0.6)):
        most, left = past_a_mast(
            seed, mast, lambda _: 8.0, lambda t, w=turn_rad_s: w * min(t, 3.0), folded_m_s=folded_m_s
        )
        assert left == most > 0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("late_s", [0.2, 0.3, 0.5])
def test_a_mast_stays_when_the_vehicles_velocity_comes_late(seed: int, late_s: float) -> None:
    """It accelerates by 5 m/s2 towards it, then turns away."""
    most, left = past_a_mast(
        seed,
        (8.0, 60.0),
        lambda t: min(15.0, 5.0 * max(t, 0.0)),
        lambda t: -math.radians(60.0) * min(max(t - 1.6, 0.0), 2.0),
        late_s=late_s,
    )
    assert left == most > 0
