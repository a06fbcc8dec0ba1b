"""Uploads go to the disk under generated names; ids that are none find nothing."""

from __future__ import annotations

import io
import logging.handlers
import queue
import socket

import numpy as np
import pytest
from PIL import Image

from planning.ground.demo_hillside import small_hill
from server.door.uploads import display_folder, display_name, suffix_of
from server.library.terrains import Origin, store_terrain
from tests.server.running import Running

RAW = {"Content-Type": "application/octet-stream"}


def test_an_upload_reaches_the_job_whole(served: Running) -> None:
    data = bytes(range(256)) * 4000
    response = served.http.post(
        "/api/terrains",
        params={
            "filename": "a/b/Hügel.TIF",
            "crs": "EPSG:32760",
            "z_scale": "0.01",
            "vertical_datum": "",
            "folder": "/survey 2026/../x\\dsm/",
            "file_utc": "2026-11-02T12:30:00+01:00",
        },
        content=data,
        headers=RAW,
    )
    assert (response.status_code, response.json()["label"]) == (202, "Reading Hügel.TIF")
    assert served.workspace.uploads["Hügel.TIF"] == data
    assert served.workspace.options == {
        "origin": Origin("survey 2026/../x/dsm", "2026-11-02T11:30:00+00:00"),
        "crs": "EPSG:32760",
        "z_scale": 0.01,
        "vertical_datum": None,
        "remove_spikes": False,
        "cell_m": None,
        "keep_noise": False,
    }


@pytest.mark.parametrize(
    ("query", "where"),
    [
        ({"z_scale": "1e"}, "z_scale"),
        ({"cell_m": "--"}, "cell_m"),
        ({"remove_spikes": "perhaps"}, ""),
        ({"file_utc": "yesterday"}, "file_utc"),
    ],
)
def test_wrong_options_are_refused_before_the_body(served: Running, query: dict, where: str) -> None:
    response = served.http.post("/api/terrains", params={"filename": "x.tif", **query}, content=b"x", headers=RAW)
    assert (response.status_code, response.json()["code"]) == (422, "invalid")
    assert where in response.json()["where"]


def test_a_model_has_a_picture_of_its_relief(served: Running) -> None:
    library = served.parts.library
    hill = small_hill()
    height_m = hill.elevation_m.copy()
    height_m[:, : hill.width_px // 2] = np.nan
    doc = store_terrain(library.root, hill.with_elevation(height_m), name="dsm.tif", origin=Origin("east", None))
    library.refresh()
    assert (doc.folder, doc.file_utc) == ("east", None)
    response = served.http.get(f"/api/terrains/{doc.id}/picture.png")
    assert response.headers["content-type"] == "image/png"
    picture = np.asarray(Image.open(io.BytesIO(response.content)))
    assert max(picture.shape[:2]) <= 96
    assert not picture[:, : picture.shape[1] // 2 - 1, 3].any()
    assert picture[:, picture.shape[1] // 2 + 1 :, 3].all()
    assert np.ptp(picture[..., 0][picture[..., 3] > 0]) > 40
    assert served.http.get("/api/terrains/unknown/picture.png").status_code == 404


def test_a_folder_is_one_short_line() -> None:
    assert display_folder("\\flights\\new\n\x1b[31m/") == "flights/new[31m"
    assert len(display_folder("deep/" * 90)) <= 80


def test_an_empty_upload_is_refused_and_leaves_nothing(served: Running) -> None:
    response = served.http.post("/api/terrains", params={"filename": "x.tif"}, headers=RAW)
    assert response.status_code == 422
    assert list((served.parts.library.root / "uploads").iterdir()) == []


@pytest.mark.parametrize("terrain_id", ["unknown", "..%2f..%2fetc", "A", "a" * 33])
def test_unknown_terrains_are_not_found(served: Running, terrain_id: str) -> None:
    assert served.http.delete(f"/api/terrains/{terrain_id}").status_code == 404
    assert served.http.post(f"/api/terrains/{terrain_id}/remove_spikes").status_code == 404


def test_an_orthophoto_needs_its_terrain(served: Running) -> None:
    response = served.http.post(
        "/api/orthophotos", params={"filename": "x.tif", "terrain_id": "unknown"}, content=b"x", headers=RAW
    )
    assert (response.status_code, response.json()["code"]) == (404, "not_found")


def test_a_job_can_be_cancelled(served: Running) -> None:
    assert served.http.post("/api/jobs/j1/cancel").status_code == 204
    assert "cancel j1" in served.workspace.calls


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("dsm.tif", "dsm.tif"),
        ("../../etc/passwd", "passwd"),
        ("C:\\maps\\dsm.tif", "dsm.tif"),
        ("a\r\nb\x1b[31m\u202e.tif", "ab[31m.tif"),
        ("", "unnamed"),
        ("..", ".."),
        ("x" * 300, "x" * 80),
    ],
)
def test_display_names_are_one_line_without_folders(given: str, shown: str) -> None:
    assert display_name(given) == shown


@pytest.mark.parametrize(
    ("name", "suffix"), [("a.TIF", ".tif"), ("a.t/../x", ""), ("a", ""), ("a.tar.gz", ".gz"), ("a.ü", ""), ("..", "")]
)
def test_suffixes_are_plain(name: str, suffix: str) -> None:
    assert suffix_of(name) == suffix


def test_an_upload_that_is_broken_off_leaves_nothing_and_is_no_fault(served: Running) -> None:
    told: queue.Queue[logging.LogRecord] = queue.Queue()
    handler = logging.handlers.QueueHandler(told)
    watched = [logging.getLogger(name) for name in ("hedgehop.http", "uvicorn.error")]
    before = watched[0].level
    watched[0].setLevel(logging.INFO)
    for logger in watched:
        logger.addHandler(handler)
    head = (
        "POST /api/terrains?filename=a.tif HTTP/1.1\r\n"
        f"Host: 127.0.0.1:{served.settings.port}\r\nOrigin: {served.origin}\r\nCookie: {served.cookie}\r\n"
        "Content-Type: application/octet-stream\r\nContent-Length: 1000000\r\n\r\n"
    )
    try:
        with socket.create_connection(("127.0.0.1", served.settings.port)) as connection:
            connection.sendall(head.encode() + bytes(1000))
        # A request is logged after its answer has gone: those of the sign-in and of a test before may come late.
        line = _until(told, "POST /api/terrains")
        served.http.get("/api/health")
        after = _until(told, "GET /api/health")
    finally:
        watched[0].setLevel(before)
        for logger in watched:
            logger.removeHandler(handler)
    assert line.startswith("POST /api/terrains 400 ")
    assert after.startswith("GET /api/health 200 ")
    assert list((served.settings.data_dir / "uploads").iterdir()) == []


def _until(told: queue.Queue[logging.LogRecord], begins: str) -> str:
    """The line that begins so; no line of the server's own log, where faults stand, may come before it."""
    while True:
        record = told.get(timeout=30)
        assert record.name == "hedgehop.http", record.getMessage()
        if record.getMessage().startswith(begins):
            return record.getMessage()
