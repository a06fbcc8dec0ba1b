"""What crosses from the workers to the 3D view: plain arrays, in the surface model's own coordinates."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.arrays import F32, F64, U8, U32
from planning.terrain.dsm import Dsm
from server.schemas import PlanDoc, SelectionDoc, ViewDoc


@dataclass(frozen=True, slots=True)
class HeightGrid:
    """A coarse grid of heights for drawing; cell (0, 0) is the north-western one."""

    alt_dsm_m: F32
    """(h, w), NaN where unknown"""
    west_m: float
    north_m: float
    """Projected coordinates of the grid's outer north-western corner."""
    cell_m: float


@dataclass(frozen=True, slots=True)
class Relief:
    """A surface as triangles."""

    points_m: F64
    """(V, 3) x, y, alt_dsm"""
    faces: U32
    """(F, 3) counter-clockwise seen from above"""


@dataclass(frozen=True, slots=True)
class TerrainScene:
    """A surface model as the view draws it."""

    terrain_id: str
    grid: HeightGrid
    texture_rgb: U8
    """(th, tw, 3) draped over the grid's whole extent: height colours, hill shading or orthomosaic."""
    legend_min_m: float
    legend_max_m: float


@dataclass(frozen=True, slots=True)
class PointsScene:
    """The thinned point cloud of a surface model."""

    terrain_id: str
    points_m: F64
    """(N, 3) x, y, alt_dsm"""
    rgb: U8
    """(N, 3)"""
    voxel_m: float
    """About how far apart neighbours lie."""


@dataclass(frozen=True, slots=True)
class TexturedScene:
    """The textured mesh of a surface model: a picture."""

    terrain_id: str
    mesh_id: str
    glb: bytes
    """z up, metres from ``origin_m``"""
    origin_m: F64
    """(3,) x, y, alt_dsm"""


@dataclass(frozen=True, slots=True)
class PlanScene:
    """A computed plan as the view draws it; all points are x, y, alt_dsm."""

    safe_surface: Relief
    path_m: F64
    """(N, 3) the sampled path, thinned for drawing"""
    path_s_m: F64
    """(N,)"""
    path_ground_alt_dsm_m: F64
    """(N,)"""
    flown_m: F64
    """(K, 3) waypoints as the vehicle flies them"""
    flown_distance_m: F64
    """(K - 1,) smallest distance of each leg to the surface model"""
    worst_m: F64
    """(3,) the place nearest to the surface model"""
    required_clearance_m: float
    home_m: F64
    """(3,)"""
    takeoff_alt_dsm_m: float
    around_m: F64
    """(D, 3) where the path turns around a fence"""
    around: tuple[str, ...]
    """(D,) the shape"""


@dataclass(frozen=True, slots=True)
class ReviewScene:
    """A recorded flight as the view draws it; all points are x, y, alt_dsm."""

    planned_m: F64
    """(K, 3) waypoints of the plan that was flown; K is 0 when it is unknown"""
    flown_m: F64
    """(N, 3); NaN where nothing is known of the line"""
    ground: Dsm | None = None
    """To draw it on where the library has no surface model of it: the recording's own, or level ground."""
    drawn: TerrainScene | None = None
    """The recording's own surface model; None: level ground, or the library's model."""


@dataclass(frozen=True, slots=True)
class OverlayScene:
    """Colours that are laid over a surface model; its extent may end within the model's."""

    terrain_id: str
    rgba: U8
    """(h, w, 4) row 0 northernmost"""
    west_m: float
    north_m: float
    cell_m: float


@dataclass(frozen=True, slots=True)
class SiteMark:
    """A numbered place to land."""

    rank: int
    lat_deg: float
    lon_deg: float


@dataclass(frozen=True, slots=True)
class SceneState:
    """Everything the view has to show; the view draws the difference to what it shows already."""

    terrain: TerrainScene | None
    plan: PlanScene | None
    plan_is_stale: bool
    """A newer plan is being computed."""
    document: PlanDoc
    selection: SelectionDoc
    view: ViewDoc
    review: ReviewScene | None = None
    """The recording that is open; then there is no plan."""
    overlay: OverlayScene | None = None
    sites: tuple[SiteMark, ...] = ()
    points: PointsScene | None = None
    """Of the surface model on show, once they are wanted and at hand."""
    textured: TexturedScene | None = None
    """Likewise."""
