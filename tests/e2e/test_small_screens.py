"""On small screens the ways past an obstacle cover neither the alert nor an instrument, and need no panel opened."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import FloatRect, Page, WebSocketRoute, expect

from server.schemas import LinkMessage, ObstaclesMessage, PerceptionMessage
from server.schemas.obstacle_docs import AlertDoc, ManoeuvreDoc, ObstaclesState
from telemetry.topics.messages import Candidate, LinkStatus
from tests.e2e.stations import Station
from tests.e2e.steps import visit
from tests.server.obstacle_messages import alert, approach, obstacle, status

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

QUAD = Candidate("q", "udpin:127.0.0.1:14550", "127.0.0.1:14551", 1, 1, "ardupilot", 2)
WAYS = (
    ManoeuvreDoc(
        id="s", kind="sidestep", for_alert="t7", possible=True, text="Turn 25 deg left, 4.2 m/s, for 5 s, passes 3.8 m"
    ),
    ManoeuvreDoc(id="o", kind="over", for_alert="radar-1", possible=True, text="Climbs 6 m", clearance_m=3.2),
    ManoeuvreDoc(id="a", kind="around", for_alert="radar-1", possible=False, text="Unknown terrain on both sides."),
)
AHEAD = (
    LinkMessage(link=LinkStatus(10.0, adopted=QUAD, state="live")),
    PerceptionMessage(source="live", now_mono_s=10.1, sensor="radar", status=status(occupied=True)),
    ObstaclesMessage(
        source="live",
        obstacles=ObstaclesState(
            alerts=[
                AlertDoc(alert=one, began_utc_s=1000.0, over=False, acknowledged=False)
                for one in (alert(obstacle=obstacle()), approach())
            ],
            manoeuvres=list(WAYS),
        ),
    ),
)


@pytest.mark.parametrize("size", [(1024, 768), (820, 1180), (390, 844)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_the_ways_past_it_stand_beside_alert_and_instruments(
    station: Station, page: Page, size: tuple[int, int]
) -> None:
    page.context.route_web_socket(re.compile(r"/ws$"), _with_something_ahead)
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    page.set_viewport_size({"width": size[0], "height": size[1]})

    cards = page.get_by_test_id("manoeuvres")
    expect(cards).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id("manoeuvre-sidestep")).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id("alert-acknowledge")).to_be_in_viewport(ratio=1)
    assert not _overlap(_box(page, "manoeuvres"), _box(page, "alert-banner"))
    opens_right = page.locator(".drawer-button.right")
    if opens_right.is_visible():
        opens_right.click()
    expect(page.get_by_test_id("polar")).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id("panel-right").get_by_test_id("manoeuvres")).to_have_count(0)


@pytest.mark.parametrize("width", [1440, 1180, 1024, 820, 390])
def test_nothing_sticks_out_of_panels_and_strip(station: Station, page: Page, width: int) -> None:
    page.context.route_web_socket(re.compile(r"/ws$"), _with_something_ahead)
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    page.set_viewport_size({"width": width, "height": 844})
    for testid in ("chip-mode", "chip-gnss", "chip-battery", "hold-position", "return-home"):
        expect(page.get_by_test_id(testid)).to_be_in_viewport(ratio=1)
    for side, drawer in (("left", "drawer-left"), ("right", "drawer-facts")):
        opens = page.get_by_test_id(drawer)
        if opens.is_visible():
            opens.click()
        expect(page.get_by_test_id(f"panel-{side}")).to_be_in_viewport(ratio=1)
        assert page.get_by_test_id(f"panel-{side}").evaluate(STICK_OUT) == []
        if opens.is_visible():
            opens.click()


STICK_OUT = """(panel) => {
  const sides = panel.getBoundingClientRect();
  return [...panel.querySelectorAll(":not(.visually-hidden, .visually-hidden *, svg *)")].filter((part) => {
    const box = part.getBoundingClientRect();
    const seen = box.width > 0 && getComputedStyle(part).visibility !== "hidden";
    return seen && (box.right > sides.right + 1 || box.left < sides.left - 1);
  }).map((part) => `${part.className}: ${part.textContent}`);
}"""


def _with_something_ahead(page_side: WebSocketRoute) -> None:
    """What the station itself says of vehicles is left out."""
    server = page_side.connect_to_server()
    told = {"link", "obstacles", "perception", "tracks"}

    def pass_on(text: str | bytes) -> None:
        kind = json.loads(text)["type"]
        if kind not in told:
            page_side.send(text)
        if kind == "snapshot":
            for message in AHEAD:
                page_side.send(message.model_dump_json())

    server.on_message(pass_on)


def _box(page: Page, testid: str) -> FloatRect:
    box = page.get_by_test_id(testid).bounding_box()
    assert box is not None
    return box


def _overlap(one: FloatRect, other: FloatRect) -> bool:
    return all(
        one[at] < other[at] + other[size] and other[at] < one[at] + one[size]
        for at, size in (("x", "width"), ("y", "height"))
    )
