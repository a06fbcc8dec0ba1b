"""The simulated SLAM drifts as the table says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.sensor_frames import SlamPose
from telemetry.simulation.simulator.sensors import SlamDrift
from telemetry.simulation.simulator.sensors.body import of_truth
from telemetry.topics.vehicle import SimTruth
from tests.telemetry.scenes import truth


def turned(pose: SlamPose, p: np.ndarray) -> np.ndarray:
    q = np.array(pose.q_wxyz[1:])
    return p + 2 * np.cross(q, np.cross(q, p) + pose.q_wxyz[0] * p)


def straight(metres: float, step_m: float = 0.1) -> list[SimTruth]:
    return [truth(north=n, t_s=n / 3, heading_deg=20) for n in np.arange(0.0, metres + step_m / 2, step_m)]


def wrong_m(seed: int, way: list[SimTruth], share_seen: float = 1.0) -> tuple[float, SlamPose]:
    """How far the last pose is from where the first one's frame says that it should be."""
    slam = SlamDrift(seed=seed)
    poses = [slam.pose(at, share_seen) for at in way]
    first = way[0]
    ahead = of_truth(first).T @ (np.array(way[-1].position_enu_m) - np.array(first.position_enu_m))
    expected = np.array(poses[0].position_m) + turned(poses[0], ahead)
    return float(np.linalg.norm(expected - np.array(poses[-1].position_m))), poses[-1]


@settings(max_examples=20)
@given(st.integers(0, 2**31))
def test_it_drifts_by_one_per_cent_of_the_way(seed: int) -> None:
    error, pose = wrong_m(seed, straight(50.0))
    assert 0.0099 * 50 <= error <= 0.0103 * 50
    assert pose.tracking == "good"
    assert wrong_m(seed, straight(300.0, 1.0))[0] <= 0.0103 * 300


def test_with_nothing_fixed_in_view_it_drifts_faster() -> None:
    good, poor, lost = (wrong_m(1, straight(40.0), share) for share in (0.5, 0.02, 0.0))
    assert (good[1].tracking, poor[1].tracking, lost[1].tracking) == ("good", "poor", "lost")
    assert 4 * good[0] < poor[0] < lost[0]


def test_a_lost_one_drifts_where_it_stands() -> None:
    standing = [truth(t_s=t) for t in np.arange(0.0, 10.0, 0.1)]
    assert wrong_m(1, standing)[0] == 0.0
    assert wrong_m(1, standing, 0.0)[0] == pytest.approx(0.3 * 9.9, rel=0.03)


@given(st.integers(0, 1000), st.floats(-20, 20), st.floats(-20, 20), st.floats(0, 360))
def test_attitude_is_that_of_the_body_in_a_level_frame(seed, roll, pitch, heading) -> None:
    at = truth(roll_deg=roll, pitch_deg=pitch, heading_deg=heading)
    pose = SlamDrift(seed=seed).pose(at)
    assert math.hypot(*pose.q_wxyz) == pytest.approx(1.0)
    for axis in np.eye(3):
        assert turned(pose, axis)[2] == pytest.approx((of_truth(at) @ axis)[2], abs=1e-9)


def test_its_frame_is_its_own_and_the_seeds() -> None:
    poses = [SlamDrift(seed=seed).pose(truth(5.0, 6.0, 7.0, heading_deg=10)) for seed in (1, 1, 2)]
    assert poses[0] == poses[1] != poses[2]
    assert poses[0].position_m == (0.0, 0.0, 0.0)
