"""The whole station at work on the demo: edits, undo, files, with real workers and the real 3D view."""

from __future__ import annotations

import asyncio
import io
import json
import threading
import time
import zipfile
from collections.abc import Callable

import pytest

from planning.formats.poi_files import read_pois
from planning.ground.demo_hillside import demo_pois
from server.door.guard import IMPORT_LIMIT_BYTES
from server.plan.demo import PLAN_NAME, TERRAIN_NAME
from server.schemas import (
    CursorMessage,
    HoverProfile,
    NoticeMessage,
    PlaceDoc,
    PlanDoc,
    PoiDoc,
    SelectionDoc,
    SelectionMessage,
    SetSelection,
)
from tests.planning.plan_examples import PLAN_FILES
from tests.server.station import PATIENCE_S, Station, ok

pytestmark = pytest.mark.xdist_group("workspace")


@pytest.fixture
def demo(demo_station: Station) -> Station:
    """The demo plan, open and as it was made."""
    ok(demo_station.http.post("/api/terrains/demo"))
    while demo_station.state.can_undo:
        demo_station.post("/api/plan/undo")
    return demo_station


def test_the_demo_opens_certified(demo: Station) -> None:
    answer = demo.answer(trade=True)
    assert answer.state == "ready"
    assert answer.result is not None
    assert answer.result.certified
    assert not answer.result.reasons
    assert [row.waypoints for row in answer.result.trade] == sorted(
        (row.waypoints for row in answer.result.trade), reverse=True
    )
    assert [terrain.name for terrain in demo.library.terrains] == [TERRAIN_NAME]


def test_an_edit_is_answered_and_a_stale_one_refused(demo: Station) -> None:
    before = demo.answer().result
    base = demo.state
    surface = base.document.surface.model_copy(update={"height_m": base.document.surface.height_m + 10})
    after = demo.put(base.document.model_copy(update={"surface": surface}), "Height")
    answer = demo.answer()
    assert answer.revision == after.revision
    assert before is not None
    assert answer.result is not None
    assert (answer.result.min_vertical_m or 0.0) > (before.min_vertical_m or 0.0) + 5
    edit = {"base_revision": base.revision, "label": "Late", "document": base.document.model_dump()}
    refused = demo.http.put("/api/plan", json=edit)
    assert (refused.status_code, refused.json()["code"]) == (409, "stale")
    assert demo.state.document == after.document


def test_undo_and_redo_bring_every_field_back(demo: Station) -> None:
    first = demo.state.document
    place = PlaceDoc(lat_deg=first.pois[1].lat_deg, lon_deg=first.pois[1].lon_deg)
    everything = PlanDoc(
        name="Other",
        terrain_id=first.terrain_id,
        source="survey",
        pois=[*first.pois[:3], PoiDoc(id="new", lat_deg=place.lat_deg, lon_deg=place.lon_deg, name="N", loiter_s=9)],
        survey=first.survey.model_copy(update={"gsd_cm": 2.5, "side_overlap": 0.5, "angle_deg": 30.0}),
        home=place,
        profile=first.profile.model_copy(update={"name": "P", "max_items": 99, "camera": None, "firmware": "px4"}),
        surface=first.surface.model_copy(update={"radius_m": 12.0, "smooth_sigma_m": 1.0, "floor": False}),
        path=first.path.model_copy(update={"step_m": 0.5, "on_steep": "slow"}),
        mission=first.mission.model_copy(update={"heading": "point", "look_at": place, "end": "land"}),
        clearance=first.clearance.model_copy(update={"required_clearance_m": 4.0, "max_height_above_ground_m": 90.0}),
    )
    demo.put(everything, "Everything")
    assert demo.state.document == everything
    undone = demo.post("/api/plan/undo")
    assert (undone.document, undone.redo_label, undone.can_undo) == (first, "Everything", False)
    redone = demo.post("/api/plan/redo")
    assert (redone.document, redone.undo_label, redone.can_redo) == (everything, "Everything", False)


def test_undo_past_the_start_changes_nothing(demo: Station) -> None:
    before = demo.state
    after = demo.post("/api/plan/undo")
    # What computes and saves beside it may have moved on between the two looks.
    meanwhile = {"computation": before.computation, "saved_utc": before.saved_utc}
    assert after.model_copy(update=meanwhile) == before


