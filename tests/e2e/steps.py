"""Steps of an operator that several tests take, each with what shows that it is done."""

from __future__ import annotations

import contextlib
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from playwright.sync_api import Locator, Page, TimeoutError, expect

from tests.e2e.stations import SimulatedVehicle, Station

PATIENCE_MS = 90_000
"""The browser renders in software while other tests keep the processors busy."""
LONG_MS = 3 * PATIENCE_MS
"""A flight goes by the clock."""

STREAM = re.compile(r"/ws(\?|$)")
"""A page's own stream, also when it comes back as the page that it was."""


def wait_until(page: Page, condition: Callable[[], bool], timeout_ms: int = PATIENCE_MS) -> None:
    end_s = time.monotonic() + timeout_ms / 1000
    while time.monotonic() < end_s:
        if condition():
            return
        page.wait_for_timeout(200)
    raise AssertionError("not within the time allowed")


@contextlib.contextmanager
def again_and_again(act: Callable[[], None], every_s: float) -> Iterator[None]:
    """What goes on beside the page, while the body runs."""
    ended = threading.Event()

    def acting() -> None:
        while not ended.wait(every_s):
            act()

    thread = threading.Thread(target=acting)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def enter(page: Page, station: Station, origin: str = "") -> None:
    """As the operator who is signed in and in charge; ``origin``: where the page finds the station, if elsewhere."""
    station.sign_in()
    for name, value in station.cookies.items():
        page.context.add_cookies([{"name": name, "value": value, "url": origin or station.origin}])
    page.goto(origin or station.origin)


def visit(page: Page, station: Station) -> None:
    enter(page, station)
    expect(page.get_by_test_id("verdict")).to_be_visible()


def open_demo(page: Page, station: Station) -> None:
    visit(page, station)
    page.get_by_test_id("empty-demo").click()
    certified(page)


def certified(page: Page) -> None:
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-verdict", "certified")


def computed(page: Page) -> None:
    """What the page shows of the plan is of the plan as it stands."""
    expect(page.get_by_test_id("verdict")).not_to_have_attribute("data-verdict", "computing")


def drawn(page: Page) -> None:
    expect(page.get_by_test_id("scene-busy")).to_have_count(0)


def choose(page: Page, button: Locator, path: Path) -> None:
    with page.expect_file_chooser() as chooser:
        button.first.click()
    chooser.value.set_files(str(path))


def press_after_g(page: Page, key: str, arrived: Callable[[float], None]) -> None:
    """Again where a slow page heard the second key too late; ``arrived`` raises AssertionError unless the page shows so
    within as many milliseconds."""

    def is_there() -> bool:
        page.keyboard.press("g")
        page.keyboard.press(key)
        with contextlib.suppress(AssertionError):
            arrived(5000)
            return True
        return False

    wait_until(page, is_there)


def click_surface(page: Page, share: tuple[float, float], answered: Callable[[float], None]) -> None:
    """At a share of the 3D view's width and height; ``answered`` raises AssertionError unless the page shows so within
    as many milliseconds.

    A click that met nothing is made again, for the surface was not there yet; one that is only answered late is not: it
    would count twice.
    """
    box = page.get_by_test_id("scene").bounding_box()
    assert box is not None
    place = (box["x"] + share[0] * box["width"], box["y"] + share[1] * box["height"])

    def is_taken() -> bool:
        page.mouse.click(*place)
        with contextlib.suppress(AssertionError):
            answered(20_000)
            return True
        return False

    wait_until(page, is_taken)


# Flying


def connect(page: Page, vehicle: SimulatedVehicle) -> None:
    page.get_by_test_id("tab-fly").click()
    page.get_by_test_id("link-address").fill(vehicle.address)
    page.get_by_test_id("link-connect").click()
    expect(page.get_by_test_id("hold-position")).to_be_visible()
    expect(page.get_by_test_id("chip-gnss")).to_contain_text("RTK")


def start_simulator(page: Page) -> None:
    """Unless a test before this one has started it."""
    page.get_by_test_id("tab-fly").click()
    offered, connected = page.get_by_test_id("next-simulator"), page.get_by_test_id("hold-position")

    def is_connected() -> bool:
        """The offer goes as soon as the page has heard of the vehicle."""
        if offered.count():
            with contextlib.suppress(TimeoutError):
                offered.click(timeout=2000)
        return connected.is_visible()

    wait_until(page, is_connected)


def upload(page: Page) -> None:
    page.get_by_test_id("tab-plan").click()
    page.get_by_test_id("upload").click()
    expect(page.get_by_test_id("outcome-upload")).to_contain_text("verified")
    expect(page.get_by_test_id("upload")).to_have_text("On board")
    page.get_by_test_id("tab-fly").click()
    expect(page.get_by_test_id("rounded-note")).to_contain_text("centimetres")


