"""``hedgehop map --sensor vision``: the camera's maps out of a recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic
from tests.server.test_cli_map import run
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Clouds, camera poses and states of four seconds; no perception node ran."""
    path, clock = tmp_path_factory.mktemp("map") / "filmed.mcap", [0.0]
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: clock[0])
    for k in range(80):
        clock[0] = t_s = k / 20
        writer.write(Topic.VEHICLE, flights.state_at(t_s, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
        writer.write(Topic.SLAM_POSE, flights.slam_pose(t_s, T0_MONO_S), T0_UTC_S + t_s)
        if k % 4 == 0:
            writer.write(Topic.CLOUD_FRAME, flights.cloud_frame(t_s, k // 4, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
    writer.close()
    return path


def test_its_map_of_the_whole_flight_holds_more_than_its_last_frame(filmed: Path, tmp_path: Path) -> None:
    local = run(filmed, "--sensor", "vision", "--out", tmp_path / "a.ply")[1]
    code, whole = run(filmed, "--sensor", "vision", "--out", tmp_path / "b.ply", "--whole-flight")
    assert code == 0
    assert whole["points"] == local["points"]
    assert int(str(whole["voxels_occupied"])) > int(str(local["voxels_occupied"]))


def test_of_its_clouds_one_point_per_voxel_may_be_used(filmed: Path, tmp_path: Path) -> None:
    whole = run(filmed, "--sensor", "vision", "--out", tmp_path / "a.ply")[1]
    thin = run(filmed, "--sensor", "vision", "--out", tmp_path / "b.ply", "--cloud-voxel-m", "0.25")[1]
    assert int(str(thin["points"])) < 0.5 * int(str(whole["points"]))
    assert int(str(thin["voxels_occupied"])) > 0.9 * int(str(whole["voxels_occupied"]))
    for coarse_m in ("-1", "0.3", "nan"):
        code, refused = run(filmed, "--sensor", "vision", "--out", tmp_path / "c.ply", "--cloud-voxel-m", coarse_m)
        assert code == 2
        assert "Give 0 (all points) to 0.25 m" in str(refused["error"])
