"""Survey firms' files in a real browser: a point cloud that does not say where it lies becomes a surface model."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import choose, drawn, visit
from tests.planning.cloud_samples import some_points, write_las

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_cloud_without_a_system_asks_for_it_and_becomes_a_model(station: Station, page: Page, tmp_path: Path) -> None:
    xyz, classes = some_points(1)
    visit(page, station)
    choose(page, page.get_by_test_id("terrain-file"), write_las(tmp_path / "survey.laz", xyz, classes, crs=None))
    failed = page.get_by_test_id("failed-job").filter(has_text="survey.laz")
    expect(failed.get_by_test_id("error-box")).to_contain_text("no coordinate reference system")
    failed.get_by_test_id("raster-crs").fill("EPSG:32633")
    failed.get_by_test_id("cloud-cell").fill("0.25")
    failed.get_by_test_id("raster-retry").click()
    row = page.get_by_test_id("terrain-row").filter(has_text="survey.laz")
    expect(row.get_by_role("button", pressed=True)).to_be_visible()
    page.get_by_test_id("section-terrain").locator("details > summary").first.click()
    facts = page.get_by_test_id("cloud-facts")
    expect(facts).to_contain_text("0.25 m, as chosen")
    expect(facts).to_contain_text("noise")
    expect(facts).to_contain_text("ground")
    drawn(page)
    expect(page.get_by_test_id("layer-mesh")).to_be_disabled()
    page.get_by_test_id("layer-points").click()
    expect(page.get_by_test_id("points-drawn")).to_have_text(re.compile(r"^\d[\d\u202f]+ of \d[\d\u202f]+ points$"))
    expect(page.get_by_test_id("layer-mesh")).to_have_attribute("aria-pressed", "false")
    page.reload()
    expect(page.get_by_test_id("layer-points")).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("layer-points").click()
    expect(page.get_by_test_id("points-drawn")).to_have_count(0)
    expect(page.get_by_test_id("layer-mesh")).to_be_disabled()
