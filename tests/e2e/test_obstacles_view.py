"""The demo's vehicle meets a building that its surface model does not know, in a real browser."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import PATIENCE_MS, SimulatedVehicle, Station
from tests.e2e.test_fly_view import _connect, _open_demo, _start, _upload, _wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("browser")]

PLACE = re.compile(r"-?\d+\.\d{7}, -?\d+\.\d{7}")


@pytest.fixture
def sighted(tmp_path: Path, console: None) -> Iterator[Station]:
    """A station whose demo stands in a world with things that the surface model does not know."""
    running = Station(tmp_path / "data", "--demo-world")
    try:
        yield running
    finally:
        running.stop()


def test_an_obstacle_is_alerted_climbed_over_planned_around_and_reviewed(
    sighted: Station, page: Page, tmp_path: Path
) -> None:
    _open_demo(page, sighted)
    page.get_by_test_id("tab-fly").click()
    page.get_by_test_id("next-simulator").click()
    expect(page.get_by_test_id("hold-position")).to_be_visible()
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-enabled", "true")
    _upload(page)
    _start(page)

    _is_alerted(page)
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-state", "offset")
    _is_acknowledged(page)
    _is_planned_against(page)
    _returns(page)
    _is_reviewed(page, tmp_path)


def _is_alerted(page: Page) -> None:
    expect(page.get_by_test_id("alert-banner")).to_be_visible()
    # Both ways past the obstacle have their cards as soon as it is in a region.
    expect(page.get_by_test_id("manoeuvre-over")).to_be_visible()
    expect(page.get_by_test_id("manoeuvre-around")).to_be_visible()
    expect(page.get_by_test_id("alert-distance")).to_contain_text(re.compile(r"\d\sm"))
    expect(page.get_by_test_id("alert-place")).to_contain_text(PLACE)
    expect(page.get_by_test_id("alert-spoken")).to_contain_text(re.compile("Radar|Camera"))
    for sensor in ("radar", "vision"):
        row = page.get_by_test_id("sensors-live").get_by_test_id(f"sensor-{sensor}")
        expect(row).to_contain_text(re.compile(r"\d\sHz"))
        expect(row).to_contain_text(re.compile(r"\d\sms"))
    expect(page.get_by_test_id("polar")).to_have_attribute("aria-label", re.compile("Obstacles around"))


def _is_acknowledged(page: Page) -> None:
    banner = page.get_by_test_id("alert-banner")
    expect(banner).to_be_visible()
    page.get_by_test_id("polar").click()
    page.keyboard.press("k")
    page.keyboard.press("m")
    expect(page.get_by_test_id("sound")).to_have_attribute("aria-pressed", "false")

    def none_calls() -> bool:
        """Further ones may begin meanwhile, so that the button may go under the click."""
        left = page.get_by_test_id("alert-acknowledge")
        if left.count():
            page.keyboard.press("k")
        return not left.count()

    _wait_until(page, none_calls)


def _is_planned_against(page: Page) -> None:
    page.get_by_test_id("plan-with-seen").click()
    expect(page.get_by_test_id("outcome-seen")).to_contain_text("seen")
    page.get_by_test_id("tab-plan").click()
    expect(page.get_by_test_id("seen-in-plan")).to_be_visible()
    expect(page.get_by_test_id("against-seen")).to_contain_text(re.compile(r"\d+ seen column"))
    page.get_by_test_id("take-seen-out").click()
    expect(page.get_by_test_id("seen-in-plan")).to_have_count(0)
    expect(page.get_by_test_id("against-seen")).to_have_count(0)
    page.get_by_test_id("tab-fly").click()


def _returns(page: Page) -> None:
    page.get_by_test_id("return-home").focus()
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("outcome-safety")).to_contain_text("returns home")
    page.keyboard.up("Enter")
    expect(page.get_by_test_id("chip-mode")).to_contain_text("disarmed", timeout=2 * PATIENCE_MS)


def _is_reviewed(page: Page, tmp_path: Path) -> None:
    page.get_by_test_id("tab-review").click()
    page.get_by_test_id("recording-open").first.click()
    expect(page.get_by_test_id("replay-badge")).to_be_visible()
    page.get_by_test_id("review-part-instruments").click()
    page.get_by_test_id("speed").select_option("2")
    page.get_by_test_id("play").click()
    replayed = page.get_by_test_id("instruments-replay")
    expect(replayed.get_by_test_id("polar")).to_be_visible()
    expect(page.get_by_test_id("sensors-replay").get_by_test_id("sensor-radar")).to_be_visible()
    # The recorded alert stands over the 3D view again, and nobody has to answer it.
    expect(page.get_by_test_id("alert-banner")).to_contain_text("REPLAY")
    expect(page.get_by_test_id("alert-acknowledge")).to_have_count(0)
    with page.expect_download() as download:
        page.get_by_test_id("map-radar-geojson").click()
    kept = tmp_path / "radar.geojson"
    download.value.save_as(kept)
    assert json.loads(kept.read_text())["type"] == "FeatureCollection"


def test_maps_are_shown_and_hidden_and_the_regions_set(sighted: Station, page: Page) -> None:
    _open_demo(page, sighted)
    page.get_by_test_id("tab-fly").click()
    page.get_by_test_id("next-simulator").click()
    for layer in ("radar_map", "vision_map", "explained", "regions"):
        toggle = page.get_by_test_id(f"layer-{layer}")
        expect(toggle).to_have_attribute("aria-pressed", "true")
        toggle.click()
        expect(toggle).to_have_attribute("aria-pressed", "false")

    page.get_by_test_id("section-obstacles").get_by_role("button").first.click()
    depth = page.get_by_test_id("perception-radar_depth_m")
    depth.fill("15")
    depth.press("Enter")
    expect(page.get_by_test_id("section-obstacles")).to_contain_text("15 m radar")
    polar = page.get_by_test_id("polar")
    expect(polar).to_have_attribute("data-range", "20")
    page.get_by_test_id("polar-farther").click()
    expect(polar).to_have_attribute("data-range", "40")


def test_without_the_server_hold_and_return_are_disabled_and_say_why(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    _open_demo(page, station)
    _connect(page, vehicle)
    station.kill()
    expect(page.get_by_test_id("safety-why")).to_contain_text("transmitter")
    expect(page.get_by_test_id("hold-position")).to_be_disabled()
    expect(page.get_by_test_id("return-home")).to_be_disabled()
