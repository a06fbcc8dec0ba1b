"""Home set by order in a real browser: asked for, looked at, held, and told by the vehicle."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import connect, hold, visit
from tests.server.station import ok

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_home_is_judged_shown_put_away_and_set(station: Station, page: Page, vehicle: SimulatedVehicle) -> None:
    ok(station.http.post("/api/terrains/demo"))
    visit(page, station)
    connect(page, vehicle)
    section = page.get_by_test_id("section-home")
    section.get_by_role("button", name="Home").first.click()
    expect(page.get_by_test_id("home-there")).to_be_disabled()
    page.get_by_test_id("home-here").click()
    card = page.get_by_test_id("home-card")
    expect(card).to_contain_text("It stays there when the vehicle arms")
    expect(page.get_by_test_id("home-set")).to_be_in_viewport(ratio=1)
    page.get_by_test_id("home-drop").click()
    expect(card).to_have_count(0)
    page.get_by_test_id("home-here").click()
    hold(page, "home-set")
    expect(page.get_by_test_id("outcome-home")).to_contain_text("Home is set.")
    lines = ok(station.http.get("/api/audit")).text
    assert "set home to 37.72" in lines
