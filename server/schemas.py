"""Everything that crosses the door, once: REST bodies and the messages of the ``/ws`` stream.

``web/src/messages.ts`` is generated from this module (``server.typescript``); a test fails when they differ.
Numbers are SI, degrees only for latitude, longitude, heading and gimbal pitch. NaN and infinity become null.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

PROTOCOL_VERSION = 1

Name = Annotated[str, StringConstraints(max_length=80, strip_whitespace=True)]
Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Metres = Annotated[float, Field(allow_inf_nan=False)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


# The plan document: what the operator edits; every change is undoable and autosaved.


class PoiDoc(Strict):
    id: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
    lat_deg: Latitude
    lon_deg: Longitude
    name: Name = ""
    loiter_s: Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False)] = 0.0


class PlaceDoc(Strict):
    lat_deg: Latitude
    lon_deg: Longitude


class SurveyDoc(Strict):
    polygon: Annotated[list[PlaceDoc], Field(max_length=200)] = []
    gsd_cm: Annotated[float, Field(gt=0, le=100)] = 1.0
    side_overlap: Annotated[float, Field(ge=0, lt=0.95)] = 0.7
    front_overlap: Annotated[float, Field(ge=0, lt=0.95)] = 0.8
    angle_deg: Annotated[float, Field(ge=0, lt=180)] | None = None


class CameraDoc(Strict):
    image_width_px: Annotated[int, Field(gt=0, le=100_000)]
    image_height_px: Annotated[int, Field(gt=0, le=100_000)]
    focal_mm: Annotated[float, Field(gt=0, le=1000)]
    sensor_width_mm: Annotated[float, Field(gt=0, le=200)]
    sensor_height_mm: Annotated[float, Field(gt=0, le=200)]


class ProfileDoc(Strict):
    """A vehicle profile; the same fields as ``planning.model.VehicleProfile``."""

    name: Name
    firmware: Literal["ardupilot", "px4"] = "ardupilot"
    radius_m: Metres = 0.35
    mean_speed_m_s: Metres = 3.0
    max_speed_m_s: Metres = 5.0
    max_climb_m_s: Metres = 2.5
    max_descent_m_s: Metres = 1.5
    max_accel_m_s2: Metres = 2.5
    max_jerk_m_s3: Metres = 1.0
    endurance_s: Metres = 1200.0
    reserve_share: Metres = 0.25
    max_items: int = 650
    position_error_m: Metres = 2.5
    rtl_height_m: Metres = 30.0
    camera: CameraDoc | None = None


class SurfaceDoc(Strict):
    radius_m: Metres = 20.0
    height_m: Metres = 5.0
    smooth_sigma_m: Metres | None = None
    floor: bool = True


class PathDoc(Strict):
    step_m: Metres = 0.1
    on_steep: Literal["raise", "slow"] = "raise"


class MissionDoc(Strict):
    excess_height_m: Metres = 1.0
    end: Literal["rtl", "land"] = "rtl"
    altitude_reference: Literal["home", "amsl"] = "home"
    heading: Literal["path", "fixed", "point"] = "path"
    heading_deg: Annotated[float, Field(ge=0, lt=360)] = 0.0
    look_at: PlaceDoc | None = None
    gimbal_pitch_deg: Annotated[float, Field(ge=-90, le=30)] | None = None
    camera_trigger_m: Annotated[float, Field(gt=0, le=1000)] | None = None


class ClearanceDoc(Strict):
    required_clearance_m: Metres | None = None
    """None: position error + 0.5 m + vehicle radius."""
    max_height_above_ground_m: Metres | None = None


class PlanDoc(Strict):
    name: Name = "Untitled plan"
    terrain_id: str | None = None
    orthophoto_id: str | None = None
    source: Literal["pois", "survey"] = "pois"
    pois: Annotated[list[PoiDoc], Field(max_length=5000)] = []
    survey: SurveyDoc = SurveyDoc()
    home: PlaceDoc | None = None
    """None: the first point."""
    profile: ProfileDoc = ProfileDoc(name="Generic quad")
    surface: SurfaceDoc = SurfaceDoc()
    path: PathDoc = PathDoc()
    mission: MissionDoc = MissionDoc()
    clearance: ClearanceDoc = ClearanceDoc()


# What the server computes from it.


class ErrorDoc(Strict):
    code: str
    what: str
    where: str = ""
    advice: str = ""


class ReasonDoc(Strict):
    code: str
    text: str
    mend: str


class WorstDoc(Strict):
    lat_deg: float
    lon_deg: float
    alt_rel_home_m: float
    leg: int
    s_m: float


class TradeRow(Strict):
    """Fewer waypoints against excess height."""

    excess_height_m: float
    waypoints: int
    items: int
    duration_s: float


class Chart(Strict):
    """Curves over the horizontal distance flown; null where unknown."""

    s_m: list[float]
    ground_rel_home_m: list[float | None]
    surface_rel_home_m: list[float | None]
    path_rel_home_m: list[float | None]
    flown_s_m: list[float]
    """Waypoints of the mission as it will be flown."""
    flown_rel_home_m: list[float]
    trend_s_m: list[float]
    trend_distance_m: list[float | None]
    poi_s_m: list[float]
    poi_names: list[str]


class ResultDoc(Strict):
    certified: bool
    min_distance_m: float | None
    min_vertical_m: float | None
    required_clearance_m: float
    worst: WorstDoc | None
    rtl_height_needed_m: float | None
    rtl_height_m: float
    home_column_clear: bool
    max_height_above_ground_m: float | None
    reasons: list[ReasonDoc]
    warnings: list[str]
    length_m: float
    duration_s: float
    """As the autopilot will fly it: take-off to landing."""
    lspb_duration_s: float
    endurance_s: float
    usable_endurance_s: float
    """Endurance less the reserve."""
    samples: int
    waypoints: int
    items: int
    max_items: int
    excess_height_m: float
    gsd_min_cm: float | None
    gsd_max_cm: float | None
    home_alt_dsm_m: float
    vertical_datum: str | None
    trade: list[TradeRow]
    chart: Chart
    seconds: dict[str, float]


class Computation(Strict):
    """Where the answer to the present document stands."""

    revision: int
    """Of the document that it belongs to."""
    state: Literal["empty", "running", "ready", "error"]
    hint: str = ""
    """For "empty": what to do next."""
    error: ErrorDoc | None = None
    result: ResultDoc | None = None


class PlanState(Strict):
    plan_id: str
    revision: int
    document: PlanDoc
    can_undo: bool
    can_redo: bool
    undo_label: str = ""
    redo_label: str = ""
    saved_utc: str
    computation: Computation


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


class ViewDoc(Strict):
    """What the 3D view shows; shared by all pages, not part of the plan."""

    shading: Literal["height", "hillshade", "orthophoto"] = "height"
    show_surface: bool = True
    show_path: bool = True
    show_unknown: bool = True
    vertical_exaggeration: Annotated[float, Field(ge=1, le=5)] = 1.0
    legend_min_m: float | None = None
    legend_max_m: float | None = None


class SelectionDoc(Strict):
    """Which tool clicks in the 3D view act through, and what is selected."""

    tool: Literal["select", "add_poi", "polygon", "home", "look_at"] = "select"
    poi_id: str | None = None


# REST bodies


class PlanEdit(Strict):
    base_revision: int
    label: Annotated[str, StringConstraints(max_length=60)]
    """For the undo button: "Move POI 3"."""
    document: PlanDoc
    coalesce: bool = False
    """Merge with the previous edit of the same label (a slider being dragged is one undo step)."""


class OpenPlan(Strict):
    plan_id: str


class SavePlanAs(Strict):
    name: Name


class SignIn(Strict):
    password: Annotated[str, StringConstraints(max_length=1024)]


class Imported(Strict):
    state: PlanState
    warnings: list[str]


# The stream: every message has ``v`` and ``type``. First a snapshot, then whatever changed.


class Snapshot(Strict):
    v: Literal[1] = 1
    type: Literal["snapshot"] = "snapshot"
    product_version: str
    page_id: str
    """Names this page's 3D view: its address is ``/view/{page_id}/``."""
    plan: PlanState
    library: LibraryState
    view: ViewDoc
    selection: SelectionDoc
    jobs: list[JobDoc]


