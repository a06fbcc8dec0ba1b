"""What is loaded to stay: the collector rests meanwhile, and has less to look through afterwards."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator

import pytest

from server.work.loading import loaded_to_stay


@pytest.fixture(autouse=True)
def unfrozen() -> Iterator[None]:
    yield
    gc.unfreeze()


def test_the_collector_no_longer_looks_at_what_was_loaded() -> None:
    gc.collect()
    with loaded_to_stay():
        assert not gc.isenabled()
        kept = [[] for _ in range(50_000)]
    assert gc.isenabled()
    assert gc.get_freeze_count() > len(kept)
    assert len(gc.get_objects()) < len(kept)


def test_of_two_loads_at_once_the_last_one_wakes_it() -> None:
    begun, may_end = threading.Event(), threading.Event()

    def load() -> None:
        with loaded_to_stay():
            begun.set()
            may_end.wait(60)

    other = threading.Thread(target=load)
    other.start()
    begun.wait(60)
    with loaded_to_stay():
        pass
    assert not gc.isenabled()
    may_end.set()
    other.join()
    assert gc.isenabled()


def test_it_wakes_after_a_load_that_failed() -> None:
    with pytest.raises(ValueError, match="no kernel"), loaded_to_stay():
        raise ValueError("no kernel")
    assert gc.isenabled()
