"""Running servers that the tests of one module share."""

from collections.abc import Iterator

import pytest

from server.plan.demo import PLAN_NAME
from server.schemas import PlanMessage
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
