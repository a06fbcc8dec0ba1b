"""The pages of Help from the console: by the sheet, by a key, and from page to page, in a real browser."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import visit

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_help_is_read_beside_the_console(station: Station, page: Page) -> None:
    visit(page, station)
    page.get_by_test_id("theme-toggle").click()
    page.keyboard.press("?")
    with page.context.expect_page() as opened:
        page.get_by_test_id("help-pages").get_by_role("link", name="Glossary").click()
    pages = opened.value
    expect(pages.get_by_role("heading", level=1)).to_have_text("Glossary")
    expect(pages.locator("html")).to_have_attribute("data-theme", "light")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("help-sheet")).to_have_count(0)

    # The same tab again: one is enough.
    page.keyboard.press("h")
    expect(pages).to_have_url(re.compile(r"/help/index\.html$"))
    assert len(page.context.pages) == 2

    picture = pages.get_by_role("img").first
    expect(picture).to_be_visible()
    # Its words may stand in its place while it is on its way.
    expect(picture).to_have_js_property("complete", True)
    assert picture.evaluate("image => image.naturalWidth") > 1000
    pages.get_by_role("navigation", name="Contents").get_by_role("link", name="Files on disk").click()
    expect(pages.get_by_role("heading", level=1)).to_have_text("Files on disk")
    pages.get_by_role("link", name="topic", exact=True).click()
    expect(pages.get_by_role("heading", level=1)).to_have_text("Bus topics")
    pages.get_by_role("link", name="recording", exact=True).click()
    expect(pages.get_by_role("heading", name="Recordings")).to_be_in_viewport()
