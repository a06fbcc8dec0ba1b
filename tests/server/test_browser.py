"""What only a browser can show: the strict cookie survives the sign-in link, and viser runs under our policies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from tests.server.running import PASSWORD, Running, running

pytestmark = [pytest.mark.e2e, pytest.mark.xdist_group("real-time")]

CONSOLE = """<!doctype html><title>Console</title><link rel="icon" href="data:,">
<iframe id="view" width="600" height="400"></iframe><script type="module" src="/assets/main.js"></script>"""
SCRIPT = """
const socket = new WebSocket(`ws://${location.host}/ws`);
socket.onmessage = (event) => {
  const message = JSON.parse(event.data);
  if (message.type === "snapshot") document.getElementById("view").src = `/view/${message.page_id}/?fixedDpr=0.5`;
};
socket.onclose = (event) => { document.title = `closed ${event.code}`; };
"""
ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="module")
def console_served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("console")
    (folder / "assets").mkdir()
    (folder / "index.html").write_text(CONSOLE)
    (folder / "assets" / "main.js").write_text(SCRIPT)
    with running(tmp_path_factory.mktemp("data"), console_dir=folder, password=PASSWORD) as server:
        yield server


@pytest.fixture(scope="module")
def browser(chromium_path: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=chromium_path, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 800, "height": 600})
    yield context.new_page()
    context.close()


def test_the_link_signs_in_and_viser_runs_framed(console_served: Running, page: Page) -> None:
    complaints: list[str] = []
    requests: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    auth, host = console_served.parts.auth, console_served.parts.scene_host
    page.goto(f"{console_served.origin}/login?token={auth.new_link_token()}")
    assert page.title() == "Console"
    frame = page.frame_locator("#view")
    frame.locator("canvas").first.wait_for(timeout=60_000)
    for _ in range(300):
        if host.server.get_clients():
            break
        page.wait_for_timeout(100)
    (client_id,) = host.server.get_clients()
    assert host.page_of_client(client_id) is not None
    assert not frame.get_by_text("Scene tree").is_visible()
    # A library inside viser probes whether it may evaluate strings, and does without when it may not.
    blocked = [text for text in complaints if "Content Security Policy" in text]
    assert [text for text in blocked if "Evaluating a string" not in text] == []
    assert [url for url in requests if not url.startswith((console_served.origin, "blob:", "data:"))] == []
    cookie = next(c for c in page.context.cookies() if c["name"].startswith("hedgehop"))  # type: ignore[typeddict-item]
    assert (cookie["httpOnly"], cookie["sameSite"]) == (True, "Strict")  # type: ignore[typeddict-item]


def test_a_link_on_another_site_still_finds_the_session(console_served: Running, page: Page, tmp_path: Path) -> None:
    page.goto(f"{console_served.origin}/login?token={console_served.parts.auth.new_link_token()}")
    # "localhost" and "127.0.0.1" are different sites: the strict cookie is not sent at first.
    page.goto(f"http://localhost:{console_served.settings.port}/signin")
    page.evaluate("url => { location.href = url }", f"{console_served.origin}/")
    page.wait_for_function("() => document.title.startsWith('Console')")
    assert page.url == f"{console_served.origin}/"


def test_the_password_form_and_signing_out(console_served: Running, page: Page) -> None:
    page.goto(f"{console_served.origin}/")
    assert page.url.endswith("/signin")
    page.fill("#password", "wrong password")
    page.click("button")
    page.wait_for_function("() => document.getElementById('message').textContent.includes('wrong')")
    page.fill("#password", PASSWORD)
    page.click("button")
    page.wait_for_function("() => document.title === 'Console'")
    page.evaluate("() => fetch('/api/session', { method: 'DELETE' })")
    page.wait_for_function("() => document.title === 'closed 4401'")
