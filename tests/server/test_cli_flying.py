"""``hedgehop upload``, ``fly`` and ``review`` as a pilot uses them, against a simulated vehicle."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from planning.basics.limits import LARGEST_SEED
from planning.basics.plan_model import Mission, PlannedFor
from planning.formats.wpl import write_wpl
from planning.missions.vehicle_profile import load_profile
from planning.terrain.geotiff import read_dsm, write_dsm
from server.cli.flights.fly_command import keep_recording
from server.cli.shared.upload_words import report_lines
from server.errors import StorageError
from server.flying.review import recording_of
from server.flying.review import review as judge
from server.schemas.review_docs import ReviewDoc
from telemetry.recording.flight_log import read_flight_log
from telemetry.topics.onboard_lists import OnboardMission, Rounded, UploadReport
from tests.server.cli_runs import Run, hedgehop
from tests.server.flight_logs import PLAIN, mission
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle

# On one worker: two would each fly the mission for themselves.
pytestmark = pytest.mark.xdist_group("cli-flying")

SHORT = mission([(50.0, 150.0, 12.0), (90.0, 150.0, 12.0), (90.0, 175.0, 14.0)])
BRIEF = mission([(50.0, 150.0, 12.0), (65.0, 150.0, 12.0), (65.0, 160.0, 13.0)])
"""In GUIDED the station leads the vehicle by its own clock, however fast the vehicle's is."""
TO_AND_FRO = mission([(50.0, 150.0, 12.0), *8 * [(110.0, 150.0, 12.0), (60.0, 150.0, 12.0)]])
"""Still on its way when a busy machine has heard Ctrl+C twice."""
VEHICLE = ("--boot-s", 1, "--parameter", "RTL_ALT=2000", *QUICKLY_DOWN)
HOME = f"{SHORT.home.lat_deg:.7f},{SHORT.home.lon_deg:.7f},100"
CHECKLIST = "# Vehicle\nPropellers\n# Place\nNo people\n"
KEYS = [
    "completed", "cross_track_max_m", "cross_track_mean_m", "cross_track_p95_m", "height_error_max_m",
    "min_distance_m", "lag_s", "duration_s",
]  # fmt: skip


@dataclass(frozen=True)
class Ground:
    """Files of a flight, and the vehicle that flies it."""

    dsm: Path
    mission: Path
    link: str


def write_mission(path: Path, flight: Mission) -> Path:
    path.write_text(write_wpl(flight))
    return path


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    folder = tmp_path_factory.mktemp("ground")
    write_dsm(folder / "plain.tif", PLAIN)
    with simulated_vehicle(HOME, "--speedup", 15, *VEHICLE) as link:
        yield Ground(folder / "plain.tif", write_mission(folder / "short.waypoints", SHORT), link)


