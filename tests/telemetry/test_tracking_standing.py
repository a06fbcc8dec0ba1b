"""What stands still: remembered beside the vehicle, told of ground, and followed as an operator has set."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.poses import Pose
from mapping.perceiving.ground import ground_grid
from mapping.tracking.tracker_params import TrackState
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings
from telemetry.tracking.evasion import DIRECTIONS, FARTHEST_M, GroundRoom
from telemetry.tracking.followed import Followed
from telemetry.tracking.out_of_view import GONE_S, LONGEST_MOVING_S, LONGEST_S, Remembered
from tests.telemetry.moving_flights import Flight, straight

NORTHWARDS = np.array([1.0, 0.0, 0.0, 0.0])


def pose(t_s: float, north_m: float, *, heading_rad: float = 0.0) -> Pose:
    turned = np.array([math.cos(-heading_rad / 2), 0.0, 0.0, math.sin(-heading_rad / 2)])
    return Pose(t_s, np.array([0.0, north_m, 10.0]), np.array([0.0, 2.0, 0.0]), turned)


def pole(at: tuple[float, float], seen_from: Pose, *, number: int = 1, moving: bool = False) -> Followed:
    velocity = np.array([0.0, -4.0]) if moving else np.zeros(2)
    state = TrackState(number, np.array(at), velocity, np.diag([0.01, 0.01, 0.01, 0.01]), 2.0, 20, True, True)
    offset = state.position_enu_m - seen_from.position_enu_m[:2]
    return Followed(state, moving, offset, math.hypot(*offset), 1.0)


def lost(at: tuple[float, float] = (1.5, 6.0), *, moving: bool = False) -> Remembered:
    """Seen from 4 m before it, then never again."""
    memory, here = Remembered(), pose(100.0, 2.0)
    assert len(memory.observe([pole(at, here, moving=moving)], here)) == 1
    return memory


def test_a_pole_beside_the_vehicle_that_it_cannot_see_any_more_is_still_there() -> None:
    memory = lost()
    seen = [memory.observe([], pose(100.1 + 0.1 * k, 5.0 + 0.1 * k)) for k in range(20)]
    assert [len(frame) for frame in seen] == [1] * 20
    (one,) = seen[-1]
    assert one.remembered
    assert not one.state.seen
    assert one.offset_m == pytest.approx([1.5, 6.0 - 6.9])
    assert one.closest_in_s == 0.0


def test_what_moves_and_is_lost_in_plain_sight_is_not_remembered() -> None:
    assert lost(moving=True).observe([], pose(100.1, 2.0)) == []


def test_what_moves_and_has_left_the_view_goes_on_as_it_did_and_is_known_worse() -> None:
    memory = lost((12.0, 10.0), moving=True)
    (one,) = memory.observe([], pose(101.0, 4.0))
    assert one.remembered
    assert one.moving
    assert one.offset_m == pytest.approx([12.0, 10.0 - 4.0 - 4.0])
    assert one.velocity_enu_m_s.tolist() == [0.0, -4.0]
    assert one.sigma_m == pytest.approx(0.1 * math.hypot(1.0, 1.0))
    assert memory.observe([], pose(100.0 + LONGEST_MOVING_S - 0.1, 4.0))
    assert memory.observe([], pose(100.1 + LONGEST_MOVING_S, 4.0)) == []


def test_what_comes_back_into_view_is_one_thing_not_two() -> None:
    memory, here = lost((12.0, 10.0), moving=True), pose(101.0, 4.0)
    found = memory.observe([pole((12.5, 6.5), here, number=2, moving=True)], here)
    assert [one.id for one in found] == [2]


@pytest.mark.parametrize(("north_m", "is_there"), [(1.2, True), (6.0, False)])
def test_what_was_followed_briefly_is_remembered_only_where_the_radar_cannot_see(
    north_m: float, is_there: bool
) -> None:
    memory, here = Remembered(), pose(100.0, 0.0)
    one = pole((0.1, north_m), here)
    memory.observe([replace(one, state=replace(one.state, updates=4, age_s=0.4))], here)
    assert bool(memory.observe([], pose(100.1, 0.0))) == is_there


def test_in_plain_sight_without_an_echo_it_is_gone() -> None:
    memory = lost((0.5, 8.0))
    seen = [bool(memory.observe([], pose(100.0 + 0.1 * k, 2.0))) for k in range(1, 30)]
    assert seen[5]
    assert not seen[round(GONE_S / 0.1) + 2]


def test_it_is_forgotten_far_away_and_in_the_end() -> None:
    assert lost().observe([], pose(100.1, 60.0)) == []
    memory = lost()
    assert memory.observe([], pose(100.1, 6.0))
    assert memory.observe([], pose(100.2 + LONGEST_S, 6.0)) == []


def test_found_again_it_is_one_thing_not_two() -> None:
    memory, here = lost(), pose(100.2, 3.0)
    memory.observe([], pose(100.1, 3.0))
    found = memory.observe([pole((1.6, 6.1), here, number=2)], here)
    assert [one.id for one in found] == [2]


def hill(east_from_m: float, up_m: float = 20.0):
    """Flat at 0, and up to the east of a line."""
    up = np.zeros((200, 200), np.float32)
    up[:, round(50 + east_from_m) :] = up_m
    return ground_grid(up, [[0.0, -1.0, 100.0], [1.0, 0.0, 50.0]])


def test_the_room_ends_before_rising_ground_and_at_the_edge_of_what_is_known() -> None:
    here = np.array([0.0, 0.0, 10.0])
    room = GroundRoom().around(hill(20.0), here, 1.3)
    north, east, west = room[0], room[DIRECTIONS // 4], room[3 * DIRECTIONS // 4]
    assert (north, west) == (FARTHEST_M, FARTHEST_M)
    assert 17.0 <= east < 20.0
    assert GroundRoom().around(hill(20.0, up_m=8.0), here, 1.3) == (FARTHEST_M,) * DIRECTIONS
    assert max(GroundRoom().around(hill(20.0, up_m=8.8), here, 1.3)[20:40]) < 25.0
    assert GroundRoom().around(hill(99.0), np.array([-30.0, 0.0, 10.0]), 1.3)[3 * DIRECTIONS // 4] < 20.0


def test_no_spike_is_between_the_directions_that_are_looked_in() -> None:
    up = np.zeros((200, 200), np.float32)
    random = np.random.default_rng(0)
    for _ in range(60):
        spiky, (row, col) = up.copy(), random.integers(65, 136, 2)
        spiky[row, col] = 30.0
        grid = ground_grid(spiky, [[0.0, -1.0, 100.0], [1.0, 0.0, 100.0]])
        away = math.hypot(col + 0.5 - 100, 100 - row - 0.5)
        if 5.0 < away < FARTHEST_M - 1.0:
            room = GroundRoom().around(grid, np.array([0.0, 0.0, 10.0]), 1.3)
            assert min(room) < away
            assert min(room) > away - 4.0


def test_without_a_surface_model_no_room_is_told() -> None:
    assert GroundRoom().around(None, np.zeros(3), 1.0) == ()


def test_a_pole_ahead_of_a_flight_is_alerted_with_a_way_past() -> None:
    flight = Flight()
    told = flight.fly(0.0, 6.0, straight((0.3, 30.0), (0.0, 0.0)))
    assert flight.phases[0] == "begins"
    assert flight.texts[0].startswith("Standing object")
    proposals = [one.status.proposal for one in flight.told if one.status.proposal is not None]
    assert proposals
    assert all(one.closest_m >= 2.0 for one in proposals)
    assert told.status.cones


@pytest.mark.parametrize("coordinates", ["cartesian", "polar"])
def test_the_filters_are_those_that_were_chosen_from_then_on(coordinates) -> None:
    flight = Flight()
    flight.fly(0.0, 2.0, straight((0.0, 80.0), (0.0, -4.0)))
    tracker = TrackerSettings(coordinates=coordinates, birth_updates=6)
    flight.following.on_settings(replace(PerceptionSettings(), tracker=tracker))
    before = {track.id for one in flight.told for track in one.status.tracks}
    told = flight.fly(2.0, 6.0, straight((0.0, 80.0), (0.0, -4.0)))
    (track,) = told.status.tracks
    assert flight.following.perceiver.perception._tracker.params.coordinates == coordinates
    assert track.id not in before
    assert track.velocity_enu_m_s == pytest.approx((0.0, -4.0), abs=0.8)


def test_limits_of_velocity_are_those_that_were_set() -> None:
    flight = Flight()
    wanted = VelocitySettings(max_speed_m_s=2.5, max_turn_deg=40.0)
    flight.following.on_settings(replace(PerceptionSettings(), velocities=wanted))
    flight.fly(0.0, 7.0, straight((0.0, 80.0), (0.0, -4.0)))
    found = [one.status.proposal for one in flight.told if one.status.proposal is not None]
    assert found
    for one in found:
        east, north = one.velocity_enu_m_s
        assert math.hypot(east, north) <= 2.5 + 1e-6
        assert abs(math.degrees(math.atan2(east, north))) <= 40.0 + 2.0 or math.hypot(east, north) < 1e-6
