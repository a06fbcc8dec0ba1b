"""A whole Hedgehop in a process of its own, and a real browser that signs in to it."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from server.settings import default_console_dir
from telemetry.node_lock import running_nodes

# The browser renders in software while other tests keep the processors busy.
PATIENCE_MS = 90_000
expect.set_options(timeout=PATIENCE_MS)

# viser's page tries to evaluate a string, which the content security policy forbids, and goes on without.
KNOWN_ERROR = "Evaluating a string as JavaScript violates the following Content Security Policy directive"

GONE = "WebSocket connection to"
"""A page says so while its server is away, which one test brings about."""

REFUSED = re.compile(r"the server responded with a status of (400|409|422|502|504)\b")
"""What the server refuses, the page explains; the browser notes it as well."""

FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


class Station:
    """A running server; ``kill()`` is the power cut, ``start()`` the next morning."""

    def __init__(self, data_dir: Path, *arguments: str) -> None:
        self.data_dir, self._arguments = data_dir, arguments
        self.origin = self.link = ""
        self.start()

    def start(self) -> None:
        port = _free_port()
        command = [sys.executable, "-m", "server", "serve", "--port", str(port), "--data-dir", str(self.data_dir)]
        # Flights of other tests meet no obstacles: a later option wins.
        command.append("--no-demo-world")
        self._process = subprocess.Popen(
            [*command, *self._arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        self.origin = f"http://127.0.0.1:{port}"
        self.link = self._read_link()

    def _read_link(self) -> str:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if found := re.search(r"http://\S+/login\?token=\S+", line):
                return found.group(0)
        raise AssertionError(f"the server ended with {self._process.wait()} before it printed its sign-in link")

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        self._process.communicate()

    def stop(self) -> None:
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
            raise AssertionError("the server did not stop within 20 s of SIGTERM") from None
        finally:
            self._end_nodes()

    def _end_nodes(self) -> None:
        """With an armed vehicle they outlive their server on purpose."""
        for facts in running_nodes(self.data_dir / "run"):
            os.kill(facts.pid, signal.SIGKILL)


class SimulatedVehicle:
    """A vehicle at the demo plan's home that flies faster than time; ground stations connect to ``address``."""

    HOME = "37.7290205,14.9926236,1712.0"
    RTL_CM = 6000

    def __init__(self, *, speedup: float = 10.0) -> None:
        self.address = f"tcp:127.0.0.1:{_free_port()}"
        command = [sys.executable, "-m", "server", "sim", "--link", self.address.replace("tcp", "tcpin", 1)]
        command += ["--home", self.HOME, "--speedup", str(speedup), "--parameter", f"RTL_ALT={self.RTL_CM}"]
        self._process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        assert self._process.stdout is not None
        self.said = self._process.stdout.readline()

    def stop(self) -> None:
        """As when its battery is unplugged; more than once is no harm."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()


@pytest.fixture
def vehicle(console: None) -> Iterator[SimulatedVehicle]:
    flying = SimulatedVehicle()
    try:
        yield flying
    finally:
        flying.stop()


@pytest.fixture(scope="session")
def console() -> None:
    if not (default_console_dir() / "index.html").is_file():
        pytest.skip("the console is not built: make setup")


@pytest.fixture
def station(tmp_path: Path, console: None) -> Iterator[Station]:
    running = Station(tmp_path / "data")
    try:
        yield running
    finally:
        running.stop()


# Not for the session: while Playwright runs, no other test of this process can run an event loop.
@pytest.fixture(scope="module")
def browser(chromium_path: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=chromium_path, args=FLAGS)
        yield launched
        launched.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page that fails the test when it asks any other origin, or when the console logs an error."""
    context = browser.new_context(viewport={"width": 1366, "height": 768}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    asked: set[str] = set()
    errors: list[str] = []
    page.on("request", lambda request: asked.add("/".join(request.url.split("/")[:3])))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    context.close()
    errors = [error for error in errors if not error.startswith(GONE) and not REFUSED.search(error)]
    foreign = {origin for origin in asked if not origin.startswith(("http://127.0.0.1:", "data:", "blob:"))}
    assert not foreign
    assert not [error for error in errors if KNOWN_ERROR not in error]


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
