"""Review: what a recorded flight came to. Times count from the recording's start."""

from __future__ import annotations

from server.schemas.flight_docs import RecordingDoc
from server.schemas.strict_model import Strict
from telemetry.topics.checklist import ChecklistRecord


class ReviewFigures(Strict):
    """From the first waypoint to the last."""

    completed: bool
    duration_s: float | None
    predicted_s: float | None
    lag_s: float | None
    """How much later the flown path is than the plan's timing."""
    cross_track_max_m: float | None
    cross_track_mean_m: float | None
    cross_track_p95_m: float | None
    height_error_max_m: float | None
    height_error_mean_m: float | None
    height_error_p95_m: float | None
    """Of the absolute value."""
    height_error_lowest_m: float | None
    height_error_highest_m: float | None
    min_distance_m: float | None
    min_vertical_m: float | None
    certified_distance_m: float | None
    required_distance_m: float | None = None
    """Null where nothing tells what was required."""
    below_required: str | None = None
    """How far the flight went below its required clearance, in a sentence; null where it did not."""
    min_distance_t_s: float | None
    min_distance_s_m: float | None
    min_distance_lat_deg: float | None = None
    min_distance_lon_deg: float | None = None
    min_distance_way_home_m: float | None = None
    """From the last waypoint until 3 m from home."""
    positions: int = 0
    """That the figures count."""
    higher_m: float | None = None
    """How much above the plan avoidance passed places of the mission, at most; null where it passed none higher."""
    higher_from_item: int | None = None
    """The first of these places, 1 is the mission's first item."""


class ReviewSeries(Strict):
    """Curves over time; null where unknown. All lists are equally long."""

    t_s: list[float]
    alt_rel_home_m: list[float | None]
    reference_alt_rel_home_m: list[float | None]
    """The plan at the place of its line that is nearest."""
    planned_alt_rel_home_m: list[float | None]
    """The plan by its own clock, which starts at the first waypoint as the flight's does."""
    ground_rel_home_m: list[float | None]
    cross_track_m: list[float | None]
    s_m: list[float | None]
    distance_to_dsm_m: list[float | None]


class Histogram(Strict):
    """Of the cross-track error's size."""

    edges_m: list[float]
    counts: list[int]


class ReviewEvent(Strict):
    t_s: float
    kind: str
    """mode, text, arm, item, command, alert, gap"""
    text: str
    severity: int = 6


class ReviewDoc(Strict):
    recording: RecordingDoc
    start_utc: str
    duration_s: float
    first_waypoint_t_s: float | None
    last_waypoint_t_s: float | None
    figures: ReviewFigures | None
    """Null without a plan."""
    series: ReviewSeries
    histogram: Histogram | None
    events: list[ReviewEvent]
    plan_name: str
    terrain_name: str
    other_surface: str
    """That this is another surface model than the mission was planned on, and how far home moves; empty: it is not."""
    checklist: ChecklistRecord | None = None
    """As it was ticked for this flight's start; null where nothing was demanded."""
    notes: list[str]
    """What had to be assumed or could not be told."""
