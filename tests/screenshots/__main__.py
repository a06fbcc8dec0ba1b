"""Takes the pictures of the documents anew: ``make screenshots``, or with the names of some of them."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, ViewportSize, expect, sync_playwright

from tests.conftest import CHROMIUM_NAMES, ROOT
from tests.e2e.conftest import FLAGS, SELDOM
from tests.e2e.stations import Station
from tests.e2e.steps import LONG_MS
from tests.screenshots.scenes import PAUSE_MS, SCENES, Camera

SIZE: ViewportSize = {"width": 1440, "height": 810}
QUALITY = 72


def main() -> int:
    wanted = set(sys.argv[1:])
    if unknown := wanted - {name for scene in SCENES for name in scene.pictures}:
        sys.stderr.write(f"There is no picture {', '.join(sorted(unknown))}.\n")
        return 2
    expect.set_options(timeout=LONG_MS)
    for scene in SCENES:
        if not wanted or wanted & set(scene.pictures):
            with tempfile.TemporaryDirectory() as folder, _station(Path(folder)) as station, _page() as page:
                scene.play(page, station, _camera(page, wanted or set(scene.pictures)))
    return 0


def _camera(page: Page, wanted: set[str]) -> Camera:
    """Keeps those pictures that are wanted; the others are only passed by."""

    def take(name: str) -> None:
        if name in wanted:
            # The pointer leaves no trace, and no field a caret.
            page.mouse.move(0, 0)
            png = page.screenshot(animations="disabled", timeout=LONG_MS)
            file = ROOT / "docs" / f"{name}.webp"
            Image.open(BytesIO(png)).convert("RGB").save(file, quality=QUALITY, method=6)
            sys.stdout.write(f"{file.relative_to(ROOT)}: {file.stat().st_size / 1000:.0f} kB\n")

    return take


@contextmanager
def _station(folder: Path) -> Iterator[Station]:
    station = Station(folder / "data", "--demo-world")
    try:
        yield station
    finally:
        station.stop()


@contextmanager
def _page() -> Iterator[Page]:
    path = next(filter(None, map(shutil.which, CHROMIUM_NAMES)), None)
    if path is None:
        raise SystemExit(f"No browser: none of {', '.join(CHROMIUM_NAMES)} is on the PATH.")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        context = browser.new_context(viewport=SIZE, locale="en-GB", timezone_id="UTC", reduced_motion="reduce")
        context.add_init_script(SELDOM.replace("PAUSE_MS", str(PAUSE_MS)))
        page = context.new_page()
        page.set_default_timeout(LONG_MS)
        yield page
        browser.close()


if __name__ == "__main__":
    os.chdir(ROOT)
    raise SystemExit(main())
