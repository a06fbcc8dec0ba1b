"""Poses at a frame's time: interpolated, carried on a little, jumps refused."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import quaternions
from mapping.geometry.poses import Pose, PoseTrack, TrackParams


def level(heading: float = 0.0) -> np.ndarray:
    return quaternions.from_attitude(heading, 0.0, 0.0)


def flown(*, velocity: tuple[float, float, float] | None = (0.0, 5.0, 0.0)) -> PoseTrack:
    """Northwards at 5 m/s, turning at 0.5 rad/s: positions 5 a second, attitudes 50 a second, for one second."""
    track = PoseTrack()
    for k in range(6):
        assert track.add_position(10 + k * 0.2, (0.0, k * 1.0, 3.0), velocity) is None
    for k in range(51):
        assert track.add_attitude(10 + k * 0.02, level(k * 0.01)) is None
    return track


@given(st.floats(10, 11))
def test_between_samples(t: float) -> None:
    pose = flown().at(t)
    assert isinstance(pose, Pose)
    np.testing.assert_allclose(pose.position_enu_m, [0, (t - 10) * 5, 3], atol=1e-9)
    assert math.remainder(pose.heading_rad - (t - 10) * 0.5, 2 * math.pi) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(pose.velocity_enu_m_s, [0, 5, 0], atol=1e-9)


def test_velocity_from_positions_where_none_is_given() -> None:
    pose = flown(velocity=None).at(10.5)
    assert isinstance(pose, Pose)
    np.testing.assert_allclose(pose.velocity_enu_m_s, [0, 5, 0], atol=1e-9)


def test_a_little_beyond_the_newest_sample_and_no_more() -> None:
    pose = flown().at(11.15)
    assert isinstance(pose, Pose)
    np.testing.assert_allclose(pose.position_enu_m, [0, 5.75, 3], atol=1e-9)
    assert flown().at(11.25) == "position too far in time"
    assert flown().at(9.75) == "position too far in time"


def test_over_a_gap_only_near_its_edges() -> None:
    track = PoseTrack()
    for t in (10.0, 11.0):
        track.add_position(t, (0, t, 0), (0, 1, 0))
        track.add_attitude(t, level())
    assert isinstance(track.at(10.1), Pose)
    assert isinstance(track.at(10.9), Pose)
    assert track.at(10.5) == "position too far in time"


def test_nothing_known() -> None:
    track = PoseTrack()
    assert track.at(1.0) == "no position"
    track.add_position(1.0, (0, 0, 0))
    assert track.at(1.0) == "no attitude"
    track.add_attitude(0.5, level())
    assert track.at(1.0) == "attitude too far in time"


def test_broken_samples_are_refused() -> None:
    track = flown()
    assert track.add_position(12, (math.nan, 0, 0)) == "not finite"
    assert track.add_position(math.nan, (0, 0, 0)) == "not finite"
    assert track.add_position(12, (0, 0, 0), (math.inf, 0, 0)) == "not finite"
    assert track.add_attitude(12, (0, 0, 0, 0)) == "not finite"
    assert track.add_position(10.5, (0, 2.5, 3)) == "out of order"
    assert track.add_attitude(10.51, level()) == "out of order"
    assert track.add_position(11.0, (0, 5.0, 3), (0, 5, 0)) is None, "the same once more is no error"


def test_a_jump_of_100_m_is_refused_and_its_way_back_is_not() -> None:
    track = flown()
    for k in range(1, 8):
        assert track.add_position(11 + k * 0.2, (100.0, 5.0 + k, 3.0)) == "position jumped"
    assert track.is_doubting
    assert track.at(12.3) == "position too far in time"
    assert track.add_position(12.6, (0.0, 13.0, 3.0)) is None
    assert not track.is_doubting


def test_a_new_place_is_believed_when_it_has_lasted() -> None:
    track = flown()
    told = [track.add_position(11 + k * 0.2, (100.0, 5.0 + k, 3.0)) for k in range(1, 60)]
    assert told[0] == "position jumped"
    assert told[-1] is None
    assert told.index(None) == pytest.approx(TrackParams().settle_s / 0.2, abs=2)


def at_speed(speed_m_s: float) -> PoseTrack:
    """Northward for 5 s, at 20 Hz."""
    track = PoseTrack()
    for k in range(101):
        assert track.add_position(k / 20, (0.0, speed_m_s * k / 20, 10.0), (0.0, speed_m_s, 0.0)) is None
    return track


@pytest.mark.parametrize("speed_m_s", [3.0, 15.0])
@pytest.mark.parametrize("jump_m", [(0.0, -100.0), (0.0, 100.0), (100.0, 0.0), (-30.0, -30.0)])
def test_no_direction_of_a_jump_is_believed_sooner(jump_m: tuple[float, float], speed_m_s: float) -> None:
    track = at_speed(speed_m_s)
    for k in range(101, 300):
        place = (jump_m[0], speed_m_s * k / 20 + jump_m[1], 10.0)
        assert track.add_position(k / 20, place, (0.0, speed_m_s, 0.0)) == "position jumped"
    true = (0.0, speed_m_s * 15.0, 10.0)
    assert track.add_position(15.0, true, (0.0, speed_m_s, 0.0)) is None


def test_where_a_vehicle_turned_and_braked_meanwhile_it_is_believed_at_once() -> None:
    track, north_m, east_m = at_speed(15.0), 75.0, 0.0
    for k in range(101, 201):
        north_m_s, east_m_s = (max(0.0, 15.0 - 0.3 * (k - 100)), min(8.0, 0.2 * (k - 100)))
        north_m, east_m = north_m + north_m_s / 20, east_m + east_m_s / 20
        told = track.add_position(k / 20, (east_m, north_m - 100.0, 10.0), (east_m_s, north_m_s, 0.0))
        assert told == "position jumped"
    assert track.add_position(10.05, (east_m + 0.4, north_m, 10.0), (8.0, 0.0, 0.0)) is None


@given(st.lists(st.tuples(st.floats(0, 100), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), max_size=40))
def test_whatever_comes_the_believed_path_never_jumps(samples: list[tuple[float, float, float]]) -> None:
    params = TrackParams(settle_s=1e6)
    track, believed = PoseTrack(params), []
    for t, east, north in samples:
        before = track.position_t_mono_s
        if track.add_position(t, (east, north, 0.0)) is None and track.position_t_mono_s != before:
            believed.append((t, east, north))
    for (t0, e0, n0), (t1, e1, n1) in pairwise(believed):
        assert math.hypot(e1 - e0, n1 - n0) <= params.largest_speed_m_s * (t1 - t0) + params.slack_m + 1e-6
