"""What stood in the way is in the way until it was SEEN to be free: not when it is too near, aside, or forgotten."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.range_perception import RangePerception
from mapping.perceiving.remembered import LOOKS, MOST_COLUMNS, Field, Remembered, Way
from mapping.sensor_frames import RangeFrame
from tests.mapping.flights import radar_frame

WAY = Way(depth_m=10.0, half_angle_rad=math.radians(12.0), half_width_m=0.8, height_m=2.0)
FIELD = Field(nearest_m=1.5, aside_rad=math.radians(45.0))
NORTH_M, TOP_M = 20.5, 15.0


def pose(north_m: float, up_m: float, heading_rad: float = 0.0) -> Pose:
    place = np.array([0.5, north_m, up_m])
    return Pose(0.0, place, np.zeros(3), quaternions.from_attitude(heading_rad, 0.0, 0.0))


def stands(places: F64) -> Bools:
    """The wall, as a map that has seen all of it."""
    return (np.abs(places[:, 1] - NORTH_M) <= 0.5) & (places[:, 2] <= TOP_M)


def nothing(places: F64) -> Bools:
    return np.zeros(len(places), np.bool_)


def of_a_wall() -> Remembered:
    remembered = Remembered(1.0)
    remembered.remember(np.array([[0.5, NORTH_M, 8.5], [1.5, NORTH_M, 8.5]]))
    return remembered


@pytest.mark.parametrize("away_m", [0.3, 1.0, 2.0])
def test_what_is_too_near_is_hidden_however_often_nothing_is_seen(away_m: float) -> None:
    remembered = of_a_wall()
    for _ in range(20):
        hidden = remembered.look(pose(NORTH_M - away_m, 16.0), WAY, FIELD.sees, nothing)
        assert hidden[0] == pytest.approx(away_m)


def test_from_farther_away_it_is_free_after_some_looks_and_stays_so_while_it_is_passed_above() -> None:
    remembered, high = of_a_wall(), TOP_M + 1.5
    for _ in range(LOOKS):
        assert not len(remembered.look(pose(NORTH_M - 4.0, high), WAY, FIELD.sees, stands))
    assert not len(remembered.look(pose(NORTH_M - 0.5, high), WAY, FIELD.sees, nothing))
    assert len(remembered.look(pose(NORTH_M - 0.5, high - 1.0), WAY, FIELD.sees, nothing)), "lower nobody has looked"


def test_fewer_looks_are_a_drop_out() -> None:
    remembered = of_a_wall()
    for _ in range(LOOKS - 1):
        remembered.look(pose(NORTH_M - 4.0, 16.5), WAY, FIELD.sees, nothing)
    assert len(remembered.look(pose(NORTH_M - 0.5, 16.5), WAY, FIELD.sees, nothing))


def test_what_was_free_and_then_is_not_stands_at_all_heights_again() -> None:
    remembered = of_a_wall()
    for _ in range(LOOKS):
        remembered.look(pose(NORTH_M - 4.0, 10.0), WAY, FIELD.sees, nothing)
    remembered.look(pose(NORTH_M - 4.0, 12.0), WAY, FIELD.sees, stands)
    assert len(remembered.look(pose(NORTH_M - 0.5, 30.0), WAY, FIELD.sees, nothing))


def test_beside_the_beam_it_is_hidden_and_behind_the_vehicle_it_is_not_in_the_way() -> None:
    narrow = Field(nearest_m=0.1, aside_rad=math.radians(5.0))
    assert len(of_a_wall().look(pose(NORTH_M - 1.5, 9.0), WAY, narrow.sees, nothing)) == 1
    assert not len(of_a_wall().look(pose(NORTH_M + 3.0, 9.0), WAY, FIELD.sees, nothing))
    assert not len(of_a_wall().look(pose(NORTH_M - 3.0, 9.0, math.pi / 2), WAY, FIELD.sees, nothing))


def test_the_oldest_columns_are_forgotten_first() -> None:
    remembered = Remembered(1.0)
    for north in range(0, 2 * MOST_COLUMNS, 500):
        rows = np.arange(north, north + 500, dtype=np.float64) + np.float64(0.5)
        remembered.remember(np.column_stack([np.full(500, 0.5), rows, np.zeros(500)]).astype(np.float64))
    assert not len(remembered.look(pose(0.0, 0.0), WAY, FIELD.sees, nothing))
    assert len(remembered.look(pose(2 * MOST_COLUMNS - 1.0, 0.0), WAY, FIELD.sees, nothing))


def feed(perception: RadarPerception | RangePerception, t_s: float, north_m: float, up_m: float) -> None:
    perception.feed_position(t_s, (0.0, north_m, up_m), (0.0, 0.0, 0.0))
    perception.feed_attitude(t_s, 0.0, 0.0, 0.0)


def radar_before_a_wall(nearest_m: float) -> float | None:
    """Comes as near to a wall 8 m high, then climbs to 16 m: what is hidden there?"""
    radar, hidden_m = RadarPerception(Settings()), None
    way = [(float(away_m), 5.0) for away_m in np.arange(12.0, nearest_m - 1e-9, -0.2)]
    way += [(nearest_m, float(up_m)) for up_m in np.arange(5.0, 16.0, 0.2)]
    for number, (away_m, up_m) in enumerate(way, start=1):
        t_s = 100.0 + 0.1 * number
        feed(radar, t_s, -away_m, up_m)
        seen = away_m >= 1.5 and up_m < 8.0
        xyz = np.array([[east, away_m, 0.1] for east in (-1.0, 0.0, 1.0)]) if seen else np.empty((0, 3))
        flat = np.zeros(len(xyz))
        result = radar.on_frame(radar_frame(t_s, number, xyz, flat, flat + 30.0), t_s)
        assert result.region is not None
        hidden_m = result.region.hidden_m
    return hidden_m


def test_a_radar_says_what_it_is_too_near_to_see() -> None:
    assert radar_before_a_wall(5.0) is None
    hidden_m = radar_before_a_wall(0.8)
    assert hidden_m is not None
    assert hidden_m < 2.0


def looking(bearing_rad: float, t_s: float, number: int) -> RangeFrame:
    return RangeFrame(t_s, 0.0, number, "", (), (), (), (bearing_rad,), 0.1, 0.2, 4.0)


def test_a_range_finder_that_looks_elsewhere_says_nothing_of_the_way_and_none_sees_farther_than_it_measures() -> None:
    ranges = RangePerception(Settings(depth_m=7.0, resolution_m=0.5))
    feed(ranges, 100.0, 0.0, 5.0)
    assert ranges.on_frame(looking(math.pi, 100.0, 1), 100.0).region is None
    feed(ranges, 100.1, 0.0, 5.0)
    ahead = ranges.on_frame(looking(0.0, 100.1, 2), 100.1).region
    assert ahead is not None
    assert ahead.depth_m == 4.0
