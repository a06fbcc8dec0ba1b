"""Keeps the vehicles in the 3D view where they are, ten times a second, whatever else is being drawn."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry.canvas import Canvas, Node
from server.scene.geometry.stage import Drawing
from server.scene.layers.vehicle_layers import REPLAY, VEHICLE_M, VehiclePose, track_nodes, vehicle_nodes, way_nodes
from server.schemas import Source
from server.schemas.station_docs import FIRST_VEHICLE


def actor_of(source: Source, vehicle: int) -> str:
    """What a vehicle is called on the stage: there is one of a recording, and each that lives."""
    if source == "replay":
        return REPLAY
    return source if vehicle == FIRST_VEHICLE else f"{source}_{vehicle}"


_NO_POINTS = np.zeros((0, 3))


class Vehicles:
    """Poses and paths are in the coordinates of ``dsm``, the model on show; another model forgets them all."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._drawing: Drawing | None = None
        self._poses: dict[str, VehiclePose | None] = {}
        self._tracks: dict[str, F64] = {}
        self._ways: dict[str, tuple[F64, bool]] = {}

    @property
    def dsm(self) -> Dsm | None:
        return None if self._drawing is None else self._drawing.dsm

    def pose(self, actor: str) -> VehiclePose | None:
        return self._poses.get(actor)

    def marks(self) -> list[tuple[F64, float]]:
        """(3,) in the scene, and radius, of every vehicle that is drawn."""
        if self._drawing is None:
            return []
        places = (pose.place_m for pose in self._poses.values() if pose is not None)
        return [(self._drawing.frame.scene_from_model(place_m), VEHICLE_M) for place_m in places]

    def move(self, actor: str, pose: VehiclePose | None) -> None:
        """None: the vehicle is nowhere on this model."""
        if pose is None and self._poses.get(actor) is None:
            return
        self._poses[actor] = pose
        self._canvas.draw(self._vehicle(actor))

    def follow(self, actor: str, points_m: F64) -> None:
        """The flown path so far, (N, 3) x, y, alt_dsm, parted where a row is NaN."""
        if not len(points_m) and not len(self._tracks.get(actor, _NO_POINTS)):
            return
        self._tracks[actor] = points_m
        self._canvas.draw(self._track(actor))

    def lead(self, actor: str, points_m: F64, *, is_certified: bool = True) -> None:
        """The guided way that is judged or flown, (K, 3) x, y, alt_dsm; none where it is empty."""
        if not len(points_m) and actor not in self._ways:
            return
        self._ways[actor] = points_m, is_certified
        self._canvas.draw(self._way(actor))

    def redraw(self, drawing: Drawing | None) -> None:
        """The frame has changed, or the model: nothing of another model is shown on this one."""
        if drawing is None or self._drawing is None or drawing.dsm is not self._drawing.dsm:
            self._poses, self._tracks = dict.fromkeys(self._poses), dict.fromkeys(self._tracks, _NO_POINTS)
            self._ways = dict.fromkeys(self._ways, (_NO_POINTS, True))
        self._drawing = drawing
        for actor in {**self._poses, **self._tracks, **self._ways}:
            self._canvas.draw(self._vehicle(actor) | self._track(actor) | self._way(actor))

    def _vehicle(self, actor: str) -> dict[str, list[Node]]:
        drawn = [] if self._drawing is None else vehicle_nodes(self._drawing, actor, self._poses.get(actor))
        return {f"vehicle_{actor}": drawn}

    def _track(self, actor: str) -> dict[str, list[Node]]:
        track_m = self._tracks.get(actor, _NO_POINTS)
        drawn = [] if self._drawing is None else track_nodes(self._drawing, actor, track_m)
        return {f"track_{actor}": drawn}

    def _way(self, actor: str) -> dict[str, list[Node]]:
        points_m, is_certified = self._ways.get(actor, (_NO_POINTS, True))
        drawn = [] if self._drawing is None else way_nodes(self._drawing, actor, points_m, is_certified=is_certified)
        return {f"way_{actor}": drawn}
