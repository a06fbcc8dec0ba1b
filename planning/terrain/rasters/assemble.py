"""Makes the surface model of the stored numbers, as planned, and reports what was done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from affine import Affine

from mapping.geometry.arrays import F32
from planning.errors import NoElevationError
from planning.terrain.cells.squares import squares
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.heights import HeightStats, doubts, false_sentinels, mask_and_scale
from planning.terrain.rasters.surface_plan import SurfacePlan
from planning.terrain.spikes import Spike


@dataclass(frozen=True, slots=True)
class ReadReport:
    """What was found in a file and what was done to make a surface model of it."""

    vertical_datum: str | None
    height_scale: float
    """Metres per stored unit."""
    spikes: tuple[Spike, ...]
    spikes_removed: bool
    warnings: tuple[str, ...]
    """In plain words: what was assumed, masked, or looks wrong."""


def assemble(
    stored: F32,
    plan: SurfacePlan,
    stats: HeightStats,
    *,
    sha256: str,
    where: str,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[Dsm, ReadReport]:
    """The surface model from the stored numbers (changed in place) and the plan; NoElevationError without heights."""
    sentinels = false_sentinels(stats)
    kept = sum(count for text, count in stats.sentinels.items() if float(text) not in sentinels)
    if stats.known + kept == 0:
        raise NoElevationError(
            "Every cell is unknown.", where=where, advice="Check the export: it should hold the surface's heights."
        )
    mask_and_scale(stored, sentinels=sentinels, scale=plan.height_scale, offset=plan.height_offset)
    dsm = replace(_model(stored, plan, sha256, progress), name=where)
    found = doubts(stats, dtype=plan.header.dtypes[0], scaled=plan.scaled) if stats.known else ()
    return dsm, _report(dsm, plan, (*plan.notes, *_masked(stats, sentinels), *found))


def _model(stored: F32, plan: SurfacePlan, sha256: str, progress: Callable[[str, float], None] | None) -> Dsm:
    source = plan.placing.cells(stored) if plan.placing else None
    if source is None or plan.grid is None:
        elevation, transform = _north_up(stored, plan.affine)
    else:
        transform, shape = plan.grid
        elevation = squares(source, transform, shape, progress=lambda s: progress("resample", s) if progress else None)
    return Dsm(elevation, transform, plan.crs, plan.reference.vertical_datum, sha256, source)


def _north_up(stored: F32, t: Affine) -> tuple[F32, Affine]:
    flipped = stored[:: -1 if t.e > 0 else 1, :: -1 if t.a < 0 else 1]
    return np.ascontiguousarray(flipped), north_up_grid(t, stored.shape)[0]


def north_up_grid(t: Affine, shape: tuple[int, ...]) -> tuple[Affine, tuple[int, int]]:
    """Transform and (rows, columns) of the squares that stand for a raster's pixels one by one."""
    rows, columns = shape
    size = (abs(t.a) + abs(t.e)) / 2 if not np.isclose(abs(t.a), abs(t.e), rtol=1e-9, atol=0) else abs(t.a)
    west, north = min(t.c, t.c + columns * t.a), max(t.f, t.f + rows * t.e)
    return Affine(size, 0.0, west, 0.0, -size, north), (rows, columns)


def _masked(stats: HeightStats, sentinels: tuple[float, ...]) -> tuple[str, ...]:
    said = [
        f"{stats.sentinels[str(value)]} cells of {value:g} were taken as unknown: no other height is near that."
        for value in sentinels
    ]
    if stats.absurd:
        said.append(f"{stats.absurd} cells with infinite or absurd numbers were taken as unknown.")
    return tuple(said)


def _report(dsm: Dsm, plan: SurfacePlan, warnings: tuple[str, ...]) -> ReadReport:
    return ReadReport(
        vertical_datum=dsm.vertical_datum,
        height_scale=plan.height_scale,
        spikes=(),
        spikes_removed=False,
        warnings=warnings,
    )
