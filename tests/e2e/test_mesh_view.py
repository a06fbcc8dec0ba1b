"""A textured mesh in a real browser: drawn where the ground is, in place of the model, and called a picture."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import FloatRect, Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, choose, visit, wait_until
from tests.planning.geotiff_samples import write_raster
from tests.planning.mesh_samples import dsm_of, local_glb, packed, tileset

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_tileset_is_drawn_on_its_place_and_put_off(station: Station, page_3d: Page, tmp_path: Path) -> None:
    """Its western half is red and its eastern half blue: so is the picture from above, between the same edges."""
    page, dsm = page_3d, dsm_of()
    raster = write_raster(
        tmp_path / "dsm.tif", np.array(dsm.elevation_m), crs="EPSG:32633+5773", transform=dsm.transform
    )
    visit(page, station)
    choose(page, page.get_by_test_id("terrain-file"), raster)
    expect(page.get_by_test_id("terrain-row").filter(has_text="dsm.tif")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("layer-textured")).to_have_count(0)

    # As fine as the screen: between two texels a colour runs into the next one.
    files = tileset(dsm, size_px=1024)
    choose(page, page.get_by_test_id("terrain-file"), packed(tmp_path / "survey.zip", files))
    expect(page.get_by_test_id("layer-textured")).to_have_attribute("aria-pressed", "true", timeout=LONG_MS)
    expect(page.get_by_test_id("mesh-drawn")).to_have_text("Mesh: a picture, not certified")
    wait_until(page, lambda: min(_colors(page)) > 5000)
    # The model stands where the mesh stood (0.989 in common): a metre to one side leaves 0.957.
    wait_until(page, lambda: _in_common(*_mesh_and_model(page)) > 0.985)
    page.get_by_test_id("view-top").click()
    wait_until(page, lambda: _meet_in_the_middle(page))

    page.get_by_test_id("section-terrain").locator("details > summary").first.click()
    facts = page.get_by_test_id("mesh-facts")
    expect(facts).to_contain_text("surface model alone")
    expect(facts).to_contain_text("above the ellipsoid")
    page.get_by_test_id("layer-textured").click()
    expect(page.get_by_test_id("mesh-drawn")).to_have_count(0)
    wait_until(page, lambda: _colors(page) == (0, 0))
    page.get_by_test_id("mesh-delete").click()
    expect(facts).to_have_count(0)
    expect(page.get_by_test_id("layer-textured")).to_have_count(0)
    expect(page.get_by_test_id("terrain-row").filter(has_text="dsm.tif")).to_be_visible()


def test_a_mesh_that_says_not_where_it_lies_is_refused_on_the_page(
    station: Station, page: Page, tmp_path: Path
) -> None:
    visit(page, station)
    path = tmp_path / "house.glb"
    path.write_bytes(local_glb(np.array([500_000.0, 4_170_000.0, 0.0]), 20.0))
    choose(page, page.get_by_test_id("terrain-file"), path)
    failed = page.get_by_test_id("failed-job").filter(has_text="house.glb")
    expect(failed.get_by_test_id("error-box")).to_contain_text("Open the surface model")


def _rgb(page: Page) -> np.ndarray:
    """(h, w, 3) of the 3D view without what stands over it at its edges."""
    box = page.get_by_test_id("scene").bounding_box()
    assert box is not None
    clip: FloatRect = {"x": box["x"], "y": box["y"] + 60, "width": box["width"], "height": box["height"] - 110}
    return np.asarray(Image.open(BytesIO(page.screenshot(clip=clip))).convert("RGB")).astype(int)


def _silhouette(page: Page) -> np.ndarray:
    """(h, w) what is drawn before the grey of the sky."""
    rgb = _rgb(page)
    return rgb.max(axis=2) - rgb.min(axis=2) > 35


def _mesh_and_model(page: Page) -> tuple[np.ndarray, np.ndarray]:
    """What is drawn of each, one after the other: alike once the camera has come to rest, however late that is."""
    mesh = _silhouette(page)
    page.get_by_test_id("layer-textured").click()
    wait_until(page, lambda: _colors(page) == (0, 0))
    model = _silhouette(page)
    page.get_by_test_id("layer-textured").click()
    wait_until(page, lambda: min(_colors(page)) > 5000)
    return mesh, model


def _in_common(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / max(1, (one | other).sum()))


def _is(rgb: np.ndarray, channel: int) -> np.ndarray:
    """Nearly pure red (0) or blue (2)."""
    others = [each for each in range(3) if each != channel]
    return (rgb[..., channel] > 200) & (rgb[..., others].max(axis=2) < 60)


def _colors(page: Page) -> tuple[int, int]:
    rgb = _rgb(page)
    return int(_is(rgb, 0).sum()), int(_is(rgb, 2).sum())


def _meet_in_the_middle(page: Page) -> bool:
    """Red to the west of blue, under a camera that stands over the model's middle."""
    rgb = _rgb(page)
    red, blue = (np.flatnonzero(_is(rgb, channel).sum(axis=0) > 40) for channel in (0, 2))
    if not len(red) or not len(blue):
        return False
    return abs(int(red[-1]) - int(blue[0])) < 6 and abs(int(red[-1]) - rgb.shape[1] / 2) < 8
