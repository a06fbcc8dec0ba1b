"""Keeps the vehicles in the 3D view where they are, ten times a second, whatever else is being drawn."""

from __future__ import annotations

from typing import get_args

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry.canvas import Canvas, Node
from server.scene.geometry.stage import Drawing
from server.scene.layers.vehicle_layers import VEHICLE_M, VehiclePose, track_nodes, vehicle_nodes
from server.schemas import Source

_SOURCES: tuple[Source, ...] = get_args(Source)
_NO_POINTS = np.zeros((0, 3))


class Vehicles:
    """Poses and paths are in the coordinates of ``dsm``, the model on show; another model forgets them all."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._drawing: Drawing | None = None
        self._poses: dict[Source, VehiclePose | None] = dict.fromkeys(_SOURCES)
        self._tracks: dict[Source, F64] = dict.fromkeys(_SOURCES, _NO_POINTS)

    @property
    def dsm(self) -> Dsm | None:
        return None if self._drawing is None else self._drawing.dsm

    def pose(self, source: Source) -> VehiclePose | None:
        return self._poses[source]

    def marks(self) -> list[tuple[F64, float]]:
        """(3,) in the scene, and radius, of every vehicle that is drawn."""
        if self._drawing is None:
            return []
        places = (pose.place_m for pose in self._poses.values() if pose is not None)
        return [(self._drawing.frame.scene_from_model(place_m), VEHICLE_M) for place_m in places]

    def move(self, source: Source, pose: VehiclePose | None) -> None:
        """None: the vehicle is nowhere on this model."""
        if pose is None and self._poses[source] is None:
            return
        self._poses[source] = pose
        self._canvas.draw(self._vehicle(source))

    def follow(self, source: Source, points_m: F64) -> None:
        """The flown path so far, (N, 3) x, y, alt_dsm."""
        if not len(points_m) and not len(self._tracks[source]):
            return
        self._tracks[source] = points_m
        self._canvas.draw(self._track(source))

    def redraw(self, drawing: Drawing | None) -> None:
        """The frame has changed, or the model: nothing of another model is shown on this one."""
        if drawing is None or self._drawing is None or drawing.dsm is not self._drawing.dsm:
            self._poses, self._tracks = dict.fromkeys(_SOURCES), dict.fromkeys(_SOURCES, _NO_POINTS)
        self._drawing = drawing
        for source in _SOURCES:
            self._canvas.draw(self._vehicle(source) | self._track(source))

    def _vehicle(self, source: Source) -> dict[str, list[Node]]:
        drawn = [] if self._drawing is None else vehicle_nodes(self._drawing, source, self._poses[source])
        return {f"vehicle_{source}": drawn}

    def _track(self, source: Source) -> dict[str, list[Node]]:
        drawn = [] if self._drawing is None else track_nodes(self._drawing, source, self._tracks[source])
        return {f"track_{source}": drawn}
