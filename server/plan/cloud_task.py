"""What a worker does with a point cloud: its surface model joins the library, with what the points told."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from planning.terrain import SMALL_HOLE_M2
from planning.terrain.clouds.canopy import canopy_of, shares_of
from planning.terrain.clouds.read import CloudModel, CloudParams, read_cloud
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from planning.terrain.spikes import Spike, find_spikes, remove_spikes
from server.library.terrains import Origin, spike_docs, store_terrain
from server.plan.cloud_points import write_points
from server.schemas import CloudDoc, CloudShareDoc, TerrainDoc
from server.work.jobs import Progress

_STAGES = {"bounds": "Looking for the bounds", "sort": "Sorting the points", "thin": "Thinning the points"}
MOST_POINTS = 300_000
"""Of the cloud itself in the 3D view: 4.5 MB for the browser, as much as the model."""


def import_cloud(
    root: Path,
    upload: Path,
    filename: str,
    *,
    origin: Origin,
    params: CloudParams,
    without_spikes: bool,
    report: Progress,
) -> TerrainDoc:
    """The highest point of each cell as a surface model. Raises RasterError."""
    params = replace(params, most_points=MOST_POINTS)
    made = read_cloud(upload, params, progress=lambda stage, share: report(_STAGES.get(stage, stage), share))
    report("Looking for spikes", None)
    dsm, spikes = made.dsm, find_spikes(made.dsm)
    warnings = list(made.notes)
    if without_spikes and spikes:
        dsm = remove_spikes(dsm, spikes)
        warnings.append(f"{len(spikes)} isolated spikes and pits were removed.")
    report("Looking for holes", None)
    cloud = _cloud_doc(made, dsm, sized=params.cell_m is not None)
    report("Storing", None)
    left: tuple[Spike, ...] = () if without_spikes else spikes
    return store_terrain(
        root,
        replace(dsm, sha256=_digest(dsm)),
        name=filename,
        origin=origin,
        spikes=spike_docs(left),
        warnings=warnings,
        cloud=cloud,
        fill=lambda folder: _keep_points(folder, made.thinned),
    )


def _cloud_doc(made: CloudModel, dsm: Dsm, *, sized: bool) -> CloudDoc:
    known = int(np.count_nonzero(np.isfinite(dsm.elevation_m)))
    _, holes = fill_holes(dsm)
    canopy = None if made.ground is None else canopy_of(dsm.elevation_m, made.ground.elevation_m)
    return CloudDoc(
        points=made.points,
        taken=made.taken,
        noise=made.noise,
        not_numbers=made.not_numbers,
        points_per_m2=made.taken / (max(1, known) * dsm.resolution_m**2),
        cell_chosen=sized,
        shares=[CloudShareDoc(what=what, share=share) for what, share in shares_of(made.classes).items()],
        canopy_greatest_m=None if canopy is None or not canopy.cells else canopy.greatest_m,
        canopy_median_m=None if canopy is None or canopy.share == 0.0 else canopy.median_m,
        canopy_share=None if canopy is None or not canopy.cells else canopy.share,
        small_holes=holes.count,
        small_holes_m2=holes.area_m2,
        small_hole_limit_m2=SMALL_HOLE_M2,
        shown=0 if made.thinned is None else len(made.thinned.xyz_m),
        voxel_m=0.0 if made.thinned is None else made.thinned.voxel_m,
        colored=made.thinned is not None and made.thinned.rgb is not None,
    )


def cloud_beside_doc(made: CloudModel, points: ThinnedCloud) -> CloudDoc:
    """Of a cloud that came with a surface model, which tells nothing of that model's cells."""
    return CloudDoc(
        made_model=False,
        points=made.points,
        taken=made.taken,
        noise=made.noise,
        not_numbers=made.not_numbers,
        points_per_m2=made.taken / (max(1, int(np.isfinite(made.dsm.elevation_m).sum())) * made.dsm.resolution_m**2),
        cell_chosen=False,
        shares=[CloudShareDoc(what=what, share=share) for what, share in shares_of(made.classes).items()],
        canopy_greatest_m=None,
        canopy_median_m=None,
        canopy_share=None,
        small_holes=0,
        small_holes_m2=0.0,
        small_hole_limit_m2=SMALL_HOLE_M2,
        shown=len(points.xyz_m),
        voxel_m=points.voxel_m,
        colored=points.rgb is not None,
    )


def _keep_points(folder: Path, thinned: ThinnedCloud | None) -> None:
    if thinned is not None:
        write_points(folder, thinned)


def _digest(dsm: Dsm) -> str:
    """Of the model, not of the file: another size of cells makes another model of the same cloud."""
    found = hashlib.sha256(repr((tuple(dsm.transform), dsm.crs.to_wkt(), dsm.vertical_datum)).encode())
    found.update(np.ascontiguousarray(dsm.elevation_m).data)
    return found.hexdigest()