def check(page: Page) -> None:
    """Until the vehicle is ready, by a check that is not too old."""
    ready = page.get_by_test_id("next-start")
    again = page.get_by_test_id("next-check").and_(page.locator(":enabled"))

    def is_ready() -> bool:
        """An answer may come between its request's end and the next look: the button goes under the click."""
        if again.count():
            with contextlib.suppress(TimeoutError):
                again.click(timeout=2000)
            expect(ready.or_(again)).to_be_visible()
        return bool(ready.count())

    expect(ready.or_(again)).to_be_visible()
    wait_until(page, is_ready)


def start(page: Page) -> None:
    """Checks until the vehicle is ready, accepts what may be accepted, and holds Start."""
    flies = page.locator("[data-testid=next-action][data-step=pause]")
    check(page)

    def is_started() -> bool:
        """Again where the order came too late to be done, or the vehicle had been disarmed meanwhile."""
        with contextlib.suppress(AssertionError):
            check(page)
            for tick in page.locator("[data-testid^=accept-]").all():
                tick.check()
            hold(page, "next-start")
            expect(flies).to_be_visible(timeout=30_000)
        return bool(flies.count())

    wait_until(page, is_started, LONG_MS)


def _orderable(page: Page, testid: str) -> Locator:
    return page.get_by_test_id(testid).and_(page.locator(":enabled:not([aria-disabled=true])"))


def hold(page: Page, testid: str) -> None:
    """Until the page has taken it: what moves under the pointer, or cannot be ordered for a moment, ends a hold."""
    button, ready = page.get_by_test_id(testid), _orderable(page, testid)
    expect(ready).to_be_visible()

    def is_taken() -> bool:
        if ready.count():
            with contextlib.suppress(TimeoutError, AssertionError):
                ready.hover(timeout=2000)
                page.mouse.down()
                # Its frames come slowly where the browser renders in software.
                expect(button).to_have_count(0, timeout=5000)
            page.mouse.up()
        return not button.count()

    wait_until(page, is_taken)


def is_held_by_key(page: Page, testid: str, taken: Callable[[float], None]) -> bool:
    """One hold of Enter; ``taken`` raises AssertionError unless the page shows so within as many milliseconds."""
    with contextlib.suppress(TimeoutError, AssertionError):
        _orderable(page, testid).focus(timeout=2000)
        page.keyboard.down("Enter")
        try:
            taken(5000)
        finally:
            page.keyboard.up("Enter")
        return True
    return False


def hold_return(page: Page) -> None:
    """By key, again where it could not be ordered for a moment, or the order came too late to be done."""
    said = page.get_by_test_id("outcome-safety")

    def is_taken() -> bool:
        return is_held_by_key(page, "return-home", lambda ms: expect(said).to_contain_text("returns home", timeout=ms))

    wait_until(page, is_taken)


def return_home(page: Page) -> None:
    hold_return(page)
    disarmed(page)


def land(page: Page) -> None:
    hold(page, "land")
    disarmed(page)


def disarmed(page: Page) -> None:
    expect(page.get_by_test_id("chip-mode")).to_contain_text("disarmed", timeout=LONG_MS)


def percent(page: Page) -> int:
    found = re.search(r"\d+", page.get_by_test_id("progress").inner_text())
    return int(found.group(0)) if found else 0


def open_recording(page: Page) -> None:
    """The newest one."""
    page.get_by_test_id("tab-review").click()
    page.get_by_test_id("recording-open").first.click()
    expect(page.get_by_test_id("replay-badge")).to_be_visible()


def play(page: Page, testid: str = "play") -> None:
    """Again for as long as the recording is still being opened, which the page says."""
    button, shown = page.get_by_test_id(testid), page.get_by_test_id("play")

    def plays() -> bool:
        button.click()
        with contextlib.suppress(AssertionError):
            expect(shown).to_have_text("Pause", timeout=10_000)
            return True
        return False

    wait_until(page, plays)


def replay_alert(page: Page) -> None:
    """Of the newest recording, from the event before the first alert on, with the instruments beside it."""
    open_recording(page)
    events, banner = page.get_by_test_id("review-event"), page.get_by_test_id("alert-banner")

    def is_shown() -> bool:
        """Again where it was over before a slow page had come to draw it."""
        page.get_by_test_id("review-part-events").click()
        expect(events.and_(page.locator("[data-kind=alert]")).first).to_be_visible()
        kinds = events.evaluate_all("events => events.map((event) => event.dataset.kind)")
        events.nth(kinds.index("alert") - 1).click()
        page.get_by_test_id("review-part-instruments").click()
        play(page)
        with contextlib.suppress(AssertionError):
            expect(banner).to_contain_text("REPLAY", timeout=20_000)
            return True
        return False

    wait_until(page, is_shown, LONG_MS)
