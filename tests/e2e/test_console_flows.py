"""What an operator does by hand beyond the first user story: move, reorder, survey, drape, hover, two pages at once."""

from __future__ import annotations

import contextlib
import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import rasterio
from PIL import Image
from playwright.sync_api import Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import certified, choose, click_surface, computed, drawn, open_demo, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

MOVE_HANDLE_RGB = (51, 145, 238)
"""viser's handle for moving in the plane, a square beside the selected point."""


@pytest.fixture
def demo(station: Station, page: Page) -> Page:
    """A page with the demo's plan, certified."""
    open_demo(page, station)
    return page


@pytest.fixture
def demo_3d(station: Station, page_3d: Page) -> Page:
    """As ``demo``, drawn as well."""
    open_demo(page_3d, station)
    drawn(page_3d)
    return page_3d


def test_points_are_dragged_reordered_and_brought_back(demo_3d: Page) -> None:
    page, rows = demo_3d, demo_3d.get_by_test_id("poi-row")
    order = _names(page)
    _drag_row(page, 4, 1)
    assert _names(page) == [order[0], order[4], *order[1:4], order[5]]

    page.get_by_test_id("poi-handle").nth(1).focus()
    page.keyboard.press("Alt+ArrowDown")
    expect(rows.nth(2).get_by_test_id("poi-name")).to_have_value(order[4])
    expect(page.get_by_test_id("poi-handle").nth(2)).to_be_focused()
    page.keyboard.press("Control+z")
    expect(rows.nth(1).get_by_test_id("poi-name")).to_have_value(order[4])
    page.keyboard.press("Control+z")
    expect(rows.nth(1).get_by_test_id("poi-name")).to_have_value(order[1])
    assert _names(page) == order

    place = rows.nth(2).get_by_test_id("poi-coordinates")
    before = place.inner_text()
    page.get_by_test_id("poi-handle").nth(2).click()
    page.get_by_test_id("view-fit").click()
    _drag_in_view(page, dx=-50, dy=10)
    expect(place).not_to_have_text(before, use_inner_text=True)
    expect(page.get_by_test_id("undo")).to_have_attribute("title", re.compile("Undo Move"))
    page.get_by_test_id("undo").click()
    expect(place).to_have_text(before, use_inner_text=True)


def test_profile_and_view_mark_the_same_place(demo_3d: Page) -> None:
    demo = demo_3d
    plot = demo.locator(".u-over")
    values = demo.get_by_test_id("cursor-values")
    # The place in degrees is the server's answer, which comes with the mark in 3D.
    place = re.compile(r"37\.\d{7}, 14\.\d{7}")

    def shown() -> bool:
        """The chart is made anew when what it shows is another: a pointer that rested on the old one marks nothing."""
        demo.mouse.move(0, 0)
        plot.hover()
        with contextlib.suppress(AssertionError):
            expect(values).to_contain_text(place, timeout=3000)
            return True
        return False

    wait_until(demo, shown)

    demo.get_by_test_id("view-worst").click()  # which also takes the pointer off the chart
    expect(values).to_have_count(0)
    # The camera looks at the nearest place, which lies on the path: the middle of the view points at it.
    wait_until(demo, lambda: _hovers(demo))


def test_two_pages_stay_in_step(demo: Page) -> None:
    other = demo.context.new_page()
    other.goto(demo.url)
    expect(other.get_by_test_id("poi-row")).to_have_count(6)
    name = demo.get_by_test_id("poi-name").first
    name.fill("Launch <i>pad</i>")
    name.press("Enter")
    expect(other.get_by_test_id("poi-name").first).to_have_value("Launch <i>pad</i>")
    other.get_by_test_id("poi-delete").nth(5).click()
    expect(demo.get_by_test_id("poi-row")).to_have_count(5)
    demo.get_by_test_id("undo").click()
    expect(other.get_by_test_id("poi-row")).to_have_count(6)
    other.get_by_test_id("shading-hillshade").click()
    expect(demo.get_by_test_id("shading-hillshade")).to_have_attribute("aria-pressed", "true")
    for page in (demo, other):
        expect(page.get_by_test_id("verdict")).to_have_attribute("data-verdict", "certified")
    other.close()


