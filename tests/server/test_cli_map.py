"""``hedgehop map``: recordings of any kind in, files out, wrong input refused in words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from server.cli import app
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import PerceptionSettings
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S, write_flight


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Frames and states of eight seconds; no perception node ran."""
    return flown(tmp_path_factory.mktemp("map") / "flight.mcap")


def flown(path: Path, settings: PerceptionSettings | None = None) -> Path:
    clock = [0.0]
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: clock[0])
    if settings is not None:
        writer.write(Topic.PERCEPTION_SETTINGS, settings, T0_UTC_S)
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
    names = ["frames", "dropped", "points", "voxels_occupied", "resolution_m", "left_out", "extent_m", "seconds"]
    assert list(found) == names
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


def test_another_resolution_and_memory_limit(recording: Path, tmp_path: Path) -> None:
    def built(*options: str) -> dict[str, object]:
        code, found = run(recording, "--sensor", "radar", "--out", tmp_path / "a.ply", *options)
        assert code == 0
        return found

    live, fine, coarse = built(), built("--resolution-m", "0.1"), built("--resolution-m", "4")
    assert [found["resolution_m"] for found in (live, fine, coarse)] == [1.0, 0.1, 4.0]
    voxels = [int(str(found["voxels_occupied"])) for found in (coarse, live, fine)]
    assert voxels[0] < voxels[1] < voxels[2]
    assert [found["points"] for found in (fine, coarse)] == [live["points"]] * 2
    assert built("--memory-mb", "1000") | {"seconds": 0} == live | {"seconds": 0}
    full = built("--resolution-m", "0.02", "--memory-mb", "0.03")
    assert isinstance(full["left_out"], int)
    assert full["left_out"] > 0
    assert live["left_out"] == 0


def test_what_was_set_in_flight_gives_way_to_what_is_asked_for(tmp_path: Path) -> None:
    settings = PerceptionSettings(radar_resolution_m=2.0, radar_depth_m=120.0, fov_deg=120.0, height_m=20.0)
    recorded = flown(tmp_path / "flight.mcap", settings)
    for options, resolution_m in (((), 2.0), (("--resolution-m", "0.2"), 0.2)):
        code, found = run(recorded, "--sensor", "radar", "--out", tmp_path / "a.ply", *options)
        assert (code, found["resolution_m"]) == (0, resolution_m)


def test_a_full_map_is_told(recording: Path, tmp_path: Path) -> None:
    arguments = ["map", str(recording), "--sensor", "radar", "--out", str(tmp_path / "a.ply")]
    result = CliRunner().invoke(app, [*arguments, "--resolution-m", "0.02", "--memory-mb", "0.03"])
    assert result.exit_code == 0
    assert "reached its memory limit" in result.stderr
    assert "voxels of 0.02 m" in result.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--memory-mb", "0.02"), ("No map fits in 20,000 bytes", "100,000")),
        (("--memory-mb", "1e12"), ("this computer has", "Allow at most")),
        (("--memory-mb", "nan"), ("nan MB", "Try")),
        (("--memory-mb", "-3"), ("-3 MB", "Try")),
        (("--resolution-m", "0"), ("0.0 m is no edge", "Try 0.5")),
        (("--resolution-m", "nan"), ("nan m is no edge", "Try 0.5")),
        (("--resolution-m", "1e-7"), ("Voxels of 1e-07 m reach only 107 m", "0.5 m")),
    ],
    ids=" ".join,
)
def test_a_map_that_cannot_fit_is_refused_with_the_number(
    recording: Path, tmp_path: Path, options: tuple[str, str], words: tuple[str, str]
) -> None:
    code, found = run(recording, "--sensor", "radar", "--out", tmp_path / "a.ply", *options)
    assert code == 2
    error = found["error"]
    assert isinstance(error, dict)
    assert words[0] in error["what"]
    assert words[1] in error["advice"]
    assert list(tmp_path.iterdir()) == []


def test_a_fine_map_of_the_camera_is_refused_with_what_would_do(recording: Path, tmp_path: Path) -> None:
    code, found = run(recording, "--sensor", "vision", "--out", tmp_path / "a.ply", "--resolution-m", "0.01")
    assert code == 2
    assert isinstance(found["error"], dict)
    assert "One look out to 40 m" in found["error"]["what"]
    assert "0.06 m or coarser" in found["error"]["advice"]


def test_the_radars_gate_may_be_another_than_in_flight(recording: Path, tmp_path: Path) -> None:
    as_flown = run(recording, "--sensor", "radar", "--out", tmp_path / "a.ply")[1]
    narrow = run(recording, "--sensor", "radar", "--out", tmp_path / "b.ply", "--radar-azimuth-deg", "1")[1]
    assert narrow["points"] < as_flown["points"]  # type: ignore[operator]
    placed = run(recording, "--sensor", "radar", "--out", tmp_path / "c.ply", "--radar-variant", "full-attitude")[1]
    assert placed["points"] == as_flown["points"]
    assert (tmp_path / "c.ply").read_bytes() != (tmp_path / "a.ply").read_bytes()
    code, refused = run(recording, "--sensor", "radar", "--out", tmp_path / "d.ply", "--radar-high-deg", "2")
    assert code == 2
    assert "end it at 5 or higher" in str(refused["error"])
