"""Traffic in the console: listed with its figures, chosen with one press, warned of, and set, at any width."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from server.schemas import AlertMessage, ObstaclesMessage, TrafficMessage
from server.schemas.obstacle_docs import AlertDoc, ObstaclesState
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import TrafficSettings
from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, STREAM, enter, visit
from tests.server.test_traffic import aircraft, status

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

TEXT = "Traffic HBABC, 2 o'clock, 1.2 km, 80 m above, closing, 35 s. Give way: hold, descend or land, as you decide."
WARNED = ObstacleAlert("traffic-1", "traffic", "traffic", "begins", 100.0, 1000.0, 100.0, TEXT)
SKY = (
    aircraft(distance_m=1240.0, closing_m_s=40.0, closest_m=300.0, closest_in_s=35.0, conflict=True),
    aircraft(
        key="rid 0a1b",
        source="remote_id",
        name="1581F5FKD2323000A1B2",
        kind="multirotor drone",
        alt_datum="unknown",
        height_m=None,
        alt_m=None,
        distance_m=430.0,
        bearing_deg=300.0,
        age_s=14.0,
        closing_m_s=-3.0,
        closest_in_s=0.0,
        closest_m=430.0,
    ),
    aircraft(
        key="adsb 3c6444", name="DLH9LF", kind="heavy", distance_m=14_200.0, height_m=2_900.0, alt_datum="pressure"
    ),
)


@pytest.fixture(scope="module")
def overflown(tmp_path_factory: pytest.TempPathFactory, console: None) -> Iterator[Station]:
    """The demo, past which an aircraft flies."""
    environment = {**os.environ, "HEDGEHOP_DEMO_TRAFFIC": "1"}
    station = Station(tmp_path_factory.mktemp("data") / "data", "--demo", environment=environment)
    yield station
    station.stop()


def test_the_demos_aircraft_is_listed_and_what_is_warned_of_is_set(overflown: Station, page: Page) -> None:
    visit(page, overflown)
    page.get_by_test_id("tab-fly").click()
    rows = page.get_by_test_id("traffic-live").get_by_test_id("traffic-row")
    expect(rows).to_have_count(1, timeout=LONG_MS)
    expect(rows).to_contain_text("DEMO1")
    expect(page.get_by_test_id("traffic-note")).to_contain_text("by GNSS")
    page.get_by_test_id("section-traffic").get_by_role("button").first.click()
    field = page.get_by_test_id("traffic-warn_distance_m")
    expect(field).to_have_value("9260")
    field.fill("40")
    field.press("Enter")
    expect(page.get_by_test_id("section-traffic")).to_contain_text("out of range")
    field.fill("1500")
    field.press("Enter")
    expect(page.get_by_test_id("section-traffic")).to_contain_text("Set.")
    page.get_by_test_id("traffic-own_icao").fill("nobody")
    page.get_by_test_id("traffic-own_icao").press("Enter")
    expect(page.get_by_test_id("section-traffic")).to_contain_text("six hexadecimal digits")
    page.reload()
    expect(page.get_by_test_id("traffic-warn_distance_m")).to_have_value("1500", timeout=LONG_MS)


BOUNDS = """panel => [panel, ...panel.querySelectorAll("li span, li strong")].map(part => {
    const box = part.getBoundingClientRect();
    return [box.left, box.right];
})"""
"""Left and right, px, of the panel and of all that stands in its rows: at one moment, for a drawer slides in."""


def fly_among(page: Page) -> None:
    """What the server says of traffic is what ``SKY`` holds."""
    sky = TrafficMessage(source="live", now_mono_s=100.0, settings=TrafficSettings(), status=status(*SKY, filtered=3))
    listed = ObstaclesState(alerts=[AlertDoc(alert=WARNED, began_utc_s=1000.0)])

    def pass_on(route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def to_page(text: str | bytes) -> None:
            told = json.loads(text)
            if told["type"] == "traffic" and told["source"] == "live":
                route.send(sky.model_dump_json())
                route.send(AlertMessage(source="live", alert=WARNED).model_dump_json())
                route.send(ObstaclesMessage(source="live", obstacles=listed).model_dump_json())
            elif not (told["type"] == "obstacles" and told["source"] == "live"):
                route.send(text)

        server.on_message(to_page)

    page.route_web_socket(STREAM, pass_on)


@pytest.mark.parametrize("width", [390, 1440])
def test_a_warning_and_its_aircraft_are_read_and_chosen(overflown: Station, page: Page, width: int) -> None:
    fly_among(page)
    enter(page, overflown)
    page.get_by_test_id("tab-fly").click()
    page.set_viewport_size({"width": width, "height": 844})
    banner = page.get_by_test_id("alert-banner")
    expect(banner).to_contain_text("Traffic: may come too near", timeout=LONG_MS)
    expect(banner).to_contain_text(TEXT)
    drawer = page.get_by_test_id("drawer-facts")
    if drawer.is_visible():
        drawer.click()
    rows = page.get_by_test_id("traffic-live").get_by_test_id("traffic-row")
    expect(rows).to_have_count(3)
    expect(rows.nth(0)).to_contain_text("closing 35")
    expect(rows.nth(1)).to_contain_text("old")
    note = page.get_by_test_id("traffic-note")
    expect(note).to_contain_text("HBABC, light (ADS-B)")
    expect(note).to_contain_text("And 3 too far or high to show.")
    rows.nth(1).get_by_role("button").press("Enter")
    expect(note).to_contain_text("height unknown: counts as yours")
    panel, *parts = page.get_by_test_id("traffic-live").evaluate(BOUNDS)
    assert parts
    for left, right in parts:
        assert left >= panel[0]
        assert right <= panel[1] + 1
