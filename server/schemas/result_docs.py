"""What the server computes from a plan document, where that stands, and what pages ask of the open plan."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.schemas.plan_docs import PlanDoc
from server.schemas.strict_model import Name, Strict


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


class TermDoc(Strict):
    """One part of the required clearance."""

    code: str
    name: str
    value_m: float
    source: str


class UncoveredDoc(Strict):
    code: str
    name: str
    missing_m: float


class BudgetDoc(Strict):
    """What the required clearance is for."""

    terms: list[TermDoc]
    rule: str
    total_m: float
    set_by_hand: bool
    uncovered: list[UncoveredDoc]


class TubeDoc(Strict):
    """Everything within ``radius_m`` of the line keeps ``min_distance_m``."""

    radius_m: float
    min_distance_m: float
    required_m: float
    statement: str


class FeasibilityDoc(Strict):
    """One thing that the vehicle must be able to do."""

    code: str
    state: Literal["holds", "fails", "unknown"]
    text: str
    mend: str


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


class SurveyResult(Strict):
    """What a survey's photos see over the surface; the fields of ``planning.route.survey_coverage.SurveyCoverage``."""

    height_m: float
    """Above the surface: height H of this plan."""
    area_m2: float
    photos: int
    photographed_share: float
    twice_share: float
    front_overlap: float | None
    """Of 95 % of the area at least; null: none of it is seen."""
    side_overlap: float | None
    asked_front_overlap: float
    asked_side_overlap: float
    gsd_cm: float | None
    asked_gsd_cm: float
    gimbal_pitch_deg: float | None
    faults: list[str]


class BetterHomeDoc(Strict):
    """The nearest place where home would do, or do better."""

    lat_deg: float
    lon_deg: float
    away_m: float
    bearing_deg: float
    drop_m: float
    does: bool
    """The line keeps its required clearance from there as well."""


class HomeDoc(Strict):
    """How high a vehicle at home may really stand: all heights are counted from there."""

    lat_deg: float
    lon_deg: float
    chosen: bool
    """For want of one in the plan: the first point, or the nearest place to it that does."""
    drop_m: float | None
    """By how much the whole line may be lower than planned."""
    reach_m: float
    min_distance_m: float | None
    """Smallest distance of the line lowered by ``drop_m``."""
    better: BetterHomeDoc | None


class FenceVerdictDoc(Strict):
    """The nearest that the line and the ways back come to what the fence forbids."""

    keeps: bool
    line_keeps: bool = True
    """Whatever is wrong is so of ways back alone."""
    margin_m: float
    min_distance_m: float | None
    """Null: the fence has no shapes, only heights."""
    shape: str
    part: Literal["line", "home", "rally"]
    lat_deg: float
    lon_deg: float
    lowest_rel_home_m: float
    highest_rel_home_m: float
    faults: list[str]


class DetourDoc(Strict):
    """A point that was put into the path to keep to the fence; the fields of ``planning.planner.laid.Detour``."""

    lat_deg: float
    lon_deg: float
    shape: str
    before_poi: int
    """Index of the point that the leg leads to."""


class ResultDoc(Strict):
    other_surface: str = ""
    """That the points were planned on another surface model, and how far home moves; empty: they were not."""
    certified: bool
    feasible: bool | None = None
    """Whether the vehicle can fly it; null: not all is known."""
    feasibility: list[FeasibilityDoc] = Field(default=[])
    min_distance_m: float | None
    min_vertical_m: float | None
    required_clearance_m: float
    clearance_budget: BudgetDoc | None = None
    tube: TubeDoc | None = None
    worst: WorstDoc | None
    rtl_height_needed_m: float | None
    rtl_height_m: float
    home_column_clear: bool
    home: HomeDoc | None = None
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
    fence: FenceVerdictDoc | None = None
    """Null: the plan has no fence."""
    detours: list[DetourDoc] = Field(default=[])
    survey: SurveyResult | None = None
    gsd_min_cm: float | None
    gsd_max_cm: float | None
    home_alt_dsm_m: float
    vertical_datum: str | None
    seen_columns: int = 0
    """Columns of the surface model that were raised by what was seen."""
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


class Imported(Strict):
    state: PlanState
    warnings: list[str]
    taken: str
    """What was read, in words."""
