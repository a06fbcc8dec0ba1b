"""The first user story in a real browser, on a real surface model."""

from __future__ import annotations

import json
import re
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from planning.formats.detect import read_mission
from tests.e2e.stations import Station
from tests.e2e.steps import choose, click_surface, computed, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_plan_on_a_real_model_from_sign_in_to_export(
    station: Station, page_3d: Page, shared_data: Path, tmp_path: Path
) -> None:
    page = page_3d
    _sign_in(page, station)
    _load_model(page, shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")
    _click_points(page, [(0.40, 0.50), (0.55, 0.55), (0.62, 0.45)])
    before = _distance_m(page)

    height = page.get_by_test_id("height-input")
    height.fill("9")
    height.press("Enter")
    wait_until(page, lambda: _distance_m(page) > before + 2)
    radius = page.get_by_test_id("radius-input")
    radius.fill("8")
    radius.press("Enter")
    expect(page.get_by_test_id("undo")).to_be_enabled()

    page.keyboard.press("Escape")
    page.get_by_test_id("undo").click()
    expect(radius).to_have_value("20")
    page.get_by_test_id("undo").click()
    expect(height).to_have_value("5")
    wait_until(page, lambda: abs(_distance_m(page) - before) < 0.02)
    page.get_by_test_id("redo").click()
    expect(height).to_have_value("9")

    archive = zipfile.ZipFile(BytesIO(_export_all(page)))
    certificate = json.loads(archive.read("certificate.json"))
    mission = read_mission("mission.waypoints", archive.read("mission.waypoints"))
    assert certificate["min_distance_m"] > before + 2
    assert len(mission.items) == certificate["items"]
    assert b"<script" not in archive.read("report.html")


def test_a_file_that_is_no_surface_model_is_explained_where_it_was_dropped(
    station: Station, page: Page, shared_data: Path, tmp_path: Path
) -> None:
    visit(page, station)
    fake = tmp_path / "model.tif"
    fake.write_text("<VRTDataset></VRTDataset>", encoding="utf-8")
    choose(page, page.get_by_test_id("terrain-file"), fake)
    expect(page.get_by_text("model.tif").first).to_be_visible()
    expect(page.get_by_text(re.compile("virtual raster")).first).to_be_visible()

    choose(page, page.get_by_test_id("terrain-file"), shared_data / "dsm" / "landslide" / "pre_runout_DEM.asc")
    crs = page.get_by_test_id("raster-crs")
    expect(crs).to_be_visible()
    crs.fill("EPSG:32633")
    page.get_by_test_id("raster-retry").click()
    expect(page.get_by_test_id("terrain-row").filter(has_text="pre_runout_DEM.asc")).to_have_count(1)


def _sign_in(page: Page, station: Station) -> None:
    page.goto(station.link)
    expect(page.get_by_test_id("verdict")).to_be_visible()


def _load_model(page: Page, path: Path) -> None:
    choose(page, page.get_by_test_id("terrain-file"), path)
    expect(page.get_by_test_id("terrain-row").filter(has_text=path.name)).to_have_class("current")


def _click_points(page: Page, shares: list[tuple[float, float]]) -> None:
    """Adds points by clicking the surface, at shares of the 3D view's width and height."""
    page.get_by_test_id("tool-add_poi").click()
    rows = page.get_by_test_id("poi-row")
    for number, share in enumerate(shares, start=1):
        click_surface(page, share, lambda ms, number=number: expect(rows).to_have_count(number, timeout=ms))
    page.keyboard.press("Escape")


def _distance_m(page: Page) -> float:
    """The smallest distance on the certificate of the plan as it stands, once it is computed."""
    computed(page)
    text = page.get_by_test_id("min-distance").inner_text() if page.get_by_test_id("min-distance").count() else ""
    found = re.search(r"-?\d+\.\d+", text)
    return float(found.group(0)) if found else -1.0


def _export_all(page: Page) -> bytes:
    page.get_by_test_id("export-menu").click()
    with page.expect_download() as download:
        page.get_by_test_id("export-all.zip").click()
    return Path(download.value.path()).read_bytes()


def test_home_is_moved_by_one_press_to_where_it_would_do(station: Station, page: Page, shared_data: Path) -> None:
    """The first point lies on the edge of bush, and so does home when it is put there."""
    visit(page, station)
    _load_model(page, shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")
    page.get_by_test_id("empty-add").or_(page.get_by_test_id("tool-add_poi")).first.wait_for()
    with page.expect_file_chooser() as chooser:
        page.get_by_test_id("points-import").click()
    chooser.value.set_files(shared_data / "logs" / "arducopter" / "pois.csv")
    expect(page.get_by_test_id("poi-row")).not_to_have_count(0)
    home = page.get_by_test_id("home-input")
    home.fill("-37.12445073, 175.68928790")
    home.press("Enter")
    reasons = page.get_by_test_id("reasons")
    expect(reasons).to_contain_text("Home lies on top of something")
    page.get_by_test_id("move-home").click()
    expect(reasons.get_by_text("Home lies on top of something")).to_have_count(0)
    expect(home).not_to_have_value(re.compile("175.6892879"))
