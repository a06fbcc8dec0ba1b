"""Layer of a map: one node per chunk of 32 m for what was seen, one for known ground, as boxes of one shape each.

A chunk that changes keeps the size of its arrays for as long as it can, so that only places and colours travel:
15 bytes for each box.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import trimesh

from mapping.geometry.arrays import F64, U8
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.enu import EnuPlacing
from server.scene.geometry.mark_shapes import linear_light
from server.scene.geometry.stage import Drawing
from server.scene.mirror import CHUNK_M, ChunkKey, Voxels
from telemetry.perception.showing import MOST_POINTS
from telemetry.topics.looks import CloudLook, points_enu_m
from telemetry.topics.obstacles import MapName

POINT_M = 0.12
HUES: Mapping[MapName, tuple[int, int, int]] = {
    "radar": palette.RADAR,
    "vision": palette.VISION,
    "ranges": palette.VISION,
    "vision_flight": palette.VISION_FLIGHT,
}
_SEEN_SHARE, _FLIGHT_SHARE, _GROUND_SHARE = 0.94, 0.8, 0.4
"""Of a voxel's edge: gaps show the single voxels, what the camera sees now covers what it has seen, and known ground
hides neither the model nor what stands on it."""
_LEAST_CAPACITY, _GROWTH = 32, 1.3


@dataclass(frozen=True, slots=True)
class ChunkPlace:
    """Where a chunk stands in the scene, and how it is turned there."""

    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]
    stretch: float


def chunk_place(drawing: Drawing, placing: EnuPlacing, key: ChunkKey) -> ChunkPlace:
    corner_enu_m = np.array(key, dtype=np.float64) * CHUNK_M
    x, y, z = drawing.frame.scene_from_model(placing.model_from_enu(corner_enu_m))[0].tolist()
    half = placing.turn_rad(corner_enu_m) / 2
    return ChunkPlace((x, y, z), (math.cos(half), 0.0, 0.0, math.sin(half)), drawing.frame.exaggeration)


def chunk_nodes(
    name: str, of: MapName, key: ChunkKey, voxels: Voxels, place: ChunkPlace, *, with_ground: bool
) -> list[Node]:
    """``voxels`` as coarse as they are to be drawn; their number decides which arrays are as long as before."""
    corner_m = np.array(key, dtype=np.float64) * CHUNK_M
    local_m = voxels.centres_enu_m - corner_m
    seen = ~voxels.explained
    probability = voxels.probability[seen] / 255.0
    colors = palette.probability_rgb(HUES[of], probability)
    nodes = _boxes(f"{name}/seen", local_m[seen], colors, _seen_share(of) * voxels.resolution_m, place)
    if with_ground:
        grey = np.broadcast_to(np.array(palette.KNOWN_GROUND, dtype=np.uint8), (int((~seen).sum()), 3))
        nodes += _boxes(f"{name}/ground", local_m[~seen], grey, _GROUND_SHARE * voxels.resolution_m, place)
    return nodes


def _seen_share(of: MapName) -> float:
    return _FLIGHT_SHARE if of == "vision_flight" else _SEEN_SHARE


def sent_bytes(before: list[Node], after: list[Node]) -> int:
    """What the difference costs on its way to one page, but for its names."""
    old = {node.name: node for node in before}
    return sum(_cost(old.get(node.name), node) for node in after)


def _cost(old: Node | None, new: Node) -> int:
    arrays = {key: value for key, value in new.props.items() if isinstance(value, np.ndarray)}
    if old is None or any(np.shape(old.props[key]) != value.shape for key, value in arrays.items()):
        return sum(value.nbytes for value in arrays.values())
    return sum(value.nbytes for key, value in arrays.items() if not np.array_equal(old.props[key], value))


def _boxes(name: str, local_m: F64, colors: U8, edge_m: float, place: ChunkPlace) -> list[Node]:
    if not len(local_m):
        return []
    vertices, faces = _box(edge_m, place.stretch)
    at = _filled_up((local_m * [1.0, 1.0, place.stretch]).astype(np.float32))
    upright = np.zeros((len(at), 4), dtype=np.float32)
    upright[:, 0] = 1.0
    props: dict[str, Any] = {
        "vertices": vertices,
        "faces": faces,
        "batched_positions": at,
        "batched_wxyzs": upright,
        "batched_colors": _filled_up(linear_light(colors)),
        "flat_shading": True,
        "lod": "off",
        "position": place.position,
        "wxyz": place.wxyz,
        "cast_shadow": False,
        "receive_shadow": False,
    }
    return [Node(name, "batched_meshes_simple", props)]


def _filled_up(rows: np.ndarray) -> np.ndarray:
    """Longer by copies of the first row, which nobody sees, so that a few more boxes fit next time."""
    capacity = _LEAST_CAPACITY
    while capacity < len(rows):
        capacity = math.ceil(capacity * _GROWTH)
    return np.concatenate([rows, np.broadcast_to(rows[:1], (capacity - len(rows), rows.shape[1]))])


@lru_cache(maxsize=64)
def _box(edge_m: float, stretch: float) -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.box((edge_m, edge_m, edge_m * stretch))
    return np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.uint32)


def cloud_nodes(drawing: Drawing, placing: EnuPlacing, look: CloudLook | None, *, prefix: str) -> list[Node]:
    """Always as long: only places travel, 6 bytes a point."""
    if look is None or not drawing.state.view.show_cloud or not look.points_cm:
        return []
    points = drawing.frame.scene_from_model(placing.model_from_enu(points_enu_m(look)))[:MOST_POINTS]
    middle = points.mean(axis=0)
    at = np.concatenate([points, np.broadcast_to(points[:1], (MOST_POINTS - len(points), 3))]) - middle
    x, y, z = (float(value) for value in middle)
    props = {
        "points": at.astype(np.float16),
        "colors": palette.VISION,
        "point_size": POINT_M * math.sqrt(drawing.frame.exaggeration),
        "point_shape": "circle",
        "position": (x, y, z),
    }
    return [Node(f"{prefix}/cloud", "point_cloud", props)]
