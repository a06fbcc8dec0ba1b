"""A recording of another ground station is opened, judged, played and steered in a real browser."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import Station
from tests.e2e.steps import PATIENCE_MS, choose, play, visit, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


@pytest.fixture
def reviewed(station: Station, page: Page, shared_data: Path) -> Page:
    """A page with a real autopilot's .tlog open, over the surface model that it was flown over."""
    visit(page, station)
    choose(page, page.get_by_test_id("terrain-file"), shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")
    expect(page.get_by_test_id("terrain-row").filter(has_text="coromandel")).to_have_class("current")
    page.get_by_test_id("tab-review").click()
    choose(page, page.get_by_test_id("recording-import"), _tlog(shared_data))
    expect(page.get_by_test_id("replay-badge")).to_be_visible()

    def takes_orders() -> bool:
        """It is judged and shown before its file is open to be played."""
        return station.http.post("/api/review/play", json={"playing": False}).is_success

    wait_until(page, takes_orders)
    return page


def test_a_tlog_is_judged_and_played(reviewed: Page) -> None:
    page = reviewed
    expect(page.get_by_test_id("recording-row")).to_contain_text("tlog")
    expect(page.get_by_test_id("completed")).to_have_text("completed")
    expect(page.get_by_test_id("cross-track-max")).to_contain_text(re.compile(r"\d\.\d\d\sm"))
    expect(page.get_by_test_id("flown-distance")).to_contain_text(re.compile(r"\d\.\d\d\sm"))

    page.get_by_test_id("time-chart-histogram").click()
    expect(page.get_by_test_id("histogram").locator("rect.column").first).to_be_visible()
    page.get_by_test_id("time-chart-cross_track").click()
    expect(page.get_by_test_id("playhead")).to_be_visible()

    page.get_by_test_id("review-part-instruments").click()
    play(page, "transport-play")
    expect(page.get_by_test_id("instruments-replay").get_by_test_id("above-home")).to_contain_text(re.compile(r"\d"))
    page.get_by_test_id("play").click()
    expect(page.get_by_test_id("play")).to_have_text("Play")


def test_chart_keys_and_events_steer_the_replay(reviewed: Page) -> None:
    page = reviewed
    chart = page.locator(".time-pane .u-over")
    expect(page.get_by_test_id("playhead")).to_be_visible()
    length_s = _seconds(page, last=True)

    def is_dragged_to() -> bool:
        """Again where the chart was made anew under the pointer: it is the place that counts."""
        box = chart.bounding_box()
        assert box is not None
        height = box["y"] + 0.5 * box["height"]
        page.mouse.move(box["x"] + 0.5 * box["width"], height)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.6 * box["width"], height, steps=5)
        page.mouse.up()
        with contextlib.suppress(AssertionError):
            _expect_time(page, 0.6 * length_s, timeout_ms=20_000)
            return True
        return False

    wait_until(page, is_dragged_to)

    page.locator(".time-pane header").click(position={"x": 400, "y": 4})
    page.keyboard.press("ArrowLeft")
    _expect_time(page, 0.6 * length_s - 10)
    page.keyboard.press("ArrowRight")
    _expect_time(page, 0.6 * length_s)

    page.get_by_test_id("review-part-events").click()
    event = page.get_by_test_id("review-event").nth(12)
    event_s = _code_s(event.inner_text())
    event.click()
    _expect_time(page, event_s)
    expect(page.locator("[data-testid=review-event][aria-current=time]")).to_have_count(1)


def test_a_recording_is_downloaded_closed_and_deleted(reviewed: Page, shared_data: Path) -> None:
    page = reviewed
    with page.expect_download() as download:
        page.get_by_test_id("recording-download").click()
    assert Path(download.value.path()).read_bytes() == _tlog(shared_data).read_bytes()
    page.get_by_test_id("review-close").click()
    expect(page.get_by_test_id("replay-badge")).to_have_count(0)
    page.get_by_test_id("recording-delete").click()
    page.get_by_test_id("recording-delete-confirm").click()
    expect(page.get_by_test_id("recording-row")).to_have_count(0)


def test_a_file_that_is_no_recording_is_explained(station: Station, page: Page, tmp_path: Path) -> None:
    visit(page, station)
    page.get_by_test_id("tab-review").click()
    fake = tmp_path / "flight.tlog"
    fake.write_text("not a recording", encoding="utf-8")
    choose(page, page.get_by_test_id("recording-import"), fake)
    expect(page.get_by_test_id("section-recordings").get_by_test_id("error-box")).to_contain_text("flight.tlog")


def _tlog(shared_data: Path) -> Path:
    return sorted((shared_data / "logs" / "arducopter").glob("*.tlog"))[0]


def _seconds(page: Page, *, last: bool = False) -> float:
    at, length = page.get_by_test_id("replay-time").inner_text().split("/")
    return _code_s(length if last else at)


def _code_s(text: str) -> float:
    """Of the first time code in a text, such as 3:07.4."""
    found = re.search(r"(\d+):(\d+\.\d)", text)
    assert found is not None, text
    return 60 * int(found.group(1)) + float(found.group(2))


def _expect_time(page: Page, wanted_s: float, timeout_ms: int = PATIENCE_MS) -> None:
    """Within a pixel or so of the chart."""
    wait_until(page, lambda: abs(_seconds(page) - wanted_s) < 1.5, timeout_ms)
