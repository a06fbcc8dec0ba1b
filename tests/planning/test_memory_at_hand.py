"""How much memory may be taken, from made-up systems and control groups; and files that ask for more."""

from __future__ import annotations

from pathlib import Path

import pytest

from planning.errors import RasterTooLargeError
from planning.terrain.geotiff import open_dsm, read_dsm_reported
from planning.terrain.rasters import memory_at_hand
from planning.terrain.rasters.memory_at_hand import RESERVE_BYTES, memory_at_hand_bytes
from tests.planning.geotiff_samples import hill, write_raster
from tests.planning.test_geotiff_safety import sparse

GIB = 2**30


def system(root: Path, cgroup: str, **files: str) -> Path:
    texts = {"proc/meminfo": "MemTotal: 99 kB\nMemAvailable: 8388608 kB\n", "proc/self/cgroup": cgroup, **files}
    for name, text in texts.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def group(path: str, limit: object, used: int, files: int) -> dict[str, str]:
    return {
        f"sys/fs/cgroup{path}/memory.max": f"{limit}\n",
        f"sys/fs/cgroup{path}/memory.current": f"{used}\n",
        f"sys/fs/cgroup{path}/memory.stat": f"anon 1\ninactive_file {files}\n",
    }


def test_without_groups_the_system_decides(tmp_path: Path) -> None:
    assert memory_at_hand_bytes(system(tmp_path, "")) == 8 * GIB


def test_nothing_known_is_no_limit(tmp_path: Path) -> None:
    assert memory_at_hand_bytes(tmp_path) is None


@pytest.mark.parametrize("path", ["/", "/a/b"])
def test_the_tightest_group_decides(tmp_path: Path, path: str) -> None:
    inner = group(path.rstrip("/"), "max", 1, 0)
    outer = group("/a" if path != "/" else "", 2 * GIB, GIB, GIB // 2)
    root = system(tmp_path, f"0::{path}\n", **{**inner, **outer})
    assert memory_at_hand_bytes(root) == 3 * GIB // 2


def test_a_group_of_the_first_version_named_by_the_host(tmp_path: Path) -> None:
    files = {
        "sys/fs/cgroup/memory/memory.limit_in_bytes": f"{GIB}\n",
        "sys/fs/cgroup/memory/memory.usage_in_bytes": f"{GIB + 5}\n",
        "sys/fs/cgroup/memory/memory.stat": "total_inactive_file 2\n",
    }
    assert memory_at_hand_bytes(system(tmp_path, "4:memory:/docker/abc\n3:cpu:/\n", **files)) == 0


def test_a_small_file_that_grows_large_is_refused_by_its_header(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory_at_hand, "memory_at_hand_bytes", lambda: 2 * GIB)
    path = sparse(tmp_path / "sparse.tif", 20_000, tiled=True)
    with pytest.raises(RasterTooLargeError, match=r"20000 x 20000 cells take about 5\.2 GiB.*2\.0 GiB are free.*Crop"):
        read_dsm_reported(path)
    large = open_dsm(path)
    with pytest.raises(RasterTooLargeError, match="are free"):
        large.whole()
    assert large.window(0, 0, 10, 10).height_px == 10


def test_memory_that_runs_short_meanwhile_ends_the_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    left = iter([4 * GIB])
    monkeypatch.setattr(memory_at_hand, "memory_at_hand_bytes", lambda: next(left, RESERVE_BYTES // 4))
    with pytest.raises(RasterTooLargeError, match=r"x\.tif: Only 0\.1 GiB of memory are left.*Close other programs"):
        read_dsm_reported(write_raster(tmp_path / "x.tif", hill()))
