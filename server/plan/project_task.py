"""A mapping program's project in a ZIP archive: its surface model opened, its orthophoto and its cloud beside it."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from secrets import token_hex

from planning.errors import MissingCrsError, PlanningError, RasterFormatError
from planning.terrain.clouds.read import CloudModel, CloudParams, read_cloud
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm_reported, read_orthophoto
from planning.terrain.meshes.mesh_file import MeshNames, mesh_in
from planning.terrain.meshes.on_model import PlacedMesh
from planning.terrain.orthophoto import Orthophoto
from planning.terrain.projects import Project, doubts_of_name, project_of, shortened
from server.errors import BadRequestError, StorageFullError
from server.library.orthophotos import store_orthophoto
from server.library.terrains import FOLDER, Origin, spike_docs, store_terrain
from server.plan import archives
from server.plan.beside_model import offset_of, placed_on
from server.plan.cloud_points import write_points
from server.plan.cloud_task import MOST_POINTS, cloud_beside_doc
from server.plan.mesh_task import keep, laid_on
from server.schemas import CloudDoc, TerrainDoc
from server.work.jobs import Progress

_MOST_BYTES = 16 * 2**30
_CELL_M = 1.0
_MOST_SAID = 5
_LONGEST_PATH_BYTES = 1000


@dataclass(frozen=True, slots=True)
class Unpacked:
    """The files of a project; None where it has none."""

    project: Project
    model: Path
    orthophoto: Path | None
    cloud: Path | None
    offset: Path | None
    mesh: MeshNames | None = None
    archive: Path | None = None
    """In which its textured mesh is read where it lies."""


@dataclass(frozen=True, slots=True)
class Beside:
    """What is laid beside a surface model, and what was said of it."""

    photo: Orthophoto | None = None
    points: ThinnedCloud | None = None
    doc: CloudDoc | None = None
    notes: tuple[str, ...] = ()
    is_above: bool = False
    """Whether parts of the cloud stand above the model."""


def project_in(upload: Path, filename: str) -> Project | None:
    """None for an archive of tiles. Raises RasterFormatError, BadRequestError, TooLargeError."""
    with archives.opened(upload, filename) as archive:
        names = [member.filename for member in archive.infolist() if not member.is_dir()]
    project = project_of(names, where=filename)
    if project is not None:
        for name in (project.model, project.orthophoto, project.cloud, project.offset):
            _check_length(name or "", filename)
    return project


def _check_length(name: str, filename: str) -> None:
    if (length := len(name.encode(errors="surrogateescape"))) > _LONGEST_PATH_BYTES:
        what = f"A file's path in the archive has {length:,} bytes; {_LONGEST_PATH_BYTES:,} are the most."
        raise BadRequestError(what, where=filename, advice="Give its files shorter names and pack it again.")


@contextmanager
def unpacked_project(upload: Path, filename: str, project: Project, report: Progress) -> Iterator[Unpacked]:
    """As long as it is read, under names of our own. Raises RasterFormatError where it has no surface model."""
    if project.model is None:
        what = f"This {project.program} project has no surface model."
        cloud = shortened(project.cloud or "")
        advice = f"Export it with one (DSM), or open its point cloud alone ({cloud}): a model is made of it."
        raise RasterFormatError(what, where=filename, advice=advice)
    report("Unpacking", None)
    wanted = (project.model, project.orthophoto, project.cloud, project.offset)
    own = {name: f"{token_hex(8)}{PurePosixPath(name).suffix.lower()}" for name in wanted if name is not None}
    with tempfile.TemporaryDirectory(dir=upload.parent, prefix=f"{upload.stem}-") as directory:
        folder = Path(directory, "project")
        with archives.opened(upload, filename) as archive:
            mesh = mesh_in(member.filename for member in archive.infolist() if not member.is_dir())
            members = {own[name]: archive.getinfo(name) for name in own}
            archives.unpack(archive, members, folder, filename, most_bytes=_MOST_BYTES, report=report)
        model, *others = (None if name is None else folder / own[name] for name in wanted)
        assert model is not None
        yield Unpacked(project, model, *others, mesh=mesh, archive=upload)


def import_project(
    root: Path, filename: str, found: Unpacked, *, origin: Origin, params: CloudParams, without_spikes: bool,
    report: Progress,
) -> TerrainDoc:  # fmt: skip
    """What cannot be laid beside the surface model is left out and said; the model itself raises RasterError."""
    with archives.named(found.model, f"{filename}, {shortened(found.project.model or '')}"):
        dsm, said = read_dsm_reported(
            found.model,
            crs=params.crs,
            z_scale=params.z_scale,
            vertical_datum=params.vertical_datum,
            remove_spikes=without_spikes,
            progress=lambda stage, share: report("Reading the surface model", share),
        )
    found.model.unlink(missing_ok=True)  # there may be room for what is read, and not for both
    photo, cloud = _photo(found, dsm, report), _cloud(found, dsm, params, report)
    mesh, mesh_notes = _mesh(found, dsm, report)
    report("Storing", None)
    _check_room(root, dsm, photo, cloud)
    left = () if said.spikes_removed else said.spikes
    doc = store_terrain(
        root,
        dsm,
        name=filename,
        origin=origin,
        spikes=spike_docs(left),
        warnings=[
            *said.warnings,
            *doubts_of_name(found.project.model or ""),
            *photo.notes,
            *cloud.notes,
            *mesh_notes,
            *_left_out(found.project),
        ],
        cloud=cloud.doc,
        in_doubt=cloud.is_above,
        fill=lambda folder: None if cloud.points is None else write_points(folder, cloud.points),
    )
    if photo.photo is not None:
        name = shortened(PurePosixPath(found.project.orthophoto or "").name)
        with _undone(root / FOLDER / doc.id):
            store_orthophoto(root, photo.photo, name=name, terrain_id=doc.id)
    if mesh is not None and found.mesh is not None:
        with _undone(root / FOLDER / doc.id):
            keep(root, mesh, name=shortened(found.mesh.entry), terrain_id=doc.id)
    return doc


def free_bytes(root: Path) -> int:
    """Of the disk that the library lies on."""
    return shutil.disk_usage(root).free


def _check_room(root: Path, dsm: Dsm, photo: Beside, cloud: Beside) -> None:
    arrays = [dsm.elevation_m, photo.photo and photo.photo.rgb, cloud.points and cloud.points.xyz_m]
    size, room = sum(each.nbytes for each in arrays if each is not None), free_bytes(root) - archives.LEFT_FREE_BYTES
    if size > room:
        what = f"The surface model and what came with it take {size / 1e6:,.1f} MB, more than there is room for."
        raise StorageFullError(what, advice="Free some space on the disk and try again.")


@contextmanager
def _undone(terrain_dir: Path) -> Iterator[None]:
    """What fails after the model was stored leaves no model: the job says that it failed."""
    try:
        yield
    except BaseException:
        shutil.rmtree(terrain_dir, ignore_errors=True)
        raise


def _left_out(project: Project) -> list[str]:
    if not project.more:
        return []
    names = [shortened(name) for name in project.more[:_MOST_SAID]]
    more = ", ".join([*names, "..."] if len(project.more) > _MOST_SAID else names)
    return [f"Of this {project.program} project more was left out: {more}."]


def _photo(found: Unpacked, dsm: Dsm, report: Progress) -> Beside:
    """In another system it is brought into the model's; in none that it names, it is taken to be in that."""
    name, path = shortened(found.project.orthophoto or ""), found.orthophoto
    if path is None:
        return Beside()

    def read(declared_crs: str | None) -> Orthophoto:
        return read_orthophoto(
            path,
            bounds_m=dsm.bounds_m,
            crs=dsm.crs,
            declared_crs=declared_crs,
            progress=lambda stage, share: report("Reading the orthophoto", share),
        )

    report("Reading the orthophoto", 0.0)
    try:
        with archives.named(path, name):
            try:
                return Beside(photo=read(None))
            except MissingCrsError:
                note = f"{name} names no reference system: it was taken to be in the model's ({dsm.crs.name})."
                return Beside(photo=read(dsm.crs.to_wkt()), notes=(note,))
    except PlanningError as error:
        return Beside(notes=(f"The orthophoto is left out. {error}",))
    finally:
        path.unlink(missing_ok=True)


