"""A whole flight through the doors: nodes, bus and simulated vehicle are real, only the pilot is not."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from server.app import origin_file
from server.schemas import FlyState, ReviewDoc, Snapshot
from tests.server.cli_runs import hedgehop
from tests.server.running import PASSWORD
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle
from tests.server.station import PATIENCE_S, Station, ok, station

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

LONG_S = 3 * PATIENCE_S
SPEEDUP = 12.0


@pytest.fixture(scope="module")
def ground_station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with station(tmp_path_factory.mktemp("data"), flies=True, password=PASSWORD) as made:
        yield made


@pytest.fixture(scope="module")
def planned(ground_station: Station) -> Station:
    """The demo's plan is open and certified."""
    ok(ground_station.http.post("/api/terrains/demo"))
    assert ground_station.answer().state == "ready"
    return ground_station


@pytest.fixture(scope="module")
def vehicle(planned: Station) -> Iterator[str]:
    """At the plan's home, with the return height that the plan counts on, connected and ready."""
    document, result = planned.state.document, planned.state.computation.result
    assert result is not None
    home = document.pois[0]
    place = f"{home.lat_deg:.9f},{home.lon_deg:.9f},{result.home_alt_dsm_m:.3f}"
    rtl = f"RTL_ALT={100 * document.profile.rtl_height_m:.0f}"
    with simulated_vehicle(place, "--speedup", SPEEDUP, "--parameter", rtl, *QUICKLY_DOWN) as address:
        ok(planned.http.post("/api/link/connect", json={"address": address}))
        planned.until(lambda m: m.type == "vehicle" and _is_ready(m.state), LONG_S)
        yield address
        ok(planned.http.post("/api/link/disconnect", json={"address": address}))


def _is_ready(state: Any) -> bool:
    return state is not None and bool(state.ready_to_arm and state.estimator_ok) and state.home_lat_deg is not None


def test_a_page_is_told_everything_at_once_and_opening_it_gives_no_command(planned: Station) -> None:
    with planned.server.socket() as socket:
        page = Station(planned.server, socket)
        assert isinstance(page.snapshot, Snapshot)
        assert page.until(lambda m: m.type == "me").me.owner
        assert page.until(lambda m: m.type == "lease").lease.mine
    with other_operator(planned) as other, planned.server.socket(additional_headers=cookies(other)) as socket:
        assert not Station(planned.server, socket).until(lambda m: m.type == "lease").lease.mine


@contextlib.contextmanager
def other_operator(planned: Station) -> Iterator[httpx.Client]:
    with planned.server.stranger(headers={"Origin": planned.server.origin}) as other:
        assert other.post("/api/session", json={"password": PASSWORD}).status_code == 204
        yield other
        other.delete("/api/session")


