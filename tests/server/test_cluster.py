from __future__ import annotations

import hashlib
import importlib
import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import dask.config
import distributed
import numpy as np
import pytest
from numpy.typing import NDArray

from mapping.traversability import traversability_map
from planning.errors import PoiError
from server.errors import ClusterError, WorkerDiedError
from server.work import cluster
from server.work.cluster import check_where, installed, spread
from tests.server.cluster_keys import write_keys
from tests.server.running_workers import running_workers

pytestmark = pytest.mark.xdist_group("cluster")


def _worked_out(seed: int) -> str:
    """Of bytes that a kernel made; early pieces take longest."""
    time.sleep(0.2 if seed == 0 else 0.0)
    heights_m = np.random.default_rng(seed).uniform(0.0, 3.0, (40, 40)).astype(np.float32)
    return hashlib.sha256(traversability_map(heights_m, 0.5).index.tobytes()).hexdigest()


def _large(number: int) -> NDArray[np.int64]:
    return np.full(20_000_000, number, np.int64)


def _refuse(number: int) -> int:
    if number == 2:
        raise PoiError("POI 3 lies outside.", where="row 4", advice="Move it.")
    return number


def _die_once(mark: tuple[Path, int]) -> int:
    path, number = mark
    if number == 1 and not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def _die(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def _late(number: int) -> int:
    raise TimeoutError("the piece's own")


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    with running_workers() as address:
        yield address


def _loops() -> set[int | None]:
    return {thread.ident for thread in threading.enumerate() if thread.name == "IO loop"}


def test_here_pieces_are_done_one_after_another() -> None:
    shares: list[float] = []
    answers = spread(_worked_out, [0, 1, 2, 3], None, shares.append)
    assert next(answers) == _worked_out(0)
    assert shares == [0.0]
    assert list(answers) == [_worked_out(seed) for seed in (1, 2, 3)]
    assert shares == [0.0, 0.25, 0.5, 0.75]


def test_workers_give_the_same_bytes_in_the_same_order(scheduler: str) -> None:
    shares: list[float] = []
    seeds = list(range(40))
    assert list(spread(_worked_out, seeds, scheduler, shares.append)) == [_worked_out(seed) for seed in seeds]
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < shares[-1] <= 1.0


def test_what_a_piece_raises_comes_through_as_it_is(scheduler: str) -> None:
    answers = spread(_refuse, [0, 1, 2, 3], scheduler, lambda share: None)
    assert [next(answers), next(answers)] == [0, 1]
    with pytest.raises(PoiError, match=r"row 4: POI 3 lies outside\. Move it\."):
        next(answers)
    with pytest.raises(TimeoutError, match="the piece's own"):
        list(spread(_late, [0], scheduler, lambda share: None))


def test_a_large_answer_comes_though_it_is_told_often(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_TOLD_EVERY_S", 0.001)
    shares: list[float] = []
    answers = [answer.sum() for answer in spread(_large, [1, 2, 3], scheduler, shares.append)]
    assert answers == [20_000_000, 40_000_000, 60_000_000]
    assert len(shares) > 3


def test_a_worker_that_dies_loses_nothing_and_a_piece_that_ends_every_worker_is_named(tmp_path: Path) -> None:
    pieces = [(tmp_path / "died", number) for number in range(6)]
    with running_workers() as mortal:
        assert list(spread(_die_once, pieces, mortal, lambda share: None)) == list(range(6))
        assert (tmp_path / "died").exists()
        with pytest.raises(WorkerDiedError, match="piece 1 of 1: Every worker"):
            list(spread(_die, [0], mortal, lambda share: None))


def test_processes_of_its_own_have_keys_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_REACH_S", 2.0)
    answers = spread(_worked_out, [0, 1, 2], "local:2", lambda share: None)
    first = next(answers)
    (running,) = [one for one in distributed.Client._instances if one.status == "running"]
    assert running.scheduler is not None
    address = running.scheduler.address
    assert address is not None
    assert address.startswith("tls://127.0.0.1:")
    before = _loops()
    with pytest.raises(ClusterError, match="No Dask scheduler is reached"):
        list(spread(_worked_out, [0], address, lambda share: None))
    # A client left open waits, wherever it is collected, for a lock that each new loop's start holds.
    assert _loops() == before
    assert [first, *answers] == [_worked_out(seed) for seed in (0, 1, 2)]


def test_a_scheduler_that_is_not_there_or_has_no_worker_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as hasty:
        hasty.setattr(cluster, "_REACH_S", 1.0)
        with pytest.raises(ClusterError, match=r"tcp://127\.0\.0\.1:1: No Dask scheduler is reached"):
            list(spread(_worked_out, [0], "tcp://127.0.0.1:1", lambda share: None))
    monkeypatch.setattr(cluster, "_JOIN_S", 1.0)
    with running_workers(workers=0) as empty, pytest.raises(ClusterError, match="No worker has joined"):
        list(spread(_worked_out, [0], empty, lambda share: None))


def test_a_key_that_is_not_there_is_said(tmp_path: Path) -> None:
    with (
        dask.config.set({"distributed.comm.tls.ca-file": str(tmp_path / "none.pem")}),
        pytest.raises(ClusterError, match=r"No Dask scheduler is reached .*distributed\.comm\.tls"),
    ):
        list(spread(_worked_out, [0], "tls://127.0.0.1:1", lambda share: None))


def test_a_worker_of_another_version_is_refused_also_if_it_joins_later(
    scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = installed()
    monkeypatch.setattr(cluster, "installed", lambda: ours | {"Hedgehop": "0.0.1"})
    with pytest.raises(
        ClusterError, match=r"would not answer as the machine that asks: Hedgehop .*, asked with 0\.0\.1"
    ):
        list(spread(_worked_out, [0], scheduler, lambda share: None))
    monkeypatch.setattr(cluster, "_check_workers", lambda client, where: None)
    with pytest.raises(ClusterError, match="would not answer"):
        list(spread(_worked_out, [0], scheduler, lambda share: None))


def test_one_scheduler_is_reached_by_tls_with_keys_for_both_sides(tmp_path: Path) -> None:
    keys = write_keys(tmp_path)
    running = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=50,
        protocol="tls://", security=distributed.Security(require_encryption=True, **keys),
    )  # fmt: skip
    settings = {"distributed.comm.tls.ca-file": keys["tls_ca_file"]}
    settings |= {f"distributed.comm.tls.client.{part}": keys[f"tls_client_{part}"] for part in ("cert", "key")}
    try:
        address = running.scheduler_address
        assert address.startswith("tls://")
        with dask.config.set(settings):
            assert list(spread(_worked_out, [0, 1], address, lambda share: None)) == [_worked_out(0), _worked_out(1)]
    finally:
        running.close()


def test_workers_of_this_machine_that_do_not_start_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(**asked: object) -> None:
        raise TimeoutError

    monkeypatch.setattr(distributed, "LocalCluster", slow)
    with pytest.raises(ClusterError, match=r"did not start \(TimeoutError.*fewer with local:N"):
        list(spread(_worked_out, [0], "local", lambda share: None))


def test_without_dask_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(ClusterError, match=r"--cluster: Dask is not installed\. .*hedgehop\[cluster\]"):
        list(spread(_worked_out, [0], "local", lambda share: None))


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("local:0", "no number of workers"),
        ("local:", "no number of workers"),
        ("local:-2", "no number of workers"),
        ("local:²", "no number of workers"),
        ("local:1000", "no number of workers"),
        ("", "names no cluster"),
        ("dask", "names no cluster"),
        ("tls://", "names no cluster"),
        ("tls://10.0.0.5", "names no cluster"),
        ("tls://10.0.0.5:99999", "names no cluster"),
        ("tls://[::1:8786", "names no cluster"),
        ("tls://me@10.0.0.5:8786", "names no cluster"),
        ("inproc://10.0.0.5:8786", "names no cluster"),
        ("tcp://10.0.0.5:8786", "anyone in that network"),
    ],
)
def test_what_names_no_cluster_is_refused(where: str, words: str) -> None:
    with pytest.raises(ClusterError, match=words):
        check_where(where)