def test_a_survey_under_an_orthophoto(station: Station, page_3d: Page, shared_data: Path, tmp_path: Path) -> None:
    page = page_3d
    visit(page, station)
    model = shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"
    choose(page, page.get_by_test_id("terrain-file"), model)
    expect(page.get_by_test_id("terrain-row").filter(has_text=model.name)).to_have_class("current")
    drawn(page)
    photo = _photo_like(model, tmp_path / "photo.tif")
    choose(page, page.get_by_test_id("terrain-file"), photo)
    refused = page.get_by_test_id("failed-job").filter(has_text="orthomosaic")
    expect(refused).to_be_visible()
    page.get_by_test_id("drape-instead").click()
    expect(page.get_by_test_id("shading-orthophoto")).to_have_attribute("aria-pressed", "true")
    expect(refused).to_have_count(0)

    page.get_by_test_id("source-survey").click()
    page.get_by_test_id("tool-polygon").click()
    _click_corners(page, [(0.40, 0.45), (0.55, 0.43), (0.57, 0.58), (0.42, 0.60)])
    page.get_by_test_id("camera-add").click()
    # 1 cm with the added camera: eq. 1 gives 26.7 m, at which the photos overlap as asked.
    expect(page.get_by_test_id("survey-height")).to_contain_text("26.7 m")
    expect(page.get_by_test_id("height")).to_have_count(0)
    expect(page.get_by_test_id("photographed")).to_contain_text("of ")
    expect(page.get_by_test_id("front-overlap")).to_contain_text("of 80 % asked")
    expect(page.locator("[data-testid=reasons] [data-code=photos]")).to_have_count(0)
    computed(page)
    before = page.get_by_test_id("length").inner_text()
    overlap = page.get_by_test_id("side-overlap-input")
    overlap.fill("85")
    overlap.press("Enter")
    expect(page.get_by_test_id("length")).not_to_have_text(before, use_inner_text=True)


def test_plans_are_copied_opened_and_deleted(demo: Page) -> None:
    page, name, rows = demo, demo.get_by_test_id("plan-name"), demo.get_by_test_id("plan-row")
    first = name.input_value()
    page.get_by_test_id("plans-button").click()
    expect(rows).not_to_have_count(0)
    before = rows.count()
    page.get_by_test_id("plan-save-as").click()
    page.get_by_test_id("save-as-name").fill("Second <b>try</b>")
    page.get_by_test_id("save-as-submit").click()
    expect(name).to_have_value("Second <b>try</b>")
    expect(page.get_by_test_id("save-as-dialog")).to_have_count(0)
    name.fill("Third try")
    name.press("Enter")
    page.get_by_test_id("plans-button").click()
    expect(rows).to_have_count(before + 1)
    # The open plan stands there under its newest name, and cannot be deleted.
    opened = rows.filter(has_text=re.compile("open"))
    expect(opened).to_contain_text("Third try")
    expect(opened.get_by_role("button")).to_have_count(0)
    rows.filter(has_text=first).get_by_role("button", name="Open").click()
    expect(name).to_have_value(first)
    page.get_by_test_id("plans-button").click()
    copy = rows.filter(has_text="Third try")
    copy.get_by_role("button", name="Delete").click()
    copy.get_by_role("button", name="Delete for good").click()
    expect(rows).to_have_count(before)


def test_a_model_for_another_place_is_offered(demo: Page, shared_data: Path) -> None:
    page = demo
    page.reload()
    certified(page)
    drawn(page)
    choose(page, page.get_by_test_id("terrain-file"), shared_data / "dsm" / "campus" / "dsm.tif")
    page.get_by_test_id("offer-new").click()
    expect(page.get_by_test_id("terrain-row").filter(has_text="dsm.tif")).to_have_class("current")
    expect(page.get_by_test_id("poi-row")).to_have_count(0)


def test_the_page_leaves_when_its_session_ends(demo: Page) -> None:
    other = demo.context.new_page()
    other.goto(demo.url)
    expect(other.get_by_test_id("poi-row")).to_have_count(6)
    # Nothing of it is on its way when it leaves, no font either (it would be refused): Chromium has been seen never to
    # answer to the close of such a page.
    expect(other.frame_locator("[data-testid=view-frame]").locator("title")).to_be_attached()
    other.get_by_test_id("help").click()
    for page in (demo, other):
        page.evaluate("async () => { await document.fonts.ready; }")
    other.get_by_test_id("sign-out").click()
    expect(demo).to_have_url(re.compile(r"/signin\?ended=true$"))


