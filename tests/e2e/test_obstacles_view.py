"""The demo's vehicle meets a building that its surface model does not know, in a real browser."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import Point, Station
from tests.e2e.steps import drawn, hold, land, replay_alert, start, start_simulator, upload, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

PLACE = re.compile(r"-?\d+\.\d{7}, -?\d+\.\d{7}")


@pytest.fixture(scope="module")
def demo(sighted: Station) -> Station:
    """The building stands on the first leg; the way home is less high than usual."""
    sighted.open_demo(_past_the_building, {"rtl_height_m": 20.0})
    return sighted


def _past_the_building(points: dict[str, Point]) -> list[Point]:
    """With a stay in sight of it, so that a slow page sees the ways past it, and one behind it, to land at."""
    meadow, ruin = points["Meadow"], points["Ruin"]
    before = {axis: meadow[axis] + 0.15 * (ruin[axis] - meadow[axis]) for axis in ("lat_deg", "lon_deg")}
    return [meadow, {**meadow, **before, "id": "before", "loiter_s": 30.0}, {**ruin, "loiter_s": 600.0}]


def test_an_obstacle_is_alerted_climbed_over_planned_around_and_reviewed(
    demo: Station, page: Page, tmp_path: Path
) -> None:
    visit(page, demo)
    start_simulator(page)
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-enabled", "true")
    upload(page)
    start(page)

    _is_alerted(page)
    expect(page.get_by_test_id("avoidance")).to_have_attribute("data-state", "offset")
    _is_acknowledged(page)
    _is_planned_against(page)
    _its_rest_is_planned(page, demo)
    land(page)
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

    wait_until(page, none_calls)


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


def _its_rest_is_planned(page: Page, demo: Station) -> None:
    """The mission ahead, and the way home, from where the vehicle is."""
    for part, outcome, points in (
        ("ahead", "Planned from where the vehicle was", ["here", "Ruin"]),
        ("home", "The way home is planned", ["here", "home"]),
    ):
        page.get_by_test_id(f"plan-with-seen-{part}").click()
        expect(page.get_by_test_id("outcome-seen")).to_contain_text(outcome)
        document = demo.state["plan"]["document"]
        planned = [poi["id"] if poi["id"] in points else poi["name"] for poi in document["pois"]]
        # While the page was slow the vehicle may have come to the last point, where it waits.
        assert planned == points or (part == "ahead" and planned == points[1:])
        assert document["seen_id"] is not None
    # Of a plan that is not the one on board nothing may be flown before the landing.
    page.get_by_test_id("tab-plan").click()
    expect(page.get_by_test_id("upload")).to_be_disabled()
    page.get_by_test_id("tab-fly").click()


def _is_reviewed(page: Page, tmp_path: Path) -> None:
    # The recorded alert stands over the 3D view again, and nobody has to answer it.
    replay_alert(page)
    expect(page.get_by_test_id("alert-acknowledge")).to_have_count(0)
    replayed = page.get_by_test_id("instruments-replay")
    expect(replayed.get_by_test_id("polar")).to_be_visible()
    expect(page.get_by_test_id("sensors-replay").get_by_test_id("sensor-radar")).to_be_visible()
    with page.expect_download() as download:
        page.get_by_test_id("map-radar-geojson").click()
    kept = tmp_path / "radar.geojson"
    download.value.save_as(kept)
    assert json.loads(kept.read_text())["type"] == "FeatureCollection"


def test_what_was_seen_in_that_flight_is_drawn(demo: Station, page_3d: Page) -> None:
    """From its recording: a browser that renders in software would take the processor from sensors in flight."""
    page = page_3d
    visit(page, demo)
    replay_alert(page)
    drawn(page)
    # Whatever the frame's page could not draw would stand in its console, which the fixture reads.
    expect(page.frame_locator("[data-testid=view-frame]").locator("canvas").first).to_be_visible()


def test_maps_are_shown_and_hidden_and_the_regions_set(demo: Station, page: Page) -> None:
    visit(page, demo)
    start_simulator(page)
    for layer in ("radar_map", "vision_map", "regions", "vision_flight", "explained"):
        toggle = page.get_by_test_id(f"layer-{layer}")
        is_on = layer not in ("vision_flight", "explained")
        for shown in (is_on, not is_on):
            expect(toggle).to_have_attribute("aria-pressed", str(shown).lower())
            toggle.click()
        expect(toggle).to_have_attribute("aria-pressed", str(is_on).lower())
    _both_maps_are_one_picture(page)
    _slices_and_targets_are_looked_at(page)

    page.get_by_test_id("section-obstacles").get_by_role("button").first.click()
    depth = page.get_by_test_id("perception-radar_depth_m")
    depth.fill("15")
    depth.press("Enter")
    expect(page.get_by_test_id("section-obstacles")).to_contain_text("15 m radar")
    polar = page.get_by_test_id("polar")
    expect(polar).to_have_attribute("data-range", "20")
    page.get_by_test_id("polar-farther").click()
    expect(polar).to_have_attribute("data-range", "40")
    _maps_begin_anew_when_held_for(page)


def _both_maps_are_one_picture(page: Page) -> None:
    both, alone = page.get_by_test_id("merged-maps"), page.get_by_test_id("layer-vision_map")
    both.click()
    expect(both).to_have_attribute("aria-pressed", "true")
    for layer, shown in (("radar_map", "true"), ("vision_flight", "true"), ("vision_map", "false")):
        expect(page.get_by_test_id(f"layer-{layer}")).to_have_attribute("aria-pressed", shown)
    both.click()
    expect(both).to_have_attribute("aria-pressed", "false")
    expect(alone).to_have_attribute("aria-pressed", "true")


def _slices_and_targets_are_looked_at(page: Page) -> None:
    """The radar looks out on the ground, too: its frames come, kept or not."""
    page.get_by_test_id("looking-section").click()
    expect(page.get_by_test_id("section-says-live")).to_contain_text("heights above home")
    page.get_by_test_id("section-across").click()
    expect(page.get_by_test_id("section-says-live")).to_contain_text("left")
    height = page.get_by_test_id("section-live").evaluate("canvas => canvas.clientHeight")
    page.get_by_test_id("looking-targets").click()
    expect(page.get_by_test_id("section-live")).to_have_count(0)
    expect(page.get_by_test_id("targets-says-live")).to_contain_text(re.compile(r"\d+ of \d+ kept; gate ±45°"))
    assert page.get_by_test_id("targets-live").evaluate("canvas => canvas.clientHeight") == height
    page.get_by_test_id("looking-targets").click()
    expect(page.get_by_test_id("targets-live")).to_have_count(0)


def _maps_begin_anew_when_held_for(page: Page) -> None:
    page.get_by_test_id("map-settings").locator("summary").click()
    thin = page.get_by_test_id("perception-cloud_voxel_m")
    expect(thin).to_have_value("0")
    thin.fill("0.25")
    thin.press("Enter")
    expect(thin).to_have_value("0.25")
    edge, memory = page.get_by_test_id("perception-radar_resolution_m"), page.get_by_test_id("perception-memory_mb")
    anew = page.get_by_test_id("begins-anew")
    expect(edge).to_have_value("1")
    expect(anew).to_have_count(0)
    edge.fill("0.1")
    edge.press("Enter")
    expect(anew).to_contain_text("The radar's map begins anew")
    for _ in range(2):  # as assistive technology does: what is refused leaves the button where it is
        page.get_by_test_id("begin-anew").evaluate("button => button.click()")
    section = page.get_by_test_id("section-obstacles")
    expect(section.get_by_test_id("error-box")).to_contain_text(re.compile(r"A corridor .* points"))
    edge.fill("0.8")
    edge.press("Enter")
    memory.fill("500")
    memory.press("Enter")
    expect(anew).to_contain_text("The radar's, camera's and range finder's maps begin anew")
    hold(page, "begin-anew")
    expect(anew).to_have_count(0)
    expect(section.get_by_test_id("error-box")).to_have_count(0)
    expect(edge).to_have_value("0.8")
    memory.fill("99999")
    memory.press("Enter")
    for _ in range(2):
        page.get_by_test_id("begin-anew").evaluate("button => button.click()")
    expect(section.get_by_test_id("error-box")).to_contain_text("this computer has")
    page.get_by_test_id("keep-maps").click()
    expect(memory).to_have_value("500")
    expect(section.get_by_test_id("error-box")).to_have_count(0)
