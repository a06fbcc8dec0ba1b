"""``hedgehop bag``, ``hedgehop export`` and ``hedgehop map`` of bags, as they are typed."""

from __future__ import annotations

from pathlib import Path

import pytest

from telemetry.recording.flight_log import read_flight_log
from tests.server.cli_runs import hedgehop
from tests.telemetry.bags import write_bag
from tests.telemetry.recordings import write_flight
from tests.telemetry.test_ros_bags import Flight


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("bag"), "ros1", Flight().entries("ros1"))


def test_the_table_for_people_and_for_scripts(bag: Path) -> None:
    run = hedgehop("bag", bag)
    assert run.code == 0
    lines = run.out.splitlines()
    assert lines[0] == "ROS 1 bag, 91 messages"
    assert lines[1].split()[:3] == ["nav_msgs/Odometry", "/odom", "61"]
    assert "2023-11-14T22:13:20.000Z + 3.0 s" in run.out
    found = hedgehop("bag", bag, "--json").json
    assert (found["kind"], found["fault"]) == ("ros1", None)
    assert {row["topic"]: row["messages"] for row in found["topics"]}["/points"] == 28


def test_a_map_with_every_number_that_a_recordings_map_has(bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "radar.ply"
    run = hedgehop("map", bag, "--sensor", "radar", "--points", "/points", "--out", out, "--json")
    assert run.code == 0
    assert run.json["frames"] == 28
    assert run.json["voxels_occupied"] == len(Flight().keys)
    assert out.read_bytes().startswith(b"ply")
    assert "taken as east, north, up (REP 103)" in run.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--out", "a.ply"), "Give --points: /points (28)."),
        (("--out", "a.tif", "--points", "/points"), "where on Earth, and how high above the sea"),
        (("--out", "a.ply", "--points", "/nothing"), "/points (PointCloud2, 28)"),
    ],
)
def test_what_is_missing_is_said(bag: Path, tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    options = ("--out", str(tmp_path / options[1]), *options[2:])
    run = hedgehop("map", bag, "--sensor", "radar", *options)
    assert run.code == 2
    assert words in " ".join(run.err.split())
    assert list(tmp_path.iterdir()) == []


def test_on_earth_with_the_height_of_home(bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.geojson"
    options = ("--points", "/points", "--home-alt-amsl-m", "432", "--out", out)
    assert hedgehop("map", bag, "--sensor", "radar", *options).code == 0
    assert '"lat_deg": 45.0' in out.read_text()


def test_a_bag_becomes_a_recording_that_review_opens(bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "flight.mcap"
    asked = ("bag", bag, "--points", "/points", "--out", out)
    refused = hedgehop(*asked)
    assert refused.code == 2
    assert "a flight in Review lies" in " ".join(refused.err.split())
    assert not out.exists()
    assert hedgehop(*asked, "--home-alt-amsl-m", "432").code == 0
    flight = read_flight_log(out)
    assert len(flight.track.t_utc_s) == 28
    assert flight.track.lat_deg[-1] - flight.track.lat_deg[0] == pytest.approx(8.1 / 111_131, rel=0.01)
    assert hedgehop(*asked).code == 2
    assert "Give --out as well" in hedgehop("bag", bag, "--points", "/points").err


def test_the_folder_that_one_is_in_is_a_bag_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(write_bag(tmp_path, "mcap", Flight().entries("mcap")))
    asked = ("map", ".", "--sensor", "radar", "--out", tmp_path / "a.ply")
    assert hedgehop(*asked, "--points", "/points").code == 0
    assert "run: Which points" in hedgehop(*asked).err


def test_recordings_take_no_options_of_bags_and_are_no_bags(tmp_path: Path) -> None:
    flight = write_flight(tmp_path / "flight.mcap", seconds=2)
    run = hedgehop("map", flight, "--sensor", "radar", "--points", "/points", "--out", tmp_path / "a.ply")
    assert run.code == 2
    assert "--points only means something for a bag of ROS." in run.err
    run = hedgehop("bag", flight, "--json")
    assert run.code == 2
    assert run.json["error"]["what"] == "It is no bag of ROS."


def test_a_flight_is_exported_and_listed(tmp_path: Path) -> None:
    flight, out = write_flight(tmp_path / "flight.mcap", seconds=2), tmp_path / "ros2.mcap"
    run = hedgehop("export", flight, "--ros2", out, "--json")
    assert run.code == 0
    assert run.json["messages"]["/fix"] > 10
    assert run.json["faults"] == []
    listed = {row["topic"]: row["messages"] for row in hedgehop("bag", out, "--json").json["topics"]}
    assert listed == run.json["messages"]
    again = hedgehop("export", flight, "--ros2", out)
    assert again.code == 2
    assert "such a file already" in again.err
    assert hedgehop("export", flight, "--ros2", tmp_path / "a.bag").code == 2
