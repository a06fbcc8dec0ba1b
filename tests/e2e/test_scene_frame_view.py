"""The 3D view's frame holds the picture and nothing of viser's own page, however narrow it is."""

from __future__ import annotations

import contextlib
import re

import pytest
from playwright.sync_api import Frame, Page, WebSocketRoute, expect

from tests.e2e.conftest import VIEW
from tests.e2e.stations import Station
from tests.e2e.steps import STREAM, drawn, open_demo, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

SIZES = ((1440, 900), (1180, 820), (1100, 768), (1024, 768), (820, 1180), (390, 844))
NARROW_PX = 576
"""Below it viser shows its panel in another form."""

IN_FRONT = """() => {
  const steps = [...Array(12).keys()].map((step) => (step + 0.5) / 12);
  const hit = steps.flatMap((x) => steps.map((y) => document.elementFromPoint(x * innerWidth, y * innerHeight)));
  return [...new Set(hit.filter((one) => one && one.tagName !== "CANVAS" && !one.querySelector("canvas"))
    .map((one) => one.outerHTML.slice(0, 120)))];
}"""
"""What of the frame's page takes clicks before its canvas does."""


TWO_PICTURES = """() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))"""
"""By the second one the page has taken its new size."""


def test_nothing_lies_over_the_picture(station: Station, page_3d: Page) -> None:
    open_demo(page_3d, station)
    drawn(page_3d)
    view = _view(page_3d)
    widths_px = []
    for width, height in SIZES:
        page_3d.set_viewport_size({"width": width, "height": height})
        view.evaluate(TWO_PICTURES)
        widths_px.append(view.evaluate("innerWidth"))
        with contextlib.suppress(AssertionError):
            wait_until(page_3d, lambda: view.evaluate(IN_FRONT) == [])
        assert view.evaluate(IN_FRONT) == [], f"{width} px: something covers the picture"
        expect(view.locator(".mantine-Paper-root:visible, [data-floating-window]:visible")).to_have_count(0)
    assert min(widths_px) < NARROW_PX < max(widths_px)


def test_a_stream_that_breaks_off_leaves_the_3d_view_as_it_is(station: Station, page: Page) -> None:
    streams = list[WebSocketRoute]()

    def opened(page_side: WebSocketRoute) -> None:
        streams.append(page_side)
        page_side.connect_to_server()

    page.context.route_web_socket(STREAM, opened)
    visit(page, station)
    handle = page.get_by_test_id("view-frame").element_handle()
    view = handle.content_frame() if handle is not None else None
    assert view is not None
    # The page that the frame is opened for: a mark on the empty one before it would go with that.
    view.wait_for_url(VIEW)
    view.evaluate("() => { window.isTheSame = true }")
    streams[0].close(code=4408)
    wait_until(page, lambda: len(streams) >= 2)
    expect(page.get_by_test_id("link-state")).to_have_class(re.compile(r"\bopen\b"))
    assert page.get_by_test_id("view-frame").count() == 1
    assert view.evaluate("() => window.isTheSame") is True


def _view(page: Page) -> Frame:
    handle = page.get_by_test_id("view-frame").element_handle()
    assert handle is not None
    frame = handle.content_frame()
    assert frame is not None
    frame.wait_for_selector("canvas")
    # viser's own page comes up in pieces: its panel after the canvas.
    frame.wait_for_selector(".mantine-Notifications-root", state="attached")
    return frame
