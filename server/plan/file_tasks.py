"""What workers do with files: points and rasters are read, spikes removed, the demo generated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from planning.errors import FormatError, ParameterError
from planning.formats.fence_files import is_fence, read_fence
from planning.formats.poi_files import looks_swapped, read_pois
from planning.ground.demo_hillside import demo_dsm, small_hill
from planning.terrain.clouds.cloud_header import is_cloud
from planning.terrain.clouds.read import CloudParams
from planning.terrain.geotiff import read_dsm_reported, read_orthophoto
from planning.terrain.projects import doubts_of_name
from planning.terrain.spikes import find_spikes
from planning.terrain.spikes import remove_spikes as without
from server.errors import error_doc
from server.library.documents import doc_of_points
from server.library.fences import with_fence
from server.library.orthophotos import store_orthophoto
from server.library.shelf import read_manifest
from server.library.terrains import Origin, TerrainManifest, load_terrain, spike_docs, store_terrain
from server.plan import archives
from server.plan.cloud_points import points_to_keep, write_points
from server.plan.cloud_task import import_cloud
from server.plan.mesh_task import import_mesh, mesh_of
from server.plan.project_task import Unpacked, import_project, project_in, unpacked_project
from server.plan.tile_archive import unpacked_tiles
from server.schemas import MeshDoc, OrthophotoDoc, PlanDoc, TerrainDoc
from server.work.jobs import Progress

_HEIGHTS_OF_BEFORE = {"canopy_greatest_m": None, "canopy_median_m": None, "canopy_share": None}
"""Told of a cloud's cells, spikes and all."""
_STAGES = {"digest": "Reading", "decode": "Reading", "resample": "Resampling", "spikes": "Looking for spikes"}


def warm_up(*, report: Progress) -> None:
    """Loads what the first surface model that is dropped in would wait for."""
    report("Getting ready", None)
    find_spikes(small_hill())


def import_terrain(
    root: Path,
    upload: Path,
    filename: str,
    *,
    origin: Origin,
    crs: str | None,
    z_scale: float | None,
    vertical_datum: str | None,
    remove_spikes: bool,
    cell_m: float | None,
    keep_noise: bool,
    under: tuple[str, Path] | None = None,
    report: Progress,
) -> TerrainDoc | MeshDoc:
    """Reads an uploaded surface model, a file, tiles or a point cloud, into the library. Raises RasterError.

    A textured mesh is laid on the surface model ``under`` it, by its id and folder.
    """
    with archives.named(upload, filename):
        if mesh := mesh_of(upload, filename):
            terrain_id, terrain_dir = under or ("", None)
            names = None if mesh is True else mesh
            return import_mesh(root, upload, filename, names, terrain_dir, terrain_id, report=report)
    with archives.named(upload, filename), _unpacked(upload, filename, report) as source:
        if is_cloud(upload):
            params = CloudParams(cell_m, crs, vertical_datum, z_scale, keep_noise)
            return import_cloud(
                root, upload, filename, origin=origin, params=params, without_spikes=remove_spikes, report=report
            )
        if cell_m is not None or keep_noise:
            what = "Cell size and noise are asked of point clouds: a raster has its own cells."
            raise ParameterError(what, where=filename, advice="Leave both out.")
        if isinstance(source, Unpacked):
            params = CloudParams(crs=crs, vertical_datum=vertical_datum, z_scale=z_scale)
            return import_project(
                root, filename, source, origin=origin, params=params, without_spikes=remove_spikes, report=report
            )
        dsm, found = read_dsm_reported(
            source,
            crs=crs,
            z_scale=z_scale,
            vertical_datum=vertical_datum,
            remove_spikes=remove_spikes,
            progress=lambda stage, share: report(_STAGES.get(stage, stage), share),
        )
    report("Storing", None)
    spikes = () if found.spikes_removed else found.spikes
    warnings = (*found.warnings, *doubts_of_name(f"{origin.folder}/{filename}"))
    return store_terrain(root, dsm, name=filename, origin=origin, spikes=spike_docs(spikes), warnings=warnings)


@contextmanager
def _unpacked(upload: Path, filename: str, report: Progress) -> Iterator[Path | Unpacked]:
    """What is read of an upload: itself, the files of a project in it, or a folder of the tiles in it."""
    if not archives.is_archive(upload):
        yield upload
        return
    if (project := project_in(upload, filename)) is not None:
        with unpacked_project(upload, filename, project, report) as files:
            yield files
        return
    report("Unpacking", None)
    with unpacked_tiles(upload, filename, report) as folder:
        yield folder


def read_points(
    upload: Path, filename: str, terrain_dir: Path | None, *, only_fence: bool = False, report: Progress
) -> tuple[PlanDoc, tuple[str, ...]]:
    """A file's points, or its fence and rally points, as a document, and remarks. Raises FormatError, PoiError."""
    report("Reading the file", None)
    data = upload.read_bytes()
    if only_fence or is_fence(filename, data):
        return _fence_of(filename, data)
    points = read_pois(filename, data)
    try:
        document = doc_of_points(points)
    except ValidationError as error:
        fault = error_doc(error)
        raise FormatError(fault.what, where=f"{filename}, {fault.where}", advice="Split or correct the file.") from None
    remarks = list(points.warnings)
    if terrain_dir is not None and looks_swapped(points.pois, load_terrain(terrain_dir)):
        remarks.append("Latitude and longitude seem swapped: exchanged, these points lie on the surface model.")
    return document, tuple(remarks)


def _fence_of(filename: str, data: bytes) -> tuple[PlanDoc, tuple[str, ...]]:
    found = read_fence(filename, data)
    return with_fence(PlanDoc(), found.fence, found.rally), found.warnings


def import_orthophoto(
    root: Path, terrain_dir: Path, upload: Path, filename: str, *, terrain_id: str, report: Progress
) -> OrthophotoDoc:
    """Reads an uploaded orthomosaic, brought onto its surface model's grid. Raises RasterError."""
    dsm = load_terrain(terrain_dir)
    with archives.named(upload, filename):
        photo = read_orthophoto(
            upload,
            bounds_m=dsm.bounds_m,
            crs=dsm.crs,
            progress=lambda stage, share: report(_STAGES.get(stage, stage), share),
        )
    report("Storing", None)
    return store_orthophoto(root, photo, name=filename, terrain_id=terrain_id)


def without_spikes(root: Path, terrain_dir: Path, *, report: Progress) -> TerrainDoc:
    """A copy of a surface model without its isolated spikes and pits."""
    dsm, before = load_terrain(terrain_dir), read_manifest(terrain_dir, TerrainManifest).doc
    report("Looking for spikes", None)
    spikes = find_spikes(dsm)
    report("Storing", None)
    points, lost = points_to_keep(terrain_dir)
    cloud = None if before.cloud is None else before.cloud.model_copy(update=_HEIGHTS_OF_BEFORE)
    if cloud is not None and points is None:
        cloud = cloud.model_copy(update={"shown": 0})
    return store_terrain(
        root,
        without(dsm, spikes),
        name=f"{before.name} without spikes",
        origin=Origin(before.folder, before.file_utc),
        warnings=[*before.warnings, f"{len(spikes)} isolated spikes and pits were removed.", *lost],
        in_doubt=before.in_doubt,
        cloud=cloud,
        fill=lambda folder: None if points is None else write_points(folder, points),
    )


def make_demo_terrain(root: Path, name: str, *, report: Progress) -> TerrainDoc:
    """Generates the demo's surface model."""
    report("Generating the demo surface model", None)
    return store_terrain(root, demo_dsm(), name=name)