@pytest.fixture(scope="module")
def flight(ground: Ground, tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    record = tmp_path_factory.mktemp("recordings") / "short.mcap"
    checklist = record.with_name("checklist.txt")
    checklist.write_text(CHECKLIST)
    run = hedgehop(
        "fly", ground.mission, "--link", ground.link, "--dsm", ground.dsm, "--profile", "mapper-rtk", "--record",
        record, "--json", "--checklist", checklist, "--checklist-done-by", "Anna",
    )  # fmt: skip
    return run, record


def left_behind() -> set[str]:
    return {name for name in os.listdir(tempfile.gettempdir()) if name.startswith("hedgehop-") and "raster" not in name}


def test_upload(ground: Ground) -> None:
    before = left_behind()
    run = hedgehop("upload", ground.mission, "--link", ground.link, "--json")
    assert run.code == 0, run.err
    answer = run.json
    assert list(answer)[:3] == ["verified", "items", "rounded"]
    assert answer["verified"] is True
    assert answer["items"] == 5
    assert all(set(rounded) == {"item", "field", "sent", "kept"} for rounded in answer["rounded"])
    assert left_behind() <= before


def test_upload_in_words() -> None:
    onboard = OnboardMission((), None, None, None, "")
    rounded = (Rounded(2, "altitude", 32.94, 32.93), Rounded(3, "parameter 4", None, 0.0))
    assert report_lines(UploadReport(True, onboard, rounded, (), 0.5)) == [
        "VERIFIED: 0 items in 0.5 s, read back",
        "  item 2: altitude 32.94 is kept as 32.93",
        "  item 3: parameter 4 not given is kept as 0",
    ]
    refused = report_lines(UploadReport(False, onboard, (), ("Item 3: the command is 20, not 16 as sent.",), 0.5))
    assert refused[0].startswith("NOT VERIFIED")
    assert "Item 3" in refused[1]


def test_fly(flight: tuple[Run, Path]) -> None:
    run, _ = flight
    assert run.code == 0, run.err
    answer = run.json
    assert list(answer)[: len(KEYS)] == KEYS
    assert answer["completed"] is True
    assert answer["cross_track_max_m"] < 2.0  # corners are cut
    assert 10.0 < answer["min_distance_m"] < 13.0
    assert answer["duration_s"] > 5.0
    assert answer["certified_distance_m"] == pytest.approx(12.0, abs=0.05)
    assert "The vehicle is at home" in run.err
    assert "The mission was flown and the vehicle has landed." in run.err


def test_the_record_is_reviewed_alike(flight: tuple[Run, Path], ground: Ground) -> None:
    run, record = flight
    again = hedgehop("review", record, "--dsm", ground.dsm, "--json")
    assert again.code == 0, again.err
    assert again.json == run.json
    people = hedgehop("review", record, "--dsm", ground.dsm)
    assert people.out.startswith("COMPLETED\n")
    assert "certified 12.00 m" in people.out


def test_waypoints_one_at_a_time_over_another_model_than_the_planned_one_which_is_said_first(
    ground: Ground, flight: tuple[Run, Path], tmp_path: Path
) -> None:
    surface = {"surface_sha256": "ab" * 32, "surface_name": "spring.tif"}
    elsewhere = write_mission(tmp_path / "elsewhere.waypoints", replace(BRIEF, **surface))
    run = hedgehop(
        "fly", elsewhere, "--link", ground.link, "--dsm", ground.dsm, "--profile", "mapper-rtk", "--mode", "guided"
    )
    assert run.code == 0, run.err
    first, second = run.out.splitlines()[:2]
    assert 'than the mission was planned on, "spring.tif" (SHA-256 abababab)' in first
    assert second == "COMPLETED"
    notes = [line for line in run.err.splitlines() if line.startswith("Note: ")]
    assert notes[0] == f"Note: {first}"
    flown = write_mission(tmp_path / "flown.waypoints", replace(SHORT, **surface))
    again = hedgehop("review", flight[1], "--dsm", ground.dsm, "--mission", flown, "--json")
    assert again.json["other_surface"] == first


@pytest.mark.fact("A43")
def test_vehicle_and_demands_come_from_the_missions_own_file(ground: Ground, tmp_path: Path) -> None:
    planned = PlannedFor(load_profile("mapper-rtk"), "auto", required_clearance_m=40.0)
    high = write_mission(tmp_path / "high.waypoints", replace(SHORT, planned_for=planned))
    run = hedgehop("fly", high, "--link", ground.link, "--dsm", ground.dsm, "--json")
    assert run.code == 1
    assert "vehicle as in the mission's file: Mapper, RTK, 24 Mpx, position error 0.1 m" in run.err
    assert "the plan assumes 0.10 m" in run.err
    assert "required 40.00 m" in run.json["error"]["what"]
    wider = hedgehop(
        "fly", high, "--link", ground.link, "--dsm", ground.dsm, "--json", "--mode", "guided",
        "--position-error-m", 1.5, "--required-clearance-m", 41,
    )  # fmt: skip
    assert "position error of 1.5 m is taken instead of the mission's own 0.1" in wider.err
    assert "41 m are required instead of the mission's own 40 m" in wider.err
    assert "planned for AUTO, judged as flown in GUIDED" in wider.err
    assert "the plan assumes 1.50 m" in wider.err
    assert wider.code == 1


@pytest.mark.fact("A44")
def test_a_mission_too_low_is_not_started(ground: Ground, tmp_path: Path) -> None:
    low = write_mission(tmp_path / "low.waypoints", mission([(50.0, 150.0, 3.0), (90.0, 150.0, 3.0)]))
    record = tmp_path / "refused.mcap"
    run = hedgehop("fly", low, "--link", ground.link, "--dsm", ground.dsm, "--json", "--record", record)
    assert run.code == 1
    assert not record.exists()
    assert run.json["error"]["code"] == "not_allowed"
    assert run.json["error"]["where"] == "the check before the start"
    assert "required" in run.json["error"]["what"]
    assert "Starting" not in run.err
    assert "Vehicle 1: ardupilot 4.7.0-dev" in run.err


def test_poor_gnss_must_be_accepted(ground: Ground, tmp_path: Path) -> None:
    profile = tmp_path / "exact.toml"
    profile.write_text('name = "exact"\nposition_error_m = 0.005\n')
    run = hedgehop("fly", ground.mission, "--link", ground.link, "--dsm", ground.dsm, "--profile", profile)
    assert run.code == 1
    assert "Or accept it: gnss." in run.err


@pytest.mark.parametrize("command", ["upload", "fly"])
def test_wrong_links(command: str, ground: Ground) -> None:
    run = hedgehop(command, ground.mission, "--link", "/etc/passwd", "--json")
    assert (run.code, run.json["error"]["code"]) == (2, "link_address")


def test_a_port_in_use(ground: Ground) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        run = hedgehop("upload", ground.mission, "--link", f"udpin:127.0.0.1:{taken.getsockname()[1]}", "--json")
    assert (run.code, run.json["error"]["code"]) == (1, "connection")
    assert "in use" in run.json["error"]["what"]


def test_wrong_files(ground: Ground, tmp_path: Path) -> None:
    assert hedgehop("fly", tmp_path / "none.plan", "--link", ground.link).code == 2
    assert hedgehop("fly", ground.mission, "--link", ground.link, "--dsm", tmp_path / "none.tif").code == 2
    assert hedgehop("fly", ground.mission, "--link", ground.link, "--record", ground.dsm).code == 2
    assert ground.dsm.stat().st_size > 1000


def test_wrong_simulators(tmp_path: Path) -> None:
    link = ("--link", "tcpin:127.0.0.1:0")
    for options in (
        (*link, "--home", "here"),
        (*link, "--home", "1,2"),
        (*link, "--home", HOME, "--speedup", 0),
        (*link, "--home", HOME, "--seed", -1),
        (*link, "--home", HOME, "--seed", LARGEST_SEED + 1),
        (*link, "--home", HOME, "--parameter", "NOSUCH=1"),
        (*link, "--home", HOME, "--dsm", tmp_path / "none.tif"),
        (*link, "--home", HOME, "--world", tmp_path / "none.json"),
        (*link, "--home", HOME, "--gnss-event", "jam:1:2"),
        ("--link", "/etc/passwd", "--home", HOME),
    ):
        run = hedgehop("sim", *options)
        assert run.code == 2, run
        assert run.err.startswith("Error: ")


def test_review_of_another_stations_log(shared_data: Path) -> None:
    folder = shared_data / "logs" / "arducopter"
    dsm = shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"
    run = hedgehop("review", folder / "guided.tlog", "--mission", folder / "mission.waypoints", "--dsm", dsm, "--json")
    assert run.code == 0
    assert list(run.json)[: len(KEYS)] == KEYS
    assert run.json["completed"] is False
    assert run.json["cross_track_max_m"] == pytest.approx(0.16, abs=0.05)
    assert run.json["min_distance_m"] == pytest.approx(4.97, abs=0.05)
    true = hedgehop("review", folder / "auto.tlog", "--dsm", dsm, "--json", "--truth")
    assert true.json["height_error_max_m"] == pytest.approx(0.16, abs=0.05)


def test_review_of_a_vehicles_own_log(shared_data: Path) -> None:
    run = hedgehop("review", shared_data / "logs" / "real_flights" / "arducopter-4.7.BIN", "--json")
    assert run.code == 0
    assert run.json["completed"] is True
    assert run.json["cross_track_max_m"] == pytest.approx(0.53, abs=0.01)
    assert "The file ends in the middle of a message." in run.json["notes"]


@pytest.mark.fact("A2")
def test_a_flight_below_its_required_clearance_ends_with_1(shared_data: Path) -> None:
    """A real ArduCopter in GUIDED: certified at 1.29 m, 1.15 m required, 0.76 m by its own positions."""
    dsm = shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"
    folder = shared_data / "logs" / "real_flights"
    low = folder / "arducopter-4.7_guided_below_certified.mcap"
    run = hedgehop("review", low, "--dsm", dsm, "--json")
    assert run.code == 1
    assert run.json["min_distance_m"] == pytest.approx(0.757, abs=0.01)
    assert run.json["required_distance_m"] == pytest.approx(1.15)
    assert "went below its required clearance: it came within 0.75 m" in run.json["below_required"]
    assert f"WARNING: {run.json['below_required']}" in run.err
    people = hedgehop("review", low, "--dsm", dsm)
    assert people.out.split("\n")[0].endswith("COMPLETED, BELOW THE REQUIRED CLEARANCE")
    assert "certified 1.29 m, required 1.15 m" in people.out
    for name in ("arducopter-4.7_auto.mcap", "px4-1.17_auto_rtk.mcap", "px4-1.17_guided_rtk.mcap"):
        kept = hedgehop("review", folder / name, "--dsm", dsm, "--json")
        assert (kept.code, kept.json["below_required"]) == (0, None)


def test_fly_ends_with_1_when_the_flight_was_too_low(
    ground: Ground, shared_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, dsm = shared_data / "logs" / "real_flights", shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"
    path = folder / "arducopter-4.7_guided_below_certified.mcap"
    log = read_flight_log(path)
    doc = judge(log, recording_of(log, path), dsm=read_dsm(dsm))
    assert doc.figures is not None
    done = doc.model_copy(update={"figures": doc.figures.model_copy(update={"completed": True})})

    async def flown(_: object) -> tuple[object, ReviewDoc]:
        return SimpleNamespace(completed=True, text="The mission was flown and the vehicle has landed."), done

    monkeypatch.setattr(sys.modules["server.cli.flights.fly_command"]._Conductor, "run", flown)
    run = hedgehop("fly", ground.mission, "--link", ground.link, "--json")
    assert run.code == 1
    assert run.json["completed"] is True
    assert "WARNING: The flight went below its required clearance" in run.err


def test_review_without_figures(shared_data: Path, tmp_path: Path) -> None:
    run = hedgehop("review", shared_data / "logs" / "arducopter" / "rejects.tlog", "--json")
    assert run.code == 1
    assert run.json["completed"] is False
    assert run.json["cross_track_max_m"] is None
    foreign = tmp_path / "notes.txt"
    foreign.write_text("not a flight")
    assert (hedgehop("review", foreign).code, hedgehop("review", tmp_path / "none").code) == (2, 2)


@pytest.mark.slow
def test_ctrl_c_in_the_air_asks_twice_before_it_commands_the_return(ground: Ground, tmp_path: Path) -> None:
    record, long = tmp_path / "cut.mcap", write_mission(tmp_path / "long.waypoints", TO_AND_FRO)
    with simulated_vehicle(HOME, "--speedup", 8, *VEHICLE) as link:
        command = [sys.executable, "-c", "from server.cli import main; main()", "fly", str(long)]
        command += ["--link", link, "--dsm", str(ground.dsm), "--profile", "mapper-rtk", "--record", str(record)]
        process = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert process.stdout is not None
        assert process.stderr is not None
        with process.stdout, process.stderr:
            heard = until(process.stderr, "Flying")
            process.send_signal(signal.SIGINT)
            heard += until(process.stderr, "The vehicle flies on.")
            process.send_signal(signal.SIGINT)
            heard += until(process.stderr, "Return home commanded")
            heard += process.stderr.read()
            answer = json.loads(process.stdout.read())
            assert process.wait(60) == 1, heard
    assert answer["completed"] is False
    assert "broke off" in heard
    assert record.stat().st_size > 10_000


def until(stream, words: str) -> str:
    """What is read up to the line with these words."""
    heard = ""
    for line in stream:
        heard += line
        if words in line:
            return heard
    pytest.fail(f"{words!r} was never said:\n{heard}")


def test_a_recording_that_cannot_be_written_where_it_should_stays(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    recording = tmp_path / "flight.mcap"
    recording.write_bytes(b"precious")
    with pytest.raises(StorageError, match="cannot be written") as caught:
        keep_recording(recording, tmp_path / "gone" / "flight.mcap")
    (kept,) = tmp_path.glob("hedgehop-kept-*/flight.mcap")
    assert kept.read_bytes() == b"precious"
    assert str(kept) in caught.value.advice


def test_the_checklist_that_somebody_answers_for_stands_in_the_recording(flight: tuple[Run, Path]) -> None:
    run, record = flight
    assert "Checklist of 2 points: done by Anna" in run.err
    log = read_flight_log(record)
    assert log.checklist is not None
    assert [(p.heading, p.text, p.ticked_by) for p in log.checklist.points] == [
        ("Vehicle", "Propellers", "Anna"),
        ("Place", "No people", "Anna"),
    ]
    assert any(c.words.endswith("Propellers (by Anna)") for c in log.commands)
