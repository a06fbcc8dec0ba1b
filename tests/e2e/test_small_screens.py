"""On small screens nothing covers what counts: ways past an obstacle, alerts, and what has failed."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence

import pytest
from playwright.sync_api import FloatRect, Page, Route, WebSocketRoute, expect

from server.schemas import (
    FleetMessage,
    FlyMessage,
    FlyState,
    HomeAskedDoc,
    HomeMessage,
    HomeState,
    LeaseDoc,
    LeaseMessage,
    LinkMessage,
    MeMessage,
    NodesMessage,
    ObstaclesMessage,
    PerceptionMessage,
    ReasonDoc,
    RecorderMessage,
    ReturnDoc,
    TextMessage,
    VehicleMessage,
)
from server.schemas.account_docs import MeDoc, RoleName
from server.schemas.flight_docs import NodeDoc, OnboardDoc
from server.schemas.obstacle_docs import AlertDoc, ManoeuvreDoc, ObstaclesState
from server.schemas.station_docs import VehicleDoc
from server.schemas.strict_model import Message
from telemetry.topics.messages import Candidate, LinkStatus, RecorderStatus, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.e2e.stations import Station
from tests.e2e.steps import STREAM, hold_return, visit
from tests.server.obstacle_messages import alert, approach, obstacle, status
from tests.server.station import ok

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


def test_the_ways_past_it_stand_beside_alert_and_instruments(station: Station, page: Page) -> None:
    _with_messages(page, AHEAD)
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    for width, height in ((1024, 768), (820, 1180), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        cards = page.get_by_test_id("manoeuvres")
        expect(cards).to_be_in_viewport(ratio=1)
        expect(page.get_by_test_id("manoeuvre-sidestep")).to_be_in_viewport(ratio=1)
        expect(page.get_by_test_id("alert-acknowledge")).to_be_in_viewport(ratio=1)
        one, other = page.evaluate(BOXES, ["manoeuvres", "alert-banner"])
        assert not _overlap(one, other), width
        opens_right, polar = page.locator(".drawer-button.right"), page.get_by_test_id("polar")
        is_drawer = opens_right.is_visible()
        if is_drawer:
            expect(polar).not_to_be_in_viewport()
            opens_right.click()
        expect(polar).to_be_in_viewport(ratio=1)
        expect(page.get_by_test_id("panel-right").get_by_test_id("manoeuvres")).to_have_count(0)
        if is_drawer:
            opens_right.click()
            expect(polar).not_to_be_in_viewport()


WIDTHS = (1440, 1180, 1024, 820, 390)


def test_nothing_sticks_out_of_panels_and_strip(station: Station, page: Page) -> None:
    _with_messages(page, AHEAD)
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 844})
        for testid in ("chip-mode", "chip-gnss", "chip-battery", "hold-position", "return-home"):
            expect(page.get_by_test_id(testid)).to_be_in_viewport(ratio=1)
        for side, drawer in (("left", "drawer-left"), ("right", "drawer-facts")):
            opens, panel = page.get_by_test_id(drawer), page.get_by_test_id(f"panel-{side}")
            is_drawer = opens.is_visible()
            if is_drawer:
                opens.click()
            expect(panel).to_be_in_viewport(ratio=1)
            assert panel.evaluate(STICK_OUT) == [], width
            if is_drawer:
                opens.click()
                expect(panel).not_to_be_in_viewport()


BLOCKED = ReturnDoc(
    state="not_certified",
    reasons=[ReasonDoc(code=f"r{k}", text=f"Near place {k} it comes too low.", mend="Plan higher.") for k in range(9)],
    judged_mono_s=10.0,
)
JUDGED = HomeAskedDoc(
    id="h", is_here=True, lat_deg=37.7, lon_deg=15.0, alt_amsl_m=1700.0, moves_m=30.0, rises_m=2.0,
    changes=["Return leads there, and every height counts from there."], ret=BLOCKED,
)  # fmt: skip
PAIR = FleetMessage(vehicles=[VehicleDoc(number=1, name="Bee"), VehicleDoc(number=2, name="Wasp")])


@pytest.mark.parametrize("size", [(1366, 768), (390, 844)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_what_is_asked_of_home_is_seen_to_its_end_and_what_return_says_covers_no_vehicle(
    station: Station, page: Page, size: tuple[int, int]
) -> None:
    ok(station.http.post("/api/terrains/demo"))
    now_s = time.monotonic()
    state = VehicleState(1, 1, armed=True, landed="in_air", mode="LOITER", heartbeat_t_mono_s=now_s)
    hovers = VehicleMessage(source="live", now_mono_s=now_s, follow=None, state=state)
    link, home = LinkMessage(link=LinkStatus(now_s, adopted=QUAD, state="live")), HomeMessage(home=HomeState())
    sides = _with_messages(page, (link, hovers, PAIR, home))

    def judged(route: Route) -> None:
        sides[-1].send(HomeMessage(home=HomeState(asked=JUDGED)).model_dump_json())
        route.fulfill(json=HomeState(asked=JUDGED).model_dump(mode="json"))

    page.route("**/api/flight/home", judged)
    page.route("**/api/flight/return", lambda route: route.fulfill(status=204))
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    if page.get_by_test_id("drawer-left").is_visible():
        page.get_by_test_id("drawer-left").click()
    page.get_by_test_id("section-home").get_by_role("button", name="Home").first.click()
    page.get_by_test_id("home-here").click()
    expect(page.get_by_test_id("home-set")).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id("home-drop")).to_be_in_viewport(ratio=1)

    hold_return(page)
    said, fleet = page.evaluate(BOXES, ["outcome-safety", "fleet"])
    assert not _overlap(said, fleet)


def test_what_is_computed_for_a_take_up_has_its_end_beside_it_and_nothing_moves(station: Station, page: Page) -> None:
    link = LinkMessage(link=LinkStatus(10.0, adopted=QUAD, state="live"))
    finds = FlyState(onboard=OnboardDoc(state="none"), busy="Finding the way into the plan")
    sides = _with_messages(page, (link, FlyMessage(fly=finds)))
    path = "**/api/flight/take_up"
    page.route(path, lambda route: route.fulfill(json=finds.model_dump(mode="json")))
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    footer, cancel = page.get_by_test_id("next-action"), page.get_by_test_id("take-up-cancel")
    expect(footer).to_contain_text("Finding the way into the plan")
    expect(cancel).to_have_count(0)
    (before,) = page.evaluate(BOXES, ["next-action"])
    sides[-1].send(FlyMessage(fly=finds.model_copy(update={"can_cancel": True})).model_dump_json())
    expect(cancel).to_be_in_viewport(ratio=1)
    assert page.evaluate(BOXES, ["next-action"]) == [before]
    with page.expect_request(path) as asked:
        cancel.press("Enter")
    assert asked.value.method == "DELETE"
    expect(cancel).to_be_enabled()


LOST = (
    LinkMessage(link=LinkStatus(10.0, adopted=QUAD, state="live")),
    VehicleMessage(
        source="live",
        now_mono_s=10.0,
        follow=None,
        state=VehicleState(1, 1, armed=True, mode="GUIDED", heartbeat_t_mono_s=10.0, battery_share=0.97),
    ),
    RecorderMessage(
        recorder=RecorderStatus(10.0, True, "flight.mcap", started_utc_s=time.time() - 754.0, bytes=40_000_000)
    ),
    TextMessage(source="live", text=VehicleText(1000.0, 1, "The link has restarted: nothing avoided meanwhile.")),
    NodesMessage(
        nodes=[
            NodeDoc(name="link", state="restarting", restarts=1, text="It was killed."),
            NodeDoc(name="radar", state="silent", restarts=0, text="Nothing is heard of it."),
        ]
    ),
)


def _who(role: RoleName, lease: LeaseDoc) -> tuple[MeMessage, LeaseMessage]:
    return MeMessage(me=MeDoc(name="Ann", role=role, owner=False)), LeaseMessage(lease=lease)


WHO = {
    "in-charge": _who("operator", LeaseDoc(holder="Ann", mine=True, silent=False)),
    "looking-on": _who("operator", LeaseDoc(holder="Owner ad42", mine=False, silent=True)),
    "nobody-in-charge": _who("operator", LeaseDoc(holder=None, mine=False, silent=False)),
    "observer": _who("observer", LeaseDoc(holder="Owner ad42", mine=False, silent=False)),
}


@pytest.mark.parametrize("who", WHO)
def test_while_something_has_failed_the_bars_stay_readable_at_every_width(
    station: Station, page: Page, who: str
) -> None:
    """The link alone, then the server, too."""
    sides = _with_messages(page, (*LOST, *WHO[who]))
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    expect(page.get_by_test_id("chip-link")).to_contain_text("Link failed")
    _who_is_told(page, who)
    found = {}
    for failed in ("link", "server"):
        if failed == "server":
            page.context.route_web_socket(STREAM, lambda side: side.close(code=4408))
            sides.pop().close(code=4408)
            expect(page.get_by_test_id("link-state")).to_contain_text("No connection")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 844})
            for bar in (".status-bar", ".vehicle-strip"):
                if collisions := page.locator(bar).evaluate(COLLISIONS):
                    found[failed, width, bar] = collisions
            for testid in ("hold-position", "return-home", "safety-why", "loss-acknowledge"):
                assert page.get_by_test_id(testid).is_visible(), (failed, width, testid)
    assert found == {}


@pytest.mark.parametrize("late_s", [0.0, 16.0], ids=["now", "late"])
def test_an_alert_and_who_is_in_charge_cut_no_figure_off(station: Station, page: Page, *, late_s: float) -> None:
    def flies() -> VehicleMessage:
        at_s = time.monotonic() - late_s
        state = VehicleState(1, 1, armed=True, mode="BRAKE", heartbeat_t_mono_s=at_s, battery_share=0.87)
        return VehicleMessage(source="live", now_mono_s=at_s, follow=None, state=state)

    at_s = time.monotonic() - late_s
    link = LinkMessage(link=LinkStatus(at_s, adopted=QUAD, state="live", warnings=("Another station commands it.",)))
    silent = NodesMessage(nodes=[NodeDoc(name="radar", state="silent", restarts=0, text="Nothing is heard of it.")])
    sides = _with_messages(page, (link, *AHEAD[1:], flies(), *LOST[2:4], silent, *WHO["in-charge"]))
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    expect(page.get_by_test_id("chip-battery")).to_contain_text("87")
    found = {}
    for who in WHO:
        for message in (flies(), *WHO[who]):
            sides[-1].send(message.model_dump_json())
        _who_is_told(page, who)
        if late_s:
            expect(page.get_by_test_id("loss-acknowledge")).to_be_visible()
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 844})
            expect(page.get_by_test_id("chip-alert")).to_be_visible()
            expect(page.get_by_test_id("take-control")).to_have_count(0 if who in {"in-charge", "observer"} else 1)
            if collisions := page.locator(".vehicle-strip").evaluate(COLLISIONS):
                found[who, width] = collisions
    assert found == {}


def _who_is_told(page: Page, who: str) -> None:
    """The page has taken what it was last told of that."""
    expect(page.get_by_test_id("chip-operator")).to_contain_text(who.replace("-", " ").capitalize())


COLLISIONS = """(bar) => {
  const sides = bar.getBoundingClientRect();
  const isSeen = (part) => part.getClientRects().length > 0 && getComputedStyle(part).clipPath === "none";
  const kinds = "button, input, .chip, .saved, .link-badge, .safety-why, .tabs, .operator-holder";
  const parts = [...bar.querySelectorAll(kinds)]
    .filter((part) => isSeen(part) && !part.closest(".tabs button"))
    .map((part) => ({ part, box: part.getBoundingClientRect(), is: part.dataset.testid ?? part.className }))
    .filter(({ box }) => box.width > 1 && box.height > 1);
  const out = parts.filter(({ box }) => box.right > sides.right + 1 || box.left < sides.left - 1);
  const found = out.map(({ is, box }) => `${is} sticks out, to ${box.right}`);
  const cut = parts.filter(({ box }) => box.bottom > sides.bottom + 1 || box.top < sides.top - 1);
  found.push(...cut.map(({ is, box }) => `${is} is cut off, from ${box.top} to ${box.bottom}`));
  for (const [i, one] of parts.entries())
    for (const two of parts.slice(i + 1)) {
      if (one.part.contains(two.part) || two.part.contains(one.part)) continue;
      const wide = Math.min(one.box.right, two.box.right) - Math.max(one.box.left, two.box.left);
      const high = Math.min(one.box.bottom, two.box.bottom) - Math.max(one.box.top, two.box.top);
      if (wide > 1 && high > 1) found.push(`${one.is} lies over ${two.is}`);
    }
  return found;
}"""

STICK_OUT = """(panel) => {
  const sides = panel.getBoundingClientRect();
  return [...panel.querySelectorAll(":not(.visually-hidden, .visually-hidden *, svg *)")].filter((part) => {
    const box = part.getBoundingClientRect();
    const seen = box.width > 0 && getComputedStyle(part).visibility !== "hidden";
    return seen && (box.right > sides.right + 1 || box.left < sides.left - 1);
  }).map((part) => `${part.className}: ${part.textContent}`);
}"""


def _with_messages(page: Page, messages: Sequence[Message]) -> list[WebSocketRoute]:
    """The page hears these, and nothing that the station itself says of such things. Returned: its ends of streams."""
    told = {"tracks", "perception", *(json.loads(message.model_dump_json())["type"] for message in messages)}
    sides = list[WebSocketRoute]()

    def opened(page_side: WebSocketRoute) -> None:
        server = page_side.connect_to_server()
        sides.append(page_side)

        def pass_on(text: str | bytes) -> None:
            kind = json.loads(text)["type"]
            if kind not in told:
                page_side.send(text)
            if kind == "snapshot":
                for message in messages:
                    page_side.send(message.model_dump_json())

        server.on_message(pass_on)

    page.context.route_web_socket(STREAM, opened)
    return sides


BOXES = """testids => testids.map((id) => {
  const { x, y, width, height } = document.querySelector(`[data-testid=${id}]`).getBoundingClientRect();
  return { x, y, width, height };
})"""
"""At one moment: what stands above them may grow."""


def _overlap(one: FloatRect, other: FloatRect) -> bool:
    return all(
        one[at] < other[at] + other[size] and other[at] < one[at] + one[size]
        for at, size in (("x", "width"), ("y", "height"))
    )
