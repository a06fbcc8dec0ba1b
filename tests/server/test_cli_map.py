"""``hedgehop map``: recordings of any kind in, files out, wrong input refused in words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from server.cli import app
from telemetry.messages import Topic
from telemetry.recording.writer import RecordingWriter
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S, write_flight


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Frames and states of eight seconds; no perception node ran."""
    path = tmp_path_factory.mktemp("map") / "flight.mcap"
    clock = [0.0]
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: clock[0])
    for k in range(160):
        clock[0] = t_s = k / 20
        writer.write(Topic.VEHICLE, flights.state_at(t_s, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
        if k % 2 == 0:
            writer.write(Topic.RADAR_FRAME, flights.radar_frame(t_s, k // 2, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
    writer.close()
    return path


def run(*arguments: str | Path) -> tuple[int, dict[str, object]]:
    result = CliRunner().invoke(app, ["map", *map(str, arguments), "--json"])
    return result.exit_code, json.loads(result.stdout)


@pytest.mark.parametrize("ending", ["ply", "bt", "tif", "geojson"])
def test_a_recording_without_a_node_is_mapped_frame_by_frame(recording: Path, tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"radar.{ending}"
    code, found = run(recording, "--sensor", "radar", "--out", out)
    assert code == 0
    assert list(found) == ["frames", "dropped", "points", "voxels_occupied", "extent_m", "seconds"]
    assert found["frames"] == 80
    assert found["dropped"] == 0
    assert isinstance(found["voxels_occupied"], int)
    assert found["voxels_occupied"] > 10
    assert out.stat().st_size > 100


def test_for_people_it_says_what_became_of_the_frames(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "radar.ply"
    result = CliRunner().invoke(app, ["map", str(recording), "--sensor", "radar", "--out", str(out)])
    assert result.exit_code == 0
    assert "80 frames" in result.stdout
    assert "radar.ply" in result.stdout


@pytest.mark.parametrize(
    ("sensor", "name", "words"),
    [
        ("vision", "a.ply", "no frames of the vision"),
        ("radar", "a.stl", "no format of maps"),
        ("radar", "a", "No ending"),
    ],
)
def test_what_cannot_be_done_is_said(recording: Path, tmp_path: Path, sensor: str, name: str, words: str) -> None:
    code, found = run(recording, "--sensor", sensor, "--out", tmp_path / name)
    assert code == 2
    assert isinstance(found["error"], dict)
    assert words in found["error"]["what"]
    assert list(tmp_path.iterdir()) == []


def test_other_files_are_refused(tmp_path: Path) -> None:
    plain = write_flight(tmp_path / "plain.mcap", seconds=2)
    (tmp_path / "text.mcap").write_text("hello")
    for path, words in ((plain, "no frames"), (tmp_path / "text.mcap", "text"), (tmp_path / "none.mcap", "no such")):
        code, found = run(path, "--sensor", "radar", "--out", tmp_path / "a.ply")
        assert code == 2
        assert isinstance(found["error"], dict)
        assert words in found["error"]["what"]
