"""What the data directory holds, and the jobs that fill it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from server.schemas.plan_docs import PlaceDoc, ProfileDoc
from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Strict


class SpikeDoc(Strict):
    lat_deg: float
    lon_deg: float
    size_m: float
    height_m: float
    """Positive: spike; negative: pit."""


class CloudShareDoc(Strict):
    what: str
    """Ground, vegetation, buildings..."""
    share: float
    """Of the points that were taken, 0..1."""


class CloudDoc(Strict):
    """The point cloud that a surface model was made of, or that came with it."""

    made_model: bool = True
    """False: it came with the model, and what follows of cells, canopy and holes is not told."""
    points: int
    taken: int
    noise: int
    """Left out because the file calls them so."""
    not_numbers: int
    points_per_m2: float
    """Of the cells that have any."""
    cell_chosen: bool
    """By the operator; else by the density."""
    shares: list[CloudShareDoc]
    """Largest first; empty where no point is classified."""
    canopy_greatest_m: float | None
    """The highest point above the ground point of the same cell."""
    canopy_median_m: float | None
    """Of the cells that stand 2 m or more above their ground."""
    canopy_share: float | None
    """Of them, among the cells that have ground points."""
    small_holes: int
    """Holes that a plan fills with the highest cell around them."""
    small_holes_m2: float
    small_hole_limit_m2: float
    shown: int = 0
    """Points that were kept to be looked at; 0 of models that were read before any were."""
    voxel_m: float = 0.0
    """Edge of the voxels of which each kept one point."""
    colored: bool = False


class TerrainDoc(Strict):
    id: str
    name: str
    width_px: int
    height_px: int
    resolution_m: float
    crs: str
    vertical_datum: str | None
    unknown_share: float
    min_m: float
    max_m: float
    sha256: str
    spikes: list[SpikeDoc]
    warnings: list[str]
    corner_lat_lon_deg: list[PlaceDoc]
    """The model's four outer corners, clockwise from the north-west."""
    added_utc: str
    folder: str = ""
    """Where the file lay, as far as the page that sent it could tell; empty: it could not."""
    file_utc: str | None = None
    """When the file was last changed."""
    cloud: CloudDoc | None = None
    """Null: it comes of no point cloud."""
    in_doubt: bool = False
    """What stands on the ground may be missing in it: no plan takes it by itself."""


class OrthophotoDoc(Strict):
    id: str
    name: str
    terrain_id: str
    added_utc: str


class MeshDoc(Strict):
    """A textured mesh that is drawn in a surface model's place: a picture, by which nothing is judged."""

    id: str
    name: str
    terrain_id: str
    triangles: int
    shift_m: float
    """By how much its heights were moved onto the model's; 0: they are its own."""
    notes: list[str]
    added_utc: str


class PlanEntry(Strict):
    id: str
    name: str
    terrain_id: str | None
    saved_utc: str


class ProfileEntry(Strict):
    id: str
    profile: ProfileDoc


class LibraryState(Strict):
    terrains: list[TerrainDoc]
    orthophotos: list[OrthophotoDoc]
    meshes: list[MeshDoc] = Field(default=[])
    """Of each surface model the newest one is drawn."""
    plans: list[PlanEntry]
    profiles: list[ProfileEntry]


class JobDoc(Strict):
    id: str
    label: str
    """What is being done, e.g. "Reading etna.tif"."""
    step: str = ""
    progress: float | None = None
    """0..1; None: unknown."""
    state: Literal["running", "done", "failed", "cancelled"]
    error: ErrorDoc | None = None
