"""The vehicle's parameters in Fly: read, judged before a low flight, set, searched, compared."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import choose, connect, open_demo

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


def test_a_setting_is_judged_set_and_read_back_and_a_file_says_what_was(
    station: Station, page: Page, vehicle: SimulatedVehicle, tmp_path: Path
) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    page.get_by_test_id("open-parameters").click()
    dialog = page.get_by_test_id("parameters-dialog")
    expect(dialog).to_contain_text("Not read yet.")
    dialog.get_by_test_id("parameters-read").click()
    expect(dialog).to_contain_text("Of vehicle 1, ardupilot")
    expect(dialog.get_by_test_id("low-flight-about")).to_contain_text("Upload the plan to know more")

    dialog.get_by_test_id("parameters-part-all").click()
    with page.expect_download() as download:
        dialog.get_by_test_id("parameters-save").click()
    saved = tmp_path / "before.param"
    saved.write_bytes(Path(download.value.path()).read_bytes())
    before = re.search(r"^RTL_ALT,(\d+)$", saved.read_text(), re.MULTILINE)
    assert before is not None

    dialog.get_by_test_id("parameter-search").fill("rtl_alt")
    row = dialog.get_by_test_id("parameter").and_(page.locator("[data-name=RTL_ALT]"))
    row.locator("button").first.click()
    field = row.get_by_test_id("parameter-value")
    field.fill("twelve")
    field.press("Enter")
    expect(row).to_contain_text('"twelve" is no number.')
    expect(row.get_by_test_id("parameter-write")).to_be_disabled()
    field.fill(str(int(before.group(1)) + 700))
    field.press("Enter")
    row.get_by_test_id("parameter-write").click()
    expect(dialog.get_by_test_id("parameters-written")).to_contain_text("set, read back")

    choose(page, dialog.get_by_test_id("parameters-compare"), saved)
    expect(dialog.get_by_test_id("compared")).to_contain_text("1 different")
    expect(dialog.get_by_test_id("compared")).to_contain_text(f"file {before.group(1)}")
    dialog.get_by_role("button", name=f"Write {before.group(1)}").click()
    expect(row).to_contain_text(before.group(1))

    dialog.get_by_test_id("parameters-part-low").click()
    offered = dialog.get_by_test_id("set-it-so").first
    expect(offered).to_be_enabled()
    said = re.fullmatch(r"Set (\S+) to (\S+)", offered.inner_text().strip())
    assert said is not None
    # The very one that was read: what is offered first may change with what is judged anew.
    read = dialog.get_by_role("button", name=said.group(0))
    read.first.click()
    expect(dialog.get_by_test_id("parameters-written")).to_contain_text(said.group(1))
    expect(read).to_have_count(0)
