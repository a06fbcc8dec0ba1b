"""Every example runs, and prints what it should with its units."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mapping import POSITION2GO
from mapping.sensor_frames import RadarFrame
from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.terrain.geotiff import write_dsm
from server.door.sensor_token import FILE
from tests.conftest import ROOT
from tests.mapping.radar.echoes import Echo, frame
from tests.planning.format_examples import write_pois_csv
from tests.server.running import running
from tests.server.station import PATIENCE_S, ok, station

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

pytestmark = pytest.mark.xdist_group("examples")


@pytest.fixture
def example(capsys: pytest.CaptureFixture[str]):
    """What an example prints."""

    def run(name: str, *arguments: object) -> str:
        importlib.import_module(f"examples.{name}").main([str(argument) for argument in arguments])
        return capsys.readouterr().out

    return run


def number(pattern: str, text: str) -> float:
    """The one that stands in brackets."""
    found = re.search(pattern, text)
    assert found, f"{pattern} is not in:\n{text}"
    return float(found[1])


def test_each_example_has_a_row_a_test_and_a_readable_length() -> None:
    table = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    tests = Path(__file__).read_text(encoding="utf-8")
    assert len(EXAMPLES) >= 8
    for path in EXAMPLES:
        assert f"[{path.name}]({path.name})" in table
        assert path.stem in tests
        assert 20 <= len(path.read_text(encoding="utf-8").splitlines()) <= 80


def test_the_hillside_is_planned_over(example, tmp_path: Path) -> None:
    text = example("plan_a_path", "--out", tmp_path / "flight")
    assert text.startswith("certified for the Mapper")
    assert number(r"nearest: ([\d.]+) m", text) > number(r"required: ([\d.]+) m", text)
    assert number(r"path: (\d+) m, \d+ waypoints, \d+ s to fly", text) == pytest.approx(394, abs=20)
    assert (tmp_path / "flight" / "mission.waypoints").read_text().startswith("QGC WPL 110")


def test_ones_own_model_points_and_mission_are_taken(example, tmp_path: Path) -> None:
    dsm, pois, flight = tmp_path / "hill.tif", tmp_path / "pois.csv", tmp_path / "flight"
    write_dsm(dsm, demo_dsm())
    pois.write_text(write_pois_csv(demo_pois()[:2]))
    assert "certified" in example("plan_a_path", dsm, pois, "--height-m", 6, "--out", flight)
    text = example("certify_a_mission", dsm, flight / "mission.plan")
    assert text.startswith("mission.plan: certified\n")
    assert number(r"nearest: ([\d.]+) m", text) > 4.0


def test_another_stations_mission_is_too_low(example) -> None:
    text = example("certify_a_mission")
    assert text.startswith("another.waypoints: NOT certified")
    assert 0.0 < number(r"nearest: ([\d.]+) m", text) < 4.0
    assert "Raise H by at least" in text
    assert example("certify_a_mission", "--required-m", 2).startswith("another.waypoints: certified")


def test_an_area_is_surveyed(example) -> None:
    text = example("survey_an_area", "--gsd-cm", 2)
    assert number(r"(\d+) lines", text) < 7
    assert number(r"lines [\d.]+ m apart, ([\d.]+) m above", text) == pytest.approx(102.2, abs=0.5)
    assert number(r"photos show (\d+) %", text) == 100


def test_a_recording_becomes_a_map(example, tmp_path: Path) -> None:
    text = example("map_a_recording", "--out", tmp_path / "wall.ply")
    assert text.startswith("60 frames with 720 points")
    coarse = number(r"(\d+) occupied voxels of 1 m", text)
    assert number(r"over ([\d.]+) m east", text) == pytest.approx(12.0, abs=1.0)
    assert (tmp_path / "wall.ply").read_bytes().startswith(b"ply")
    assert number(r"(\d+) occupied voxels of 0.5 m", example("map_a_recording", "--resolution-m", 0.5)) > coarse


def test_samples_become_targets(example, tmp_path: Path) -> None:
    assert re.search(r" 5\.\d\d m, -1\.\d\d m/s, +\+(19|20)\.\d deg", example("detect_radar_targets"))
    np.save(tmp_path / "cube.npy", frame(POSITION2GO, Echo(6.0, speed_m_s=1.0)))
    text = example("detect_radar_targets", tmp_path / "cube.npy", "--radar", "position2go")
    assert number(r"([\d.]+) m, \+[\d.]+ m/s", text) == pytest.approx(6.0, abs=0.2)


def test_objects_are_followed(example, tmp_path: Path) -> None:
    text = example("track_objects")
    assert text.startswith("2 objects after 3.9 s")
    assert number(r"object 1: .* ([+-][\d.]+) m/s east", text) == pytest.approx(1.2, abs=0.2)
    standing = [f"{t / 10},15,0.1,0\n" for t in range(20)]
    (tmp_path / "pole.csv").write_text("t_s,range_m,bearing_rad,speed_m_s\n" + "".join(standing))
    text = example("track_objects", tmp_path / "pole.csv")
    assert number(r"object 1: .* ([+-][\d.]+) m north", text) == pytest.approx(15 * np.cos(0.1), abs=0.1)


def test_grass_is_cleared_and_the_stone_stays(example) -> None:
    text = example("clear_foliage")
    blocked, cleared = number(r"roughness: ([\d.]+) m2", text), number(r"foliage: ([\d.]+) m2", text)
    assert 0.3 * blocked < cleared < 0.8 * blocked


def test_the_http_api_is_driven(example, tmp_path: Path) -> None:
    with station(tmp_path / "data", demo=True) as ground:
        ok(ground.http.post("/api/terrains/demo"))
        before = ground.answer().result
        token = ground.server.parts.auth.new_link_token()
        link = f"{ground.server.origin}/login?token={token}"
        text = example("drive_the_http_api", link, "--height-m", 8, "--out", tmp_path / "mission.plan")
    assert before is not None
    assert number(r"nearest ([\d.]+) m", text) > (before.min_distance_m or 0.0) + 1.0
    assert '"fileType": "Plan"' in (tmp_path / "mission.plan").read_text()


def test_a_sensors_frames_reach_the_ground_station(tmp_path: Path) -> None:
    driver = [sys.executable, str(ROOT / "examples" / "sensor_for_the_agent.py"), "--frames", "20", "--rate-hz", "40"]
    with running(tmp_path) as server:
        agent = [sys.executable, "-m", "server", "agent", server.origin, "--token-file", str(tmp_path / FILE)]
        with subprocess.Popen(driver, stdout=subprocess.PIPE, cwd=tmp_path) as lines:
            subprocess.run(agent, stdin=lines.stdout, check=True, timeout=3 * PATIENCE_S, cwd=ROOT)
        frames = [message for _, message in server.flying.published if isinstance(message, RadarFrame)]
    assert [message.number for message in frames] == list(range(20))
    walls_m = [float(message.columns()[0][:, 1].mean()) for message in frames]
    assert walls_m[0] == pytest.approx(60.0, abs=0.3)
    assert walls_m[-1] == pytest.approx(60.0 - 2.0 * 19 / 40, abs=0.3)
