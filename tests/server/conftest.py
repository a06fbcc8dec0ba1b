"""Running servers that the tests of one module share, and what all tests of flying desks do."""

import asyncio
from collections.abc import Iterator

import pytest

from server.plan.demo import PLAN_NAME
from server.schemas import PlanMessage
from server.work.jobs import Lane
from tests.server.flying_desk_bench import Made
from tests.server.running import PASSWORD, Running, running
from tests.server.station import Station, station


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """With a password, and an upload limit of 1 MiB."""
    with running(tmp_path_factory.mktemp("data"), password=PASSWORD, upload_limit_bytes=1024**2) as server:
        yield server


@pytest.fixture(scope="module")
def demo_station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """With the demo's plan open."""
    with station(tmp_path_factory.mktemp("data"), demo=True) as running:
        if running.state.document.name != PLAN_NAME:
            running.until(lambda m: isinstance(m, PlanMessage) and m.plan.document.name == PLAN_NAME)
        yield running


@pytest.fixture(scope="package")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Made]:
    made = Made(tmp_path_factory.mktemp("data"))
    yield made
    made.library.close()


@pytest.fixture(scope="package")
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="package")
def lanes(runner: asyncio.Runner) -> Iterator[tuple[Lane, Lane]]:
    """For planning and for flying: processes that take a while to start."""
    lanes = Lane("plan"), Lane("flight")
    yield lanes
    for lane in lanes:
        runner.run(lane.close())


@pytest.fixture
def lane(lanes: tuple[Lane, Lane]) -> Lane:
    """For flying."""
    return lanes[1]