def test_points_from_a_file_replace_the_points(demo: Station) -> None:
    rows = [f"{poi.lat_deg},{poi.lon_deg},<b>{poi.name}</b>\x07" for poi in demo_pois()[:3]]
    data = "\n".join(["lat_deg,lon_deg,name", *rows]).encode()
    response = ok(
        demo.http.post(
            "/api/plan/import",
            params={"filename": "../../<i>p.csv"},
            content=data,
            headers={"Content-Type": "application/octet-stream"},
        )
    )
    state = response.json()["state"]
    assert [poi["name"] for poi in state["document"]["pois"]] == ["<b>Meadow</b>", "<b>Ruin</b>", "<b>Gully</b>"]
    assert state["undo_label"] == "Import <i>p.csv"
    assert demo.answer().state == "ready"


def test_every_export_comes_and_reads(demo: Station) -> None:
    response = ok(demo.http.get("/api/plan/export/all.zip"))
    assert response.headers["content-disposition"] == 'attachment; filename="all.zip"'
    with zipfile.ZipFile(io.BytesIO(response.content)) as archive:
        assert archive.testzip() is None
        names = set(archive.namelist())
        certificate = json.loads(archive.read("certificate.json"))
    assert names == PLAN_FILES
    assert certificate["certified"] is True
    assert ok(demo.http.get("/api/plan/export/mission.waypoints")).text.startswith("QGC WPL 110")


def test_an_empty_plan_has_nothing_to_export(demo: Station) -> None:
    fresh = demo.post("/api/plan/new")
    assert (fresh.computation.state, fresh.document.pois) == ("empty", [])
    refused = demo.http.get("/api/plan/export/all.zip")
    assert (refused.status_code, refused.json()["code"]) == (409, "not_ready")
    ok(demo.http.post("/api/terrains/demo"))
    assert demo.http.delete(f"/api/plans/{fresh.plan_id}").status_code == 204


def test_plans_are_saved_opened_and_deleted(demo: Station) -> None:
    first = demo.state
    copy = demo.post("/api/plan/save_as", json={"name": " A/../b \x1b[31m<script> "})
    assert copy.document.name == "A/../b [31m<script>"
    assert copy.plan_id != first.plan_id
    assert demo.http.delete(f"/api/plans/{copy.plan_id}").json()["code"] == "in_use"
    assert demo.post("/api/plan/open", json={"plan_id": first.plan_id}).document == first.document
    assert demo.http.delete(f"/api/plans/{copy.plan_id}").status_code == 204
    for strange in (copy.plan_id, "../plans", "%2e%2e", "a" * 200, "\x00"):
        assert demo.http.post("/api/plan/open", json={"plan_id": strange}).status_code == 404
    assert demo.state.plan_id == first.plan_id


def test_the_shortest_order_keeps_the_first_point(demo: Station) -> None:
    pois = demo.state.document.pois
    demo.change("Shuffle", pois=[pois[0], *reversed(pois[1:])])
    demo.answer()
    ordered = demo.post("/api/plan/shortest_order").document.pois
    assert ordered[0] == pois[0]
    assert sorted(poi.id for poi in ordered) == sorted(poi.id for poi in pois)


def test_a_terrain_in_use_stays(demo: Station) -> None:
    terrain_id = demo.state.document.terrain_id
    refused = demo.http.delete(f"/api/terrains/{terrain_id}")
    assert (refused.status_code, refused.json()["code"]) == (409, "in_use")
    assert PLAN_NAME in refused.json()["what"]
    assert demo.http.delete("/api/terrains/nothing").status_code == 404


def test_hovering_marks_the_path_on_all_pages(demo: Station) -> None:
    demo.answer()
    demo.socket.send(HoverProfile(s_m=10.0).model_dump_json())
    cursor = demo.until(lambda m: isinstance(m, CursorMessage))
    assert cursor.s_m == 10.0
    assert cursor.path_rel_home_m > cursor.ground_rel_home_m
    demo.socket.send('{"type": "hover_profile", "s_m": NaN}')
    assert demo.until(lambda m: isinstance(m, CursorMessage)).s_m is None


