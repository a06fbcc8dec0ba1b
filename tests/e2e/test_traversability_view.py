"""Where to drive and where to land: worked out, looked at, searched and kept as files, in a real browser."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import IO

import pytest
from playwright.sync_api import Page, expect

from server.door.sensor_token import sensor_token
from tests.e2e.stations import Station
from tests.e2e.steps import again_and_again, choose, click_surface, drawn, open_demo

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

TIFF = (b"II*\x00", b"II+\x00")


def test_the_ground_is_worked_out_searched_for_landing_sites_and_kept(
    station: Station, page: Page, tmp_path: Path
) -> None:
    open_demo(page, station)
    page.keyboard.press("8")
    page.get_by_test_id("work-out").click()
    expect(page.get_by_test_id("traversability-status")).to_have_attribute("data-state", "ready")
    expect(page.get_by_test_id("ground-cells")).to_contain_text(re.compile(r"\d.*cells"))
    expect(page.get_by_test_id("ground-untraversable")).to_contain_text(re.compile(r"\d\s%"))
    # What was worked out is shown at once, with what its colours mean.
    expect(page.get_by_test_id("layer-traversability")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_role("list", name="Colours of the layer").first).to_contain_text("Untraversable")
    # Without a radar log there is one map.
    expect(page.get_by_test_id("map-layer-before")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("map-layer-probability")).to_be_disabled()

    page.get_by_test_id("sites-home").click()
    expect(page.get_by_test_id("site-row").first).to_contain_text(re.compile(r"Slope \d"))
    assert 1 <= page.get_by_test_id("site-row").count() <= 5
    expect(page.get_by_test_id("sites-near")).to_contain_text(re.compile(r"\d\.\d{7}"))

    with page.expect_download() as download:
        page.get_by_test_id("ground-before-tif").click()
    kept = tmp_path / "before.tif"
    download.value.save_as(kept)
    assert kept.read_bytes()[:4] in TIFF

    page.get_by_test_id("traversability-away").click()
    expect(page.get_by_test_id("ground-cells")).to_have_count(0)
    expect(page.get_by_test_id("layer-traversability")).to_have_count(0)


def test_landing_sites_are_looked_for_where_the_surface_was_clicked(station: Station, page_3d: Page) -> None:
    page = page_3d
    open_demo(page, station)
    drawn(page)
    page.keyboard.press("8")
    page.get_by_test_id("work-out").click()
    expect(page.get_by_test_id("ground-cells")).to_be_visible()
    page.get_by_test_id("view-top").click()
    page.get_by_test_id("sites-click").click()
    expect(page.get_by_test_id("tool-hint")).to_contain_text("land")
    near = page.get_by_test_id("sites-near")
    click_surface(page, (0.5, 0.5), lambda ms: expect(near).to_be_visible(timeout=ms))
    # The tool has been put down, and the plan is as it was.
    expect(page.get_by_test_id("tool-hint")).to_have_count(0)
    expect(page.get_by_test_id("undo")).to_be_disabled()


def test_a_file_that_is_no_radar_log_is_refused_where_it_was_opened(
    station: Station, page: Page, tmp_path: Path
) -> None:
    open_demo(page, station)
    page.keyboard.press("8")
    garbage = tmp_path / "wood.npz"
    garbage.write_bytes(b"PK\x03\x04 this is no radar log")
    choose(page, page.get_by_test_id("radar-log-open"), garbage)
    section = page.get_by_test_id("section-traversability")
    expect(section.get_by_test_id("error-box")).to_contain_text("wood.npz")
    expect(page.get_by_test_id("work-out")).to_be_enabled()


def scanning(agent: IO[str]) -> contextlib.AbstractContextManager[None]:
    """Scan after scan: without any for two seconds a radar counts as silent."""
    scan = json.dumps({"type": "uwb", "intensity": [8.0] * 64})
    return again_and_again(lambda: print(scan, file=agent, flush=True), 0.05)


def test_a_radar_that_scans_now_is_shown_and_its_silence_is_told(station: Station, page: Page, tmp_path: Path) -> None:
    """Without a vehicle no scan has a place: that is said as well, and none is fused."""
    open_demo(page, station)
    page.keyboard.press("8")
    live = page.get_by_test_id("live-radar")
    expect(live).to_have_count(0)
    token = tmp_path / "token.txt"
    token.write_text(sensor_token(station.data_dir))
    command = [sys.executable, "-m", "server", "agent", station.origin, "--token-file", str(token), "--name", "rover"]
    with subprocess.Popen([*command, "--json"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as agent:
        assert agent.stdin is not None
        assert agent.stdout is not None
        print('{"type": "uwb"}', file=agent.stdin, flush=True)
        with scanning(agent.stdin):
            expect(live).to_have_attribute("data-state", "live")
            expect(live).to_contain_text("rover: ")
            expect(live).to_contain_text("left out: where the vehicle was is not known")
        page.get_by_test_id("uwb-fusion").locator("summary").first.click()
        page.get_by_test_id("uwb-rule").select_option("paper")
        page.get_by_test_id("fuse-live").click()
        expect(live).to_contain_text("paper")
        expect(live).to_have_attribute("data-state", "silent")
        expect(live.get_by_role("alert")).to_contain_text(re.compile(r"sent nothing for \d+ s"))
        agent.stdin.close()
        lines = json.loads(agent.stdout.read())["lines"]
    assert (lines["bad"], lines["reasons"]) == (1, {"a field is missing": 1})
    page.get_by_test_id("work-out").click()
    expect(page.get_by_test_id("ground-cells")).to_be_visible()
    page.get_by_test_id("traversability-away").click()
    expect(live).to_have_count(0)
