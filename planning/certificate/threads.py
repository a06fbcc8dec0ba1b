"""One thread for small models: on a busy machine, waking and awaiting a second costs more than it brings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from numba import get_num_threads, set_num_threads

SMALL_MODEL_PX = 500_000


@contextmanager
def threads_for(cells: int) -> Iterator[None]:
    """Run the parallel kernels on one thread when the model has few cells; only this thread's setting changes."""
    before = get_num_threads()
    set_num_threads(1 if cells < SMALL_MODEL_PX else before)
    try:
        yield
    finally:
        set_num_threads(before)
