"""Several vehicles in the console: all in sight, one shown, and no command to one that is not."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from server.schemas import FleetMessage
from server.schemas.station_docs import VehicleAlarm, VehicleDoc
from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, STREAM, enter, hold, press_after_g, visit

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory, console: None) -> Iterator[Station]:
    """The demo with two simulated vehicles."""
    station = Station(tmp_path_factory.mktemp("data") / "data", "--demo", "--demo-vehicles", "2")
    yield station
    station.stop()


def test_one_press_shows_another_vehicle_and_moves_nobody_s_charge(pair: Station, page: Page) -> None:
    visit(page, pair)
    page.get_by_test_id("tab-fly").click()
    operator, second = page.get_by_test_id("chip-operator"), page.get_by_test_id("vehicle-2")
    expect(page.get_by_test_id("vehicle-1")).to_have_attribute("aria-pressed", "true", timeout=LONG_MS)
    expect(second).to_contain_text("disarmed", timeout=LONG_MS)
    expect(operator).to_contain_text("In charge")
    second.click()
    expect(second).to_have_attribute("aria-pressed", "true")
    expect(operator).to_contain_text("Nobody in charge")
    expect(page.get_by_test_id("chip-mode")).to_contain_text("disarmed")
    hold(page, "take-control")
    expect(operator).to_contain_text("In charge")
    first = page.get_by_test_id("vehicle-1")
    press_after_g(page, "1", lambda ms: expect(first).to_have_attribute("aria-pressed", "true", timeout=ms))
    expect(operator).to_contain_text("In charge")
    # A page that is loaded anew begins with the first one.
    page.reload()
    expect(page.get_by_test_id("vehicle-1")).to_have_attribute("aria-pressed", "true")


def test_many_vehicles_have_whole_names_on_a_phone(pair: Station, page: Page) -> None:
    longest = "Mapper of the north field"[:24]
    lost = VehicleAlarm(kind="loss", key="lost", text="Nothing is heard of it any more.")
    vehicles = [VehicleDoc(number=n, name=longest if n % 2 else f"Vehicle {n}", alarm=lost) for n in range(1, 9)]
    page.route_web_socket(STREAM, partial(_with_fleet, vehicles))
    page.set_viewport_size({"width": 390, "height": 800})
    enter(page, pair)
    expect(page.get_by_test_id("vehicle-8")).to_contain_text("Vehicle 8", timeout=LONG_MS)
    is_cut = "e.scrollWidth > e.clientWidth || e.scrollHeight > e.clientHeight + 1"
    find = f"all => all.filter(e => {is_cut}).map(e => e.innerText)"
    cut = page.eval_on_selector_all(".fleet-vehicle, .fleet-vehicle > strong", find)
    assert cut == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    # What is said of the safety buttons covers none of them.
    page.wait_for_function(
        "getComputedStyle(document.documentElement).getPropertyValue('--fleet-height') ==="
        " document.querySelector('.fleet-vehicles').offsetHeight + 'px'",
        timeout=LONG_MS,
    )


def _with_fleet(vehicles: list[VehicleDoc], route: WebSocketRoute) -> None:
    """The station's own words, but of these vehicles."""
    server = route.connect_to_server()

    def to_page(text: str | bytes) -> None:
        told = json.loads(text)
        route.send(FleetMessage(vehicles=vehicles).model_dump_json() if told["type"] == "fleet" else text)

    server.on_message(to_page)


@pytest.mark.parametrize("width", [390, 1366])
def test_an_alarm_of_another_vehicle_is_read_and_answered_at_any_width(pair: Station, page: Page, width: int) -> None:
    lost = VehicleAlarm(kind="loss", key="lost", text="Nothing is heard of it any more. Take the pilot's transmitter.")
    vehicles = [VehicleDoc(number=1, name="Bee"), VehicleDoc(number=2, name="Wasp", armed=True, alarm=lost)]
    page.route_web_socket(STREAM, partial(_with_fleet, vehicles))
    page.set_viewport_size({"width": width, "height": 800})
    enter(page, pair)
    alarm = page.get_by_test_id("fleet-alarm")
    expect(alarm).to_contain_text("Wasp: Nothing is heard of it any more.", timeout=LONG_MS)
    for each in (alarm, page.get_by_test_id("fleet-show"), page.get_by_test_id("fleet-acknowledge")):
        box = each.bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
    page.get_by_test_id("fleet-acknowledge").click()
    expect(alarm).to_have_count(0)
    page.get_by_test_id("vehicle-2").click()
    expect(page.get_by_test_id("vehicle-2")).to_have_attribute("aria-pressed", "true")
