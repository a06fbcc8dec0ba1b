"""Pictures of surface models on disk: ``orthophotos/<id>/{manifest.json, pixels.npy}``, and textured meshes:
``meshes/<id>/{manifest.json, mesh.npy}``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict
from pyproj import CRS

from mapping.geometry.arrays import F64
from planning.terrain.orthophoto import Orthophoto
from server.library.shelf import read_manifest, utc_now, write_manifest
from server.library.stored_arrays import read_array, write_array
from server.library.whole_files import new_directory, new_id
from server.schemas import MeshDoc, OrthophotoDoc

FOLDER = "orthophotos"
MESHES = "meshes"
_PIXELS, _GLB = "pixels.npy", "mesh.npy"


class OrthophotoManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: OrthophotoDoc
    height_px: int
    width_px: int
    bounds_m: tuple[float, float, float, float]
    crs_wkt: str


def store_orthophoto(root: Path, photo: Orthophoto, *, name: str, terrain_id: str) -> OrthophotoDoc:
    """Adds a photo to the data directory ``root``, from any process; raises ``StorageFullError``."""
    photo_id = new_id()
    height_px, width_px = photo.known.shape
    manifest = OrthophotoManifest(
        doc=OrthophotoDoc(id=photo_id, name=name, terrain_id=terrain_id, added_utc=utc_now()),
        height_px=height_px,
        width_px=width_px,
        bounds_m=photo.bounds_m,
        crs_wkt=photo.crs.to_wkt(),
    )
    # Colours and coverage in one file: alpha 0 where nothing was photographed.
    alpha = np.where(photo.known, 255, 0).astype(np.uint8)
    with new_directory(root / FOLDER / photo_id) as folder:
        write_array(folder / _PIXELS, np.dstack([photo.rgb, alpha]))
        write_manifest(folder, manifest)
    return manifest.doc


def load_orthophoto(directory: Path) -> Orthophoto:
    """The photo in this folder; raises ``StorageError`` when it is damaged."""
    manifest = read_manifest(directory, OrthophotoManifest)
    shape = (manifest.height_px, manifest.width_px, 4)
    pixels = read_array(directory / _PIXELS, shape=shape, dtype=np.uint8)
    return Orthophoto(
        rgb=pixels[..., :3],
        known=pixels[..., 3] > 0,
        bounds_m=manifest.bounds_m,
        crs=CRS.from_wkt(manifest.crs_wkt),
    )


class MeshManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: MeshDoc
    origin_m: tuple[float, float, float]
    """x, y, alt_dsm of the mesh's zero."""
    size_bytes: int


def store_mesh(
    root: Path, glb: bytes, origin_m: F64, *, name: str, terrain_id: str, triangles: int, shift_m: float,
    notes: Sequence[str],
) -> MeshDoc:  # fmt: skip
    """Adds a mesh as binary glTF, z up from its origin, to the data directory; raises ``StorageFullError``."""
    mesh_id = new_id()
    doc = MeshDoc(
        id=mesh_id, name=name, terrain_id=terrain_id, triangles=triangles, shift_m=shift_m, notes=list(notes),
        added_utc=utc_now(),
    )  # fmt: skip
    x_m, y_m, alt_dsm_m = (float(each) for each in origin_m)
    with new_directory(root / MESHES / mesh_id) as folder:
        write_array(folder / _GLB, np.frombuffer(glb, np.uint8))
        write_manifest(folder, MeshManifest(doc=doc, origin_m=(x_m, y_m, alt_dsm_m), size_bytes=len(glb)))
    return doc


def load_mesh(directory: Path) -> tuple[bytes, F64]:
    """Binary glTF and (3,) its origin; raises ``StorageError`` when it is damaged."""
    manifest = read_manifest(directory, MeshManifest)
    glb = read_array(directory / _GLB, shape=(manifest.size_bytes,), dtype=np.uint8).tobytes()
    return glb, np.array(manifest.origin_m)
