"""A scenario in a real browser: run, watched, and read figure by figure beside the paper's."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from server.schemas import ScenarioResultDoc, ScenarioRunDoc
from server.studies.scenario_task import part_doc
from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS, visit
from tests.server.test_scenario_runs import PART

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

QUICKEST = "corner-reflector"
PATIENCE_MS = 3 * LONG_MS
"""It yields to everything else that the machine does."""


def scenarios(page: Page, station: Station) -> None:
    visit(page, station)
    page.get_by_test_id("tab-review").click()
    page.get_by_test_id("study-scenarios").click()
    expect(page.get_by_test_id("scenario-iq-reflector")).to_be_visible()


def test_a_scenario_is_run_and_its_figures_stand_beside_the_papers(station: Station, page: Page) -> None:
    scenarios(page, station)
    page.get_by_test_id("scenario-long-flight").click()
    expect(page.get_by_test_id("scenario-run")).to_be_disabled()
    page.get_by_test_id(f"scenario-{QUICKEST}").click()
    expect(page.get_by_test_id("scenario-about")).to_contain_text("Miccinesi")
    page.get_by_test_id("scenario-run").click()
    expect(page.get_by_test_id("scenario-running")).to_contain_text(QUICKEST)
    page.get_by_test_id("scenario-cancel").click()
    expect(page.get_by_test_id("run-row").first).to_have_attribute("data-state", "cancelled")

    page.get_by_test_id("scenario-run").click()
    expect(page.get_by_test_id("scenario-result")).to_contain_text(f"{QUICKEST}, seed 0", timeout=PATIENCE_MS)
    expect(page.get_by_test_id("scenario-verdict")).to_contain_text("reached")
    row = page.get_by_test_id("scenario-figure").filter(has_text="clusters that the reflector makes")
    expect(row).to_contain_text("one, compact (fig. 15)")
    expect(row).to_have_attribute("data-verdict", "reached")
    expect(page.get_by_test_id("chart-points").first).to_be_visible()
    expect(page.get_by_test_id("printed-mark").first).to_be_visible()
    # What it came to is kept.
    page.reload()
    page.get_by_test_id("run-open").first.click()
    expect(page.get_by_test_id("scenario-result")).to_contain_text("vertical spread")
    page.get_by_test_id("run-delete").first.click()
    expect(page.get_by_test_id("run-row")).to_have_count(0)


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_results_are_read_at_every_width(station: Station, page: Page, size: tuple[int, int]) -> None:
    """Of a result that was made beforehand."""
    run = ScenarioRunDoc(
        id="r1",
        name="iq-reflector",
        seed=0,
        started_utc="2026-01-01T00:00:00Z",
        state="done",
        passed=False,
        seconds=9.0,
    )
    kept = ScenarioResultDoc(run=run, parts=[part_doc(PART)]).model_dump_json()
    page.route(re.compile("/api/scenarios/runs/r1$"), lambda route: route.fulfill(body=kept))
    page.route(
        re.compile("/api/scenarios/runs$"),
        lambda route: route.fulfill(body=f"[{run.model_dump_json()}]"),
    )
    scenarios(page, station)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    opens_left = page.get_by_test_id("drawer-left")
    if opens_left.is_visible():
        opens_left.click()
    page.get_by_test_id("run-open").click()
    if opens_left.is_visible():
        page.get_by_role("button", name="Close panel").click(position={"x": 370, "y": 200})
    expect(page.get_by_test_id("scenario-verdict")).to_contain_text("Not every figure was reached")
    expect(page.get_by_test_id("scenario-figure").first).to_be_in_viewport()
    page.get_by_test_id("scenario-chart").scroll_into_view_if_needed()
    expect(page.get_by_test_id("chart-line").first).to_be_in_viewport()
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
