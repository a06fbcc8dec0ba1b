"""What a map is asked for, checked before anything is done with it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import CapacityError, ParameterError
from mapping.geometry.arrays import F64, Bools
from mapping.voxels.marks import LARGEST_KEY, MAX_RANGE_VOXELS
from mapping.voxels.store import WHOLE_BLOCK_BYTES, room_bytes
from mapping.voxels.update import Model

LEAST_BLOCKS = 16
"""Known whole."""
LEAST_EXTENT_M = 1_000.0
"""Keys must reach at least so far from the origin."""
BYTES_PER_VOXEL = 3.12
"""Estimated for the whole ball; a block that is known whole takes 2.7."""
SEEN_SHARE = 0.25
"""Of the ball around the sensor, at once."""


def checked_size(resolution_m: float, reach_m: float | None, memory_limit_bytes: int) -> None:
    """Raises ParameterError or CapacityError, with the number that would do."""
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        raise ParameterError(f"{resolution_m} m is no edge of a voxel.", where="resolution_m", advice="Try 0.5.")
    if resolution_m * LARGEST_KEY < LEAST_EXTENT_M:
        raise CapacityError(
            f"Voxels of {resolution_m:g} m reach only {resolution_m * LARGEST_KEY:.3g} m from the map's origin.",
            where="resolution_m",
            advice="Choose coarser voxels, for example 0.5 m.",
        )
    if room_bytes(int(memory_limit_bytes)) < LEAST_BLOCKS * WHOLE_BLOCK_BYTES:
        raise CapacityError(
            f"No map fits in {memory_limit_bytes:,.0f} bytes.",
            where="memory_limit_bytes",
            advice="Allow at least 100,000.",
        )
    if reach_m is not None:
        _check_reach(resolution_m, reach_m, memory_limit_bytes)


def _check_reach(resolution_m: float, reach_m: float, memory_limit_bytes: int) -> None:
    checked_range(reach_m, resolution_m)
    if not math.isfinite(reach_m):
        return
    seen_m3 = SEEN_SHARE * 4.0 / 3.0 * math.pi * reach_m**3
    needed_bytes = seen_m3 / resolution_m**3 * BYTES_PER_VOXEL
    if needed_bytes > memory_limit_bytes:
        finest_m = (seen_m3 * BYTES_PER_VOXEL / memory_limit_bytes) ** (1.0 / 3.0)
        raise CapacityError(
            f"One look out to {reach_m:g} m holds {seen_m3 / resolution_m**3:,.0f} voxels of {resolution_m:g} m, "
            f"{needed_bytes / 1e6:,.0f} MB; the map may have {memory_limit_bytes / 1e6:,.0f} MB.",
            where="resolution_m",
            advice=f"Choose {math.ceil(finest_m * 1000) / 1000:g} m or coarser, or allow more memory.",
        )


def checked_model(prob_hit: float, prob_miss: float, clamp: tuple[float, float], occupied: float) -> Model:
    """The sensor model in log-odds. Raises ParameterError."""
    lowest, highest = clamp
    if not 0.5 < prob_hit < 1.0:
        raise ParameterError(f"{prob_hit} is not between 0.5 and 1.", where="prob_hit", advice="OctoMap has 0.7.")
    if not 0.0 < prob_miss < 0.5:
        raise ParameterError(f"{prob_miss} is not between 0 and 0.5.", where="prob_miss", advice="OctoMap has 0.4.")
    if not 0.0 < lowest <= 0.5 <= highest < 1.0:
        raise ParameterError(
            f"{lowest} to {highest} do not hold 0.5 between 0 and 1.", where="clamp", advice="OctoMap has 0.12 to 0.97."
        )
    if not lowest <= occupied < highest:
        raise ParameterError(f"{occupied} is outside the clamp {lowest} to {highest}.", where="occupied")
    return Model(*(np.float32(math.log(p / (1.0 - p))) for p in (prob_hit, prob_miss, lowest, highest, occupied)))


def checked_points(points: ArrayLike) -> F64:
    """(N, 3) float64 in one piece. Raises ParameterError."""
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.size == 0:
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"Points are (N, 3), these are {array.shape}.", where="points")
    return array


def checked_origin(origin: ArrayLike, resolution_m: float) -> F64:
    """(3,) near enough to the map's origin that rays from it have keys. Raises ParameterError."""
    array = np.array(origin, dtype=np.float64).reshape(-1)
    if array.size != 3:
        raise ParameterError(f"A place has 3 coordinates, this has {array.size}.", where="origin_enu")
    if not np.all(np.abs(array) < (LARGEST_KEY - 2 * MAX_RANGE_VOXELS) * resolution_m):
        raise ParameterError(
            f"The sensor cannot be at {array.tolist()} m.", where="origin_enu", advice="Drop this scan."
        )
    return array


def checked_range(max_range_m: float, resolution_m: float) -> float:
    """What of the range can be walked: ``inf`` becomes as far as a ray may go. Raises ParameterError, CapacityError."""
    if not max_range_m > 0.0:
        raise ParameterError(
            f"{max_range_m} m is no range.", where="max_range_m", advice="Give metres above 0, or inf."
        )
    farthest_m = MAX_RANGE_VOXELS * resolution_m
    if math.isfinite(max_range_m) and max_range_m > farthest_m:
        raise CapacityError(
            f"A ray of {max_range_m:g} m has {max_range_m / resolution_m:,.0f} voxels of {resolution_m:g} m; "
            f"{MAX_RANGE_VOXELS:,} is the most.",
            where="max_range_m",
            advice=f"Choose at most {farthest_m:g} m, or coarser voxels.",
        )
    return min(float(max_range_m), farthest_m)


def checked_truths(explained: ArrayLike | None, count: int) -> Bools:
    """Whether each point is UNexplained, (N,), or (1,) for all of them. Raises ParameterError."""
    if explained is None:
        return np.ones(1, np.bool_)
    unexplained = np.ascontiguousarray(~np.asarray(explained, dtype=np.bool_)).reshape(-1)
    if unexplained.size not in (1, count):
        raise ParameterError(f"{unexplained.size} verdicts for {count} points.", where="explained")
    return unexplained if unexplained.size else np.ones(1, np.bool_)
