"""A plan that is faster than the sensors see to stop for, in a real browser."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import start_simulator, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_plan_that_is_faster_than_seen_says_so_in_plan_and_is_slowed_by_one_press(
    station: Station, sighted: Station, page: Page
) -> None:
    hint = page.get_by_test_id("sees-enough")
    for each, is_known in ((station, False), (sighted, True)):
        each.open_demo(lambda points: list(points.values()), {"max_speed_m_s": 9.0, "mean_speed_m_s": 8.5})
        visit(page, each)
        expect(page.get_by_test_id("length")).to_be_visible()
        if not is_known:
            expect(hint).to_have_count(0)  # nothing is known of any sensor

    start_simulator(page)
    page.get_by_test_id("tab-plan").click()
    expect(hint).to_contain_text("9.0 m/s")
    page.set_viewport_size({"width": 390, "height": 844})
    page.get_by_test_id("drawer-right").click()
    expect(hint).to_be_visible()
    page.set_viewport_size({"width": 1440, "height": 900})
    page.get_by_test_id("fly-as-seen").click()
    expect(hint).to_have_count(0)

    def is_slowed() -> bool:
        """The page knows its own edit before the station has taken it."""
        profile = sighted.state["plan"]["document"]["profile"]
        return profile["mean_speed_m_s"] <= profile["max_speed_m_s"] < 9.0

    wait_until(page, is_slowed)
