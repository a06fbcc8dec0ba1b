"""Orthophotos on disk: ``orthophotos/<id>/{manifest.json, pixels.npy}``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict
from pyproj import CRS

from planning.terrain.orthophoto import Orthophoto
from server.library.shelf import read_manifest, utc_now, write_manifest
from server.library.stored_arrays import read_array, write_array
from server.library.whole_files import new_directory, new_id
from server.schemas import OrthophotoDoc

FOLDER = "orthophotos"
_PIXELS = "pixels.npy"


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
