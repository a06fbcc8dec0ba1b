"""The logs on the vehicle: listed, one read into the recordings and opened there, in a real browser."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import PATIENCE_MS, connect, disarmed, hold, open_demo

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_log_is_listed_read_and_reviewed(station: Station, page: Page, vehicle: SimulatedVehicle) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    section = page.get_by_test_id("section-vehicle-logs")
    section.get_by_role("button", name="Logs on the vehicle").click()
    page.get_by_test_id("logs-list").click()
    expect(section).to_contain_text("There is no log on the vehicle.")

    hold(page, "arm")
    disarmed(page)  # by itself: it does not take off
    expect(page.get_by_test_id("logs-list")).to_be_enabled(timeout=PATIENCE_MS)
    page.get_by_test_id("logs-list").click()
    page.get_by_test_id("log-download").first.click()
    expect(page.get_by_test_id("log-done")).to_contain_text(
        re.compile(r"Log \d+ is among the recordings"), timeout=PATIENCE_MS
    )
    page.get_by_test_id("log-review").click()
    expect(page).to_have_url(re.compile("#review$"))
    opened = page.locator("[data-testid=recording-row][data-open=true]")
    expect(opened).to_contain_text(".bin", timeout=PATIENCE_MS)
