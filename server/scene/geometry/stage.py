"""What every layer of the 3D view draws from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from affine import Affine
from scipy import ndimage
from skimage import measure

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry.mesh import drawn_alt_dsm_m, filled
from server.scene.geometry.payload import HeightGrid, PointsScene, SceneState, TerrainScene, TexturedScene
from server.scene.geometry.scene_frame import LocalFrame

_LARGEST_BODY_M = 0.9


class _Place(Protocol):
    @property
    def lat_deg(self) -> float: ...
    @property
    def lon_deg(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Drawing:
    """A state together with the model and the frame it is drawn in."""

    dsm: Dsm
    terrain: TerrainScene
    state: SceneState
    frame: LocalFrame
    plates: HeightGrid
    """What stands for unknown terrain."""

    @staticmethod
    def of(dsm: Dsm | None, state: SceneState, before: Drawing | None = None) -> Drawing | None:
        """None when there is no terrain to draw on; ``before`` saves work when its terrain is the same."""
        if dsm is None or state.terrain is None or not np.isfinite(state.terrain.grid.alt_dsm_m).any():
            return None
        frame = LocalFrame.of(dsm, state.terrain.grid, state.view.vertical_exaggeration)
        if before is not None and before.terrain is state.terrain:
            return Drawing(dsm, state.terrain, state, frame, before.plates)
        return Drawing(dsm, state.terrain, state, frame, plates(state.terrain.grid))

    @property
    def mark_m(self) -> float:
        """Radius of a mark that is seen from afar and does not hide what it marks."""
        return 0.011 * self.frame.half_diagonal_m

    @property
    def body_m(self) -> float:
        """Radius of a solid mark where the flight comes near it: it must not hide what flies past."""
        return min(self.mark_m, _LARGEST_BODY_M)

    @property
    def points(self) -> PointsScene | None:
        """The cloud's points, while they are drawn."""
        found = self.state.points if self.state.view.show_points else None
        return found if found is not None and found.terrain_id == self.terrain.terrain_id else None

    @property
    def textured(self) -> TexturedScene | None:
        """The textured mesh, while it is drawn."""
        found = self.state.textured if self.state.view.show_textured else None
        return found if found is not None and found.terrain_id == self.terrain.terrain_id else None

    @property
    def has_mesh(self) -> bool:
        """Without its points or its textured mesh, and under colours that are laid over it, the model is drawn whatever
        the view says."""
        alone = self.points is None and self.textured is None
        return self.state.view.show_mesh or alone or self.state.overlay is not None

    def places_xy_m(self, places: Sequence[_Place]) -> F64:
        """(N, 2) projected"""
        lat_lon = np.array([[place.lat_deg, place.lon_deg] for place in places], dtype=np.float64).reshape(-1, 2)
        return self.dsm.xy_from_lat_lon(lat_lon)

    def on_ground(self, xy_m: F64) -> F64:
        """Projected (N, 2) -> scene (N, 3) on the terrain as it is drawn; places without a projection left out."""
        xy = xy_m[np.isfinite(xy_m).all(axis=1)]
        alt = drawn_alt_dsm_m(filled(self.terrain.grid, self.plates), xy)
        return self.frame.scene_from_model(np.column_stack([xy, alt]))

    def ground_of(self, place: _Place) -> F64 | None:
        """(3,) scene; None for a place that the model's projection does not know."""
        points = self.on_ground(self.places_xy_m([place]))
        return points[0] if len(points) else None


def plates(grid: HeightGrid) -> HeightGrid:
    """The height at which each unknown cell is drawn and clicked, NaN where the ground is known.

    Each connected hole is one level plate at its lowest rim: inside the terrain, below the ground that may be there.
    """
    known = np.isfinite(grid.alt_dsm_m)
    alt = np.full(known.shape, np.nan, dtype=np.float32)
    if known.all() or not known.any():
        return replace(grid, alt_dsm_m=alt)
    hole = np.asarray(measure.label(~known, connectivity=2))
    rim_m = ndimage.minimum_filter(np.where(known, grid.alt_dsm_m, np.inf), size=3)
    level_m = np.full(int(hole.max()) + 1, np.inf, dtype=np.float32)
    np.minimum.at(level_m, hole[~known], rim_m[~known])
    alt[~known] = level_m[hole[~known]]
    return replace(grid, alt_dsm_m=alt)


def as_model(grid: HeightGrid, like: Dsm) -> Dsm:
    """A grid as a surface model of its own, to cast rays at."""
    transform = Affine(grid.cell_m, 0.0, grid.west_m, 0.0, -grid.cell_m, grid.north_m)
    return replace(like.as_grid(), elevation_m=np.ascontiguousarray(grid.alt_dsm_m), transform=transform)
