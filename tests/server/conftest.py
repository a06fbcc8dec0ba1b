"""A running server that the tests of one module share."""

from collections.abc import Iterator

import pytest

from tests.server.running import PASSWORD, Running, running


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """With a password, and an upload limit of 1 MiB."""
    with running(tmp_path_factory.mktemp("data"), password=PASSWORD, upload_limit_bytes=1024**2) as server:
        yield server
