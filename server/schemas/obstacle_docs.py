"""Obstacles: what perception sees, what is alerted, what can be done about it.

What the bus carries (``telemetry.topics.obstacles``) goes to the pages as it is; it is not written down twice.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from server.schemas.flight_docs import Source
from server.schemas.strict_model import Asked, Strict
from telemetry.topics.obstacles import AvoidanceStatus, MapName, ObstacleAlert, PerceptionSettings

SensorName = Literal["radar", "vision", "ranges"]
MapFormat = Literal["ply", "pcd", "bt", "mcap", "tif", "geojson"]


class AlertDoc(Strict):
    """An alert, latched: it stays until it is over AND acknowledged."""

    alert: ObstacleAlert
    """As last told."""
    began_utc_s: float
    over: bool = False
    acknowledged: bool = False


class ManoeuvreDoc(Strict):
    """A prepared way past an obstacle; never below it."""

    id: str
    kind: Literal["over", "around", "sidestep"]
    """sidestep: the velocity proposed against a moving object, flown level, then back to the mission."""
    for_alert: str
    """``ObstacleAlert.id``"""
    possible: bool
    text: str
    """What it does, or why there is none."""
    clearance_m: float | None = None
    """Smallest distance of its line to anything seen and to the surface model."""
    length_m: float | None = None
    seconds: float | None = None
    climb_m: float | None = None
    top_unseen: bool = False
    """It leads over something that may be higher than what was seen of it: the clearance counts from as far up as the
    radar looks."""


class MapDrawn(Strict):
    """What of one map the 3D view draws."""

    sensor: MapName
    voxels: int
    """Occupied, of the whole map."""
    drawn: int
    detail: int
    """Every drawn box stands for a cube of so many voxels along each edge; 1 is full detail."""
    sent_bytes: int
    """To the pages, since the map began."""
    text: str = ""
    """Such as "drawn coarser: 1 box for 2 x 2 x 2 voxels"."""


class SeesEnough(Strict):
    """Speeds in m/s from which a vehicle can stop in each sensor's region, as it is set."""

    radar: float = 0.0
    vision: float = 0.0
    ranges: float = 0.0


class ObstaclesState(Strict):
    """Everything about obstacles but the sensors' own status, which comes with every frame."""

    alerts: list[AlertDoc] = Field(default_factory=list)
    """Newest first, at most 20."""
    manoeuvres: list[ManoeuvreDoc] = Field(default_factory=list)
    avoidance: AvoidanceStatus = Field(default_factory=AvoidanceStatus)
    settings: PerceptionSettings = Field(default_factory=PerceptionSettings)
    sees_enough: SeesEnough = Field(default_factory=SeesEnough)
    maps: list[MapDrawn] = Field(default_factory=list)
    seen_in_plan: int = 0
    """Columns of the open plan's surface model that were raised by what was seen; 0: it is as it was read."""
    busy: str = ""
    """What is being done right now: "Looking for a way around" ..."""
    stays_higher: str = ""
    """After a climb: why the rest is not flown at its proper height."""


class SectionMap(Strict):
    """One map's cells in a vertical slice, each once."""

    name: MapName
    resolution_m: float
    s_m: list[float]
    """Of their middles, along the slice from the vehicle."""
    up_m: list[float]
    """Above home."""
    known_ground: list[bool]
    left_out: int
    """Cells that are too many to be told."""


class SectionDoc(Strict):
    """A vertical slice through the maps, where the vehicle is."""

    text: str = ""
    """Why there is none."""
    across: bool
    """Of the vehicle's heading, s to the right; else along it, s ahead."""
    thickness_m: float
    reach_m: float
    vehicle_up_m: float | None = None
    heading_deg: float | None = None
    ground_s_m: list[float] = Field(default_factory=list)
    ground_up_m: list[float | None] = Field(default_factory=list)
    """Of the surface model, above home; null where it is unknown."""
    maps: list[SectionMap] = Field(default_factory=list)


class RadarTargetsDoc(Strict):
    """All targets of the radar's newest frame, in its own frame, and the gate that they met."""

    t_mono_s: float | None = None
    """Null: there was no frame yet."""
    right_m: list[float] = Field(default_factory=list)
    ahead_m: list[float] = Field(default_factory=list)
    up_m: list[float] = Field(default_factory=list)
    kept: list[bool] = Field(default_factory=list)
    azimuth_deg: float = 0.0
    """Of the gate, to both sides."""
    low_deg: float = 0.0
    high_deg: float = 0.0
    nearest_m: float = 0.0
    farthest_m: float = 0.0


# Bodies and queries of requests


class SectionAsked(Strict):
    """A vertical slice that is asked for."""

    source: Source = "live"
    across: bool = False
    """Of the vehicle's heading; else along it."""
    thickness_m: Annotated[float, Field(ge=0.1, le=50), Asked(min=0.5)] = 4.0
    reach_m: Annotated[float, Field(ge=5, le=200), Asked(10, 150, initial=25)] = 40.0


class SetAvoidanceBody(Strict):
    enabled: bool
    consent: bool = False
    by: Literal["climb", "sidestep"] = "climb"
    """sidestep: past objects that are followed, level; it climbs over what it cannot step aside of."""


