"""``hedgehop params`` as a crew uses it, against a simulated vehicle in a process of its own."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest
from pymavlink import mavutil

from planning.formats.wpl import write_wpl
from planning.terrain.geotiff import write_dsm
from server.cli.params.params_session import ParameterSession
from telemetry.bus.link_client import LinkClient
from telemetry.link.audit import AUDIT_FILE
from telemetry.parameters.files import read_parameter_file
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS
from telemetry.topics.requests import ReadParameters
from telemetry.topics.vehicle import VehicleState
from tests.server.cli_runs import Run, hedgehop
from tests.server.flight_logs import PLAIN, mission
from tests.server.simulated import simulated_vehicle

pytestmark = pytest.mark.xdist_group("cli-flying")
HOME = "-37.1244507,175.6892878,803"
COUNTED = {"MIS_TOTAL", "FENCE_TOTAL", "RALLY_TOTAL"}
ABOUT = """<paramfile><vehicles><parameters name="ArduCopter">
<param humanName="Height of return" name="ArduCopter:RTL_ALT" documentation="How high."><field name="Range">200 8000
</field><field name="Units">cm</field><field name="RebootRequired">True</field></param>
<param humanName="Yaw" name="ArduCopter:WP_YAW_BEHAVIOR"><values><value code="2">Ahead</value></values></param>
</parameters></vehicles></paramfile>"""


@pytest.fixture(scope="module")
def link() -> Iterator[str]:
    with simulated_vehicle(HOME, "--boot-s", 1) as link:
        yield link


@pytest.fixture
def about(tmp_path: Path) -> Path:
    file = tmp_path / "apm.pdef.xml"
    file.write_text(ABOUT)
    return file


def test_get_all_by_pattern_by_name_and_with_descriptions(link: str, about: Path, tmp_path: Path) -> None:
    whole = hedgehop("params", "get", "--link", link, "--json")
    assert whole.code == 0, whole.err
    assert [p["name"] for p in whole.json["parameters"]] == sorted(SPECS)
    assert "Read " in whole.err
    data = tmp_path / "data"
    data.mkdir()
    some = hedgehop("params", "get", "rtl_alt*", "--link", link, "--about", about, "--data-dir", data)
    assert some.code == 0
    assert some.out.splitlines()[0].split() == [
        "RTL_ALT",
        "1500",
        "cm",
        "(Height",
        "of",
        "return;",
        "200",
        "to",
        "8000)",
    ]
    assert len(some.out.splitlines()) == 2
    named = hedgehop("params", "get", "WP_YAW_BEHAVIOR", "NO_SUCH", "--link", link, "--data-dir", data)
    assert named.code == 1
    assert "(Ahead; Yaw)" in named.out, "the descriptions are kept in the data directory"
    assert "The vehicle has no NO_SUCH." in named.err
    searched = hedgehop("params", "get", "--search", "height of", "--link", link, "--about", about, "--json")
    assert [p["name"] for p in searched.json["parameters"]] == ["RTL_ALT"]
    changed = hedgehop("params", "get", "--changed", "--link", link, "--about", about, "--json")
    assert changed.code == 0
    assert [p["name"] for p in changed.json["parameters"]] == ["SIM_WIND_DIR"], "the vehicle says its defaults"


def test_set_says_before_and_after_and_what_did_not_take(link: str, about: Path, tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    run = hedgehop(
        "params", "set", "RTL_ALT", 9000, "GUID_TIMEOUT=99", "LAND_SPEED", "-1", "FLTMODE1=0.5", "--link", link,
        "--about", about, "--data-dir", data,
    )  # fmt: skip
    assert run.code == 1
    assert "RTL_ALT: 1500 -> 9000: set, read back." in run.err
    assert "GUID_TIMEOUT: 3 -> 99: NOT AS ASKED, the vehicle holds 5." in run.err
    assert "LAND_SPEED: 50 -> -1: NOT AS ASKED, the vehicle holds 30." in run.err
    assert "FLTMODE1: 7 -> 0.5: NOT SET. This parameter holds whole numbers only." in run.err
    assert "Note: RTL_ALT 9000 is outside what its makers recommend, 200 to 8000." in run.err
    assert run.out.splitlines() == [
        "1 set and read back, 0 were so already, 3 did not take.",
        "Did not take: GUID_TIMEOUT, LAND_SPEED, FLTMODE1.",
        "Restart the vehicle for: RTL_ALT.",
    ]
    logged = [json.loads(line)["words"] for line in (data / AUDIT_FILE).read_text().splitlines()]
    assert "write RTL_ALT 9000, GUID_TIMEOUT 99, LAND_SPEED -1, FLTMODE1 0.5" in logged
    back = hedgehop("params", "set", "RTL_ALT=1500", "GUID_TIMEOUT=3", "LAND_SPEED=50", "--link", link, "--json")
    assert (back.code, back.json["complete"]) == (0, True)
    assert back.json["written"][0] == {
        "name": "RTL_ALT", "before": 9000.0, "asked": 1500.0, "after": 1500.0, "outcome": "set", "took": True,
        "words": "",
    }  # fmt: skip


@pytest.mark.parametrize("suffix", ["param", "params"])
def test_what_is_saved_is_the_vehicles(link: str, tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"before.{suffix}"
    saved = hedgehop("params", "save", file, "--link", link, "--json")
    assert (saved.code, saved.json["saved"]) == (0, len(SPECS)), saved.err
    assert len(read_parameter_file(file.name, file.read_bytes()).parameters) == len(SPECS)
    same = hedgehop("params", "compare", file, "--link", link, "--json")
    assert (same.code, same.json["equal"], same.json["same"]) == (0, True, len(SPECS) - len(COUNTED))


def test_saved_changed_and_loaded_again(link: str, tmp_path: Path) -> None:
    file = tmp_path / "before.param"
    assert hedgehop("params", "save", file, "--link", link).code == 0
    assert hedgehop("params", "set", "WPNAV_SPEED", 300, "WPNAV_JERK", 0.7, "--link", link).code == 0
    other = hedgehop("params", "compare", file, "--link", link)
    assert other.code == 1
    assert other.out.splitlines()[0].endswith("Different: 2.")
    assert "WPNAV_SPEED" in other.out
    assert "before.param 1000" in other.out
    part = hedgehop("params", "load", file, "--link", link, "--only", "WPNAV_*", "--leave-out", "*JERK", "--json")
    assert [w["name"] for w in part.json["written"]] == ["WPNAV_SPEED"], part.err
    rest = hedgehop("params", "load", file, "--link", link)
    assert rest.code == 0
    assert "WPNAV_JERK: 0.7 -> 1: set, read back." in rest.err
    assert "left out, for vehicles count or measure it by themselves" in rest.err
    assert hedgehop("params", "compare", file, "--link", link).code == 0
    again = hedgehop("params", "save", file, "--link", link)
    assert again.code == 2
    assert "such a file already" in again.err


def test_more_than_one_batch_and_names_that_the_vehicle_does_not_have(link: str, tmp_path: Path) -> None:
    file = tmp_path / "many.parm"
    numbers = [name for name, spec in SPECS.items() if spec.kind == "float" and spec.default + 1 <= spec.high]
    file.write_text("".join(f"{name} {SPECS[name].default + 1}\n" for name in numbers) + "NO_SUCH_THING 1\n")
    assert len(numbers) > 20
    run = hedgehop("params", "load", file, "--link", link, "--json")
    assert run.code == 1
    by_name = {w["name"]: w["outcome"] for w in run.json["written"]}
    assert {name for name, outcome in by_name.items() if outcome != "set"} == {"NO_SUCH_THING"}
    file.write_text("".join(f"{name} {SPECS[name].default}\n" for name in numbers))
    assert hedgehop("params", "load", file, "--link", link).code == 0


def test_many_names_are_asked_for_a_few_at_a_time() -> None:
    asked: list[int] = []

    class Link:
        async def call(self, request: ReadParameters) -> dict[str, float | None]:
            asked.append(len(request.names))
            return dict.fromkeys(request.names, 1.0)

    session = ParameterSession(cast(LinkClient, Link()), VehicleState(1, 1))
    names = [f"P{number}" for number in range(25)]
    assert asyncio.run(session.named(names)) == dict.fromkeys(names, 1.0)
    assert asked == [10, 10, 5]


def test_two_vehicles(link: str) -> None:
    with simulated_vehicle(HOME, "--boot-s", 1, "--parameter", "RTL_ALT=3000", "--parameter", "MAV_SYSID=2") as other:
        run = hedgehop("params", "compare", other, "--link", link, "--json")
    assert run.code == 1
    assert {"name": "RTL_ALT", "here": 1500.0, "there": 3000.0} in run.json["different"]
    assert run.json["there"].startswith("vehicle 2")


def test_refused_while_armed_unless_it_is_said(tmp_path: Path) -> None:
    with simulated_vehicle(HOME, "--boot-s", 1, "--parameter", "DISARM_DELAY=0") as link:
        arm(link)
        refused = hedgehop("params", "set", "RTL_ALT", 2000, "--link", link, "--json")
        assert (refused.code, refused.json["error"]["code"]) == (1, "not_allowed")
        assert "The vehicle is armed." in refused.err
        file = tmp_path / "x.param"
        file.write_text("RTL_ALT,2000\n")
        assert hedgehop("params", "load", file, "--link", link).code == 1
        assert hedgehop("params", "get", "RTL_ALT", "--link", link).out.split()[1] == "1500"
        run = hedgehop("params", "set", "RTL_ALT", 2000, "--link", link, "--even-armed")
        assert run.code == 0, run.err


def arm(link: str) -> None:
    """As another station does."""
    station = mavutil.mavlink_connection(link, source_system=254)
    try:
        station.wait_heartbeat(timeout=60)
        end_s = time.monotonic() + 60
        while not station.motors_armed():
            assert time.monotonic() < end_s
            station.mav.command_long_send(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
            station.recv_match(type="HEARTBEAT", blocking=True, timeout=1)
    finally:
        station.close()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("set", "RTL_ALT"), "has no value"),
        (("set", "RTL_ALT", "high"), "no number"),
        (("set", "RTL_ALT", "--even-amred"), "no number"),
        (("set", "RTL ALT=3"), "Write NAME,VALUE"),
        (("save", "x.txt"), "says no format"),
        (("load", "none.param"), "cannot be read"),
        (("compare", "none.param"), "no such file"),
        (("get", "--about", "none.xml"), "cannot be read"),
    ],
)
def test_wrong_input(link: str, arguments: tuple[str, ...], words: str) -> None:
    run = hedgehop("params", *arguments, "--link", link, "--json")
    assert run.code == 2, run
    assert words in run.err


def test_a_wrong_line_of_a_file_is_named_before_anything_is_connected(tmp_path: Path) -> None:
    file = tmp_path / "x.param"
    file.write_text("A,1\nB\n")
    run: Run = hedgehop("params", "load", file, "--link", "tcp:127.0.0.1:1", "--json")
    assert (run.code, run.json["error"]["where"]) == (2, "x.param, line 2")
    assert "Connecting" not in run.err


def test_review_says_what_to_set_on_this_plan_and_its_own_command_mends_it(tmp_path: Path) -> None:
    dsm, flight = tmp_path / "plain.tif", tmp_path / "flight.waypoints"
    write_dsm(dsm, PLAIN)
    around = [(150.0, 200.0, 6.0), (250.0, 200.0, 6.0), (250.0, 150.0, 6.0)]
    flight.write_text(write_wpl(mission(around, home=(150.0, 150.0))))  # the tower stands on the way home
    with simulated_vehicle(HOME, "--boot-s", 1, "--parameter", "RTL_ALT=100") as link:
        run = hedgehop("params", "review", flight, "--dsm", dsm, "--link", link, "--json")
        assert run.code == 1, run.err
        findings = {f["parameter"]: f for f in run.json["findings"]}
        states = [f["state"] for f in run.json["findings"]]
        assert states == sorted(states, key=("bad", "look", "good").index)
        assert run.json["to_change"] == states.count("bad") > 2
        assert findings["RTL_ALT"]["state"] == "bad"
        better = findings["RTL_ALT"]["better"]
        assert better % 100 == 0
        people = hedgehop("params", "review", flight, "--dsm", dsm, "--link", link)
        command = next(line.split() for line in people.out.splitlines() if " set RTL_ALT " in line)
        assert command == ["hedgehop", "params", "set", "RTL_ALT", f"{better:.0f}", "--link", link]
        assert hedgehop(*command[1:]).code == 0
        again = hedgehop("params", "review", flight, "--dsm", dsm, "--link", link, "--json")
        assert next(f for f in again.json["findings"] if f["parameter"] == "RTL_ALT")["state"] == "good"
        assert again.json["to_change"] == run.json["to_change"] - 1


def test_a_model_without_a_mission_is_wrong_input(tmp_path: Path) -> None:
    run = hedgehop("params", "review", "--dsm", tmp_path / "x.tif", "--link", "tcp:127.0.0.1:1")
    assert run.code == 2
    assert "Give a mission." in run.err
