"""Traversability through the doors of a whole station: worked out, cleared, searched, exported, forgotten."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.terrain.geotiff import write_dsm
from server.schemas import JobDoc, SetView, TraversabilityState, ViewDoc
from telemetry.sensors.uwb_log import write_uwb_log
from tests.server.scene_fixtures import hill
from tests.server.station import Station, ok, station
from tests.server.test_traversability_maps import scans

pytestmark = [pytest.mark.xdist_group("process"), pytest.mark.slow]

PATH = "/api/traversability"
RAW = {"Content-Type": "application/octet-stream"}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    folder = tmp_path_factory.mktemp("data")
    with station(folder) as made:
        write_dsm(folder / "hill.tif", hill())
        assert made.upload("hill.tif", (folder / "hill.tif").read_bytes()).state == "done"
        yield made


def heard(page: Station, state: str, **wanted: object) -> TraversabilityState:
    wanted["state"] = state

    def is_it(message: Any) -> bool:
        found = message.type == "traversability" and message.traversability
        return bool(found) and all(getattr(found, name) == value for name, value in wanted.items())

    return page.until(is_it).traversability


def test_from_a_surface_model_to_landing_sites_and_files(page: Station, tmp_path: Path) -> None:
    at = hill().lat_lon_from_xy(np.array([[500_060.0, 3_999_945.0]]))[0].tolist()
    near = {"lat_deg": at[0], "lon_deg": at[1], "rotor_span_m": 0.8, "radius_m": 30}
    assert page.http.post(f"{PATH}/sites", json=near).status_code == 409
    assert page.http.get(f"{PATH}/map/before.tif").status_code == 409

    job = JobDoc.model_validate_json(ok(page.http.post(PATH, json={})).text)
    ready = heard(page, "ready")
    assert ready.cells > 4000
    assert ready.resolution_m == 1.0
    assert page.ended(job.id).state == "done"

    found = TraversabilityState.model_validate_json(ok(page.http.post(f"{PATH}/sites", json=near)).text)
    assert [site.rank for site in found.sites] == [1, 2, 3, 4, 5]
    assert page.http.get(f"{PATH}/map/probability.tif").status_code == 409

    along = np.column_stack([np.linspace(500_060.0, 500_062.0, 60), np.full(60, 3_999_942.0)])
    write_uwb_log(tmp_path / "walk.npz", scans(hill().lat_lon_from_xy(along)))
    data = (tmp_path / "walk.npz").read_bytes()
    ok(page.http.post(f"{PATH}/uwb", params={"name": "walk.npz"}, content=data, headers=RAW))
    cleared = heard(page, "ready", uwb_log="walk.npz")
    assert (cleared.uwb_log, cleared.scans, len(cleared.sites)) == ("walk.npz", 60, 5)
    for layer in ("before", "cleared", "probability", "time_in_view"):
        assert ok(page.http.get(f"{PATH}/map/{layer}.tif")).content.startswith(b"II*"), layer

    view = ViewDoc(show_traversability=True, traversability_layer="time_in_view")
    page.socket.send(SetView(view=view, change=1).model_dump_json())
    shown = page.until(lambda m: m.type == "traversability").traversability
    assert shown.legend[0] == "In view: up to 2 s"

    with page.server.socket() as socket:
        later = Station(page.server, socket)
        assert heard(later, "ready").legend == shown.legend

    refused = page.http.post(f"{PATH}/uwb", params={"name": "no.npz"}, content=b"no log", headers=RAW)
    assert page.ended(JobDoc.model_validate_json(ok(refused).text).id).state == "failed"
    assert page.http.get(f"{PATH}/map/cleared.tif").is_success

    ok(page.http.delete(PATH))
    assert heard(page, "none") == TraversabilityState()
    assert page.uploads_left() == []
