"""What the data directory holds, and the jobs that fill it."""

from __future__ import annotations

from typing import Literal

from server.schemas.plan_docs import PlaceDoc, ProfileDoc
from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Strict


class SpikeDoc(Strict):
    lat_deg: float
    lon_deg: float
    size_m: float
    height_m: float
    """Positive: spike; negative: pit."""


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


class OrthophotoDoc(Strict):
    id: str
    name: str
    terrain_id: str
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
