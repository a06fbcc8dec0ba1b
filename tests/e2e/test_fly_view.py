"""A simulated vehicle is connected, given the plan, flown and brought home, in a real browser."""

from __future__ import annotations

import contextlib
import re

import pytest
from playwright.sync_api import Page, TimeoutError, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import (
    connect,
    disarmed,
    hold_return,
    is_held_by_key,
    open_demo,
    open_recording,
    percent,
    play,
    press_after_g,
    start,
    upload,
    visit,
    wait_until,
)

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_plan_upload_fly_review(station: Station, page: Page, vehicle: SimulatedVehicle) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    upload(page)
    start(page)

    expect(page.get_by_test_id("chip-mode")).to_contain_text(re.compile(r"AUTO \d+/\d+"))
    expect(page.get_by_test_id("attitude")).to_have_attribute("aria-label", re.compile("Attitude: .* heading"))
    wait_until(page, lambda: percent(page) >= 5)
    # It waits there for as long as a slow page needs to show all of it.
    _press(page, "next-pause", "next-resume")
    expect(page.get_by_test_id("cross-track")).to_contain_text(re.compile(r"\d\.\d\d\sm"))
    expect(page.get_by_test_id("vehicle-marker")).to_be_visible()
    expect(page.get_by_test_id("chip-rec")).to_contain_text("REC")
    expect(page.get_by_test_id("health-battery")).to_contain_text("to the reserve")
    expect(page.get_by_test_id("health-vibration")).to_have_attribute("data-level", "good")
    expect(page.get_by_test_id("vehicle-text").first).to_be_visible()

    _press(page, "next-resume", "next-pause")

    disarmed(page)
    _review_what_was_flown(page)


def test_return_is_held_by_key_and_can_be_let_go(station: Station, page: Page, vehicle: SimulatedVehicle) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    upload(page)
    start(page)
    wait_until(page, lambda: percent(page) >= 3)

    page.get_by_test_id("tab-plan").click()
    wait_until(page, lambda: _is_told_to_hold(page, "return-home"))
    expect(page.get_by_test_id("chip-mode")).to_contain_text("AUTO")

    hold_return(page)
    expect(page.get_by_test_id("chip-mode")).to_contain_text("RTL")
    disarmed(page)


def test_the_motors_are_stopped_behind_a_guard(station: Station, page: Page, vehicle: SimulatedVehicle) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    expect(page.get_by_test_id("emergency-open")).to_be_disabled()
    upload(page)
    start(page)
    wait_until(page, lambda: percent(page) >= 1)
    # It would not come down by itself.
    _press(page, "next-pause", "next-resume")

    page.get_by_test_id("emergency-open").click()
    expect(page.get_by_test_id("emergency-guard")).to_contain_text("the vehicle falls")
    page.get_by_test_id("emergency-cancel").click()
    expect(page.get_by_test_id("emergency-guard")).to_have_count(0)

    arm = page.get_by_test_id("arm")

    def is_refused() -> bool:
        _open_guard(page)
        return _is_told_to_hold(page, "emergency-stop")

    def is_stopped() -> bool:
        _open_guard(page)
        return arm.is_visible() or is_held_by_key(
            page, "emergency-stop", lambda ms: expect(arm).to_be_visible(timeout=ms)
        )

    wait_until(page, is_refused)
    expect(page.get_by_test_id("next-resume")).to_be_visible()
    expect(arm).to_have_count(0)
    wait_until(page, is_stopped)
    expect(page.get_by_test_id("emergency-open")).to_be_disabled()


def test_a_vehicle_that_falls_silent_is_said_and_its_values_age(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "false")
    vehicle.stop()
    expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "true")
    expect(page.get_by_test_id("link-lost")).to_contain_text(re.compile(r"Communication lost\s*\d+\ss"))
    expect(page.get_by_test_id("above-home")).to_contain_text(re.compile(r"\d"))
    expect(page.get_by_test_id("return-home")).to_be_visible()


def test_an_address_that_names_a_file_is_refused_where_it_was_typed(station: Station, page: Page) -> None:
    visit(page, station)
    page.get_by_test_id("tab-fly").click()
    page.get_by_test_id("link-address").fill("/etc/passwd")
    page.get_by_test_id("link-connect").click()
    expect(page.get_by_test_id("section-connection").get_by_test_id("error-box")).to_contain_text("/etc/passwd")


def test_the_view_is_in_the_address_and_on_the_keys(station: Station, page: Page) -> None:
    open_demo(page, station)
    page.get_by_test_id("verdict-badge").click()
    press_after_g(page, "f", lambda ms: expect(page).to_have_url(re.compile("#fly$"), timeout=ms))
    expect(page.get_by_test_id("no-vehicle")).to_be_visible()
    page.reload()
    expect(page.get_by_test_id("no-vehicle")).to_be_visible()
    page.goto(f"{station.origin}/#review")
    expect(page.get_by_test_id("recording-drop")).to_be_visible()
    page.goto(station.origin)
    expect(page.get_by_test_id("recording-drop")).to_be_visible()


def _press(page: Page, testid: str, then: str) -> None:
    """Until the button of the step after it is there: an order that came too late is not done."""
    done = page.get_by_test_id(then)

    def is_done() -> bool:
        with contextlib.suppress(TimeoutError, AssertionError):
            page.get_by_test_id(testid).click(timeout=2000)
            expect(done).to_be_visible(timeout=10_000)
        return done.is_visible()

    wait_until(page, is_done)


TAP = """button => ["keydown", "keyup"].forEach((kind) =>
  button.dispatchEvent(new KeyboardEvent(kind, { key: "Enter", bubbles: true, cancelable: true })))"""
"""At one moment: a page that is stuck for a second between two keys makes a whole hold of them."""


def _is_told_to_hold(page: Page, testid: str) -> bool:
    with contextlib.suppress(TimeoutError, AssertionError):
        page.get_by_test_id(testid).evaluate(TAP, timeout=2000)
        expect(page.get_by_text("Hold it for one second")).to_be_visible(timeout=5000)
        return True
    return False


def _open_guard(page: Page) -> None:
    """It closes by itself after a while; that something is stopped closes it as well."""
    with contextlib.suppress(TimeoutError):
        if not page.get_by_test_id("emergency-guard").count():
            page.get_by_test_id("emergency-open").click(timeout=2000)


def _review_what_was_flown(page: Page) -> None:
    open_recording(page)
    expect(page.get_by_test_id("completed")).to_have_text("completed")
    expect(page.get_by_test_id("cross-track-p95")).to_contain_text(re.compile(r"\d\.\d\d"))
    expect(page.locator(".time-pane .u-over")).to_be_visible()

    page.get_by_test_id("review-part-instruments").click()
    page.get_by_test_id("speed").select_option("2")
    play(page)
    before = page.get_by_test_id("replay-time").inner_text()
    expect(page.get_by_test_id("replay-time")).not_to_have_text(before, use_inner_text=True)
    # While it plays: it begins with what was recorded before the vehicle was first heard.
    expect(page.get_by_test_id("instruments-replay").get_by_test_id("ground-speed")).to_contain_text("m/s")
    page.get_by_test_id("play").click()
    expect(page.get_by_test_id("play")).to_have_text("Play")
    # A recording is only looked at: what commands the live vehicle is marked, and there is nothing else.
    expect(page.get_by_text("LIVE", exact=True)).to_be_visible()
    expect(page.get_by_test_id("next-action")).to_have_count(0)
