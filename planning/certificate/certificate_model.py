"""What is demanded of a flown line, and the certificate with its parts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from mapping.geometry.arrays import F64
from planning.fence.judge import FenceVerdict
from planning.margins.budget import ClearanceBudget, Term
from planning.margins.words import is_by_hand
from planning.terrain import BOUND_RMS
from planning.terrain.dsm import SurfaceModel

SET_DOWN_M = 0.1
"""What is planned holds for a vehicle that stands up to so far beside the planned home."""


@dataclass(frozen=True, slots=True)
class ClearanceParams:
    """What the certificate demands."""

    required_clearance_m: float
    vehicle_radius_m: float
    position_error_m: float
    rtl_height_m: float
    """Above home, as set in the autopilot."""
    max_height_above_ground_m: float | None = None
    budget: ClearanceBudget | None = None
    """What the required clearance is for; None: it is not known, and the line is taken to be flown exactly."""
    set_down_m: float = SET_DOWN_M
    """How far from home's place the vehicle may be set down, beside its position error."""
    home_known_dsm_m: tuple[float, float] | None = None
    """(lowest, highest) that the ground at home may be, where the vehicle tells it better than the surface model."""

    @property
    def following_m(self) -> float:
        """Radius of the tube around the line for which the certificate is made."""
        return 0.0 if self.budget is None else self.budget.value_m("following")

    @property
    def dsm_place_m(self) -> float:
        """How far from where the surface model shows them things may stand, where it tells that."""
        return 0.0 if self.budget is None else self.budget.value_m("dsm_place")

    @property
    def fence_margin_m(self) -> float:
        """Kept from a fence: how far the vehicle's outermost point may be beside where it should be."""
        return self.vehicle_radius_m + self.position_error_m + self.following_m


def with_accuracy(params: ClearanceParams, model: SurfaceModel) -> ClearanceParams:
    """The same, allowing for no less than the errors in height and place that a surface model tells, if it tells any.

    A required clearance that was set by hand stays; then it covers less.
    """
    budget = params.budget
    if budget is None:
        return params
    grown = budget
    if model.rms_m is not None:
        source = f"{BOUND_RMS:g} x RMS error of {model.rms_m:g} m, told with the surface model"
        grown = grown.with_least(Term("dsm_accuracy", BOUND_RMS * model.rms_m, source))
    if model.place_m > 0.0:
        source = "bound of its horizontal error, or the ground that it measured at once: told with the surface model"
        grown = grown.with_least(Term("dsm_place", model.place_m, source))
    if is_by_hand(budget, params.required_clearance_m):
        return replace(params, budget=grown)
    more_m = grown.total_m - budget.total_m
    return replace(params, budget=grown, required_clearance_m=params.required_clearance_m + more_m)


@dataclass(frozen=True, slots=True)
class WorstPoint:
    """The place on the flown line where it comes nearest to the surface model."""

    lat_deg: float
    lon_deg: float
    alt_rel_home_m: float
    leg: int
    """Index of the leg in ``FlownLine``."""
    s_m: float
    x_m: float
    y_m: float
    alt_dsm_m: float


@dataclass(frozen=True, slots=True)
class LegClearance:
    leg: int
    item: int
    min_distance_m: float
    min_vertical_m: float
    at_s_m: float


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a mission is not certified, and what would mend it."""

    code: str
    text: str
    mend: str


@dataclass(frozen=True, slots=True)
class BetterHome:
    """The nearest place where home would do, or do better."""

    lat_deg: float
    lon_deg: float
    away_m: float
    bearing_deg: float
    """From home, clockwise from north."""
    drop_m: float
    """How much lower than its own cell a vehicle there may stand."""
    does: bool
    """The line keeps its required clearance from there as well."""


@dataclass(frozen=True, slots=True)
class HomeStand:
    """How high a vehicle at home may really stand: all heights are counted from there."""

    alt_dsm_m: float
    """What the line counts on."""
    low_dsm_m: float
    """Lowest that it may be; NaN where the surface model does not know all the ground in reach."""
    high_dsm_m: float
    drop_m: float
    """By how much the whole line may be lower than planned; NaN when not known."""
    reach_m: float
    """Vehicle radius + position error + how far beside home the vehicle may be set down."""
    told_by: Literal["model", "vehicle"]
    min_distance_m: float
    """Smallest 3-D distance of the line lowered by ``drop_m``; NaN when that is not known."""
    better: BetterHome | None = None
    """Only where home does not do."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """The proof of clearance of one flown line against one surface model."""

    certified: bool
    min_distance_m: float
    """Smallest 3-D distance to any cell as a solid column; 0 inside one. Take-off and landing columns left out."""
    min_vertical_m: float
    """Smallest height above the cell below; negative inside terrain; -inf over unknown cells."""
    required_clearance_m: float
    worst: WorstPoint
    legs: tuple[LegClearance, ...]
    rtl_height_needed_m: float
    """Above home, smallest height from which every way home is clear wherever home may really stand; inf over
    unknown terrain."""
    home_column_clear: bool
    """A vehicle can stand at home and start from there."""
    max_height_above_ground_m: float
    reasons: tuple[Reason, ...]
    trend_s_m: F64
    """(M,) places along the line"""
    trend_distance_m: F64
    """(M,) 3-D distance to the surface model there"""
    assumptions: dict[str, object] = field(default_factory=dict)
    budget: ClearanceBudget | None = None
    """What the required clearance is for, term by term."""
    home: HomeStand | None = None
    fence: FenceVerdict | None = None
    """None: the mission has no fence."""

    @property
    def kept_m(self) -> float:
        """Smallest 3-D distance from the lowest ground that the vehicle may stand on at home, where that is known."""
        low_m = math.inf if self.home is None else self.home.min_distance_m
        return self.min_distance_m if math.isnan(low_m) else min(self.min_distance_m, low_m)

    @property
    def spare_m(self) -> float:
        """Of what is kept, what is not required."""
        return max(0.0, self.kept_m - self.required_clearance_m)

    @property
    def following_m(self) -> float:
        """Radius of the tube around the line that is proved."""
        return 0.0 if self.budget is None else self.budget.value_m("following")
