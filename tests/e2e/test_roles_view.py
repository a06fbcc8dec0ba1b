"""Several people at one station: who is in charge, who may come in, and what those who look on can do."""

from __future__ import annotations

import contextlib
import itertools
import json
import re
import socket
import time
from collections.abc import Iterator

import httpx
import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from server.schemas import AlarmDoc, AlarmsMessage, ErrorDoc
from telemetry.link.audit import open_audit
from telemetry.link.keys import audit_key_file
from telemetry.topics.messages import CommandRecord
from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import PATIENCE_MS, STREAM, again_and_again, certified, connect, enter, hold, open_demo
from tests.free_ports import free_port
from tests.server.station import ok
from tests.telemetry.frames import heartbeat, packed

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

ENTRANCES = "button, input, select, textarea, summary"


def invited(station: Station, name: str, role: str) -> str:
    """A one-time link; whoever had this name before is out."""
    station.http.delete(f"/api/accounts/{name}")
    return ok(station.http.post("/api/accounts", json={"name": name, "role": role})).json()["link"]


def test_control_is_taken_by_a_press_asked_for_and_free_once_nobody_is_heard(
    station: Station, page: Page, other_page: Page
) -> None:
    enter(page, station)
    ok(station.http.post("/api/lease/release"))
    page.get_by_test_id("tab-fly").click()
    who = page.get_by_test_id("chip-operator")
    expect(who).to_contain_text("Nobody in charge")
    hold(page, "take-control")
    expect(who).to_contain_text("In charge")

    other_page.goto(invited(station, "Ada", "operator"))
    other_page.get_by_test_id("tab-fly").click()
    expect(other_page.get_by_test_id("chip-operator")).to_contain_text("Looking on")
    ask = other_page.get_by_test_id("take-control")
    expect(ask).to_contain_text("Ask for control")
    hold(other_page, "take-control")
    asked = page.get_by_test_id("asked")
    expect(asked).to_contain_text("Ada asks for control of the vehicle")
    page.get_by_test_id("keep-control").click()
    expect(asked).to_have_count(0)
    expect(other_page.get_by_test_id("toast")).to_contain_text("keeps control")

    expect(ask).to_contain_text("Ask for control")
    hold(other_page, "take-control")
    page.get_by_test_id("hand-over").click()
    expect(other_page.get_by_test_id("chip-operator")).to_contain_text("In charge")
    expect(who).to_contain_text("Looking on")
    expect(page.get_by_test_id("vehicle-strip")).to_contain_text("Ada is in charge")

    other_page.close()
    expect(page.get_by_test_id("vehicle-strip")).to_contain_text("Ada is in charge, silent")
    expect(page.get_by_test_id("take-control")).to_contain_text("Take control")
    hold(page, "take-control")
    expect(who).to_contain_text("In charge")


def test_people_are_invited_come_in_once_and_are_signed_out(station: Station, page: Page, other_page: Page) -> None:
    for name in ("Olga", "Bea"):
        station.http.delete(f"/api/accounts/{name}")
    enter(page, station)
    page.get_by_test_id("accounts").click()
    for name, role in (("Olga", "observer"), ("Bea", "operator")):
        page.get_by_test_id("account-name").fill(name)
        page.get_by_test_id("account-role").select_option(role)
        page.get_by_test_id("account-add").click()
        expect(page.get_by_test_id("account-row").filter(has_text=name)).to_contain_text(role)
        expect(page.get_by_test_id("invitation")).to_contain_text(f"signs {name} in once")
    link = page.get_by_test_id("invitation").locator("code").inner_text()

    other_page.goto(link)
    expect(other_page.get_by_test_id("verdict")).to_be_visible()
    again = httpx.get(link, timeout=PATIENCE_MS / 1000)
    assert again.status_code == 401
    assert "has been used" in again.text

    bea = page.get_by_test_id("session-row").filter(has_text="Bea")
    bea.get_by_role("button", name="Sign out").click()
    expect(other_page).to_have_url(re.compile(r"/signin\?ended=true"))
    expect(other_page.get_by_text("Your session has ended")).to_be_visible()
    expect(bea).to_have_count(0)
    page.get_by_title("Remove Olga").click()
    expect(page.get_by_test_id("account-row").filter(has_text="Olga")).to_have_count(0)


