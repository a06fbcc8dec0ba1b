"""A crew writes its checklist, ticks it before a start by pointer and by key, and reads it again in Review."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import check, connect, open_demo, open_recording, return_home, start, upload
from tests.server.station import ok

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

PROFILE = "Generic quadrotor"
IS_KEPT = re.compile("/api/checklist$")
"""The answer to Save: what the page said of the one before may still stand there."""
LIST = "# Vehicle\nPropellers are whole\nBattery is full\n# Place\nNobody is near\n"


@pytest.fixture
def listed(station: Station) -> Iterator[Station]:
    """The station, which other tests start flights with: the list goes with the test."""
    yield station
    kept = ok(station.http.get("/api/checklist", params={"profile": PROFILE})).json()
    body = {"profile": PROFILE, "text": "", "instead_of": kept["revision"]}
    ok(station.http.put("/api/checklist", json=body))


def saved(page: Page, text: str) -> None:
    page.get_by_test_id("checklist-text").fill(text)
    with page.expect_response(IS_KEPT):
        page.get_by_test_id("checklist-save").click()
    expect(page.get_by_test_id("outcome-checklist-text")).to_contain_text("Saved")


def test_the_list_is_written_ticked_demanded_and_reviewed(
    listed: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, listed)
    name = ok(listed.http.get("/api/session")).json()["name"]
    page.get_by_test_id("section-vehicle").get_by_role("button", name="Vehicle").first.click()
    page.get_by_test_id("checklist-edit").click()
    text = page.get_by_test_id("checklist-text")
    expect(text).to_have_value("")
    text.fill("x" * 81)
    page.get_by_test_id("checklist-save").click()
    expect(page.get_by_test_id("checklist-dialog").get_by_test_id("error-box")).to_contain_text("Line 1 has 81")
    page.get_by_test_id("checklist-suggested").click()
    expect(text).to_have_value(re.compile("Propellers"))
    # Closed by mistake: what was written is still there.
    page.keyboard.press("Escape")
    page.get_by_test_id("checklist-edit").click()
    expect(text).to_have_value(re.compile("Propellers"))
    saved(page, LIST)
    saved(page, "")
    page.get_by_test_id("checklist-before").click()
    expect(text).to_have_value(LIST)
    with page.expect_response(IS_KEPT):
        page.get_by_test_id("checklist-save").click()
    expect(page.get_by_test_id("checklist-changed")).to_contain_text(name)
    page.keyboard.press("Escape")

    connect(page, vehicle)
    upload(page)
    check(page)
    expect(page.get_by_test_id("next-start")).to_be_disabled()
    expect(page.get_by_test_id("next-action")).to_contain_text("Tick the checklist first: 3 points")
    for number in (1, 2, 3):
        box = page.locator("label", has=page.get_by_test_id(f"tick-{number}")).bounding_box()
        assert box is not None
        assert box["height"] >= 44
    page.get_by_test_id("tick-1").check()
    page.get_by_test_id("tick-2").focus()
    page.keyboard.press("Space")
    expect(page.get_by_test_id("checklist-left")).to_have_text("1 of 3 open")
    expect(page.locator(".tick-by").first).to_contain_text(name)

    # Another text asks for all of it again, and says why.
    page.get_by_test_id("checklist-open").click()
    saved(page, LIST + "Wind will do\n")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("checklist-again")).to_contain_text("The list was changed")
    for number in (1, 2, 3, 4):
        page.get_by_test_id(f"tick-{number}").check()
    expect(page.get_by_test_id("checklist-left")).to_have_text("all ticked")
    start(page)
    return_home(page)
    open_recording(page)
    ticked = page.get_by_test_id("review-checklist")
    expect(ticked.locator(".tick-text")).to_have_text(
        ["Propellers are whole", "Battery is full", "Nobody is near", "Wind will do"]
    )
    expect(ticked.locator(".tick-by").last).to_contain_text(re.compile(rf"{re.escape(name)}, \d+:\d\d"))
