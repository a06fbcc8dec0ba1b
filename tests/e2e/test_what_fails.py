"""What a page says and offers while what stands between it and the vehicle has failed."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import socket
import threading
import time
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import BrowserContext, Page, Request, WebSocketRoute, expect

from server.schemas import NodeDoc, NodesMessage
from tests.e2e.conftest import simulated_vehicle
from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import STREAM, connect, enter, open_demo, upload, wait_until

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]


class Stream:
    """Between the pages and the server: passes everything on, until it is told otherwise."""

    def __init__(self, context: BrowserContext) -> None:
        self._page_side: WebSocketRoute | None = None
        self._left_out: frozenset[str] = frozenset()
        self.is_silent = False
        """As a server that hangs: its sockets stay open."""
        context.route_web_socket(STREAM, self._opened)

    def link_is(self, state: Literal["running", "silent", "restarting"]) -> None:
        """Of the process that commands the vehicle, whatever it is in truth."""
        assert self._page_side is not None
        self._left_out = frozenset({"nodes"})
        node = NodeDoc(name="link", state=state, restarts=0, text="")
        self._page_side.send(NodesMessage(nodes=[node]).model_dump_json())

    def _opened(self, page_side: WebSocketRoute) -> None:
        self._page_side = page_side
        server = page_side.connect_to_server()

        def pass_on(text: str | bytes) -> None:
            if not self.is_silent and json.loads(text)["type"] not in self._left_out:
                page_side.send(text)

        server.on_message(pass_on)


@pytest.fixture
def stream(page: Page) -> Stream:
    return Stream(page.context)


SLOW_BYTES_PER_S = 200
"""Less than what is urgent of a vehicle that stands, deflated."""


class Line:
    """A way to a station that can be cut, or be slow: then it takes no more than so much and holds next to nothing."""

    def __init__(self) -> None:
        self.is_slow = False
        self.asked: list[str] = []
        """The first request of each connection."""
        self._to = 0
        self._free_s = 0.0
        self._lock = threading.Lock()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._accepting: threading.Thread | None = None
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self.host = f"127.0.0.1:{self._listening.getsockname()[1]}"

    def lead_to(self, port: int) -> None:
        self._to = port
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def _accept(self) -> None:
        while True:
            try:
                page, _ = self._listening.accept()
            except OSError:
                return
            server = socket.socket()
            server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            try:
                server.connect(("127.0.0.1", self._to))
            except OSError:
                page.close()
                server.close()
                continue
            with self._lock:
                self._pairs.append((page, server))
            for source, sink, is_limited in ((page, server, False), (server, page, True)):
                threading.Thread(target=self._pass_on, args=(source, sink, is_limited), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket, is_limited: bool) -> None:
        is_first = not is_limited
        with contextlib.suppress(OSError):
            while data := source.recv(1460):
                if is_first:
                    is_first = False
                    self.asked.append(data.decode("latin-1").partition("\r\n")[0])
                if is_limited and self.is_slow:
                    self._wait(len(data))
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)

    def cut(self) -> None:
        """All that goes over it; what is asked after that passes again."""
        with self._lock:
            pairs, self._pairs = self._pairs, []
        for one in itertools.chain.from_iterable(pairs):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def close(self) -> None:
        """Nothing is taken any more, and then nothing is open any more."""
        self._listening.shutdown(socket.SHUT_RDWR)
        if self._accepting is not None:
            self._accepting.join()
        self._listening.close()
        self.cut()

    def _wait(self, size: int) -> None:
        with self._lock:
            self._free_s = max(self._free_s, time.monotonic()) + size / SLOW_BYTES_PER_S
            pause_s = self._free_s - time.monotonic()
        time.sleep(max(0.0, pause_s))


def test_after_its_line_was_cut_a_page_and_its_3d_view_come_back(page_3d: Page, tmp_path: Path, console: None) -> None:
    line = Line()
    station = Station(tmp_path / "data", environment={**os.environ, "HEDGEHOP_ALLOWED_HOSTS": line.host})
    try:
        line.lead_to(int(station.origin.rpartition(":")[2]))
        begun, ended = list[Request](), list[Request]()
        page_3d.on("request", lambda request: begun.append(request))
        page_3d.on("requestfinished", lambda request: ended.append(request))
        page_3d.on("requestfailed", lambda request: ended.append(request))
        enter(page_3d, station, f"http://{line.host}")
        page_3d.get_by_test_id("tab-plan").click()  # the console has the focus

        def views() -> list[str]:
            return [asked for asked in line.asked if asked.startswith("GET /view/") and "/ HTTP" not in asked]

        wait_until(page_3d, lambda: bool(views()))
        src = page_3d.get_by_test_id("view-frame").get_attribute("src")

        def has_all() -> bool:
            """The browser's console tells a request that was cut off as an error."""
            told = len(begun)
            page_3d.wait_for_timeout(1000)
            return told == len(begun) == len(ended)

        wait_until(page_3d, has_all)
        before = len(views())
        line.cut()
        expect(page_3d.get_by_test_id("link-state")).to_have_class(re.compile(r"\bopen\b"))

        def is_connected() -> bool:
            """Another one was asked for, and since then none: it tries each second."""
            tried = len(views())
            page_3d.wait_for_timeout(3000)
            return before < tried == len(views())

        wait_until(page_3d, is_connected)
        assert page_3d.get_by_test_id("view-frame").get_attribute("src") == src
        page_3d.close()
    finally:
        station.stop()
        line.close()


