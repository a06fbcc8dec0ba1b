"""What each picture shows, and the steps that lead there: by conditions of the page, never by the clock."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import rasterio
from playwright.sync_api import Page, expect

from planning.ground.demo_hillside import demo_dsm
from tests.e2e.stations import Station
from tests.e2e.steps import (
    LONG_MS,
    certified,
    choose,
    drawn,
    hold,
    open_recording,
    return_home,
    start_simulator,
    upload,
    visit,
    wait_until,
)

Camera = Callable[[str], None]
PAUSE_MS = 1500
"""Between two pictures of the 3D view, so that simulated sensors keep up beside a renderer in software."""


@dataclass(frozen=True, slots=True)
class Scene:
    pictures: tuple[str, ...]
    play: Callable[[Page, Station, Camera], None]


def _planning(page: Page, station: Station, take: Camera) -> None:
    station.sign_in()
    visit(page, station)
    expect(page.get_by_test_id("empty-state")).to_be_visible()
    take("start")
    choose(page, page.get_by_test_id("terrain-file"), _hillside(station.data_dir.parent))
    expect(page.get_by_test_id("terrain-row").filter(has_text="hillside.tif")).to_have_class("current")
    _settled(page, "view-terrain")
    take("terrain")


def _flying(page: Page, station: Station, take: Camera) -> None:
    station.open_demo(lambda points: list(points.values()), {})
    visit(page, station)
    certified(page)
    _settled(page, "view-fit")
    take("console")

    start_simulator(page)
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-enabled", "true")
    upload(page)
    _checked(page)
    page.get_by_test_id("section-preflight").scroll_into_view_if_needed()
    take("check")

    hold(page, "next-start")
    page.get_by_test_id("view-vehicle").click()
    expect(page.get_by_test_id("alert-distance")).to_be_visible()
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-state", re.compile("climbing|offset"))
    take("fly")
    return_home(page)
    open_recording(page)
    expect(page.get_by_test_id("flown-distance")).to_be_visible()
    page.get_by_test_id("seek-nearest").click()
    drawn(page)
    take("review")


SCENES = (Scene(("start", "terrain"), _planning), Scene(("console", "check", "fly", "review"), _flying))


def _hillside(folder: Path) -> Path:
    """The demo's surface model as somebody's own file."""
    dsm = demo_dsm()
    file = folder / "hillside.tif"
    rows, columns = dsm.elevation_m.shape
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "nodata": float("nan")}
    with rasterio.open(
        file, "w", **profile, height=rows, width=columns, transform=dsm.transform, crs=dsm.crs.to_wkt()
    ) as raster:
        raster.write(dsm.elevation_m, 1)
    return file


def _settled(page: Page, view: str) -> None:
    """The whole picture is there, from that place, and moves no more."""
    drawn(page)
    page.get_by_test_id(view).click()
    _still(page)


def _still(page: Page) -> None:
    scene, pictures = page.get_by_test_id("scene"), [b""]

    def is_still() -> bool:
        page.wait_for_timeout(2 * PAUSE_MS)
        pictures.append(scene.screenshot())
        return pictures[-1] == pictures[-2]

    wait_until(page, is_still, LONG_MS)


def _checked(page: Page) -> None:
    ready, check = page.get_by_test_id("next-start"), page.get_by_test_id("next-check")

    def is_ready() -> bool:
        if check.count() and check.is_enabled():
            check.click()
            expect(ready.or_(check).and_(page.locator(":enabled"))).to_be_visible()
        return bool(ready.count())

    wait_until(page, is_ready, LONG_MS)
    for tick in page.locator("[data-testid^=accept-]").all():
        tick.check()
