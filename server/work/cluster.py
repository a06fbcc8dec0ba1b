"""Work spread over Dask workers, or done here one piece after another: the same answers, in the same order.

The only module that knows Dask, which is an extra (``hedgehop[cluster]``) and loaded when it is asked for. A worker
that dies loses nothing: its piece is done again by another. No more pieces are on their way than keep all workers
busy, so that neither they nor this process hold what nobody has fetched yet.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import os
import socket
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from threading import Event, Lock
from typing import Any, TypeVar
from urllib.parse import urlsplit

from planning import __version__
from server.errors import ClusterError, WorkerDiedError

A = TypeVar("A")
R = TypeVar("R")
Done = Callable[[float], None]

LOCAL = "local"
MOST_LOCAL_WORKERS = 256
PER_WORKER = 4
"""Pieces on their way for each worker: one in work, the others so that it never waits."""
_REACH_S, _JOIN_S, _TOLD_EVERY_S = 30.0, 30.0, 0.5
_START_S = 180.0
"""On a machine that has much else to do processes take long to come up."""
_ONE_PIECE = Lock()
_DECIDE = ("numpy", "numba", "scipy", "rasterio", "pyproj")
_LOOPBACK = frozenset({"127.0.0.1", "::1", "localhost"})


def spread(function: Callable[[A], R], pieces: Sequence[A], where: str | None, done: Done) -> Generator[R]:
    """``function`` of each piece, in the pieces' order; ``done(share)`` is told how many are finished.

    ``function`` is found by its module on a worker, so it and the pieces must pickle; files that it reads must lie
    there at the same path. ``where``: None here, ``local`` or ``local:N`` processes of this machine, or the
    ``tls://HOST:PORT`` of a Dask scheduler. Who breaks off has to close it: left to the collector it would wait for
    workers that are gone. Raises ClusterError, WorkerDiedError, and whatever ``function`` raises.
    """
    if where is None:
        for number, piece in enumerate(pieces):
            done(number / len(pieces))
            yield function(piece)
        return
    with _client(where) as client:
        yield from _in_order(client, function, pieces, done)


def check_where(where: str) -> None:
    """Raises ClusterError for what names no cluster, before anything is begun."""
    if where == LOCAL or where.startswith(f"{LOCAL}:"):
        _local_workers(where)
    else:
        _check_address(where)


def _in_order(client: Any, function: Callable[[A], R], pieces: Sequence[A], done: Done) -> Generator[R]:
    from distributed import KilledWorker

    waiting: deque[Any] = deque()
    unbegun = deque(pieces)

    def tell() -> None:
        left = len(unbegun) + sum(not future.done() for future in waiting)
        done(1.0 - left / len(pieces))

    try:
        while unbegun or waiting:
            # Workers may have joined since.
            room = PER_WORKER * max(1, sum(client.nthreads().values()))
            while unbegun and len(waiting) < room:
                waiting.append(client.submit(_answered, function, unbegun.popleft(), installed(), pure=False))
            yield _answer(waiting[0], tell)
            waiting.popleft()
    except KilledWorker as error:
        raise WorkerDiedError(
            "Every worker that took up this piece of the work ended unexpectedly, perhaps for lack of memory.",
            where=f"piece {len(pieces) - len(unbegun) - len(waiting) + 1} of {len(pieces)}",
            advice="Use fewer workers with more memory each, or leave --cluster away to see it fail here.",
        ) from error
    finally:
        client.cancel(list(waiting), force=True)


def _answer(future: Any, tell: Callable[[], None]) -> Any:
    """Raises what the piece raised, ClusterError when the scheduler is gone."""
    from distributed import CancelledError

    answered = Event()
    future.add_done_callback(lambda done: answered.set())
    tell()
    while not future.done():
        answered.wait(_TOLD_EVERY_S)
        tell()
    try:
        # Without a time of its own: a large answer that is given up while it comes would never come.
        return future.result()
    except (CancelledError, OSError) as error:
        if future.status == "error":
            raise  # the piece's own
        raise ClusterError(
            "The scheduler of the cluster does not answer any more.",
            advice="Start it again, and the command: what was not written yet is done anew.",
        ) from error


@contextmanager
def _client(where: str) -> Iterator[Any]:
    check_where(where)
    try:
        distributed = importlib.import_module("distributed")
    except ModuleNotFoundError as error:
        raise ClusterError(
            "Dask is not installed.",
            where="--cluster",
            advice="Install it: pip install 'hedgehop[cluster]', or leave --cluster away.",
        ) from error
    # It logs every connection that closes as it ends.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    if where == LOCAL or where.startswith(f"{LOCAL}:"):
        with _local(distributed, _local_workers(where)) as cluster, distributed.Client(cluster) as client:
            yield client
        return
    client = distributed.Client.__new__(distributed.Client)
    try:
        client.__init__(where, timeout=_REACH_S, set_as_default=False)
    except Exception as error:  # it gives up in any way: no answer, no key, an attempt that it cancelled itself
        # Collected as garbage it would close in any thread, and in that of a loop which starts wait for ever.
        with suppress(Exception):  # where it failed before it had anything to close
            client.close()
        raise ClusterError(
            f"No Dask scheduler is reached ({type(error).__name__}: {error}).",
            where=where,
            advice="Start it: dask scheduler. For tls:// Dask needs its keys, distributed.comm.tls in its settings.",
        ) from error
    with client:
        _check_workers(client, where)
        yield client


def _local(distributed: Any, workers: int) -> Any:
    """Processes of this machine. Raises ClusterError when they do not come up."""
    dask_config = importlib.import_module("dask.config")
    try:
        with dask_config.set({"distributed.comm.timeouts.connect": f"{_START_S:g}s"}):
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                # Whoever reaches a scheduler runs code: other users of this machine have no key to it.
                security=distributed.Security.temporary(),
                silence_logs=logging.CRITICAL,
                env={"NUMBA_NUM_THREADS": "1"},
            )
    except (OSError, RuntimeError) as error:
        raise ClusterError(
            f"The workers on this machine did not start ({type(error).__name__}: {error}).",
            where="--cluster",
            advice="Ask for fewer with local:N, let what else runs here end, or leave --cluster away.",
        ) from error


def _local_workers(where: str) -> int:
    _, colon, count = where.partition(":")
    if not colon:
        return len(os.sched_getaffinity(0))
    if not (count.isascii() and count.isdigit() and 1 <= int(count) <= MOST_LOCAL_WORKERS):
        raise ClusterError(
            f'"{count}" is no number of workers.', where="--cluster", advice=f"Give local:1 to {MOST_LOCAL_WORKERS}."
        )
    return int(count)


def _check_address(where: str) -> None:
    try:
        parts = urlsplit(where)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme not in ("tls", "tcp") or not parts.hostname or not port or parts.path or parts.username:
        raise ClusterError(
            f'"{where}" names no cluster.',
            where="--cluster",
            advice="Give local, local:N, or the scheduler's address, such as tls://10.0.0.5:8786.",
        )
    if parts.scheme == "tcp" and parts.hostname not in _LOOPBACK:
        raise ClusterError(
            "Over tcp:// anyone in that network could run programs on the workers and here.",
            where="--cluster",
            advice="Start scheduler and workers with TLS and give tls://; tcp:// is for this machine alone.",
        )


def _check_workers(client: Any, where: str) -> None:
    try:
        client.wait_for_workers(1, timeout=_JOIN_S)
    except TimeoutError as error:
        raise ClusterError(
            "No worker has joined this scheduler.",
            where=where,
            advice="Start some: dask worker ADDRESS --nthreads 1 --nworkers auto.",
        ) from error
    try:
        client.run(check_same, installed())
    except ModuleNotFoundError as error:
        raise ClusterError(
            f"A worker lacks a package: {error}.", where=where, advice="Install Hedgehop on it, as it is here."
        ) from error


def _answered(function: Callable[[A], R], piece: A, asked_with: dict[str, str]) -> R:
    """On the worker, which may have joined after the others were looked at. One piece at a time: a worker of several
    threads shares what it keeps of a model, and not every kernel bears two callers."""
    check_same(asked_with)
    with _ONE_PIECE:
        return function(piece)


def check_same(asked_with: dict[str, str]) -> None:
    """Raises ClusterError on a machine whose answers may not be those of the one that asks."""
    here = installed()
    other = [f"{name} {here[name]}, asked with {wanted}" for name, wanted in asked_with.items() if here[name] != wanted]
    if other:
        raise ClusterError(
            f"This worker would not answer as the machine that asks: {'; '.join(other)}.",
            where=socket.gethostname(),
            advice="Install the same versions on all of them.",
        )


@cache
def installed() -> dict[str, str]:
    """What decides about the bytes of an answer: versions, and a digest of our own sources."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for floor in ("mapping", "planning", "telemetry", "server"):
        for source in sorted((root / floor).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode() + source.read_bytes())
    own = f"{__version__} ({digest.hexdigest()[:12]})"
    return {"Hedgehop": own, **{name: metadata.version(name) for name in _DECIDE}}
