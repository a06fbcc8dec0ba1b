"""Guided flight in a real browser: up, to a clicked place, faster, back, each looked at before it is flown."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import LONG_MS, click_surface, connect, disarmed, drawn, hold, open_demo

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def flown(page: Page) -> None:
    """It holds at the end of the way."""
    expect(page.get_by_test_id("way-card")).to_have_count(0, timeout=LONG_MS)
    expect(page.get_by_test_id("next-action")).to_contain_text("Choose the next way")


def test_one_way_after_the_other_is_judged_shown_and_flown(
    station: Station, page_3d: Page, vehicle: SimulatedVehicle
) -> None:
    page = page_3d
    open_demo(page, station)
    drawn(page)
    connect(page, vehicle)
    page.get_by_test_id("section-guided").get_by_role("button", name="Guided flight").click()
    page.get_by_test_id("way-height").fill("900")
    page.get_by_test_id("way-height").press("Enter")
    expect(page.get_by_test_id("section-guided")).to_contain_text("900 is out of range")
    page.get_by_test_id("way-height").fill("12")
    page.get_by_test_id("way-height").press("Enter")
    page.get_by_test_id("way-ask").click()
    card = page.get_by_test_id("way-card")
    expect(card).to_have_attribute("data-problem", "none")
    expect(card).to_contain_text("CERTIFIED")
    expect(page.get_by_test_id("way-clearance")).to_contain_text(re.compile(r"\d\.\d\d\sm"))
    page.get_by_test_id("way-drop").click()
    expect(card).to_have_count(0)
    page.get_by_test_id("way-ask").click()
    expect(card).to_be_visible()
    hold(page, "way-fly")
    flown(page)

    # So slowly that it is still under way when a slow page has made it faster.
    page.get_by_test_id("way-speed").fill("0.5")
    page.get_by_test_id("way-speed").press("Enter")
    page.get_by_test_id("view-top").click()
    page.get_by_test_id("way-click").click()
    expect(page.get_by_test_id("tool-hint")).to_contain_text("the way leads there")
    hint = page.get_by_test_id("tool-hint")
    click_surface(page, (0.5, 0.5), lambda ms: expect(hint).to_have_count(0, timeout=ms))
    expect(card).to_have_attribute("data-problem", "none")
    expect(page.get_by_test_id("undo")).to_be_disabled()
    hold(page, "way-fly")
    speed = page.get_by_test_id("way-flown-speed")
    speed.fill("4.5")
    speed.press("Enter")
    expect(page.get_by_test_id("outcome-guided")).to_contain_text("speed is changed")
    flown(page)

    page.get_by_test_id("guided-back").click()
    page.get_by_test_id("way-ask").click()
    expect(card).to_contain_text("It then lands.")
    hold(page, "way-fly")
    disarmed(page)
