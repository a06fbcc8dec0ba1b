"""Thinning, bandwidth, clock and sources of the agent."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.agent.bandwidth import Bandwidth
from telemetry.agent.client import CloudReading, RadarReading, SlamReading, sensor_url
from telemetry.agent.clock import RemoteClock
from telemetry.agent.sources import readings_of_lines
from telemetry.agent.thinning import thinned
from telemetry.errors import AddressError, SensorLinkError


@given(st.lists(st.tuples(*[st.floats(-50, 50, width=32)] * 3), max_size=60), st.sampled_from([0.1, 0.25, 1.0]))
def test_one_point_of_each_voxel_stays(points: list[tuple[float, float, float]], voxel_m: float) -> None:
    xyz_m = np.array(points, np.float32).reshape(-1, 3)
    kept = thinned(xyz_m, voxel_m)
    cells = {tuple(cell) for cell in np.floor(xyz_m / np.float32(voxel_m)).tolist()}
    assert {tuple(cell) for cell in np.floor(kept / np.float32(voxel_m)).tolist()} == cells
    assert len(kept) == len(cells)
    assert {tuple(p) for p in kept.tolist()} <= {tuple(p) for p in xyz_m.tolist()}


def test_points_without_numbers_go() -> None:
    xyz_m = np.array([[np.nan, 0, 0], [1, 2, 3], [np.inf, 0, 0]], np.float32)
    assert thinned(xyz_m, 0.0).tolist() == [[1, 2, 3]]


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


def test_lines_become_readings() -> None:
    lines = io.StringIO(
        '{"type": "radar", "t_s": 1, "targets": [[1, 2, 3, 4, 5]]}\n\n{"type": "cloud", "t_s": 2, "points": []}\n'
        '{"type": "slam", "position_m": [1, 2, 3], "q_wxyz": [1, 0, 0, 0]}\n'
    )
    radar, cloud, slam = readings_of_lines(lines)
    assert isinstance(radar, RadarReading)
    assert radar.targets.tolist() == [[1, 2, 3, 4, 5]]
    assert isinstance(cloud, CloudReading)
    assert cloud.xyz_m.shape == (0, 3)
    assert isinstance(slam, SlamReading)
    assert slam.slam.tracking == "good"


@pytest.mark.parametrize(
    "line",
    ["[]", "{", '{"type": "sonar"}', '{"type": "radar", "targets": [[1, 2]]}', '{"type": "cloud", "points": [1, 2]}',
     '{"type": "slam", "position_m": [1], "q_wxyz": [1, 0, 0, 0]}', '{"type": "radar", "t_s": "x", "targets": []}',
     '{"type": "slam", "position_m": [1, 2, 3], "q_wxyz": [1, 0, 0, 0], "tracking": "fine"}'],
)  # fmt: skip
def test_a_wrong_line_is_named(line: str) -> None:
    lines = io.StringIO('{"type": "cloud", "points": [[1, 2, 3]]}\n' + line + "\n")
    readings = readings_of_lines(lines)
    assert isinstance(next(readings), CloudReading)
    with pytest.raises(SensorLinkError) as caught:
        next(readings)
    assert caught.value.where == "line 2"


def test_addresses() -> None:
    assert sensor_url("http://10.0.0.5:8000") == ("ws://10.0.0.5:8000/api/sensors", "http://10.0.0.5:8000")
    assert sensor_url("https://gcs.example/fly") == ("wss://gcs.example/api/sensors", "https://gcs.example")
    for wrong in ("10.0.0.5:8000", "ftp://x", "http://", "http://x:99999", ""):
        with pytest.raises(AddressError):
            sensor_url(wrong)
