"""Why a line is not certified, in words an operator can act on, each with what would mend it."""

from __future__ import annotations

import math

import numpy as np

from planning.certificate.certificate_model import ClearanceParams, HomeStand, LegClearance, Reason, WorstPoint
from planning.certificate.home_ground import HomeGround
from planning.certificate.home_search import FARTHEST_M
from planning.margins.words import is_by_hand, rounded_down, rounded_up
from planning.terrain.dsm import Dsm

RTK_ERROR_M = 0.1
SAME_M = 0.005
WINDS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
FILL_OR_AVOID = (
    "Keep the line farther inside the surface model and away from its holes, fill the holes,"
    " or use a model that covers the whole flight."
)


def line_reasons(
    legs: tuple[LegClearance, ...], worst: WorstPoint, params: ClearanceParams, *, worst_is_unknown: bool
) -> list[Reason]:
    """Unknown terrain below, terrain hit, clearance too small: at most one of each."""
    reasons = []
    unknown = [leg for leg in legs if leg.min_vertical_m == -math.inf]
    hit = [leg for leg in legs if -math.inf < leg.min_vertical_m < 0.0]
    if unknown:
        text = f"{_legs(unknown)} over unknown terrain or outside the surface model"
        reasons.append(Reason("unknown_terrain", f"{text}, first on {_leg(unknown[0])}.", FILL_OR_AVOID))
    if hit:
        deepest = min(hit, key=lambda leg: leg.min_vertical_m)
        text = f"The line enters the terrain: {-deepest.min_vertical_m:.2f} m deep on {_leg(deepest)}."
        mend = f"Raise the line there by at least {rounded_up(params.required_clearance_m - deepest.min_vertical_m)} m."
        reasons.append(Reason("terrain_hit", text, mend))
    short = [leg for leg in legs if not leg.min_distance_m >= params.required_clearance_m]
    if short:
        reasons.append(_clearance_reason(short, worst, params, worst_is_unknown=worst_is_unknown))
    return reasons


def _clearance_reason(
    short: list[LegClearance], worst: WorstPoint, params: ClearanceParams, *, worst_is_unknown: bool
) -> Reason:
    nearest = min(short, key=lambda leg: leg.min_distance_m)
    required_m = params.required_clearance_m
    missing = rounded_up(required_m - nearest.min_distance_m)
    to_what = "an unknown cell or the model's edge" if worst_is_unknown else "the surface"
    text = (
        f"The line comes within {rounded_down(nearest.min_distance_m)} m of {to_what} on {_leg(nearest)}, at"
        f" {worst.lat_deg:.7f}, {worst.lon_deg:.7f}: {missing} m less than the required {rounded_up(required_m)} m"
        f" ({len(short)} {'leg' if len(short) == 1 else 'legs'} too near)."
    )
    if worst_is_unknown:
        return Reason("clearance", text, FILL_OR_AVOID)
    mend = f"Raise H by at least {missing} m or take a larger R."
    with_rtk_m = _required_with_rtk_m(params)
    if nearest.min_distance_m >= with_rtk_m:
        mend += (
            f" With RTK ({RTK_ERROR_M} m) in place of {params.position_error_m} m position error it would be enough."
        )
    return Reason("clearance", text, mend)


def _required_with_rtk_m(params: ClearanceParams) -> float:
    """Infinite where RTK changes nothing: a requirement that was set by hand does not fall with the position error."""
    budget = params.budget
    if budget is None or params.position_error_m <= RTK_ERROR_M or is_by_hand(budget, params.required_clearance_m):
        return math.inf
    return budget.with_value("position_error", RTK_ERROR_M).total_m


def return_reason(needed_m: float, from_m: np.ndarray | None, dsm: Dsm, params: ClearanceParams) -> Reason | None:
    """The way home at the return height; ``from_m`` (3,) projected is the place that asks for most."""
    if params.rtl_height_m >= needed_m or from_m is None:
        return None
    lat_deg, lon_deg = dsm.lat_lon_from_xy(from_m[None, :2])[0]
    place = f"{lat_deg:.7f}, {lon_deg:.7f}"
    if needed_m == math.inf:
        text = f"The straight way home from {place} passes unknown terrain or comes too near the model's edge."
        mend = "Fill the holes, use a model that covers the way home, or move home or the route."
        return Reason("return_unknown", text, mend)
    height_m = math.ceil(needed_m)
    text = (
        f"The straight way home from {place} needs {rounded_up(needed_m)} m above home;"
        f" the return height is {params.rtl_height_m:.2f} m."
    )
    mend = (
        f"Set the return height to at least {height_m} m"
        f" (ArduPilot: RTL_ALT {height_m * 100} cm; PX4: RTL_RETURN_ALT {height_m} m)."
    )
    return Reason("return_height", text, mend)


