"""Raw radar samples in a real browser: brought in, looked at frame by frame, and explained where they cannot be."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from mapping.radar.radar_params import AWR1843, POSITION2GO
from telemetry.sensors.ti_mmwave.ti_config import fmcw_params
from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, choose, visit, wait_until
from tests.server.test_cli_radar import echo
from tests.server.test_cli_radar_tracks import LATE_S, POLES_EN_M, made
from tests.telemetry.test_adc_files import dca1000_bytes
from tests.telemetry.test_ti_config import GOOD, config

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

FRAMES = 12


def radar_files(page: Page, station: Station) -> None:
    for file in station.http.get("/api/radar/files").json():
        station.http.delete(f"/api/radar/files/{file['id']}")
    visit(page, station)
    page.get_by_test_id("tab-review").click()
    page.get_by_test_id("study-radar").click()


def shown(page: Page, number: int) -> None:
    expect(page.get_by_test_id("frame-shown")).to_have_attribute("data-frame", str(number))


def strongest(page: Page) -> list[str]:
    return page.get_by_test_id("detection-row").first.locator("td").all_inner_texts()


def test_a_cube_is_looked_at_frame_by_frame(station: Station, page: Page, tmp_path: Path) -> None:
    cubes = [echo(AWR1843, 40.0 - 2.0 * number, -3.0, 0.3) for number in range(FRAMES)]
    np.save(tmp_path / "approach.npy", np.stack(cubes))
    radar_files(page, station)
    choose(page, page.get_by_test_id("radar-import"), tmp_path / "approach.npy")
    shown(page, 0)
    expect(page).to_have_url(re.compile("#review/radar$"))
    assert [float(text.replace("\u2212", "-")) for text in strongest(page)[:2]] == pytest.approx([40.0, -3.0], abs=0.2)
    expect(page.get_by_test_id("detection-mark").first).to_be_visible()
    # A map is painted once the page that it stands on is.
    for seen in ("doppler-map", "azimuth-map"):
        wait_until(page, lambda seen=seen: painted(page, seen) > 20)

    page.keyboard.press("ArrowRight")
    shown(page, 1)
    assert float(strongest(page)[0]) == pytest.approx(38.0, abs=0.2)
    page.keyboard.press("Shift+ArrowRight")
    shown(page, FRAMES - 1)
    # A slider that is dragged: the picture follows to where it is let go.
    for number in (9, 3, 7, 2):
        page.get_by_test_id("frame-slider").fill(str(number))
    shown(page, 2)
    expect(page.get_by_test_id("radar-parameters")).to_contain_text(re.compile(r"64 . 12 . 256"))

    page.reload()
    page.get_by_test_id("radar-choose").click()
    shown(page, 0)
    page.get_by_test_id("radar-delete").click()
    page.get_by_test_id("radar-delete-confirm").click()
    expect(page.get_by_test_id("radar-row")).to_have_count(0)
    expect(page.get_by_test_id("frame-shown")).to_have_count(0)


def test_a_capture_asks_for_its_configuration_and_wrong_files_are_refused(
    station: Station, page: Page, tmp_path: Path
) -> None:
    cube = echo(fmcw_params(config()), 40.0, -3.0, 0.3)
    (tmp_path / "adc.bin").write_bytes(dca1000_bytes([cube, cube], q_first=True))
    (tmp_path / "radar.cfg").write_text(GOOD)
    (tmp_path / "notes.txt").write_text("nothing")
    radar_files(page, station)
    choose(page, page.get_by_test_id("radar-import"), tmp_path / "notes.txt")
    expect(page.get_by_test_id("section-radar_files").get_by_test_id("error-box")).to_contain_text("no raw samples")

    choose(page, page.get_by_test_id("radar-import"), tmp_path / "adc.bin")
    told = page.get_by_test_id("section-radar_reading").get_by_test_id("error-box")
    expect(told).to_contain_text("Give the configuration that the radar ran with, on the left")
    choose(page, page.get_by_test_id("radar-cfg"), tmp_path / "radar.cfg")
    shown(page, 0)
    expect(told).to_have_count(0)
    page.get_by_test_id("radar-samples").select_option("offset-binary")
    expect(told).to_contain_text("no unclipped signal")
    page.get_by_test_id("radar-samples").select_option("auto")
    shown(page, 0)


def test_a_capture_and_poles_make_tracks_against_truth(station: Station, page: Page, tmp_path: Path) -> None:
    """Both files at once; what does not fit is said where it is asked for, and what came out is there again later."""
    folder = made(tmp_path)
    radar_files(page, station)
    with page.expect_file_chooser() as chooser:
        page.get_by_test_id("radar-import").click()
    chooser.value.set_files([str(folder / "optitrack.csv"), str(folder / "radar.csv")])
    shown(page, 0)
    section = page.get_by_test_id("section-radar_tracks")
    expect(section).to_contain_text("Motion capture: optitrack.csv")
    follow, told = page.get_by_test_id("tracks-follow"), section.get_by_test_id("error-box")
    expect(follow).to_be_disabled()

    page.get_by_test_id("pole-add").click()
    page.get_by_test_id("pole-x").fill("4000")
    page.get_by_test_id("pole-x").press("Enter")
    expect(section).to_contain_text("out of range: enter -1000 to 1000 m")
    for number, (east, north) in enumerate(POLES_EN_M):
        if number:
            page.get_by_test_id("pole-add").click()
        for axis, value in (("x", east), ("z", -north)):
            page.get_by_test_id(f"pole-{axis}").nth(number).fill(str(value))
            page.get_by_test_id(f"pole-{axis}").nth(number).press("Enter")
    page.get_by_test_id("tracks-offset").fill("60")
    page.get_by_test_id("tracks-offset").press("Enter")
    follow.click()
    expect(told).to_contain_text("lies within the 5.5 s of the capture", timeout=LONG_MS)
    expect(told).to_contain_text("beginnings, on the left")
    page.get_by_test_id("tracks-offset").fill(str(LATE_S))
    page.get_by_test_id("tracks-offset").press("Enter")
    follow.click()
    tracks = page.get_by_test_id("radar-tracks")
    expect(tracks).to_be_visible(timeout=LONG_MS)
    expect(told).to_have_count(0)
    row = tracks.get_by_test_id("scenario-figure").filter(has_text="pole 1: range error")
    expect(row).to_contain_text("0.15 m (the sensor's)")
    expect(tracks.get_by_test_id("scenario-chart")).to_have_count(6)
    expect(tracks.get_by_test_id("chart-points").first).to_be_attached()
    expect(page.get_by_test_id("tracks-against")).to_contain_text("optitrack.csv")

    page.reload()
    page.get_by_test_id("radar-choose").click()
    page.get_by_test_id("radar-looks-tracks").click()
    expect(tracks).to_contain_text("True way and poles")
    expect(page.get_by_test_id("pole")).to_have_count(2)
    page.get_by_test_id("radar-capture-remove").click()
    expect(tracks).to_have_count(0)
    expect(follow).to_be_disabled()


def test_a_capture_alone_belongs_to_nothing(station: Station, page: Page, tmp_path: Path) -> None:
    folder = made(tmp_path)
    radar_files(page, station)
    choose(page, page.get_by_test_id("radar-import"), folder / "optitrack.csv")
    told = page.get_by_test_id("section-radar_files").get_by_test_id("error-box")
    expect(told).to_contain_text("no radar file is open that it could belong to")
    expect(page.get_by_test_id("radar-row")).to_have_count(0)


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_maps_and_slider_are_there_at_every_width(
    station: Station, page: Page, tmp_path: Path, size: tuple[int, int]
) -> None:
    np.save(tmp_path / "hall.npy", np.stack([echo(POSITION2GO, 6.0, 1.0, -0.2)] * 3))
    radar_files(page, station)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    opens_left = page.get_by_test_id("drawer-left")
    if opens_left.is_visible():
        opens_left.click()
    choose(page, page.get_by_test_id("radar-import"), tmp_path / "hall.npy")
    page.get_by_test_id("radar-sensor").select_option("position2go")
    shown(page, 0)
    if opens_left.is_visible():
        page.get_by_role("button", name="Close panel").click(position={"x": 370, "y": 200})
    expect(page.get_by_test_id("frame-slider")).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id("doppler-map")).to_be_in_viewport(ratio=0.9)
    opens_right = page.get_by_test_id("drawer-facts")
    if opens_right.is_visible():
        opens_right.click()
    expect(page.get_by_test_id("detection-row").first).to_be_in_viewport()
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]


def painted(page: Page, testid: str) -> int:
    """How many colours a map is drawn in."""
    return (
        page.get_by_test_id(testid)
        .locator("canvas")
        .evaluate(
            """canvas => {
            const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            return new Set(new Uint32Array(data.buffer)).size;
        }"""
        )
    )
