"""Layers of what happens now: searched regions, what stands in them, conflicts on the mission ahead, manoeuvres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.enu import EnuPlacing
from server.scene.geometry.mark_shapes import GEM, label_node, line_node, raised, shape_node
from server.scene.geometry.stage import Drawing
from server.scene.layers.voxel_layers import HUES
from telemetry.topics.obstacles import MissionConflict, PerceptionStatus, Region, Sensor

_ARC_PIECES = 12
_FREE_PX, _OCCUPIED_PX = 2.0, 5.0
_FILL_OPACITY = 0.4


@dataclass(frozen=True, slots=True)
class Route:
    """A prepared manoeuvre as it is drawn."""

    kind: str
    points_enu_m: F64
    """(N, 3) from the vehicle on, in the maps' frame"""
    words: str


def region_nodes(
    drawing: Drawing, placing: EnuPlacing, statuses: Mapping[Sensor, PerceptionStatus], *, prefix: str
) -> list[Node]:
    """The sector of each sensor as a frame in its colour; one that holds an obstacle is filled, thick and red."""
    if not drawing.state.view.show_regions:
        return []
    nodes = []
    for sensor, status in statuses.items():
        if status.region is not None and status.state == "running" and status.placed:
            nodes += _region(drawing, placing, sensor, status.region, f"{prefix}/region_{sensor}")
    return nodes


def conflict_nodes(
    drawing: Drawing, placing: EnuPlacing, statuses: Mapping[Sensor, PerceptionStatus], *, prefix: str
) -> list[Node]:
    """A mark at the first place of the mission ahead that the map comes too near to."""
    found = [status.conflict for status in statuses.values() if status.conflict is not None]
    if not found:
        return []
    first = min(found, key=lambda conflict: conflict.ahead_m)
    at = drawing.frame.scene_from_model(placing.model_from_enu(np.array(first.enu_m)))[0]
    top = raised(at, 4.0 * drawing.mark_m)
    return [
        shape_node(f"{prefix}/conflict", GEM, at, drawing.body_m, palette.INSIDE),
        line_node(f"{prefix}/conflict_pole", np.stack([at, top]), palette.INSIDE, width_px=2.0),
        label_node(f"{prefix}/conflict_words", _conflict_words(first), top),
    ]


def route_nodes(drawing: Drawing, placing: EnuPlacing, routes: Sequence[Route], *, prefix: str) -> list[Node]:
    nodes = []
    for route in routes:
        if len(route.points_enu_m) < 2:
            continue
        points = drawing.frame.scene_from_model(placing.model_from_enu(route.points_enu_m))
        name = f"{prefix}/route_{route.kind}"
        nodes += [
            line_node(name, points, palette.ACCENT, width_px=4.0),
            label_node(f"{name}_words", route.words, raised(points[len(points) // 2], drawing.mark_m)),
        ]
    return nodes


def sector_corners_enu_m(region: Region) -> F64:
    """(2, P, 3): lower and upper outline, tip first; an obstacle in between is what the sensor's node looks for."""
    spread = np.linspace(-region.fov_rad / 2, region.fov_rad / 2, _ARC_PIECES + 1) + region.heading_rad
    east, north, up = region.enu_m
    arc = np.column_stack([east + region.depth_m * np.sin(spread), north + region.depth_m * np.cos(spread)])
    outline = np.concatenate([[[east, north]], arc])
    half_m = region.height_m / 2
    return np.stack([np.column_stack([outline, np.full(len(outline), up + z)]) for z in (-half_m, half_m)])


def _region(drawing: Drawing, placing: EnuPlacing, sensor: Sensor, region: Region, name: str) -> list[Node]:
    corners = sector_corners_enu_m(region)
    count = corners.shape[1]
    flat = drawing.frame.scene_from_model(placing.model_from_enu(corners.reshape(-1, 3)))
    low, high = flat[:count], flat[count:]
    color = palette.INSIDE if region.occupied else HUES[sensor]
    width_px = _OCCUPIED_PX if region.occupied else _FREE_PX
    around = np.concatenate([low, low[:1], high, high[:1]])
    nodes = [line_node(name, around, color, width_px=width_px)]
    if region.occupied:
        nodes.append(_fill(f"{name}_fill", low, high))
    return nodes


def _fill(name: str, low: F64, high: F64) -> Node:
    """The closed body of the sector, seen through."""
    count = len(low)
    ring = np.arange(count)
    after = (ring + 1) % count
    fan = np.column_stack([np.zeros(count - 2, dtype=np.intp), ring[1:-1], ring[2:]])
    sides = [np.column_stack([ring, after, ring + count]), np.column_stack([after, after + count, ring + count])]
    faces = np.concatenate([fan, fan + count, *sides])
    props = {
        "vertices": np.concatenate([low, high]).astype(np.float32),
        "faces": faces.astype(np.uint32),
        "color": palette.INSIDE,
        "opacity": _FILL_OPACITY,
        "side": "double",
        "cast_shadow": False,
        "receive_shadow": False,
    }
    return Node(name, "mesh_simple", props)


def _conflict_words(conflict: MissionConflict) -> str:
    when = "" if conflict.time_s is None or not math.isfinite(conflict.time_s) else f", {conflict.time_s:.0f} s"
    return f"In the way: {conflict.ahead_m:.0f} m ahead{when}"