def test_an_observer_sees_everything_and_nothing_that_is_pressed_changes_anything(
    station: Station, page: Page, other_page: Page
) -> None:
    open_demo(page, station)
    before = station.state["plan"]["revision"]
    asked: list[str] = []
    other_page.on("request", lambda request: asked.append(f"{request.method} {request.url}"))
    other_page.goto(invited(station, "Olga", "observer"))
    certified(other_page)
    for tab in ("plan", "fly", "review"):
        other_page.get_by_test_id(f"tab-{tab}").click()
        other_page.evaluate(UNFOLD)
        assert other_page.evaluate(SILENT_ABOUT_WHY) == []
        other_page.evaluate(PRESS_ALL, tab)
    other_page.get_by_test_id("tab-plan").click()
    other_page.get_by_test_id("plans-button").click()
    expect(other_page.get_by_test_id("plans-dialog")).to_be_visible()
    expect(other_page.get_by_test_id("plan-new")).to_be_disabled()
    assert other_page.evaluate(SILENT_ABOUT_WHY) == []
    other_page.keyboard.press("Escape")
    other_page.evaluate("document.activeElement.blur()")  # else Space presses what has the focus
    for key in ("Control+z", "Control+s", "Control+o", "a", "Delete", "k", "Space", "ArrowRight", "f", "t"):
        other_page.keyboard.press(key)
    expect(other_page.locator("dialog[open]")).to_have_count(0)
    other_page.evaluate(DROP)
    expect(other_page.get_by_test_id("drop-veil")).to_contain_text("You are an observer")
    other_page.evaluate(LET_GO)
    expect(other_page.get_by_test_id("drop-veil")).to_have_count(0)

    expect(other_page.get_by_test_id("toast")).to_have_count(0)
    expect(other_page.get_by_test_id("error-box")).to_have_count(0)
    assert [request for request in asked if not request.startswith("GET ")] == []
    assert station.state["plan"]["revision"] == before


UNFOLD = """() => {
  document.querySelectorAll(".section > h2 > button[aria-expanded=false]").forEach((head) => head.click());
}"""

PRESS_ALL = f"""async (tab) => {{
  const left = /^(tab-|sign-out|export)/;
  for (const control of [...document.querySelectorAll(".app :is({ENTRANCES})")]) {{
    const isShown = control.isConnected && control.getClientRects().length > 0;
    if (!isShown || control.matches(":disabled") || left.test(control.dataset.testid ?? "")) continue;
    control.click();
    control.dispatchEvent(new Event("change", {{ bubbles: true }}));
    await new Promise((then) => requestAnimationFrame(() => setTimeout(then)));
    document.querySelectorAll("dialog[open]").forEach((dialog) => dialog.close());
    document.querySelector(`[data-testid=tab-${{tab}}]`).click();
  }}
}}"""
"""What can be pressed on a view, once each; what it opens is shut again."""

SILENT_ABOUT_WHY = f"""() => [...document.querySelectorAll(":is({ENTRANCES}):disabled")].filter((control) => {{
  const around = control.closest("fieldset:disabled[title]") ?? control;
  return control.getClientRects().length > 0 && around.title === "";
}}).map((control) => control.outerHTML)"""

DROP = """() => {
  const carried = new DataTransfer();
  carried.items.add(new File(["x"], "model.tif"));
  window.carried = carried;
  window.dispatchEvent(new DragEvent("dragenter", { dataTransfer: carried, cancelable: true }));
}"""
LET_GO = """() => document.querySelector("[data-testid=drop-veil]").dispatchEvent(
  new DragEvent("drop", { dataTransfer: window.carried, bubbles: true, cancelable: true }))"""


def test_a_log_of_commands_that_somebody_changed_is_an_alarm_on_every_page(
    station: Station, page: Page, other_page: Page
) -> None:
    log = station.data_dir / "audit.jsonl"
    before = log.read_bytes() if log.exists() else b""
    enter(page, station)
    other_page.goto(invited(station, "Olga", "observer"))
    try:
        if not before:
            with open_audit(log, audit_key_file(station.data_dir)) as audit:
                audit.write(CommandRecord(time.time(), "Ada", "arm"))
        page.get_by_test_id("accounts").click()
        page.get_by_test_id("audit-open").click()
        page.get_by_test_id("audit-verify").click()
        expect(page.get_by_test_id("audit-verdict")).to_contain_text("The audit log is whole")
        expect(page.get_by_test_id("audit-row").first).to_be_visible()

        with log.open("ab") as file:
            file.write(b'{"words":"disarm"}\n')
        page.get_by_test_id("audit-verify").click()
        expect(page.get_by_test_id("audit-verdict")).to_contain_text("BROKEN at line")
        with page.expect_download() as exported:
            page.get_by_test_id("audit-export").click()
        assert exported.value.suggested_filename == "hedgehop-audit.zip"

        alarm = other_page.get_by_test_id("alarm")
        expect(alarm).to_contain_text("BROKEN at line")
        expect(alarm).to_contain_text("Keep a copy of the log")
        other_page.get_by_test_id("alarm-audit").click()
        expect(other_page.get_by_test_id("audit-verdict")).to_have_attribute("data-state", "broken")
        expect(other_page.get_by_test_id("audit-verify")).to_be_disabled()
        other_page.keyboard.press("Escape")
        other_page.get_by_test_id("alarm-read").click()
        expect(alarm).to_have_count(0)
        other_page.get_by_test_id("notices").click()
        expect(alarm).to_contain_text("BROKEN at line")
    finally:
        log.write_bytes(before)
        ok(station.http.post("/api/audit/verify"))
    expect(alarm).to_have_count(0)