def test_over_a_slow_line_values_are_as_old_as_they_are(page: Page, tmp_path: Path, console: None) -> None:
    line = Line()
    station = Station(tmp_path / "data", environment={**os.environ, "HEDGEHOP_ALLOWED_HOSTS": line.host})
    try:
        line.lead_to(int(station.origin.rpartition(":")[2]))
        with simulated_vehicle() as vehicle:
            enter(page, station, f"http://{line.host}")
            connect(page, vehicle)
            expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "false")
            line.is_slow = True
            expect(page.get_by_test_id("link-state")).to_contain_text(re.compile(r"Page \d+\ss late|silent"))
            expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "true")
            line.is_slow = False
            expect(page.get_by_test_id("link-state")).to_contain_text("Connected")
            expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "false")
            page.close()
    finally:
        station.stop()
        line.close()


def test_while_the_link_has_failed_nothing_is_offered_that_it_would_do(
    station: Station, page: Page, stream: Stream, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    connection = page.locator("[data-section=connection]")
    expect(connection).to_contain_text("%")
    expect(page.get_by_test_id("next-upload")).to_be_enabled()

    stream.link_is("silent")
    expect(page.get_by_test_id("safety-why")).to_contain_text("transmitter")
    expect(connection).to_contain_text("Link failed")
    expect(connection).not_to_contain_text("%")
    connection.get_by_role("button", name="Connection").click()
    expect(connection.get_by_test_id("connection-row").first).to_contain_text("not known now")
    expect(connection.get_by_test_id("signing-state")).to_have_text("not known now")
    for command in ("next-upload", "arm", "hold-position", "return-home"):
        expect(page.get_by_test_id(command)).to_be_disabled()
    expect(page.get_by_test_id("next-action")).to_contain_text("The link has failed")
    for chip in ("chip-mode", "chip-gnss", "chip-battery"):
        expect(page.get_by_test_id(chip)).to_have_class(re.compile(r"\bold\b"))
    expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "true")
    page.get_by_test_id("tab-plan").click()
    expect(page.get_by_test_id("upload")).to_be_disabled()

    stream.link_is("running")
    expect(page.get_by_test_id("upload")).to_be_enabled()
    upload(page)
    page.get_by_test_id("next-check").click()
    good = page.locator("[data-testid=check-row][data-state=good]")
    expect(good.first).to_be_visible()
    stream.link_is("restarting")
    expect(good).to_have_count(0)
    expect(page.get_by_test_id("check-again")).to_be_disabled()
    for way in ("way-auto", "way-guided"):
        expect(page.get_by_test_id(way)).to_be_disabled()


def test_a_server_that_is_silent_is_said_and_nobody_waits_for_its_answers(
    station: Station, page: Page, stream: Stream, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, station)
    connect(page, vehicle)
    arm = page.get_by_test_id("arm")
    page.context.route("**/api/flight/arm", lambda route: None)
    for _ in range(2):  # as assistive technology does
        arm.evaluate("button => button.click()")
    expect(page.get_by_test_id("section-flight")).to_contain_text("No answer yet: it is not known whether this arrived")
    expect(arm).to_have_attribute("aria-disabled", "false")

    stream.is_silent = True
    expect(page.get_by_test_id("link-state")).to_contain_text("silent")
    expect(page.get_by_test_id("safety-why")).to_contain_text("transmitter")
    expect(page.get_by_test_id("link-lost")).to_contain_text("The server is silent")
    expect(page.get_by_test_id("chip-operator")).to_have_text("Was in charge")
    expect(page.get_by_test_id("chip-link")).to_contain_text("No server")
    expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "true")
    for command in ("next-upload", "arm", "hold-position", "return-home"):
        expect(page.get_by_test_id(command)).to_be_disabled()

    stream.is_silent = False
    expect(page.get_by_test_id("link-state")).to_contain_text("Connected")
    expect(page.get_by_test_id("tiles")).to_have_attribute("data-old", "false")
    expect(page.get_by_test_id("safety-why")).to_have_count(0)
    expect(page.get_by_test_id("chip-operator")).to_have_text("In charge")
    expect(arm).to_be_enabled()


def test_without_its_server_a_page_says_so_and_the_plan_survives_the_power_cut(
    own_station: Station, page: Page, vehicle: SimulatedVehicle
) -> None:
    open_demo(page, own_station)
    name = page.get_by_test_id("poi-name").first
    name.fill("Cairn <b>1</b>")
    name.press("Enter")
    expect(page.get_by_test_id("undo")).to_be_enabled()
    expect(page.get_by_test_id("saved-state")).to_contain_text("Saved")
    connect(page, vehicle)
    own_station.kill()
    expect(page.get_by_test_id("safety-why")).to_contain_text("transmitter")
    expect(page.get_by_test_id("hold-position")).to_be_disabled()
    expect(page.get_by_test_id("return-home")).to_be_disabled()

    own_station.start()
    page.goto(own_station.link)
    page.get_by_test_id("tab-plan").click()
    expect(name).to_have_value("Cairn <b>1</b>")
    page.get_by_test_id("undo").click()
    expect(name).not_to_have_value("Cairn <b>1</b>")