def cookies(client: httpx.Client) -> dict[str, str]:
    return {"Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items())}


def test_control_is_asked_for_and_handed_over(planned: Station) -> None:
    with other_operator(planned) as other:
        refused = other.post("/api/flight/arm")
        assert (refused.status_code, refused.json()["code"]) == (403, "not_in_charge")
        name = other.get("/api/session").json()["name"]
        planned.socket.send('{"type": "ping", "page_ms": 1.0}')
        planned.until(lambda m: m.type == "clock")
        assert ok(other.post("/api/lease/take")).json()["waits"]
        assert planned.until(lambda m: m.type == "lease" and m.lease.asks).lease.asks == name
        ok(planned.http.post("/api/lease/hand_over"))
        assert planned.http.post("/api/flight/arm").status_code == 403
        ok(other.post("/api/lease/release"))
        ok(planned.http.post("/api/lease/take"))
        assert planned.until(lambda m: m.type == "lease" and m.lease.mine).lease.holder == planned.server.name


def test_a_holder_of_whom_nothing_is_heard_can_be_relieved_and_reads_it(planned: Station) -> None:
    with other_operator(planned) as other:
        planned.until(lambda m: m.type == "lease" and m.lease.silent)
        assert ok(other.post("/api/lease/take")).json()["mine"]
        assert "has taken control of the vehicle" in planned.notice().what
        ok(other.post("/api/lease/release"))
    ok(planned.http.post("/api/lease/take"))


def test_a_link_that_names_a_file_is_refused(planned: Station) -> None:
    for address in ("/etc/passwd", "file:///etc/passwd", "udpin:0.0.0.0:99999999"):
        answer = planned.http.post("/api/link/connect", json={"address": address})
        assert (answer.status_code, answer.json()["code"]) == (422, "link_address"), answer.text


def test_without_a_vehicle_commands_say_so(planned: Station) -> None:
    answer = planned.http.post("/api/flight/arm")
    assert (answer.status_code, answer.json()["code"]) == (409, "no_vehicle")
    assert planned.http.post("/api/flight/check").status_code == 409


def test_home_is_set_where_the_vehicle_stands_by_a_command(planned: Station, vehicle: str) -> None:
    settings = planned.server.settings
    origin_file(settings).write_text(planned.server.origin, encoding="ascii")
    ok(planned.http.post("/api/lease/release"))
    try:
        run = hedgehop("home", "here", "--data-dir", settings.data_dir, "--json")
        assert (run.code, run.json["set"], run.json["return"]) == (0, True, None), run.err
        assert run.json["moves_m"] < 1.0
    finally:
        ok(planned.http.post("/api/lease/take"))


def test_a_flight_is_uploaded_checked_flown_recorded_and_reviewed(planned: Station, vehicle: str) -> None:
    uploaded = FlyState.model_validate_json(
        ok(planned.http.post("/api/flight/upload", json={"revision": planned.state.revision})).text
    )
    assert (uploaded.onboard.state, uploaded.onboard.is_open_plan) == ("verified", True)
    checked = FlyState.model_validate_json(ok(planned.http.post("/api/flight/check")).text)
    assert checked.preflight is not None
    assert [row for row in checked.preflight.rows if row.state != "good"] == []
    ok(planned.http.post("/api/flight/start", json={"digest": checked.onboard.digest}))

    on_line = planned.until(lambda m: m.type == "vehicle" and m.follow is not None and (m.follow.s_m or 0) > 30, LONG_S)
    assert abs(on_line.follow.cross_track_m) < 3.0
    assert on_line.follow.distance_to_dsm_m > 3.0
    assert 0.0 < on_line.follow.progress < 1.0
    assert on_line.follow.time_left_s > 0.0
    recording = planned.until(lambda m: m.type == "recorder" and m.recorder.recording, LONG_S).recorder
    refused = planned.http.post("/api/flight/upload", json={"revision": planned.state.revision})
    assert refused.status_code == 409

    planned.until(lambda m: m.type == "flight" and m.flight.phase == "returning", LONG_S)
    home_again = planned.until(lambda m: m.type == "vehicle" and m.state is not None and not m.state.armed, LONG_S)
    assert home_again.follow.home_distance_m < 5.0
    listed = planned.until(
        lambda m: m.type == "recordings" and any(r.name == recording.name and not r.fault for r in m.recordings), LONG_S
    ).recordings
    doc = next(each for each in listed if each.name == recording.name)
    assert (doc.plan_name, doc.terrain_id) == ("Demo flight", planned.state.document.terrain_id)
    review = _opened(planned, doc.id)
    assert review.figures is not None
    assert review.figures.completed
    assert review.figures.cross_track_max_m is not None
    assert review.figures.cross_track_max_m < 3.0
    assert review.terrain_name.startswith("Demo hillside")

    ok(planned.http.post("/api/review/play", json={"playing": True, "at_s": 5.0, "speed": 2.0}))
    # In either order.
    replayed: dict[str, Any] = {}

    def both_came(m: Any) -> bool:
        if m.type == "vehicle" and m.source == "replay" and m.state is not None:
            replayed["vehicle"] = m.state
        elif m.type == "track" and m.track.source == "replay" and len(m.track.t_s) > 1:
            replayed["track"] = m.track
        return len(replayed) == 2

    planned.until(both_came)
    assert replayed["vehicle"].system_id == 1
    assert replayed["track"].t_s == sorted(replayed["track"].t_s)
    assert planned.http.delete(f"/api/recordings/{doc.id}").status_code == 409
    ok(planned.http.post("/api/review/close"))
    assert planned.until(lambda m: m.type == "review").review is None
    assert planned.http.post("/api/review/play", json={"playing": True}).status_code == 409
    assert len(ok(planned.http.get(f"/api/recordings/{doc.id}/file")).content) == doc.bytes
    assert planned.http.delete(f"/api/recordings/{doc.id}").status_code == 204


def _opened(page: Station, recording_id: str) -> ReviewDoc:
    ok(page.http.post("/api/review/open", json={"recording_id": recording_id}))
    return page.until(lambda m: m.type == "review" and m.review is not None).review


def test_the_vehicles_own_log_of_that_flight_is_read_and_reviewed(planned: Station, vehicle: str) -> None:
    del vehicle
    assert planned.http.post("/api/link/logs/1/download").status_code == 404  # not asked for the list yet
    listed = ok(planned.http.post("/api/link/logs/list")).json()["logs"]
    assert len(listed) >= 1
    newest = listed[0]
    began = ok(planned.http.post(f"/api/link/logs/{newest['number']}/download")).json()
    assert began["download"]["state"] == "reading"
    assert planned.http.post("/api/link/logs/list").status_code == 409
    deadline_s = time.monotonic() + LONG_S
    while (download := ok(planned.http.get("/api/link/logs")).json()["download"])["state"] == "reading":
        assert time.monotonic() < deadline_s
        time.sleep(0.1)
    assert (download["state"], download["error"]) == ("done", None)
    assert download["read_bytes"] == newest["bytes"]
    (recording,) = [r for r in ok(planned.http.get("/api/recordings")).json() if r["id"] == download["recording_id"]]
    assert (recording["kind"], recording["bytes"]) == ("dataflash", newest["bytes"])
    review = _opened(planned, recording["id"])
    assert review.series.t_s
    ok(planned.http.post("/api/review/close"))


def test_another_ground_stations_log_is_reviewed(planned: Station, shared_data: Path) -> None:
    log = (shared_data / "logs" / "arducopter" / "auto.tlog").read_bytes()
    added = ok(
        planned.http.post(
            "/api/recordings/import",
            params={"filename": "../auto flight.tlog"},
            content=log,
            headers={"Content-Type": "application/octet-stream"},
        )
    ).json()
    assert (added["name"], added["kind"], added["fault"]) == ("auto flight.tlog", "tlog", "")
    review = _opened(planned, added["id"])
    assert review.figures is not None
    assert review.figures.completed
    assert review.terrain_name == ""
    assert any("no surface model" in note for note in review.notes)
    ok(planned.http.post("/api/review/close"))


def test_a_vehicles_own_log_is_reviewed(planned: Station, shared_data: Path) -> None:
    log = (shared_data / "logs" / "real_flights" / "arducopter-4.7.BIN").read_bytes()
    added = ok(
        planned.http.post(
            "/api/recordings/import",
            params={"filename": "00000007.BIN"},
            content=log,
            headers={"Content-Type": "application/octet-stream"},
        )
    ).json()
    assert (added["name"], added["kind"], added["vehicle"]) == ("00000007.bin", "dataflash", "ArduPilot 4.7.0-dev")
    review = _opened(planned, added["id"])
    assert review.figures is not None
    assert review.figures.completed
    ok(planned.http.post("/api/review/close"))


@pytest.mark.parametrize(
    ("name", "data", "status"),
    [
        ("notes.txt", b"hello", 422),
        ("samples.bin", bytes(range(256)) * 9, 422),
        ("empty.tlog", b"", 422),
        ("foreign.tlog", b"\x89PNG\r\n\x1a\n" + bytes(2000), 422),
        ("foreign.mcap", b"GIF89a" + bytes(2000), 422),
    ],
)
def test_what_is_no_recording_is_refused_and_leaves_nothing(
    planned: Station, name: str, data: bytes, status: int
) -> None:
    before = ok(planned.http.get("/api/recordings")).json()
    answer = planned.http.post(
        "/api/recordings/import",
        params={"filename": name},
        content=data,
        headers={"Content-Type": "application/octet-stream"},
    )
    assert answer.status_code == status, answer.text
    assert "Traceback" not in answer.text
    assert ok(planned.http.get("/api/recordings")).json() == before
    assert planned.uploads_left() == []


def test_recordings_are_named_by_ids_only(planned: Station) -> None:
    for recording_id in ("..", "../onboard.json", "%2e%2e%2fsessions.json", "x" * 40, "0" * 16):
        assert planned.http.get(f"/api/recordings/{recording_id}/file").status_code == 404
        assert planned.http.post("/api/review/open", json={"recording_id": recording_id}).status_code == 404
