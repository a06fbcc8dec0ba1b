"""Stations that tests share, vehicles, and a real browser whose every page is watched."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, expect, sync_playwright

from server.settings import default_console_dir
from tests.e2e.stations import SimulatedVehicle, Station
from tests.e2e.steps import PATIENCE_MS

expect.set_options(timeout=PATIENCE_MS)

HERE = Path(__file__).parent

# viser's page tries to evaluate a string, which the content security policy forbids, and goes on without.
KNOWN_ERROR = "Evaluating a string as JavaScript violates the following Content Security Policy directive"

GONE = "WebSocket connection to"
"""A page says so while its server is away, which one test brings about."""

REFUSED = re.compile(r"responded with a status of ((400|409|422|502|504)\b|404 .* /api/obstacles/manoeuvre/\S+/fly$)")
"""What the server refuses, the page explains; the browser notes it as well. A way past something may have gone by the
time its button has been held for long enough."""

FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # Pages are put together without it: a third of a processor would do nothing else than that.
    "--disable-gpu-compositing",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

VIEW = re.compile(r"/view/[^/]+/(\?.*)?$")
"""The 3D view's page, a frame within the console."""

SELDOM = """
if (location.pathname.startsWith("/view/")) {
  const address = new URL(location.href);
  address.searchParams.set("fixedDpr", "0.5");
  history.replaceState(null, "", address);
  const draw = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) => setTimeout(() => draw(callback), 800);
  window.cancelAnimationFrame = clearTimeout;
}
"""
"""Each picture of the 3D view takes a processor that renders it in software up to half a second, a quarter of that at
half its size: drawn without pauses they would leave little to everything that is being tested."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sensors keep a processor busy: the station that has some is started last."""
    places = [place for place, item in enumerate(items) if item.path.is_relative_to(HERE)]
    last = sorted((items[place] for place in places), key=_has_sensors)
    for place, item in zip(places, last, strict=True):
        items[place] = item


def _has_sensors(item: pytest.Item) -> bool:
    return isinstance(item, pytest.Function) and "sighted" in item.fixturenames


@pytest.fixture(scope="session")
def console() -> None:
    if not (default_console_dir() / "index.html").is_file():
        pytest.skip("the console is not built: make setup")


@pytest.fixture(scope="package")
def shared_station(tmp_path_factory: pytest.TempPathFactory, console: None) -> Iterator[Station]:
    with _running(tmp_path_factory.mktemp("data")) as station:
        yield station


@pytest.fixture
def station(shared_station: Station) -> Station:
    """With an empty plan; tests that kill theirs have one of their own."""
    shared_station.clear()
    return shared_station


@pytest.fixture
def own_station(tmp_path: Path, console: None) -> Iterator[Station]:
    with _running(tmp_path / "data") as station:
        yield station


@pytest.fixture(scope="module")
def sighted(tmp_path_factory: pytest.TempPathFactory, console: None) -> Iterator[Station]:
    """A station whose demo stands in a world with things that the surface model does not know."""
    with _running(tmp_path_factory.mktemp("data"), "--demo-world") as station:
        yield station


@pytest.fixture
def vehicle(station: Station) -> Iterator[SimulatedVehicle]:
    with simulated_vehicle() as flying:
        yield flying
        # Else what it flew goes on being written for a while, and is listed in the middle of a later test.
        station.http.post("/api/recorder/stop")
        # Before it is gone: the next test's station has never heard of it.
        station.http.post("/api/link/disconnect", json={"address": flying.address})


@contextmanager
def simulated_vehicle() -> Iterator[SimulatedVehicle]:
    flying = SimulatedVehicle()
    try:
        yield flying
    finally:
        flying.stop()


@contextmanager
def _running(data_dir: Path, *arguments: str) -> Iterator[Station]:
    station = Station(data_dir, *arguments)
    try:
        yield station
    finally:
        station.stop()


# Not for the session: while Playwright runs, no other test of this process can run an event loop.
@pytest.fixture(scope="package")
def browser(chromium_path: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=chromium_path, args=FLAGS)
        yield launched
        launched.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    yield from _flat_page(browser)


@pytest.fixture
def other_page(browser: Browser) -> Iterator[Page]:
    """Of somebody else, in a browser of their own."""
    yield from _flat_page(browser)


def _flat_page(browser: Browser) -> Iterator[Page]:
    """Its 3D view stays empty: what it costs to render in software would slow down everything else."""
    with _watched(browser) as context:
        context.route(
            VIEW, lambda route: route.fulfill(content_type="text/html", body="<!doctype html><title>3D</title>")
        )
        yield _opened(context)


@pytest.fixture
def page_3d(browser: Browser) -> Iterator[Page]:
    """With the real 3D view."""
    with _watched(browser) as context:
        context.add_init_script(SELDOM)
        yield _opened(context)


def _opened(context: BrowserContext) -> Page:
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    return page


def _said(message: ConsoleMessage) -> str:
    """With the path of what it is about."""
    return f"{message.text} {urlsplit(message.location['url']).path}"


@contextmanager
def _watched(browser: Browser) -> Iterator[BrowserContext]:
    """Fails the test when one of its pages asks any other origin, or when its console logs an error."""
    # What slides in is where it stays: a place that a test reads or presses does not move on.
    context = browser.new_context(
        viewport={"width": 1366, "height": 768}, accept_downloads=True, reduced_motion="reduce"
    )
    asked: set[str] = set()
    errors: list[str] = []
    context.on("request", lambda request: asked.add("/".join(request.url.split("/")[:3])))
    context.on("console", lambda message: errors.append(_said(message)) if message.type == "error" else None)
    context.on("weberror", lambda error: errors.append(str(error.error)))
    try:
        yield context
    finally:
        context.close()
    errors = [error for error in errors if not error.startswith(GONE) and not REFUSED.search(error)]
    foreign = {origin for origin in asked if not origin.startswith(("http://127.0.0.1:", "data:", "blob:"))}
    assert not foreign
    assert not [error for error in errors if KNOWN_ERROR not in error]
