"""Layer of other aircraft: where each should be by now, how surely, where it goes, and who it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry import palette
from server.scene.geometry.canvas import Canvas, Node
from server.scene.geometry.mark_shapes import dots_node, label_node, line_node, raised
from server.scene.geometry.stage import Drawing
from server.scene.layers.other_stations_layer import PlacedVehicle, other_vehicle_nodes
from telemetry.topics.traffic import OLD_S, Aircraft

LINE_S = 15.0
"""A velocity line ends where its aircraft will be then."""
MOST = 32
"""Who may come too near first, then the nearest."""
_PIECES = 24
_DOT_PX, _LINE_PX, _CONFLICT_PX, _RING_PX = 14.0, 3.0, 6.0, 1.5


@dataclass(frozen=True, slots=True)
class PlacedAircraft:
    """An aircraft on the surface model that is on show."""

    it: Aircraft
    place_m: F64
    """(3,) x, y, alt_dsm; at the vehicle's own height where nobody knows better"""
    ahead_m: F64
    """(3,) after ``LINE_S``"""


class TrafficStage:
    """Places are in the coordinates of ``dsm``, the model on show."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self.drawing: Drawing | None = None
        self._is_drawn = False

    @property
    def dsm(self) -> Dsm | None:
        return None if self.drawing is None else self.drawing.dsm

    def redraw(self, drawing: Drawing | None) -> None:
        """Another model, frame or choice of layers; the aircraft are drawn again at the next turn."""
        self.drawing = drawing

    def show(self, aircraft: Sequence[PlacedAircraft], others: Sequence[PlacedVehicle] = ()) -> None:
        """``others``: vehicles of other stations."""
        nodes = list[Node]()
        if self.drawing is not None:
            nodes = [*traffic_nodes(self.drawing, aircraft), *other_vehicle_nodes(self.drawing, others)]
        if nodes or self._is_drawn:
            self._canvas.draw({"traffic": nodes})
        self._is_drawn = bool(nodes)


def traffic_nodes(drawing: Drawing, aircraft: Sequence[PlacedAircraft]) -> list[Node]:
    """A dot, a velocity line, a ring of uncertainty and a label each; thick and red where it may come too near."""
    if not drawing.state.view.show_traffic:
        return []
    return [node for placed in aircraft[:MOST] for node in _aircraft(drawing, placed)]


def _aircraft(drawing: Drawing, placed: PlacedAircraft) -> list[Node]:
    it, name = placed.it, f"/traffic/{placed.it.key.replace(' ', '_')}"
    color = palette.TRACK_DANGEROUS if it.conflict else palette.TRACK
    if it.age_s > OLD_S:
        color = tuple(palette.dimmed(color, stale=True).tolist())
    turn = np.linspace(0.0, math.tau, _PIECES + 1)
    around = it.within_m * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(_PIECES + 1)])
    at, ahead, *ring = drawing.frame.scene_from_model(
        np.vstack([placed.place_m, placed.ahead_m, placed.place_m + around])
    )
    nodes = [
        dots_node(f"{name}/at", at[None], color, size_px=_DOT_PX),
        line_node(f"{name}/within", np.array(ring), color, width_px=_RING_PX),
        label_node(f"{name}/words", label(it), raised(at, drawing.mark_m)),
    ]
    if it.velocity_enu_m_s is not None:
        width_px = _CONFLICT_PX if it.conflict else _LINE_PX
        nodes.append(line_node(f"{name}/ahead", np.stack([at, ahead]), color, width_px=width_px))
    return nodes


def label(it: Aircraft) -> str:
    """ "DEABC +80 m, 12 s old" """
    height = "height ?" if it.height_m is None else f"{it.height_m:+.0f} m"
    old = f", {it.age_s:.0f} s old" if it.age_s > OLD_S else ""
    return f"{it.name} {height}{old}"
