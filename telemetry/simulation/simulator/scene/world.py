"""A simulated world: its ground and the shapes on it, to be looked at, hit and flown into."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Self

import numpy as np

from mapping.geometry.arrays import F64, I32
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3
from telemetry.simulation.simulator.scene.ground_columns import SceneTerrain
from telemetry.simulation.simulator.scene.placed_shapes import moved, place
from telemetry.simulation.simulator.scene.primitives import bounding_spheres, distances, top_under
from telemetry.simulation.simulator.scene.ray_bundle import Hits, cast
from telemetry.simulation.simulator.scene.world_file import WorldFile, parse_world, read_world
from telemetry.simulation.simulator.scene.world_shapes import GROUND as GROUND_MATERIAL

MOST_AWAY_M = 50_000.0
"""Between the file's origin and the frame's: the frame is a plane."""


class World:
    """Places are east, north, up in metres from the frame's origin, on the ground there."""

    def __init__(self, file: WorldFile, frame: NeuFrame, terrain: SceneTerrain) -> None:
        self.name = file.name
        self.frame = frame
        self.terrain = terrain
        self.shapes = file.shapes
        origin = file.origin
        north, east, _ = (
            frame.neu_from_geodetic(origin.lat_deg, origin.lon_deg, frame.alt_amsl_m) if origin else (0.0, 0.0, 0.0)
        )
        away_m = math.hypot(north, east)
        if away_m > MOST_AWAY_M:
            raise ParameterError(
                f"The world's origin lies {away_m / 1000:.0f} km from the vehicle's home.",
                where=file.name or "simulated world",
                advice="Give a home in the world, or leave the origin out of the file.",
            )
        self._shift_m = (east, north)
        self._moves = any(shape.motion for shape in file.shapes)
        self.placed = place(file.shapes, terrain, self._shift_m)
        self._spheres = bounding_spheres(self.placed.rows)

    @classmethod
    def load(
        cls, path: Path, *, frame: NeuFrame | None = None, terrain: SceneTerrain | None = None, dsm: Dsm | None = None
    ) -> Self:
        """A world file. ``frame`` is the vehicle's; without one it is the file's own origin.

        ``terrain`` or ``dsm`` takes the place of the surface model that the file names; with none of them the ground
        is level. Raises FormatError for a broken file, ParameterError for one of another place and a RasterError
        for a broken surface model.
        """
        return cls._made(read_world(path), frame, terrain, dsm)

    @classmethod
    def parse(
        cls,
        data: object,
        *,
        frame: NeuFrame | None = None,
        terrain: SceneTerrain | None = None,
        dsm: Dsm | None = None,
        folder: Path | None = None,
    ) -> Self:
        """As ``load``, from a JSON document that has been parsed."""
        return cls._made(parse_world(data, folder=folder), frame, terrain, dsm)

    @classmethod
    def empty(cls, frame: NeuFrame, *, terrain: SceneTerrain | None = None, dsm: Dsm | None = None) -> Self:
        """Nothing but ground: level unless a surface model is given."""
        return cls._made(WorldFile("", None, None, ()), frame, terrain, dsm)

    @classmethod
    def _made(cls, file: WorldFile, frame: NeuFrame | None, terrain: SceneTerrain | None, dsm: Dsm | None) -> Self:
        if terrain is None and dsm is None and file.dsm:
            # What reads rasters takes a second to load.
            from planning.terrain.geotiff import read_dsm

            dsm = read_dsm(file.dsm)
        if frame is None:
            frame = _own_frame(file, dsm)
        if terrain is None:
            terrain = SceneTerrain.from_dsm(dsm, frame) if dsm else SceneTerrain.level()
        return cls(file, frame, terrain)

    def at(self, t_s: float) -> Self:
        """The world at that simulated time: what moves stands where it is then. This one shows the beginning."""
        if not self._moves:
            return self
        then = copy.copy(self)
        then.placed = moved(self.placed, self.shapes, self.terrain, self._shift_m, t_s)
        then._spheres = bounding_spheres(then.placed.rows)
        return then

    @property
    def ground(self) -> SceneTerrain:
        """For the vehicle to stand on."""
        return self.terrain

    @property
    def reflectors(self) -> F64:
        """(K, 3) middles of the corner reflectors."""
        rows = self.placed.rows[self.placed.corner_m2 > 0]
        return np.column_stack([rows[:, 1], rows[:, 2], (rows[:, 3] + rows[:, 4]) / 2])

    def ground_up_m(self, east_m: float, north_m: float) -> float:
        return self.terrain.up_m(north_m, east_m)

    def distance_m(self, points_enu: F64) -> F64:
        """(N, 3) -> (N,) to the nearest shape, 0 inside of it; inf in a world without. The ground does not count."""
        return np.maximum(0.0, self._nearest(points_enu)[0])

    def surface_distance_m(self, points_enu: F64) -> F64:
        """(N, 3) -> (N,) to the nearest surface, from either side: shapes' or the ground's.

        The ground is looked at straight down and within one step of 0.5 m to all sides.
        """
        points = np.asarray(points_enu, dtype=np.float64).reshape(-1, 3)
        return np.minimum(np.abs(self._nearest(points)[0]), self.terrain.distance_m(points))

    def touching(self, p_enu: Vec3, radius_m: float) -> str | None:
        """The shape that a ball of this radius touches."""
        nearest_m, index = self._nearest(np.array([p_enu], dtype=np.float64))
        if nearest_m[0] > radius_m:
            return None
        return self.shapes[self.placed.owner[index[0]]].name

    def top_under_m(self, p_enu: Vec3) -> float:
        """Height of the highest solid shape under a place, -inf without one. Crowns carry nobody."""
        return float(top_under(self.placed.rows, *p_enu))

    def cast(self, origin_enu: F64, directions_enu: F64, luck: F64, *, most_m: float, near: I32) -> Hits:
        """What rays meet first; ``near`` are the numbers of the primitives that come into question (``ahead``)."""
        return cast(self.terrain, self.placed.rows[near], near, origin_enu, directions_enu, luck, most_m=most_m)

    def ahead(self, origin_enu: F64, axis_enu: F64, *, within_m: float, half_angle_rad: float) -> I32:
        """Numbers of the primitives that may be that near and in a cone around the axis; nearest first."""
        offset, radius = self._spheres[:, :3] - origin_enu, self._spheres[:, 3]
        away = np.linalg.norm(offset, axis=1)
        outside = away > radius
        half_size = np.arcsin(np.divide(radius, away, out=np.ones_like(away), where=outside))
        off = np.arccos(np.clip(offset @ axis_enu / np.maximum(away, 1e-9), -1.0, 1.0))
        kept = (away - radius <= within_m) & (~outside | (off - half_size <= half_angle_rad))
        order = np.argsort((away - radius)[kept], kind="stable")
        return np.flatnonzero(kept)[order].astype(np.int32)

    def reflectivity(self, what: I32) -> F64:
        """Radar cross section over the area seen, of what rays met; nothing has none."""
        return self._of(what, self.placed.reflectivity, 10 ** (GROUND_MATERIAL.reflectivity_db / 10), 0.0)

    def texture(self, what: I32) -> F64:
        return self._of(what, self.placed.texture, GROUND_MATERIAL.texture, 0.0)

    def velocity_enu_m_s(self, what: I32) -> F64:
        """(N, 3) Of what rays met; the ground stands still."""
        return np.concatenate([self.placed.velocity_enu_m_s, np.zeros((2, 3))])[what]

    def _of(self, what: I32, values: F64, ground: float, nothing: float) -> F64:
        # GROUND is -1 and NOTHING -2: they stand at the end.
        return np.concatenate([values, [nothing, ground]])[what]

    def _nearest(self, points_enu: F64) -> tuple[F64, I32]:
        points = np.ascontiguousarray(np.asarray(points_enu, dtype=np.float64).reshape(-1, 3))
        nearest_m, index = np.empty(len(points)), np.empty(len(points), np.int32)
        distances(self.placed.rows, points, nearest_m, index)
        return nearest_m, index


def _own_frame(file: WorldFile, dsm: Dsm | None) -> NeuFrame:
    origin = file.origin
    if origin is None:
        return NeuFrame(0.0, 0.0, 0.0)
    height_m = 0.0
    if dsm:
        height_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[origin.lat_deg, origin.lon_deg]])))[0])
    return NeuFrame(origin.lat_deg, origin.lon_deg, height_m if math.isfinite(height_m) else 0.0)
