"""Dask workers that run on this machine for a test, as a crew's own would."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import distributed


@contextmanager
def running_workers(workers: int = 2) -> Iterator[str]:
    """The address of a scheduler that exists, on this machine."""
    running = distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=50
    )
    try:
        yield running.scheduler_address
    finally:
        running.close()