FULL = AlarmsMessage(
    alarms=[
        AlarmDoc(
            kind="disk", level="error", began_utc_s=1000.0, error=ErrorDoc(code="disk_full", what="The disk is full.")
        )
    ]
)


def _with_a_full_disk(page_side: WebSocketRoute) -> None:
    server = page_side.connect_to_server()

    def pass_on(text: str | bytes) -> None:
        page_side.send(FULL.model_dump_json() if json.loads(text)["type"] == "alarms" else text)

    server.on_message(pass_on)


def test_from_the_alarm_of_a_full_disk_the_largest_recording_goes_in_two_presses(station: Station, page: Page) -> None:
    folder = station.data_dir / "recordings"
    for name, size in (("small.tlog", 10_000), ("large.tlog", 90_000), ("other.tlog", 20_000)):
        (folder / name).write_bytes(bytes(size))
    listed = ok(station.http.get("/api/recordings")).json()
    (other,) = (recording for recording in listed if recording["name"] == "other.tlog")
    ok(station.http.delete(f"/api/recordings/{other['id']}"))

    page.context.route_web_socket(STREAM, _with_a_full_disk)
    enter(page, station)
    page.get_by_test_id("alarm-space").click()
    rows = page.get_by_test_id("space-row")
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("large.tlog")
    rows.first.get_by_test_id("space-delete").click()
    page.get_by_test_id("space-delete-confirm").click()
    expect(rows).to_have_count(1)
    assert not (folder / "large.tlog").exists()
    page.get_by_test_id("space-by-date").click()
    expect(page.locator("th[aria-sort=ascending]")).to_contain_text("oldest first")


def test_signing_is_set_up_by_one_hold_and_switched_off_in_an_emergency(
    station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    enter(page, station)
    connect(page, vehicle)
    page.locator("[data-section=connection] > h2 > button[aria-expanded=false]").click()
    state = page.get_by_test_id("signing-state")
    expect(state).to_contain_text("Not signed")
    hold(page, "signing-on")
    expect(state).to_have_text("Signed")
    hold(page, "signing-off")
    expect(state).to_contain_text("Switched off: unsigned messages are accepted")


@contextlib.contextmanager
def radio(port: int) -> Iterator[None]:
    """A vehicle that says no more than that it is there, from a port of its own."""
    sequences = itertools.cycle(range(256))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:

        def beat() -> None:
            with contextlib.suppress(ConnectionRefusedError):
                out.sendto(packed(heartbeat(), system=7, component=1, sequence=next(sequences)), ("127.0.0.1", port))

        with again_and_again(beat, 0.1):
            yield


def test_a_vehicle_that_comes_back_from_another_port_is_taken_by_one_press(station: Station, page: Page) -> None:
    port = free_port()
    address = f"udpin:127.0.0.1:{port}"
    enter(page, station)
    page.get_by_test_id("tab-fly").click()
    page.get_by_test_id("link-address").fill(address)
    try:
        with radio(port):
            page.get_by_test_id("link-connect").click()
            expect(page.get_by_test_id("hold-position")).to_be_visible()
        with radio(port):
            expect(page.get_by_test_id("heard-elsewhere")).to_contain_text("is heard from")
            page.get_by_test_id("next-again").click()
            expect(page.get_by_test_id("heard-elsewhere")).to_have_count(0)
            expect(page.get_by_test_id("chip-link")).not_to_contain_text("lost")
    finally:
        station.http.post("/api/link/disconnect", json={"address": address})
