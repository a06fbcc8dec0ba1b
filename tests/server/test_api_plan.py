"""The open plan over HTTP and its stream."""

from __future__ import annotations

import json
from typing import Any

import pytest
from websockets.sync.connection import Connection

from server.schemas import Snapshot
from tests.server.fakes import notice
from tests.server.running import Running


def test_the_state_is_a_snapshot(served: Running) -> None:
    response = served.http.get("/api/state")
    assert Snapshot.model_validate_json(response.text).page_id == ""
    assert response.headers["content-type"] == "application/json"


def test_an_edit_comes_back_and_reaches_the_other_pages(served: Running) -> None:
    with served.socket() as socket:
        assert json.loads(socket.recv(timeout=60))["type"] == "snapshot"
        edit = {"base_revision": 1, "label": "Rename", "document": {"name": "<b>&\u0007"}}
        response = served.http.put("/api/plan", json=edit)
        # Markup stays text; control characters go.
        assert response.json()["document"]["name"] == "<b>&"
        assert _next(socket, "plan")["plan"]["revision"] == 2


def test_a_stale_edit_is_a_conflict(served: Running) -> None:
    response = served.http.put("/api/plan", json={"base_revision": 0, "label": "x", "document": {}})
    assert (response.status_code, response.json()["code"]) == (409, "stale")
    assert response.json()["advice"]


@pytest.mark.parametrize(
    ("body", "where"),
    [
        ({}, "base_revision"),
        ({"base_revision": 1, "label": "x", "document": {"nonsense": 1}}, "document.nonsense"),
        (
            {"base_revision": 1, "label": "x", "document": {"pois": [{"id": "a", "lat_deg": 91, "lon_deg": 0}]}},
            "document.pois.0.lat_deg",
        ),
        ({"base_revision": 1, "label": "x" * 61, "document": {}}, "label"),
    ],
)
def test_wrong_bodies_name_the_field(served: Running, body: dict, where: str) -> None:
    response = served.http.put("/api/plan", json=body)
    assert (response.status_code, response.json()["code"]) == (422, "invalid")
    assert response.json()["where"] == where


@pytest.mark.parametrize(
    "text", ["{", "NaN", '{"base_revision": 1, "label": "x", "document": {"path": {"step_m": NaN}}}']
)
def test_what_is_not_json_is_refused(served: Running, text: str) -> None:
    response = served.http.put("/api/plan", content=text, headers={"Content-Type": "application/json"})
    assert response.status_code == 422


def test_import_takes_raw_bytes_and_a_display_name(served: Running) -> None:
    response = served.http.post(
        "/api/plan/import",
        params={"filename": "../../x\r\ny/pois.csv"},
        content=b"\x00\xff1,2",
        headers={"Content-Type": "application/octet-stream"},
    )
    assert response.status_code == 200
    assert served.workspace.uploads["pois.csv"] == b"\x00\xff1,2"


def test_exports_are_attachments_and_the_report_runs_nothing(served: Running) -> None:
    attached = served.http.get("/api/plan/export/report.html")
    assert attached.headers["content-disposition"] == 'attachment; filename="report.html"'
    shown = served.http.get("/api/plan/export/report.html", params={"inline": 1})
    assert shown.headers["content-disposition"].startswith("inline")
    for response in (attached, shown):
        assert response.headers["content-security-policy"].startswith("default-src 'none'")
        assert "script-src" not in response.headers["content-security-policy"]


def test_an_export_without_a_plan_says_so(served: Running) -> None:
    response = served.http.get("/api/plan/export/mission.plan")
    assert (response.status_code, response.json()["code"]) == (409, "not_ready")


@pytest.mark.parametrize("file", ["../secret", "nothing.txt", "%2e%2e%2fx"])
def test_only_known_files_are_exported(served: Running, file: str) -> None:
    assert served.http.get(f"/api/plan/export/{file}").status_code in (404, 422)


def test_the_stream_answers_faulty_messages_and_hides_details(served: Running) -> None:
    with served.socket() as socket:
        socket.recv(timeout=60)
        socket.send('{"type": "launch"}')
        assert "launch" in _next(socket, "notice")["error"]["what"]
        for poi, code in (("refused", "not_ready"), ("broken", "internal")):
            socket.send(json.dumps({"type": "set_selection", "selection": {"poi_id": poi}, "change": 7}))
            answer = _next(socket, "notice")
            assert answer["error"]["code"] == code
            assert "secret" not in json.dumps(answer)
            # Refused or not, the page need not wait for it any longer.
            assert _next(socket, "answered") == {"v": 1, "type": "answered", "change": 7}
        served.workspace.loop.call_soon_threadsafe(served.parts.hub.publish, notice("still here"))
        assert _next(socket, "notice")["error"]["what"] == "still here"


def _next(socket: Connection, kind: str) -> dict[str, Any]:
    """What is told of other matters meanwhile, such as who is in charge, is passed over."""
    while True:
        message = json.loads(socket.recv(timeout=60))
        if message["type"] == kind:
            return message
