"""A fence in Plan: drawn in the 3D view, judged at once, undone, exported and read again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from planning.formats.fence_files import read_fence
from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import certified, choose, click_surface, connect, drawn, hold, open_demo, upload

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_fence_drawn_over_the_way_is_judged_at_once_and_undone(
    station: Station, page_3d: Page, tmp_path: Path
) -> None:
    page = page_3d
    open_demo(page, station)
    drawn(page)
    page.get_by_test_id("view-top").click()
    _open_section(page)
    page.get_by_test_id("tool-fence_polygon").click()
    _click_corners(page, [(0.35, 0.35), (0.65, 0.35), (0.5, 0.65)])
    expect(page.get_by_test_id("fence-row")).to_have_count(1)
    refused = page.get_by_test_id("panel-right").get_by_test_id("error-box")
    expect(refused).to_contain_text("inside exclusion polygon 1 of the fence")
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-verdict", "error")

    page.keyboard.press("Escape")
    with page.expect_download() as download:
        page.get_by_test_id("fence-export").click()
        page.get_by_test_id("export-fence.geojson").click()
    file = tmp_path / "fence.geojson"
    file.write_bytes(Path(download.value.path()).read_bytes())
    assert len(read_fence(file.name, file.read_bytes()).fence.polygons) == 1

    page.get_by_test_id("undo").click()
    expect(page.get_by_test_id("fence-row")).to_have_count(0)
    certified(page)
    choose(page, page.get_by_test_id("fence-import"), file)
    expect(page.get_by_test_id("fence-row")).to_have_count(1)
    expect(refused).to_contain_text("inside exclusion polygon 1 of the fence")


def test_a_fence_in_the_way_is_passed_and_counted(station: Station, page: Page) -> None:
    """Between the fourth and the fifth point of the demo: all of it is seen from the first, which is home."""
    open_demo(page, station)
    before, after = station.state["plan"]["document"]["pois"][3:5]
    centre = {key: (before[key] + after[key]) / 2 for key in ("lat_deg", "lon_deg")}
    station.change(fence={"circles": [{"id": "c", "inclusion": False, "centre": centre, "radius_m": 4}]})
    expect(page.get_by_test_id("fence-around")).to_contain_text("points")
    expect(page.get_by_test_id("fence-kept")).to_contain_text("keeps inside")
    certified(page)


def test_a_ceiling_is_kept_or_not_and_a_fence_that_is_none_says_what_to_do(
    station: Station, page: Page, tmp_path: Path
) -> None:
    open_demo(page, station)
    _open_section(page)
    page.get_by_test_id("fence-ceiling-own").check()
    expect(page.get_by_test_id("fence-kept")).to_contain_text("keeps inside")
    ceiling = page.get_by_test_id("fence-ceiling-input")
    ceiling.fill("15")
    ceiling.press("Enter")
    expect(page.get_by_test_id("reasons").locator("[data-code=fence]")).to_contain_text(
        "the fence's ceiling is at 15 m"
    )
    page.get_by_test_id("fence-floor-own").check()
    floor = page.get_by_test_id("fence-floor-input")
    floor.fill("40")
    floor.press("Enter")
    expect(page.get_by_test_id("section-fence")).to_contain_text("is not below its ceiling, 15 m")

    area = tmp_path / "area.geojson"
    ring = [[8.0, 47.0], [8.01, 47.0], [8.0, 47.01], [8.0, 47.0]]
    area.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}), encoding="utf-8")
    choose(page, page.get_by_test_id("fence-import"), area)
    expect(page.get_by_test_id("section-fence")).to_contain_text("does not say whether it is an inclusion")
    expect(page.get_by_test_id("section-fence")).to_contain_text("area.geojson, feature 1")


def test_the_fence_goes_on_board_with_the_mission_and_the_check_has_a_row_for_it(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    home = station.state["plan"]["document"]["pois"][0]
    centre = {"lat_deg": home["lat_deg"], "lon_deg": home["lon_deg"]}
    station.change(fence={"circles": [{"id": "c", "inclusion": True, "centre": centre, "radius_m": 900}]})
    expect(page.get_by_test_id("fence-kept")).to_contain_text("keeps inside")
    certified(page)
    connect(page, vehicle)
    upload(page)
    check = page.get_by_test_id("next-check")
    check.click()
    row = page.get_by_test_id("check-row").and_(page.locator("[data-code=fence]"))
    expect(row).to_contain_text("Fence: 1 circle on board, the plan's")
    expect(row).to_contain_text("FENCE_ENABLE is 0")
    expect(row).to_have_attribute("data-state", "accept")
    expect(page.get_by_test_id("accept-fence")).to_be_visible()


def test_the_plans_ceiling_is_shown_old_and_new_set_and_found_on_board(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    station.change(fence={"ceiling_rel_home_m": 90})
    certified(page)
    connect(page, vehicle)
    upload(page)
    page.get_by_test_id("next-check").click()
    row = page.get_by_test_id("check-row").and_(page.locator("[data-code=fence]"))
    expect(row).to_contain_text("The plan's ceiling at 90 m above home is not on board.")
    expect(row).to_have_attribute("data-state", "accept")
    box = page.get_by_test_id("fence-heights")
    expect(box).to_contain_text("Ceiling 90 m above home")
    page.get_by_test_id("heights-look").click()
    changes = page.get_by_test_id("heights-changes")
    expect(changes).to_contain_text("FENCE_ALT_MAX100 → 90 m")
    expect(changes).to_contain_text("FENCE_ENABLE0 → 1")
    hold(page, "heights-set")
    expect(page.get_by_test_id("heights-written").locator("[data-outcome=set]")).to_have_count(3)
    page.get_by_test_id("next-check").click()
    expect(row).to_contain_text("The plan's ceiling at 90 m above home is on board.")
    expect(row).to_have_attribute("data-state", "good")


def _open_section(page: Page) -> None:
    section = page.get_by_test_id("section-fence")
    if not section.get_by_test_id("fence-import").count():
        section.get_by_role("button", name="Fence").click()
    section.get_by_test_id("fence-import").scroll_into_view_if_needed()


def _click_corners(page: Page, shares: list[tuple[float, float]]) -> None:
    """By clicks on the surface, at shares of the 3D view's width and height."""
    hint = page.get_by_test_id("tool-hint")
    for left, share in zip((2, 1, 0), shares, strict=True):
        told = f"corner of the fence: {left} more make it one" if left else "corner of the fence · Esc"
        click_surface(page, share, lambda ms, told=told: expect(hint).to_contain_text(told, timeout=ms))
