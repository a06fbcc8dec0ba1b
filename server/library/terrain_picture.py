"""A surface model's relief as a small picture, to tell it from others in a list."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np

from server.library.terrains import load_terrain

LONGER_SIDE_PX = 96


def terrain_picture_png(directory: Path) -> bytes:
    """PNG with the model's relief; unknown cells are transparent. Raises ``StorageError`` for a damaged model.

    One cell of each block is read: a large model is never read whole.
    """
    from PIL import Image

    dsm = load_terrain(directory)
    every = max(1, math.ceil(max(dsm.height_px, dsm.width_px) / LONGER_SIDE_PX))
    height_m = np.asarray(dsm.elevation_m[every // 2 :: every, every // 2 :: every], dtype=np.float64)
    known = np.isfinite(height_m)
    filled = np.where(known, height_m, np.nanmin(height_m) if known.any() else 0.0)
    grey = _relief(filled, every * dsm.resolution_m)
    picture = np.dstack([grey, grey, grey, np.where(known, 255, 0).astype(np.uint8)])
    stream = io.BytesIO()
    Image.fromarray(picture, "RGBA").save(stream, "PNG")
    return stream.getvalue()


def _relief(height_m: np.ndarray, step_m: float) -> np.ndarray:
    """Light from the north-west on the slopes, half of it for how high a place lies; (H, W) uint8."""
    light = np.zeros_like(height_m)
    if min(height_m.shape) > 1:
        south, east = np.gradient(height_m, step_m)
        light = (south - east) / np.sqrt(2 * (1 + south**2 + east**2))
    span_m = float(np.ptp(height_m)) or 1.0
    share = 0.5 + 0.35 * light + 0.3 * ((height_m - height_m.min()) / span_m - 0.5)
    return (np.clip(share, 0, 1) * 255).astype(np.uint8)
