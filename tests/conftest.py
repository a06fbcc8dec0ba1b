"""Fixtures that tests of all floors share."""

import os
import re
import shutil
import sys
from pathlib import Path

# Before any kernel is loaded: workers fill the processors by themselves, and threads of theirs, and of the servers that
# they start, would only wait for each other. Whoever runs tests alone has all threads.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Nor does each of the hundreds of processes that tests start compile the whole project's text for itself: what one has
# compiled the next ones load, also where the environment says that Python keeps none of it.
if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
    sys.dont_write_bytecode = False

import pytest
from hypothesis import HealthCheck, settings

# A busy machine may take any time over an example, and over making one.
settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("patient")

LONGEST_ID = 80

LONG_GROUPS = ("real-time", "process")
"""In their order. The first has all that must keep up with the clock, so that no two of its tests do beside each other:
flights with sensors, and pages in a browser."""

ROOT = Path(__file__).resolve().parent.parent
CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def pytest_make_parametrize_id(val: object) -> str | None:
    """Whole files stand in no test's name: it is told apart by their size."""
    return f"{len(val)}-long" if isinstance(val, bytes | str) and len(val) > LONGEST_ID else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests that share what their module makes once stay on one worker, which then makes it once; what takes long is
    begun first.
    """
    for item in items:
        if isinstance(item, pytest.Function) and item.get_closest_marker("xdist_group") is None:
            fixtures = item._fixtureinfo.name2fixturedefs.values()
            if any(fixture.scope == "module" for named in fixtures for fixture in named):
                item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))
    if "PYTEST_XDIST_WORKER" in os.environ:
        slow = {_group(item) for item in items if item.get_closest_marker("slow") is not None}
        items.sort(key=lambda item: (_rank(_group(item)), _group(item) not in slow))


def _group(item: pytest.Item) -> str:
    """The tests that one worker runs one after the other."""
    marker = item.get_closest_marker("xdist_group")
    return item.nodeid if marker is None else marker.args[0]


def _rank(group: str) -> int:
    return LONG_GROUPS.index(group) if group in LONG_GROUPS else len(LONG_GROUPS)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """By the test's own name: workers add its group, and ``--last-failed`` would not find it."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        report.nodeid = re.sub(r"@[^@\[\]]+$", "", report.nodeid)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded terrain, radar and flight data that may stand beside the project."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no recorded data: {folder} does not exist")
    return folder


@pytest.fixture(scope="session")
def chromium_path() -> str:
    """The browser that end-to-end tests drive. HEDGEHOP_REQUIRE_CHROMIUM=1 makes its absence a failure."""
    for name in CHROMIUM_NAMES:
        if path := shutil.which(name):
            return path
    reason = f"no browser: none of {', '.join(CHROMIUM_NAMES)} is on the PATH"
    if os.environ.get("HEDGEHOP_REQUIRE_CHROMIUM") == "1":
        pytest.fail(f"{reason}, and HEDGEHOP_REQUIRE_CHROMIUM=1 demands one")
    pytest.skip(reason)