def _names(page: Page) -> list[str]:
    return [field.input_value() for field in page.get_by_test_id("poi-name").all()]


ROW_PLACES = """([start, end]) => [["poi-handle", start], ["poi-row", end]].map(([is, number]) => {
  const { x, y } = document.querySelectorAll(`[data-testid=${is}]`)[number].getBoundingClientRect();
  return { x, y };
})"""
"""Of the one's handle and of the other, at one moment."""


def _drag_row(page: Page, start: int, end: int) -> None:
    name = _names(page)[start]
    moved = page.get_by_test_id("poi-row").nth(end).get_by_test_id("poi-name")

    def is_moved() -> bool:
        """Again where the rows had moved under the pointer."""
        if moved.input_value() != name:
            page.get_by_test_id("poi-handle").nth(start).scroll_into_view_if_needed()
            source, target = page.evaluate(ROW_PLACES, [start, end])
            page.mouse.move(source["x"] + 10, source["y"] + 10)
            page.mouse.down()
            page.mouse.move(target["x"] + 40, target["y"] + 20, steps=4)
            page.mouse.up()
        with contextlib.suppress(AssertionError):
            expect(moved).to_have_value(name, timeout=20_000)
            return True
        return False

    wait_until(page, is_moved)


def _drag_in_view(page: Page, *, dx: float, dy: float) -> None:
    x, y = _resting_handle(page)
    page.mouse.move(x, y)
    page.mouse.move(x + 1, y)
    page.wait_for_timeout(300)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=6)
    page.mouse.up()


def _resting_handle(page: Page) -> tuple[float, float]:
    """Where the handle is on the page once two pictures show it at the same place: the camera rests."""
    seen: list[tuple[float, float] | None] = [None]

    def rests() -> bool:
        page.wait_for_timeout(1000)  # a few pictures
        seen.append(_handle(page))
        return seen[-1] is not None and seen[-1] == seen[-2]

    wait_until(page, rests)
    assert seen[-1] is not None
    return seen[-1]


def _handle(page: Page) -> tuple[float, float] | None:
    box = page.get_by_test_id("scene").bounding_box()
    assert box is not None
    # Without the hint and the legend, which show the same colour.
    left, top = box["x"], box["y"] + 55
    picture = page.screenshot(clip={"x": left, "y": top, "width": box["width"], "height": box["height"] - 160})
    rgb = np.asarray(Image.open(BytesIO(picture)).convert("RGB")).astype(int)
    rows, cols = np.nonzero(np.abs(rgb - MOVE_HANDLE_RGB).sum(axis=2) < 40)
    if len(rows) < 30:
        return None
    return left + float(np.median(cols)), top + float(np.median(rows))


def _hovers(page: Page) -> bool:
    scene = page.get_by_test_id("scene").bounding_box()
    assert scene is not None
    middle = (scene["x"] + scene["width"] / 2, scene["y"] + scene["height"] / 2)
    for dy in (-12, 0, 12):
        page.mouse.move(middle[0], middle[1] + dy)
        page.wait_for_timeout(250)
        if page.get_by_test_id("cursor-values").count():
            return True
    return False


def _photo_like(model: Path, path: Path) -> Path:
    """An orthomosaic of the very place of a surface model."""
    with rasterio.open(model) as dsm:
        rgb = np.full((3, dsm.height, dsm.width), 120, dtype=np.uint8)
        profile = {"crs": dsm.crs, "transform": dsm.transform, "width": dsm.width, "height": dsm.height}
    with rasterio.open(path, "w", driver="GTiff", count=3, dtype="uint8", photometric="RGB", **profile) as photo:
        photo.write(rgb)
    return path


def _click_corners(page: Page, shares: list[tuple[float, float]]) -> None:
    rows = page.get_by_test_id("corner-row")
    for number, share in enumerate(shares, start=1):
        click_surface(page, share, lambda ms, number=number: expect(rows).to_have_count(number, timeout=ms))
