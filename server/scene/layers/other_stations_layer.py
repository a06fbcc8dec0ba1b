"""Vehicles of other stations in the 3D view: where each was last, where it went, who it is, and how old that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.mark_shapes import dots_node, label_node, line_node, raised
from server.scene.geometry.stage import Drawing

AHEAD_S = 5.0
"""A velocity line ends where its vehicle would have been after that."""
_DOT_PX, _LINE_PX, _PLAN_PX = 12.0, 3.0, 1.5


@dataclass(frozen=True, slots=True)
class PlacedVehicle:
    """Another station's vehicle on the surface model that is on show."""

    station: str
    number: int
    words: str
    place_m: F64
    """(3,) x, y, alt_dsm"""
    ahead_m: F64 | None
    """(3,) after ``AHEAD_S``; None: it tells no velocity"""
    is_old: bool
    line_m: F64 | None = None
    """(N, 3) what is left of the line that it flies; None: not known"""


def other_vehicle_nodes(drawing: Drawing, vehicles: Sequence[PlacedVehicle]) -> list[Node]:
    """A dot, a velocity line, a thin line where it will fly and a label each; grey where its position is old."""
    return [node for vehicle in vehicles for node in _vehicle(drawing, vehicle)]


def _vehicle(drawing: Drawing, vehicle: PlacedVehicle) -> list[Node]:
    name = f"/traffic/{vehicle.station}_{vehicle.number}"
    color = palette.TRACK
    if vehicle.is_old:
        color = tuple(palette.dimmed(color, stale=True).tolist())
    ends_m = [vehicle.place_m] if vehicle.ahead_m is None else [vehicle.place_m, vehicle.ahead_m]
    points = drawing.frame.scene_from_model(np.vstack(ends_m))
    nodes = [
        dots_node(f"{name}/at", points[:1], color, size_px=_DOT_PX),
        label_node(f"{name}/words", vehicle.words, raised(points[0], drawing.mark_m)),
    ]
    if vehicle.line_m is not None:
        left = drawing.frame.scene_from_model(np.vstack([vehicle.place_m, vehicle.line_m]))
        nodes.append(line_node(f"{name}/line", left, color, width_px=_PLAN_PX))
    if vehicle.ahead_m is not None:
        nodes.append(line_node(f"{name}/ahead", points, color, width_px=_LINE_PX))
    return nodes
