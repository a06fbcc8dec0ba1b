"""``python -m server.compile_kernels``: compiles the numba kernels into their cache, so that no operator waits."""

from __future__ import annotations

import numpy as np

from planning.demo import small_hill
from planning.raycast import raycast
from server import file_tasks, tasks


def main() -> None:
    tasks.warm_up(report=lambda step, share: None)
    file_tasks.warm_up(report=lambda step, share: None)
    dsm = small_hill()
    west, south, east, north = dsm.bounds_m
    above_m = np.array([(west + east) / 2, (south + north) / 2, 1e4])
    raycast(dsm, above_m, np.array([0.0, 0.0, -1.0]), floor_alt_dsm_m=0.0)


if __name__ == "__main__":
    main()
