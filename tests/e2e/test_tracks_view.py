"""The demo's vehicle meets another drone: followed, alerted, a way out of its way, and reviewed, in a real browser."""

from __future__ import annotations

import contextlib
import re

import pytest
from playwright.sync_api import Page, TimeoutError, expect

from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, land, replay_alert, start, start_simulator, upload, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


@pytest.fixture(scope="module")
def towards_another(sighted: Station) -> Station:
    """Straight to where the demo's other drone comes head-on every few seconds, to hover there for long.

    When in its to and fro the vehicle meets it depends on when that takes off; hovering, it meets it again and again.
    """
    sighted.open_demo(lambda points: [points["Ruin"], {**points["Gully"], "loiter_s": 600.0}], {"rtl_height_m": 20.0})
    return sighted


def test_the_velocity_display_shares_its_place_and_keeps_its_size(towards_another: Station, page: Page) -> None:
    visit(page, towards_another)
    start_simulator(page)
    expect(page.get_by_test_id("polar")).to_be_visible()
    # From the first sensor on both have their place, so that nothing moves when the first track comes.
    expect(page.get_by_test_id("display-velocity")).to_be_visible()
    around = _below_the_tabs(page, "polar")

    page.get_by_test_id("display-velocity").click()
    velocity = page.get_by_test_id("velocity")
    # On the ground the radar may see nothing yet: the display says so.
    expect(velocity).to_have_attribute("aria-label", re.compile(r"^Velocities: (now \d|not watched)"))
    expect(page.get_by_test_id("polar")).to_have_count(0)
    # Nothing moves when one takes the other's place, nor when there is nothing to show.
    assert _below_the_tabs(page, "velocity") == around
    expect(page.get_by_test_id("tracks-live").locator("tbody tr")).to_have_count(3)

    toggle = page.get_by_test_id("layer-tracks")
    expect(toggle).to_have_attribute("aria-pressed", "true")
    toggle.click()
    expect(toggle).to_have_attribute("aria-pressed", "false")
    toggle.click()
    expect(toggle).to_have_attribute("aria-pressed", "true")


def _below_the_tabs(page: Page, display: str) -> list[float]:
    """Where and how large, at one moment: wherever a click has scrolled the panel to."""
    return page.get_by_test_id(display).evaluate(BELOW_THE_TABS)


BELOW_THE_TABS = """display => {
  const tabs = document.querySelector("[data-testid=displays]").getBoundingClientRect();
  const box = display.getBoundingClientRect();
  return [box.x - tabs.x, box.y - tabs.y, box.width, box.height];
}"""


def test_the_safety_radius_is_set_and_kept(towards_another: Station, page: Page) -> None:
    visit(page, towards_another)
    start_simulator(page)
    before = _set_radius(page, "5")
    page.reload()
    expect(page.get_by_test_id("perception-safety_radius_m")).to_have_value("5")
    _set_radius(page, before)


def _set_radius(page: Page, value: str) -> str:
    """What it was before."""
    section, radius = page.get_by_test_id("section-obstacles"), page.get_by_test_id("perception-safety_radius_m")
    if not radius.count():
        section.get_by_role("button").first.click()
    before = radius.input_value()
    assert before != value
    radius.fill(value)
    # Until it is kept: a page that is left before that takes it along.
    with page.expect_response(re.compile("/api/obstacles/settings$")):
        radius.press("Enter")
    expect(section.get_by_test_id("error-box")).to_have_count(0)
    return before


def test_on_a_wide_screen_both_displays_and_the_list_stand_side_by_side(towards_another: Station, page: Page) -> None:
    page.set_viewport_size({"width": 1920, "height": 1080})
    visit(page, towards_another)
    start_simulator(page)
    expect(page.get_by_test_id("polar")).to_be_visible()
    expect(page.get_by_test_id("velocity")).to_be_visible()
    expect(page.get_by_test_id("displays")).to_have_count(0)
    expect(page.get_by_test_id("tracks-live").locator("tbody tr")).to_have_count(5)


def test_an_approach_is_alerted_evaded_and_reviewed(towards_another: Station, page: Page) -> None:
    visit(page, towards_another)
    start_simulator(page)
    upload(page)
    start(page)
    _steps_aside(page)
    land(page)

    replay_alert(page)
    page.get_by_test_id("display-velocity").click()
    expect(page.get_by_test_id("instruments-replay").get_by_test_id("velocity")).to_have_attribute(
        "data-state", "running"
    )
    expect(page.get_by_test_id("tracks-replay").get_by_test_id("track-row").first).to_be_visible()


def _steps_aside(page: Page) -> None:
    """Again at the next approach, where the other drone had passed before the page had taken the hold."""
    card, avoidance = page.get_by_test_id("manoeuvre-sidestep"), page.get_by_test_id("avoidance")
    aside = page.locator('[data-testid="avoidance"][data-state="manoeuvre"]')

    def is_flown() -> bool:
        with contextlib.suppress(TimeoutError, AssertionError):
            expect(card).to_be_visible(timeout=20_000)
            box = card.get_by_role("button").bounding_box(timeout=1000)
            assert box is not None
            page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            page.mouse.down()
            expect(aside).to_be_visible(timeout=6000)
        page.mouse.up()
        return bool(aside.count())

    wait_until(page, is_flown, LONG_MS)
    expect(avoidance).not_to_have_attribute("data-state", "manoeuvre")
