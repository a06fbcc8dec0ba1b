"""Thinning, bandwidth and clock of the agent."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.sensor_frames import thinned
from telemetry.agent.client import sensor_url
from telemetry.agent.link_messages import REACH_M, cloud, points_of, sendable
from telemetry.agent.pacing import Bandwidth, RemoteClock
from telemetry.errors import AddressError


@given(st.lists(st.tuples(*[st.floats(-50, 50, width=32)] * 3), max_size=60), st.sampled_from([0.1, 0.25, 1.0]))
def test_one_point_of_each_voxel_stays(points: list[tuple[float, float, float]], voxel_m: float) -> None:
    xyz_m = np.array(points, np.float32).reshape(-1, 3)
    kept = thinned(xyz_m, voxel_m)
    cells = {tuple(cell) for cell in np.floor(xyz_m / np.float32(voxel_m)).tolist()}
    assert {tuple(cell) for cell in np.floor(kept / np.float32(voxel_m)).tolist()} == cells
    assert len(kept) == len(cells)
    assert {tuple(p) for p in kept.tolist()} <= {tuple(p) for p in xyz_m.tolist()}


def test_points_that_cannot_be_sent_are_counted() -> None:
    xyz_m = np.array([[np.nan, 0, 0], [1, 2, 3], [np.inf, 0, 0], [0, 164, 0], [0, 0, -163.8]], np.float32)
    points, not_finite, out_of_reach = sendable(xyz_m, REACH_M)
    assert (not_finite, out_of_reach) == (2, 1)
    assert points == pytest.approx(np.array([[1, 2, 3], [0, 0, -163.8]]))


@given(st.lists(st.tuples(*[st.floats(width=32)] * 3), max_size=50))
def test_what_can_be_sent_is_sent(points: list[tuple[float, float, float]]) -> None:
    """Nothing is left out by the wire format that was not counted."""
    found = sendable(np.array(points, np.float32).reshape(-1, 3), REACH_M)
    assert len(found.xyz_m) + found.not_finite + found.out_of_reach == len(points)
    assert len(points_of(cloud(found.xyz_m, number=0, t_s=0.0, voxel_m=0.0))) == len(found.xyz_m)


@given(st.lists(st.tuples(st.integers(1, 4000), st.floats(0, 0.5)), min_size=1, max_size=60))
def test_no_more_than_the_rate_is_taken(requests: list[tuple[int, float]]) -> None:
    bandwidth, now_s, sent = Bandwidth(1000.0, now_s=0.0), 0.0, 0
    for size, wait_s in requests:
        now_s += wait_s
        if bandwidth.takes(size, now_s):
            sent += size
    assert sent <= 1000.0 * now_s + 1000.0 + 4000


def test_what_must_go_goes_and_is_paid_by_the_rest() -> None:
    bandwidth = Bandwidth(1000.0, now_s=0.0)
    bandwidth.spend(1500, 0.0)
    assert not bandwidth.takes(100, 0.5)
    assert bandwidth.takes(100, 0.7)


def test_the_quickest_exchange_sets_the_clock() -> None:
    clock = RemoteClock()
    assert not clock.is_known
    for asked_s, there_s, back_s in ((0.0, 0.4, 0.1), (1.0, 0.01, 0.01), (2.0, 0.1, 0.6)):
        clock.on_answer(asked_s=asked_s, remote_s=500.0 + asked_s + there_s, now_s=asked_s + there_s + back_s)
    assert clock.remote_s(3.0) == pytest.approx(503.0)
    assert clock.round_trip_s == pytest.approx(0.02)


def test_addresses() -> None:
    assert sensor_url("http://10.0.0.5:8000") == ("ws://10.0.0.5:8000/api/sensors", "http://10.0.0.5:8000")
    assert sensor_url("https://gcs.example/fly") == ("wss://gcs.example/api/sensors", "https://gcs.example")
    for wrong in ("10.0.0.5:8000", "ftp://x", "http://", "http://x:99999", ""):
        with pytest.raises(AddressError):
            sensor_url(wrong)