def _mesh(found: Unpacked, dsm: Dsm, report: Progress) -> tuple[PlacedMesh | None, tuple[str, ...]]:
    """One that cannot be laid on the model is left out, and that is said."""
    if found.mesh is None or found.archive is None:
        return None, ()
    try:
        return laid_on(dsm, found.archive, shortened(found.mesh.entry), found.mesh, report), ()
    except PlanningError as error:
        return None, (f"The textured mesh is left out. {error}",)


def _cloud(found: Unpacked, dsm: Dsm, params: CloudParams, report: Progress) -> Beside:
    name, path = shortened(found.project.cloud or ""), found.cloud
    if path is None:
        return Beside()
    report("Reading the point cloud", 0.0)
    # Its cells are but held against the model: large ones, so that no cloud is too large for them.
    how = CloudParams(max(_CELL_M, dsm.resolution_m), z_scale=params.z_scale, most_points=MOST_POINTS)
    try:
        with archives.named(path, name):
            made, says_where = _read(path, how, dsm, report)
            offset_m = None if found.offset is None else offset_of(found.offset)
    except PlanningError as error:
        return Beside(notes=(f"The point cloud is left out. {error}",))
    finally:
        path.unlink(missing_ok=True)
    assert made.thinned is not None
    placed = placed_on(dsm, made.thinned, made.dsm, has_crs=says_where, name=name, offset_m=offset_m)
    doc = None if placed.points is None else cloud_beside_doc(made, placed.points)
    told = tuple(f"{name}: {note}" for note in made.notes)
    return Beside(points=placed.points, doc=doc, notes=(*told, *placed.notes), is_above=placed.is_above)


def _read(path: Path, how: CloudParams, dsm: Dsm, report: Progress) -> tuple[CloudModel, bool]:
    """The cloud, and whether it names its reference system; one that does not is read in the model's."""

    def read(how: CloudParams) -> CloudModel:
        return read_cloud(path, how, progress=lambda stage, share: report("Reading the point cloud", share))

    try:
        return read(how), True
    except MissingCrsError:
        return read(replace(how, crs=dsm.crs.to_wkt())), False
