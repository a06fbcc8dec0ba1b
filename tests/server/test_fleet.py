"""Several vehicles on one station: each with its nodes, its lease and its words, and no command to the wrong one."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from server.errors import StartError
from server.library import Library
from server.library.recording_list import RecordingShelf
from server.settings import MOST_VEHICLES, load_settings
from server.stations import Flying
from telemetry.bus.node_lock import running_node, running_nodes
from telemetry.topics.messages import FlightStatus
from tests.server.simulated import simulated_vehicle
from tests.server.station import PATIENCE_S, Station, ok, station

LONG_S = 3 * PATIENCE_S
HOMES = ("47.000000000,8.000000000,500.0", "47.000500000,8.001000000,500.0")
BEE, WASP = {"Hedgehop-Vehicle": "1"}, {"Hedgehop-Vehicle": "2"}


@pytest.fixture(autouse=True)
def _own_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def test_link_is_the_first_vehicle_and_the_named_ones_come_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_settings().vehicles == [("Vehicle 1", ())]
    monkeypatch.setenv("HEDGEHOP_VEHICLE", "Bee = udpin:0.0.0.0:14560, /dev/ttyACM0:57600; Wasp=tcp:10.0.0.7:5760")
    bee = "Bee", ("udpin:0.0.0.0:14560", "/dev/ttyACM0:57600")
    assert load_settings().vehicles == [bee, ("Wasp", ("tcp:10.0.0.7:5760",))]
    assert load_settings(link=["udpin:0.0.0.0:14550"]).vehicles[0] == ("Vehicle 1", ("udpin:0.0.0.0:14550",))
    assert load_settings(link=["udpin:0.0.0.0:14550"]).vehicles[1] == bee


@pytest.mark.parametrize(
    ("vehicles", "says"),
    [
        (["udpin:0.0.0.0:14560"], "write NAME=LINK"),
        (["=udpin:0.0.0.0:14560"], "write NAME=LINK"),
        (["Bee="], "write NAME=LINK"),
        (["B" * 25 + "=tcp:a:1"], "at most 24 characters"),
        (["Bee=tcp:a:1", "Bee=tcp:a:2"], "the same name: Bee"),
        (["Bee=tcp:a:1", "Wasp=tcp:a:1"], "the same connection: tcp:a:1"),
        ([f"V{n}=tcp:a:{n}" for n in range(1, MOST_VEHICLES + 2)], "at most 8"),
    ],
)
def test_what_is_no_vehicle_stops_the_start_with_words(vehicles: list[str], says: str) -> None:
    with pytest.raises(StartError, match=says):
        load_settings(vehicle=vehicles)


def test_a_connection_cannot_be_two_vehicles() -> None:
    with pytest.raises(StartError, match="connection of two vehicles"):
        load_settings(link=["tcp:a:1"], vehicle=["Bee=tcp:a:1"])


def test_what_link_names_has_its_name_for_itself() -> None:
    with pytest.raises(StartError, match="Vehicle 1 is the name of the one that link names"):
        load_settings(link=["tcp:a:1"], vehicle=["Vehicle 1=tcp:a:2"])
    assert [name for name, _ in load_settings(vehicle=["Vehicle 1=tcp:a:2"]).vehicles] == ["Vehicle 1"]


def test_a_recording_says_which_vehicle_flew_it(tmp_path: Path) -> None:
    with contextlib.closing(Library(tmp_path / "data")) as library:
        shelf = RecordingShelf(library)
        for number in (1, 2):
            (shelf.folder_of(number) / f"{number}.tlog").write_bytes(b"")
        assert {doc.name: doc.vehicle for doc in shelf.docs()} == {"1.tlog": "", "2.tlog": "Vehicle 2"}


def test_the_strip_calls_no_vehicle_live_whose_link_process_has_failed() -> None:
    said = SimpleNamespace(state="live", silent_s=0.2)
    for answers, link in ((True, "live"), (False, "lost")):
        stand_in: Any = SimpleNamespace(
            number=2,
            name="Wasp",
            live=SimpleNamespace(state=None, flight=FlightStatus()),
            connections=SimpleNamespace(status=said),
            nodes=SimpleNamespace(link_answers=answers),
            lease=SimpleNamespace(holder=None),
            _aboard=SimpleNamespace(record=None),
            _loss=lambda: None,
            _alert=lambda: None,
        )
        assert Flying.doc(stand_in, None).link == link


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """Two simulated vehicles, heard and adopted."""
    with contextlib.ExitStack() as stack:
        links = [stack.enter_context(simulated_vehicle(home)) for home in HOMES]
        vehicles = [f"{name}={link}" for name, link in zip(("Bee", "Wasp"), links, strict=True)]
        folder = tmp_path_factory.mktemp("data")
        made = stack.enter_context(station(folder, flies=True, vehicle=vehicles))
        made.until(lambda m: m.type == "fleet" and all(v.link == "live" and v.lat_deg for v in m.vehicles), LONG_S)
        yield made


def choose(page: Station, number: int) -> None:
    page.socket.send(json.dumps({"type": "choose_vehicle", "vehicle": number}))
    page.until(lambda m: m.type == "active" and m.vehicle == number)


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_every_page_is_told_of_all_and_sees_one_in_full(pair: Station) -> None:
    choose(pair, 1)
    fleet = pair.until(lambda m: m.type == "fleet").vehicles
    assert [(v.number, v.name, v.armed, v.link) for v in fleet] == [
        (1, "Bee", False, "live"),
        (2, "Wasp", False, "live"),
    ]
    first = pair.until(lambda m: m.type == "vehicle" and m.state is not None and m.state.lat_deg is not None)
    assert first.state.lat_deg == pytest.approx(47.0, abs=1e-4)
    choose(pair, 2)
    # From the switch on, nothing of the other one comes any more.
    for _ in range(20):
        message = pair.until(lambda m: m.type == "vehicle" and m.state is not None and m.state.lat_deg is not None)
        assert message.state.lon_deg == pytest.approx(8.001, abs=1e-4)


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_a_page_that_comes_back_shows_the_vehicle_that_it_showed(pair: Station) -> None:
    with pair.server.socket("/ws?vehicle=2") as socket:
        page = Station(pair.server, socket)
        assert page.until(lambda m: m.type == "active").vehicle == 2
        assert page.until(lambda m: m.type == "link").link.adopted is not None
    with pair.server.socket("/ws?vehicle=7") as socket:
        assert Station(pair.server, socket).until(lambda m: m.type == "active").vehicle == 1


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_a_command_goes_to_the_vehicle_that_it_names_and_to_no_other(pair: Station) -> None:
    refused = pair.http.post("/api/flight/arm")
    assert refused.status_code == 422
    assert "2 vehicles, and the request names none" in refused.json()["what"]
    assert pair.http.post("/api/flight/arm", headers={"Hedgehop-Vehicle": "3"}).status_code == 404
    assert pair.http.post("/api/flight/arm", headers={"Hedgehop-Vehicle": "Bee"}).status_code == 422
    # In charge of the first one only: to switch moves nothing.
    choose(pair, 2)
    assert pair.http.post("/api/flight/arm", headers=WASP).json()["code"] == "not_in_charge"
    ok(pair.http.post("/api/lease/take", headers=WASP))
    _wait_ready(pair)
    ok(pair.http.post("/api/flight/arm", headers=WASP))
    armed = pair.until(lambda m: m.type == "fleet" and any(v.armed for v in m.vehicles)).vehicles
    assert [v.armed for v in armed] == [False, True]
    assert [v.holder for v in armed] == 2 * [pair.server.name]
    ok(pair.http.post("/api/flight/disarm", headers=WASP))
    pair.until(lambda m: m.type == "fleet" and not any(v.armed for v in m.vehicles))
    ok(pair.http.post("/api/lease/release", headers=WASP))
    assert pair.http.post("/api/flight/disarm", headers=WASP).json()["code"] == "not_in_charge"
    assert pair.until(lambda m: m.type == "fleet" and m.vehicles[1].holder is None).vehicles[0].holder is not None
    # Armed is recorded; the tests after this one begin without it.
    (kept,) = pair.until(lambda m: m.type == "recordings" and len(m.recordings) == 1, LONG_S).recordings
    ok(pair.http.delete(f"/api/recordings/{kept.id}"))


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_parameters_of_two_vehicles_are_compared_and_one_is_set_as_on_the_other(pair: Station) -> None:
    ok(pair.http.post("/api/parameters/read", headers=BEE))
    assert ok(pair.http.post("/api/parameters/compare/2", headers=BEE)).json()["differences"] == []
    change = {"changes": [{"name": "RTL_ALT", "value": 2100}]}
    ok(pair.http.post("/api/parameters/write", json=change, headers=BEE))
    made = ok(pair.http.post("/api/parameters/compare/2", headers=BEE)).json()
    assert made["file"].startswith("Wasp (system 1), ardupilot")
    assert made["differences"] == [{"name": "RTL_ALT", "here": 2100.0, "there": 1500.0, "own": False}]
    back = {"changes": [{"name": "RTL_ALT", "value": made["differences"][0]["there"]}]}
    ok(pair.http.post("/api/parameters/write", json=back, headers=BEE))
    assert ok(pair.http.post("/api/parameters/compare/2", headers=BEE)).json()["differences"] == []
    itself = pair.http.post("/api/parameters/compare/1", headers=BEE)
    assert (itself.status_code, pair.http.post("/api/parameters/compare/3", headers=BEE).status_code) == (422, 404)
    assert "cannot be compared with itself" in itself.json()["what"]


def _wait_ready(page: Station) -> None:
    def is_ready(message: Any) -> bool:
        state = message.state if message.type == "vehicle" else None
        return state is not None and bool(state.ready_to_arm and state.estimator_ok)

    page.until(is_ready, LONG_S)


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_a_vehicle_that_a_station_before_has_left_flying_is_found_again(tmp_path: Path) -> None:
    """This station was started for one vehicle only; a link of a third one still runs."""
    runtime = tmp_path / "data" / "vehicles" / "3" / "run"
    runtime.mkdir(parents=True, mode=0o700)
    left = subprocess.Popen([sys.executable, "-m", "telemetry.nodes.link", "--runtime", str(runtime)])
    try:
        end_s = time.monotonic() + LONG_S
        while not running_nodes(runtime):
            assert left.poll() is None
            assert time.monotonic() < end_s
            time.sleep(0.05)
        with station(tmp_path / "data", flies=True) as made:
            fleet = made.until(lambda m: m.type == "fleet").vehicles
            assert [(v.number, v.name) for v in fleet] == [(1, "Vehicle 1"), (3, "Vehicle 3")]
            choose(made, 3)
            assert made.until(lambda m: m.type == "link").link.state == "none"
            refused = made.http.post("/api/flight/arm", headers={"Hedgehop-Vehicle": "2"})
            assert (refused.status_code, refused.json()["advice"]) == (404, "There are 1, 3.")
    finally:
        left.kill()
        left.wait(30)


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_each_has_nodes_recordings_and_a_log_of_commands_of_its_own(pair: Station) -> None:
    ok(pair.http.post("/api/recorder/start", headers=BEE))
    ok(pair.http.post("/api/lease/take", headers=WASP))
    ok(pair.http.post("/api/recorder/start", headers=WASP))
    assert ok(pair.http.get("/api/recordings")).json() == []
    for vehicle in (BEE, WASP):
        ok(pair.http.post("/api/recorder/stop", headers=vehicle))
    listed = pair.until(lambda m: m.type == "recordings" and len(m.recordings) == 2).recordings
    assert len({recording.id for recording in listed}) == 2
    root = pair.server.settings.data_dir
    for folder in (root, root / "vehicles" / "2"):
        assert {"link", "recorder"} <= {node.name for node in running_nodes(folder / "run")}
        assert len(list((folder / "recordings").glob("*.mcap"))) == 1
        assert (folder / "audit.jsonl").is_file()
    assert ok(pair.http.post("/api/audit/verify")).json()["state"] == "whole"
    for recording in listed:
        ok(pair.http.delete(f"/api/recordings/{recording.id}"))
    assert ok(pair.http.get("/api/recordings")).json() == []


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_a_link_that_hangs_is_not_live_on_pages_that_show_another_vehicle(pair: Station) -> None:
    """Disarmed, too: then no alarm says it."""

    def wasp(message: Any) -> Any:
        return next(each for each in message.vehicles if each.name == "Wasp")

    node = running_node(pair.server.settings.data_dir / "vehicles" / "2" / "run", "link")
    assert node is not None
    pair.until(lambda m: m.type == "fleet" and wasp(m).link == "live", LONG_S)
    os.kill(node.pid, signal.SIGSTOP)
    told = wasp(pair.until(lambda m: m.type == "fleet" and wasp(m).link != "live", LONG_S))
    assert (told.link, told.silent_s, told.alarm) == ("lost", None, None)
    pair.until(lambda m: m.type == "fleet" and wasp(m).link == "live", LONG_S)