class AcknowledgeBody(Strict):
    """Null: all of them."""

    alert_id: str | None = None


class TrackerSettingsBody(Strict):
    """How objects are followed; what is left out stays. Anything else makes the tracker begin anew."""

    coordinates: Literal["cartesian", "polar"] | None = None
    range_sigma_m: Annotated[float, Field(ge=0.01, le=10)] | None = None
    bearing_sigma_deg: Annotated[float, Field(ge=0.05, le=30)] | None = None
    bearing_edge_deg: Annotated[float, Field(ge=0, le=180)] | None = None
    bearing_edge_sigma_deg: Annotated[float, Field(ge=0.05, le=45)] | None = None
    radial_speed_sigma_m_s: Annotated[float, Field(ge=0.01, le=10)] | None = None
    radial_speed_folded_m_s: Annotated[float, Field(ge=0, le=1000)] | None = None
    """0: no two radial speeds look the same."""
    extent_m: Annotated[float, Field(ge=0, le=10)] | None = None
    acceleration_m_s2: Annotated[float, Field(ge=0, le=50)] | None = None
    speed_m_s: Annotated[float, Field(ge=0.1, le=100)] | None = None
    detection_probability: Annotated[float, Field(gt=0, lt=1)] | None = None
    gate: Annotated[float, Field(ge=0.1, le=1000)] | None = None
    birth: Annotated[float, Field(ge=0.01, le=100)] | None = None
    birth_updates: Annotated[int, Field(ge=1, le=100)] | None = None
    death: Annotated[float, Field(ge=0.01, le=1000)] | None = None
    apart_m: Annotated[float, Field(ge=0, le=20)] | None = None


class VelocitySettingsBody(Strict):
    """What proposed and flown velocities keep to; what is left out stays."""

    max_speed_m_s: Annotated[float, Field(ge=0, le=50)] | None = None
    """0: that of the plan's vehicle."""
    max_turn_deg: Annotated[float, Field(ge=5, le=180)] | None = None
    leave_m_s: Annotated[float, Field(ge=0, le=5)] | None = None
    nearest_only: bool | None = None
    stands_m: Annotated[float, Field(ge=0.3, le=30)] | None = None
    stands_s: Annotated[float, Field(ge=1, le=30)] | None = None
    choice: Literal["room", "edge"] | None = None
    """edge: the velocity nearest on a cone's edge, as in the paper."""


class PerceptionSettingsBody(Strict):
    """What an operator may change; the rest stays."""

    radar_depth_m: Annotated[float, Field(ge=2, le=120)] | None = None
    vision_depth_m: Annotated[float, Field(ge=2, le=40)] | None = None
    ranges_depth_m: Annotated[float, Field(ge=2, le=40)] | None = None
    fov_deg: Annotated[float, Field(ge=4, le=120)] | None = None
    height_m: Annotated[float, Field(ge=0.5, le=20)] | None = None
    paper_bare: bool | None = None
    safety_radius_m: Annotated[float, Field(ge=0.5, le=30)] | None = None
    approach_s: Annotated[float, Field(ge=2, le=30)] | None = None
    radar_variant: Literal["heading_only", "full_attitude", "full_attitude_flat"] | None = None
    radar_azimuth_deg: Annotated[float, Field(ge=5, le=60)] | None = None
    """Of the radar's gate, to both sides."""
    radar_low_deg: Annotated[float, Field(ge=-30, le=0)] | None = None
    radar_high_deg: Annotated[float, Field(ge=5, le=35)] | None = None
    """Its elevations: what stands at the vehicle's own height must be seen."""
    cloud_voxel_m: Annotated[float, Field(ge=0, le=2)] | None = None
    """Of the camera's clouds one point in each such voxel is used; 0: all."""
    climb_m_s: Annotated[float, Field(ge=0.3, le=5)] | None = None
    """By itself, over what stands in the way."""
    comes_down: bool | None = None
    climb_ceiling_m: Annotated[float, Field(ge=2, le=120)] | None = None
    """Above the plan."""
    vehicle_radius_m: Annotated[float, Field(ge=0.1, le=5)] | None = None
    position_error_m: Annotated[float, Field(ge=0, le=10)] | None = None
    radar_resolution_m: Annotated[float, Field(ge=0.05, le=5)] | None = None
    vision_resolution_m: Annotated[float, Field(ge=0.05, le=5)] | None = None
    """Of the range finder's map, too."""
    memory_limit_bytes: Annotated[int, Field(ge=1_000_000, le=100_000_000_000)] | None = None
    """Per map. A new one, or another resolution, begins the map anew."""
    tracker: TrackerSettingsBody | None = None
    velocities: VelocitySettingsBody | None = None


class PlanWithSeen(Strict):
    """Takes the maps into planning, or out of it again."""

    seen: bool
    sensors: list[SensorName] = Field(default_factory=lambda: ["radar", "vision"])
    part: Literal["whole", "ahead", "home"] = "whole"
    """The open plan as it is; or of the one that is flown, from where the vehicle is: the mission ahead, the way home.
    """
