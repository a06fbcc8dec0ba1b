"""What a worker does with a textured mesh: it is laid on the surface model that it belongs to, or refused in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planning.errors import RasterFormatError
from planning.terrain.dsm import Dsm
from planning.terrain.meshes.mesh_file import MeshNames, is_mesh, mesh_in, read_mesh
from planning.terrain.meshes.on_model import PlacedMesh, placed_on
from server.library.orthophotos import store_mesh
from server.library.terrains import load_terrain
from server.plan import archives
from server.scene.geometry.glb import parted_glb
from server.schemas import MeshDoc
from server.work.jobs import Progress

_STAGES = {
    "choose": "Choosing the level of detail", "mesh": "Reading the mesh", "pictures": "Reading the mesh's pictures"
}  # fmt: skip
_RASTERS = (".tif", ".tiff", ".asc")


def mesh_of(upload: Path, filename: str) -> MeshNames | bool:
    """Where a mesh begins in an archive that holds no raster; True for a file that is one by itself, else False."""
    if not archives.is_archive(upload):
        return is_mesh(upload)
    with archives.opened(upload, filename) as archive:
        names = [member.filename for member in archive.infolist() if not member.is_dir()]
    return False if any(name.lower().endswith(_RASTERS) for name in names) else mesh_in(names) or False


def import_mesh(
    root: Path, upload: Path, filename: str, names: MeshNames | None, terrain_dir: Path | None, terrain_id: str, *,
    report: Progress,
) -> MeshDoc:  # fmt: skip
    """Onto the surface model in ``terrain_dir``. Raises RasterError."""
    if terrain_dir is None:
        raise RasterFormatError(
            "This is a textured mesh: it is drawn over a surface model, and none is open.",
            where=filename,
            advice="Open the surface model (DSM) of the same area first, then drop the mesh again.",
        )
    dsm = load_terrain(terrain_dir)
    placed = laid_on(dsm, upload, filename, names, report)
    report("Storing", None)
    return keep(root, placed, name=filename, terrain_id=terrain_id)


def laid_on(dsm: Dsm, upload: Path, name: str, names: MeshNames | None, report: Progress) -> PlacedMesh:
    """Raises RasterError."""
    report("Reading the mesh", None)
    mesh = read_mesh(upload, names, where=name, progress=lambda stage, share: report(_STAGES.get(stage, stage), share))
    report("Laying the mesh on the surface model", None)
    return placed_on(dsm, mesh, name=name)


def keep(root: Path, placed: PlacedMesh, *, name: str, terrain_id: str) -> MeshDoc:
    """As the browser gets it: in 32 bits from the middle of its lowest level."""
    xyz_m = placed.mesh.xyz_m
    low_m, high_m = xyz_m.min(axis=0), xyz_m.max(axis=0)
    origin_m = np.array([*(low_m + high_m)[:2] / 2, low_m[2]])
    glb = parted_glb(placed.mesh, (xyz_m - origin_m).astype(np.float32))
    return store_mesh(
        root, glb, origin_m, name=name, terrain_id=terrain_id, triangles=len(placed.mesh.faces),
        shift_m=placed.shift_m, notes=placed.notes,
    )  # fmt: skip
