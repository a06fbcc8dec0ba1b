"""What the cockpit owes its operator: keys that count at once, and a view that is free again once an alert is over."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from server.schemas import LinkMessage, ObstaclesMessage
from server.schemas.obstacle_docs import AlertDoc, ObstaclesState
from telemetry.topics.messages import Candidate, LinkStatus
from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import STREAM, connect, enter, open_demo, visit
from tests.server.obstacle_messages import alert, approach, obstacle

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

QUAD = Candidate("q", "udpin:127.0.0.1:14550", "127.0.0.1:14551", 1, 1, "ardupilot", 2)
PRESS_AT_ONCE = """
addEventListener("DOMContentLoaded", () => {
  if (location.pathname !== "/") return;
  for (const key of ["g", "f"]) document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
});
"""
"""The page's script has run by then, and nothing has been painted."""


def test_keys_count_from_the_first_moment_on(station: Station, page: Page) -> None:
    page.add_init_script(PRESS_AT_ONCE)
    enter(page, station)
    expect(page).to_have_url(re.compile("#fly$"))


def test_an_alert_that_is_over_shrinks_to_a_chip_with_a_count(station: Station, page: Page) -> None:
    page.context.route_web_socket(STREAM, _with_two_that_are_over)
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    banner, chip = page.get_by_test_id("alert-banner"), page.get_by_test_id("alert-chip")
    expect(chip).to_have_text("2 alerts over")
    expect(banner).to_have_count(0)

    chip.click()
    expect(page.get_by_test_id("alert-acknowledge-all")).to_be_visible()
    expect(chip).to_have_count(0)
    page.get_by_test_id("alert-shrink").click()
    expect(chip).to_be_visible()
    expect(banner).to_have_count(0)


def test_fly_follows_its_vehicle_and_one_press_leads_elsewhere_and_back(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    follow = page.get_by_test_id("view-vehicle")
    expect(follow).to_have_attribute("aria-pressed", "true")
    for elsewhere in ("view-fit", "view-top"):
        page.get_by_test_id(elsewhere).click()
        expect(follow).to_have_attribute("aria-pressed", "false")
        follow.click()
        expect(follow).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("t")
    expect(follow).to_have_attribute("aria-pressed", "false")
    page.keyboard.press("v")
    expect(follow).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("tab-plan").click()
    expect(follow).to_have_attribute("aria-pressed", "false")


def _with_two_that_are_over(page_side: WebSocketRoute) -> None:
    """What the station itself says of vehicles is left out."""
    server = page_side.connect_to_server()
    alerts = [
        AlertDoc(alert=one, began_utc_s=1000.0, over=True, acknowledged=False)
        for one in (alert(obstacle=obstacle()), approach())
    ]
    told = (
        LinkMessage(link=LinkStatus(10.0, adopted=QUAD, state="live")),
        ObstaclesMessage(source="live", obstacles=ObstaclesState(alerts=alerts)),
    )

    def pass_on(text: str | bytes) -> None:
        kind = json.loads(text)["type"]
        if kind not in {"link", "obstacles"}:
            page_side.send(text)
        if kind == "snapshot":
            for message in told:
                page_side.send(message.model_dump_json())

    server.on_message(pass_on)