class PlanMessage(Strict):
    v: Literal[1] = 1
    type: Literal["plan"] = "plan"
    plan: PlanState


class LibraryMessage(Strict):
    v: Literal[1] = 1
    type: Literal["library"] = "library"
    library: LibraryState


class ViewMessage(Strict):
    v: Literal[1] = 1
    type: Literal["view"] = "view"
    view: ViewDoc


class SelectionMessage(Strict):
    v: Literal[1] = 1
    type: Literal["selection"] = "selection"
    selection: SelectionDoc


class JobMessage(Strict):
    v: Literal[1] = 1
    type: Literal["job"] = "job"
    job: JobDoc


class CursorMessage(Strict):
    """The place marked in profile and 3D view at once."""

    v: Literal[1] = 1
    type: Literal["cursor"] = "cursor"
    s_m: float | None
    lat_deg: float | None = None
    lon_deg: float | None = None
    ground_rel_home_m: float | None = None
    path_rel_home_m: float | None = None


class NoticeMessage(Strict):
    """Something the operator must read: a failed click, a warning."""

    v: Literal[1] = 1
    type: Literal["notice"] = "notice"
    level: Literal["info", "warning", "error"]
    error: ErrorDoc


ServerMessage = Annotated[
    Snapshot
    | PlanMessage
    | LibraryMessage
    | ViewMessage
    | SelectionMessage
    | JobMessage
    | CursorMessage
    | NoticeMessage,
    Field(discriminator="type"),
]


class HoverProfile(Strict):
    """The pointer is over the altitude profile at this distance; null: it left."""

    type: Literal["hover_profile"] = "hover_profile"
    s_m: float | None


class HoverView(Strict):
    """The pointer is over the 3D view, in shares of its width and height from the top left."""

    type: Literal["hover_view"] = "hover_view"
    x: Annotated[float, Field(ge=0, le=1)] | None
    y: Annotated[float, Field(ge=0, le=1)] | None


class SetView(Strict):
    type: Literal["set_view"] = "set_view"
    view: ViewDoc


class SetSelection(Strict):
    type: Literal["set_selection"] = "set_selection"
    selection: SelectionDoc


class FrameView(Strict):
    """Move this page's camera: to the whole terrain, the plan, from above, or the worst point."""

    type: Literal["frame_view"] = "frame_view"
    target: Literal["terrain", "plan", "top", "worst", "poi"]


ClientMessage = Annotated[
    HoverProfile | HoverView | SetView | SetSelection | FrameView,
    Field(discriminator="type"),
]