def test_an_unknown_message_is_told_and_the_socket_lives(demo: Station) -> None:
    demo.socket.send('{"type": "arm"}')
    assert demo.notice().what == "Messages of type 'arm' are unknown."
    demo.socket.send(SetSelection(selection=SelectionDoc(tool="home"), change=1).model_dump_json())
    assert demo.until(lambda m: isinstance(m, SelectionMessage) and m.selection.tool == "home")


def test_a_burst_of_edits_is_answered_once_for_the_last(demo: Station) -> None:
    demo.answer()
    for height_m in (6.0, 7.0, 8.0, 9.0):
        surface = demo.state.document.surface.model_copy(update={"height_m": height_m})
        demo.put(demo.state.document.model_copy(update={"surface": surface}), "Height", coalesce=True)
    last = demo.state
    answer = demo.answer()
    assert answer.revision == last.revision
    assert last.undo_label == "Height"
    assert demo.post("/api/plan/undo").can_undo is False


def test_two_demos_at_once_are_one(demo: Station) -> None:
    answers: list[int] = []
    threads = [
        threading.Thread(target=lambda: answers.append(demo.http.post("/api/terrains/demo").status_code))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert answers == [200, 200]
    assert len(demo.library.terrains) == 1


def test_a_click_beyond_the_limit_is_told(demo: Station) -> None:
    poi = demo.state.document.pois[0]
    many = [poi.model_copy(update={"id": f"p{i}", "name": f"P{i}"}) for i in range(5000)]
    demo.put(demo.state.document.model_copy(update={"pois": many}), "Many")
    workspace = demo.server.app.state.parts.workspace
    demo.socket.send(SetSelection(selection=SelectionDoc(tool="add_poi"), change=1).model_dump_json())
    demo.until(lambda m: isinstance(m, SelectionMessage) and m.selection.tool == "add_poi")
    demo.server.on_loop(workspace.pointing.on_terrain(poi.lat_deg + 1e-5, poi.lon_deg, known=True))
    notice = demo.until(lambda m: isinstance(m, NoticeMessage))
    assert "5000" in notice.error.what
    assert len(demo.state.document.pois) == 5000


def test_the_answer_to_an_edit(demo: Station, capsys: pytest.CaptureFixture[str]) -> None:
    demo.answer()
    seconds = []
    for radius_m in (10.0, 15.0, 20.0, 25.0, 30.0):
        surface = demo.state.document.surface.model_copy(update={"radius_m": radius_m})
        document = demo.state.document.model_copy(update={"surface": surface})
        started = time.perf_counter()
        demo.put(document, "Radius", coalesce=True)
        assert demo.answer().state == "ready"
        seconds.append(round(time.perf_counter() - started, 3))
    with capsys.disabled():
        print(f"\nedit to result: {seconds} s")


def test_a_large_file_of_points_does_not_hold_up_the_loop(demo: Station) -> None:
    """Beside it, in one run: the same file read by a thread of the server's process."""
    demo.answer()
    feature = '{"type": "Feature", "geometry": {"type": "Point", "coordinates": [9, %d]}, "properties": {"note": "%s"}}'
    features = ",".join(feature % (k % 80, "x" * 90) for k in range(95_000))
    data = f'{{"type": "FeatureCollection", "features": [{features}]}}'.encode()
    assert 15e6 < len(data) < IMPORT_LIMIT_BYTES

    def send() -> None:
        answer = demo.http.post(
            "/api/plan/import",
            params={"filename": "large.geojson"},
            content=data,
            headers={"Content-Type": "application/octet-stream"},
        )
        assert (answer.status_code, answer.json()["code"]) == (422, "format")
        assert "5000" in answer.json()["what"]

    in_thread_s = demo.server.on_loop(longest_gap_s(lambda: read_pois("large.geojson", data)))
    # Whatever else the machine does may come in between once, not each time.
    in_worker_s = (demo.server.on_loop(longest_gap_s(send)) for _ in range(3))
    assert any(gap_s < in_thread_s / 2 for gap_s in in_worker_s)
    assert not demo.uploads_left()


async def longest_gap_s(work: Callable[[], object]) -> float:
    """Between two turns of this loop, while a thread does the work."""
    working = asyncio.create_task(asyncio.to_thread(work))
    longest_s, before_s = 0.0, time.monotonic()
    while not working.done():
        await asyncio.sleep(0.002)
        now_s = time.monotonic()
        longest_s, before_s = max(longest_s, now_s - before_s), now_s
    await working
    return longest_s
