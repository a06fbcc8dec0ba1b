"""How fast eq. 2 of Melita 2020 is, beside what other libraries offer."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from affine import Affine
from numpy.typing import NDArray
from pyproj import CRS
from scipy import ndimage
from skimage import morphology

from planning.safe_surface.surface import dilate
from planning.terrain.dsm import Dsm
from tests.reference.dilation import ball_structure, dilate_fast

SIDE_PX = 2048
HEIGHT_M = 5.0

Case = tuple[str, float, float, float, str]
"""name, our seconds, the alternative's seconds, alternative / ours, note"""


def cases() -> list[Case]:
    """The figures of `make bench` for the safe surface; the slow alternatives run once."""
    dsm = _rough_model()
    return [_exact_against_scipy(dsm), _fast_against_exact(dsm), *_flat_discs(dsm)]


def main() -> None:
    for name, ours_s, alternative_s, ratio, note in cases():
        print(f"{name}: {ours_s:.4f} s against {alternative_s:.4f} s, {ratio:.1f} times as fast; {note}")


def _exact_against_scipy(dsm: Dsm) -> Case:
    footprint, structure = ball_structure(20.0, HEIGHT_M)
    ours_s, ours = _best_of(5, lambda: dilate(dsm, radius_m=20.0, height_m=HEIGHT_M).elevation_m)
    theirs_s, theirs = _best_of(
        1,
        lambda: np.asarray(
            ndimage.grey_dilation(
                dsm.elevation_m, footprint=footprint, structure=structure, mode="constant", cval=-np.inf
            )
        ),
    )
    difference_m = float(np.abs(ours - theirs).max())
    name = "dilate, eq. 2 exact, 2048 x 2048, R = 20 px, against scipy grey_dilation(structure=)"
    return name, ours_s, theirs_s, theirs_s / ours_s, f"largest difference {difference_m:.1e} m"


def _fast_against_exact(dsm: Dsm) -> Case:
    radius_m = 200.0
    fast_s, fast = _best_of(5, lambda: dilate_fast(dsm, radius_m=radius_m, height_m=HEIGHT_M).elevation_m)
    exact_s, _ = _best_of(5, lambda: dilate(dsm, radius_m=20.0, height_m=HEIGHT_M).elevation_m)
    # The bounds are checked where the exact form at R = 200 px is affordable; the corner has edges and interior.
    part = dsm.window(0, 0, 700, 700)
    inside = slice(0, 700 - 210)
    low = dilate(part, radius_m=radius_m, height_m=HEIGHT_M).elevation_m[inside, inside]
    high = dilate(part, radius_m=1.05 * radius_m, height_m=1.05 * HEIGHT_M).elevation_m[inside, inside]
    fast = fast[inside, inside]
    held = bool(np.all(low <= fast) and np.all(fast <= high))
    note = (
        f"takes {fast_s / exact_s:.2f} times as long (at most 15); between eq. 2 (R, H) and (1.05 R, 1.05 H): "
        f"{'yes' if held else 'NO'}; mean excess {float((fast - low).mean()):.3f} m"
    )
    return (
        "dilate, fast form, 2048 x 2048, R = 200 px, against exact R = 20 px",
        fast_s,
        exact_s,
        exact_s / fast_s,
        note,
    )


def _flat_discs(dsm: Dsm) -> list[Case]:
    """A flat disc is NOT eq. 2: it lifts nothing above the highest cell in reach. For context only."""
    disc = ball_structure(20.0, HEIGHT_M)[0].astype(np.uint8)
    ours_s, _ = _best_of(5, lambda: dilate(dsm, radius_m=20.0, height_m=HEIGHT_M).elevation_m)
    flat = (
        ("OpenCV", 5, lambda: np.asarray(cv2.dilate(dsm.elevation_m, disc))),
        ("scikit-image", 1, lambda: np.asarray(morphology.dilation(dsm.elevation_m, disc))),
    )
    rows: list[Case] = []
    for library, runs, run in flat:
        theirs_s, _ = _best_of(runs, run)
        name = f"dilate, eq. 2 exact, 2048 x 2048, R = 20 px, beside the flat disc of {library}"
        rows.append((name, ours_s, theirs_s, theirs_s / ours_s, "a flat disc is less than eq. 2 asks for"))
    return rows


def _rough_model() -> Dsm:
    """Hills, boulders and a few masts, in cells of 1 m so that metres are pixels."""
    rng = np.random.default_rng(2020)
    coarse = rng.standard_normal((33, 33)) * 20
    hills = np.asarray(ndimage.zoom(coarse, SIDE_PX / 33, order=3))
    heights = 800 + hills + rng.random((SIDE_PX, SIDE_PX)) * 2 + 30 * (rng.random((SIDE_PX, SIDE_PX)) > 0.99999)
    transform = Affine(1.0, 0, 500_000.0, 0, -1.0, 4_180_000.0)
    return Dsm(heights.astype(np.float32), transform, CRS.from_epsg(32633), None, "0" * 64)


def _best_of(runs: int, run: Callable[[], NDArray[Any]]) -> tuple[float, NDArray[Any]]:
    """Shortest time of ``runs``, after one run that compiles when there is more than one."""
    result = run() if runs > 1 else None
    best_s = float("inf")
    for _ in range(runs):
        start_s = time.perf_counter()
        result = run()
        best_s = min(best_s, time.perf_counter() - start_s)
    assert result is not None
    return best_s, result
