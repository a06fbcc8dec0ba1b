"""Small shapes that marks are made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import trimesh

from mapping.geometry.arrays import F32, F64, U8, U32
from server.scene.geometry.canvas import Node

Rgb = tuple[int, int, int]
_UNSHADED = {"cast_shadow": False, "receive_shadow": False}


def _shape(mesh: trimesh.Trimesh) -> tuple[F32, U32]:
    return np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.uint32)


BALL = _shape(trimesh.creation.icosphere(subdivisions=2, radius=1.0))
GEM = _shape(trimesh.creation.icosphere(subdivisions=0, radius=1.0))
CONE = _shape(trimesh.creation.cone(radius=1.0, height=2.4, sections=24))


def line_node(name: str, points: F64, color: Rgb | U8, *, width_px: float) -> Node:
    """A polyline through (N, 3) scene points, parted where one is nowhere; ``color`` is one, or (N - 1, 3): one per
    segment."""
    segments = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
    colors = linear_light(np.asarray(color, dtype=np.uint8))
    # One colour for each end of each segment: viser takes a single colour for sRGB.
    ends = np.broadcast_to(colors[..., None, :] if colors.ndim == 2 else colors, (len(segments), 2, 3)).copy()
    known = np.isfinite(segments).all(axis=(1, 2))
    props = {"points": segments[known], "colors": ends[known], "thickness": width_px, "thickness_units": "screen"}
    return Node(name, "line_segments", props)


def dots_node(name: str, at: F64, color: Rgb | U8, *, size_px: float) -> Node:
    """Dots at (N, 3) scene points, equally large from near and far; ``color`` is one, or (N, 3)."""
    ends = np.stack([at, raised(at, 0.01)], axis=1).astype(np.float32)
    colors = linear_light(np.broadcast_to(np.asarray(color, dtype=np.uint8), (len(ends), 3)))
    pair = np.repeat(colors[:, None], 2, axis=1)
    return Node(
        name,
        "line_segments",
        {"points": ends, "colors": pair, "thickness": size_px, "thickness_units": "screen"},
    )


def shape_node(name: str, shape: tuple[F32, U32], at: F64, size: float, color: Rgb) -> Node:
    props = {"vertices": shape[0], "faces": shape[1], "scale": size, "color": color, "position": _triple(at)}
    return Node(name, "mesh_simple", {**props, **_UNSHADED})


def many_node(name: str, shape: tuple[F32, U32], at: F64, size: float, colors: Rgb | U8) -> Node:
    """The same shape at (N, 3) scene points."""
    positions = np.asarray(at, dtype=np.float32)
    upright = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(positions), 1))
    props: Mapping[str, Any] = {
        "vertices": shape[0],
        "faces": shape[1],
        "batched_positions": positions,
        "batched_wxyzs": upright,
        "batched_scales": np.full(len(positions), size, dtype=np.float32),
        "batched_colors": np.broadcast_to(np.asarray(colors, dtype=np.uint8), positions.shape).copy(),
        "lod": "off",
    }
    return Node(name, "batched_meshes_simple", {**props, **_UNSHADED})


def label_node(name: str, text: str, at: F64, *, size: float = 1.0, anchor: str = "bottom-center") -> Node:
    """A label that hides behind nothing; ``anchor`` is the part of it that stands on its place."""
    props = {"text": text, "position": _triple(at), "anchor": anchor, "font_screen_scale": size}
    return Node(name, "label", props)


def linear_light(srgb: U8) -> U8:
    """viser takes the colours of lines, and of meshes in batches, for linear light; those of single meshes for sRGB."""
    share = srgb / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.round(255 * linear).astype(np.uint8)


def raised(at: F64, by: float) -> F64:
    """(..., 3) scene points, higher by so much."""
    return at + np.array([0.0, 0.0, by])


def _triple(at: F64) -> tuple[float, float, float]:
    return float(at[0]), float(at[1]), float(at[2])