def near_return_reason(
    needed_m: float, from_m: np.ndarray | None, anywhere_m: float, dsm: Dsm, params: ClearanceParams
) -> Reason | None:
    """The way home from close by, for which autopilots climb less; silent where the return height itself fails."""
    if from_m is None or params.rtl_height_m < anywhere_m:
        return None
    lat_deg, lon_deg = dsm.lat_lon_from_xy(from_m[None, :2])[0]
    text = (
        f"The way home from {lat_deg:.7f}, {lon_deg:.7f} needs {rounded_up(needed_m)} m above home, but so close to"
        " home autopilots do not climb to the return height (ArduPilot RTL_CONE_SLOPE, PX4 RTL_CONE_ANG)."
    )
    mend = "Fly higher near home, or choose a home with nothing tall between it and the line."
    return Reason("return_near_home", text, mend)


def home_reason(
    ground: HomeGround, stand: HomeStand, nearest: LegClearance, planned_m: float, params: ClearanceParams
) -> Reason | None:
    """Why no vehicle can start at home, or what the flight would come to if it stood as low as it may there.

    ``nearest`` is the leg that comes nearest to the surface then, ``planned_m`` what the line keeps from where heights
    are counted. A line that is too near by itself says so; of home it is said only how much nearer it makes it.
    """
    obstacle = ground.obstacle
    if obstacle is not None and not ground.on_top:
        return Reason("home_column", f"The column over home is not clear: {obstacle}.", _other_home(stand))
    missing = rounded_up(params.required_clearance_m - stand.min_distance_m)
    if obstacle is not None:
        text = (
            f"Home lies on top of something: {obstacle}. All heights are counted from there; a vehicle that stands"
            f" beside it flies the whole mission up to {rounded_up(stand.drop_m)} m lower, and comes within"
            f" {rounded_down(stand.min_distance_m)} m of the surface."
        )
        return Reason("home_on_top", text, _other_home(stand))
    if stand.drop_m == 0.0 or not stand.min_distance_m < params.required_clearance_m:
        return None
    line_does = planned_m >= params.required_clearance_m
    if not line_does and stand.min_distance_m > planned_m - SAME_M:
        return None
    source = f"the surface model is so low within {stand.reach_m:.2f} m of it"
    if stand.told_by == "vehicle":
        source = "so low it may be by its own account"
    text = (
        f"A vehicle at home may stand {rounded_up(stand.drop_m)} m lower than heights are counted from: {source}."
        f" It then comes within {rounded_down(stand.min_distance_m)} m of the surface on {_leg(nearest)}:"
        f" {missing} m less than the required {rounded_up(params.required_clearance_m)} m."
    )
    mend = f"Raise H by at least {missing} m."
    return Reason("home_drop", text, f"{mend} {_other_home(stand)}" if line_does else mend)


def _other_home(stand: HomeStand) -> str:
    better = stand.better
    if better is None:
        return (
            f"No place within {FARTHEST_M:.0f} m would do: choose a home on open ground, lower the position error"
            " (RTK), or remove what does not stand there from the surface model."
        )
    place = f"{better.lat_deg:.7f}, {better.lon_deg:.7f}, {better.away_m:.1f} m to the {direction(better.bearing_deg)}"
    if better.does:
        return f"The nearest home that would do is {place}."
    return (
        f"The most level home within {FARTHEST_M:.0f} m is {place}; a vehicle may stand {better.drop_m:.2f} m lower"
        " than the model's ground there."
    )


def direction(bearing_deg: float) -> str:
    """One of the eight winds."""
    return WINDS[round(bearing_deg / 45.0) % 8]


def landing_reason(obstacle: str | None) -> Reason | None:
    if obstacle is None:
        return None
    text = f"The column over the landing place is not clear: {obstacle}."
    return Reason("landing_column", text, "Choose another place on open ground, or lower the position error.")


def height_reason(highest_m: float, leg: int, item: int, params: ClearanceParams) -> Reason | None:
    """The tube's upper side counts, as its lower side does for the clearance."""
    limit_m = params.max_height_above_ground_m
    if limit_m is None or highest_m + params.following_m <= limit_m:
        return None
    above = f", and the vehicle may be {rounded_up(params.following_m)} m above it" if params.following_m else ""
    text = (
        f"The line flies {rounded_up(highest_m)} m above ground on leg {leg + 1} (item {item + 1}){above};"
        f" the limit is {limit_m:.2f} m."
    )
    return Reason(
        "height_above_ground", text, "Lower H or R, allow steeper climbs and descents, or use more waypoints."
    )


def scale_reason(scale: float, tolerance: float) -> Reason | None:
    if abs(scale - 1.0) <= tolerance:
        return None
    text = f"One metre on the ground is {scale:.4f} m in the surface model's CRS: distances in it are not true."
    return Reason("crs_scale", text, "Reproject the surface model to its UTM zone or another local CRS.")


def _leg(leg: LegClearance) -> str:
    return f"leg {leg.leg + 1} (item {leg.item + 1})"


def _legs(legs: list[LegClearance]) -> str:
    return "One leg leads" if len(legs) == 1 else f"{len(legs)} legs lead"
