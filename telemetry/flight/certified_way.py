"""A guided way from the vehicle's real place: judged with what it tells of itself, and the request that flies it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import apart_m
from planning.basics.plan_model import Firmware, VehicleProfile
from planning.certificate.certificate_model import ClearanceParams, Reason, with_accuracy
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, within_both
from planning.guided.guided_model import RETURNS, Back, Demand, GuidedWay, Here, Look, Orbit, TakeOff, Wish
from planning.guided.ways import guided_way
from planning.margins.words import rounded_down, rounded_up
from planning.planner.part import needed_part, rally_places
from planning.terrain.dsm import SCALE_TOLERANCE, Dsm, SurfaceModel
from planning.terrain.holes import fill_holes
from telemetry.errors import NotAllowedError
from telemetry.flight.fence_heights import SAME_M, heights_aboard, lowest_way_m
from telemetry.flight.fence_radius import circle_aboard
from telemetry.flight.guided.handover import is_fresh
from telemetry.flight.guided.script_targets import bearing_rad
from telemetry.flight.home_watch import home_of
from telemetry.flight.preflight.checks import STEEP_ENOUGH, accuracy_m, gnss_row
from telemetry.flight.preflight.parameters import return_as_flown
from telemetry.flight.preflight.preflight import actual_home
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.requests import FlyWay, Operator, StartGuided
from telemetry.topics.vehicle import HomePlace, VehicleState

NO_ITEM = 0


@dataclass(frozen=True, slots=True)
class Flown:
    """The vehicle that is to fly a guided way."""

    profile: VehicleProfile
    clearance: ClearanceParams
    """What is demanded of its lines when it is flown in GUIDED."""
    parameters: Mapping[str, float | None]
    """As read from it: ``telemetry.flight.preflight.parameters.NAMES``."""
    fence: Fence = NO_FENCE
    """The shapes on board, and the plan's fence where there is one."""
    rally: tuple[RallyPoint, ...] = ()
    home_off_m: float = 0.0
    """So much above the ground home may lie, or below it: ``telemetry.flight.home_height``."""

    def kept_fence(self, state: VehicleState) -> Fence:
        """With the floor, the ceiling and the circle around home at which the vehicle acts by its own settings."""
        home, firmware = actual_home(state, None), _firmware(state)
        around = circle_aboard(self.parameters, firmware, None if home is None else (home.lat_deg, home.lon_deg))
        return within_both(within_both(self.fence, heights_aboard(self.parameters, firmware)), around)

    def fence_of_way(self, state: VehicleState) -> Fence:
        """Without the vehicle's own floor: a way begins where the vehicle is, also below it after a take-off, where it
        does not act yet."""
        return replace(self.kept_fence(state), floor_rel_home_m=self.fence.floor_rel_home_m)


def here_of(state: VehicleState, wish: Wish, now_s: float) -> Here:
    """Where a way begins. Raises NotAllowedError where the wish does not suit where the vehicle is, or that is old."""
    flies = state.armed and is_in_the_air(state)
    if isinstance(wish, TakeOff) and flies:
        raise NotAllowedError("The vehicle is in the air already.", advice="Ask for another height instead.")
    if not isinstance(wish, TakeOff) and not flies:
        raise NotAllowedError("The vehicle is not in the air.", advice="Take off first.")
    home, lat_deg, lon_deg, up_m = actual_home(state, None), state.lat_deg, state.lon_deg, state.alt_rel_home_m
    if home is None or lat_deg is None or lon_deg is None or up_m is None or not is_fresh(state, now_s):
        raise NotAllowedError("Where the vehicle is now is not known.", advice="Wait for its position.")
    if flies and home_of(state) is None:
        raise _homeless()
    return Here((lat_deg, lon_deg), 0.0 if isinstance(wish, TakeOff) else up_m, (home.lat_deg, home.lon_deg))


def part_for(
    model: SurfaceModel,
    state: VehicleState,
    wish: Wish,
    rally: tuple[RallyPoint, ...],
    required_clearance_m: float = 0.0,
) -> Dsm:
    """Of the model, around vehicle, home, rally points and the place, or the circle, that is asked for."""
    places = [(state.lat_deg, state.lon_deg), (state.home_lat_deg, state.home_lon_deg)]
    places.append(getattr(wish, "lat_lon_deg", None) or (None, None))
    places += [place[:2] for place in wish.flown] if isinstance(wish, Back) else []
    known = [place for place in places if None not in place]
    xy_m = model.xy_from_lat_lon(np.array(known, np.float64).reshape(-1, 2))
    places_m = np.vstack([xy_m, _circle_corners(model, wish), rally_places(model, rally)])
    return needed_part(model, places_m, required_clearance_m)


def _circle_corners(model: SurfaceModel, wish: Wish) -> F64:
    """(N, 2) projected corners of the square around an orbit, which may lie outside the model; none without one."""
    if not isinstance(wish, Orbit):
        return np.empty((0, 2))
    away_m = (1.0 + SCALE_TOLERANCE) * wish.radius_m * np.array([(-1.0, -1.0), (1.0, 1.0)])
    return model.xy_from_lat_lon(np.array([wish.lat_lon_deg])) + away_m


def nearest_rally(points: tuple[RallyPoint, ...], state: VehicleState) -> RallyPoint:
    """Raises NotAllowedError where there is none."""
    if not points:
        raise NotAllowedError("The vehicle has no rally point.", advice="Send some with the plan, or: hedgehop rally")
    at = (state.lat_deg or 0.0, state.lon_deg or 0.0)
    return min(points, key=lambda point: apart_m(at, (point.lat_deg, point.lon_deg)))


def judged_way(
    ground: Dsm, seen: Dsm | None, state: VehicleState, wish: Wish, flown: Flown, *, speed_m_s: float, now_s: float
) -> GuidedWay:
    """``seen``: the model with what sensors have seen in it, where there is such. Takes up to seconds on a large model.

    Raises NotAllowedError, MissionError and ParameterError.
    """
    here, profile = here_of(state, wish, now_s), flown.profile
    flown = replace(flown, clearance=with_accuracy(flown.clearance, ground))
    if not 0.0 < speed_m_s <= profile.max_speed_m_s:
        what = f"{speed_m_s:g} m/s were asked for; the profile's top speed is {profile.max_speed_m_s:g} m/s."
        raise NotAllowedError(what, advice="Give a speed within that.")
    demand = Demand(
        demanded(state, flown),
        speed_m_s,
        profile.max_climb_m_s,
        profile.max_descent_m_s,
        fence=flown.fence_of_way(state),
        rally=flown.rally,
    )
    way = guided_way(fill_holes(ground if seen is None else seen)[0], ground, here, wish, demand)
    return way if isinstance(wish, RETURNS) else _own_return_known(_floor_kept(way, state, flown), state, flown)


def _floor_kept(way: GuidedWay, state: VehicleState, flown: Flown) -> GuidedWay:
    """Once above its floor the vehicle acts at it: no way but a landing leads back below. One that is below climbs."""
    lowest_m = lowest_way_m(flown.parameters, _firmware(state))
    ends_m = min((place[2] for place in way.places[1:]), default=math.inf)
    if state.alt_rel_home_m is None or state.alt_rel_home_m < lowest_m or ends_m >= lowest_m - SAME_M:
        return way
    what = (
        f"The way leads to {ends_m:.2f} m above home; the vehicle acts at its own floor, {lowest_m:.2f} m with margin."
    )
    reason = Reason("floor", what, "Ask for a greater height, or lower FENCE_ALT_MIN once it is landed.")
    certificate = replace(way.certificate, certified=False, reasons=(*way.certificate.reasons, reason))
    return replace(way, certificate=certificate, problem="way")


def _own_return_known(way: GuidedWay, state: VehicleState, flown: Flown) -> GuidedWay:
    """Its own return is judged by how the vehicle says that it returns: without that, it is not certified.

    As in the check before the start, the pilot may accept it.
    """
    settings = return_as_flown(flown.parameters, _firmware(state))
    if settings.height_m is None:
        what = f"The vehicle does not tell its return height ({settings.parameter}): its own return is not certified."
        reason = Reason("return_unknown", what, "Ask again, or make sure that it is high enough.")
    elif not settings.steep_enough:
        what = "Close to home the vehicle climbs less on its return than the certificate takes for granted."
        reason = Reason("return_near_home", what, STEEP_ENOUGH)
    else:
        return way
    certificate = replace(way.certificate, certified=False, reasons=(*way.certificate.reasons, reason))
    return replace(way, certificate=certificate, problem=way.problem or "return")


def _firmware(state: VehicleState) -> Firmware:
    return "px4" if state.autopilot == "px4" else "ardupilot"


def demanded(state: VehicleState, flown: Flown) -> ClearanceParams:
    """With the vehicle's own return height, and its receiver's accuracy where that is worse than was assumed."""
    row = gnss_row(state, flown.profile)
    if row.state in ("bad", "unknown"):
        raise NotAllowedError(row.text, advice=row.mend)
    clearance = _at_worse_end(state, flown)
    height_m = return_as_flown(flown.parameters, _firmware(state)).height_m
    worse_m = max(0.0, max(accuracy_m(state)[:2]) - clearance.position_error_m)
    return replace(
        clearance,
        required_clearance_m=clearance.required_clearance_m + worse_m,
        position_error_m=clearance.position_error_m + worse_m,
        rtl_height_m=clearance.rtl_height_m if height_m is None else height_m,
        set_down_m=0.0,
    )


def _at_worse_end(state: VehicleState, flown: Flown) -> ClearanceParams:
    """The vehicle may be lower than it tells, and higher: then a fence's ceiling is nearer, and the highest height."""
    clearance, off_m = flown.clearance, flown.home_off_m
    most_m = clearance.max_height_above_ground_m
    return replace(
        clearance,
        required_clearance_m=clearance.required_clearance_m + abs(off_m),
        position_error_m=clearance.position_error_m + (max(0.0, off_m) if flown.fence_of_way(state) else 0.0),
        max_height_above_ground_m=None if most_m is None else most_m - max(0.0, off_m),
    )


def way_request(
    operator: Operator, way: GuidedWay, wish: Wish, home: HomePlace | None, *, speed_m_s: float, most_m_s: float
) -> StartGuided | FlyWay:
    """What flies a way that may be flown, from the ``home`` that it was judged for: the link refuses it for another.

    Raises NotAllowedError without one, unless it is a take-off, before which the vehicle takes its home.
    """
    targets = tuple(
        GuidedTarget(NO_ITEM, lat_deg, lon_deg, up_m, speed_m_s, heading_rad=_heading(wish, (lat_deg, lon_deg)))
        for lat_deg, lon_deg, up_m in way.places[1:]
    )
    spare_m = max(0.0, way.clearance_m - way.certificate.required_clearance_m)
    if isinstance(wish, TakeOff):
        lat_deg, lon_deg, _ = way.places[0]
        begins, up_m = {"begins_lat_deg": lat_deg, "begins_lon_deg": lon_deg}, way.places[-1][2]
        return StartGuided(operator, targets, up_m, end="hold", spare_m=spare_m, **begins)
    if home is None:
        raise _homeless()
    end = "land" if isinstance(wish, RETURNS) else "hold"
    return FlyWay(operator, targets, *way.places[0], most_m_s, end=end, spare_m=spare_m, home=home)


def _homeless() -> NotAllowedError:
    what = "The vehicle does not tell its home, place and height: no way can be certified for it."
    return NotAllowedError(what, where="home", advice="Wait for it.")


def _heading(wish: Wish, at_deg: tuple[float, float]) -> float | None:
    return bearing_rad(at_deg, wish.lat_lon_deg) if isinstance(wish, Look | Orbit) else None


def way_json(way: GuidedWay) -> dict[str, Any]:
    """Of a judged way, for scripts."""
    worst = way.certificate.worst
    return {
        "certified": way.problem is None,
        "problem": way.problem,
        "clearance_m": _finite(way.clearance_m),
        "required_clearance_m": way.certificate.required_clearance_m,
        "worst": {"lat_deg": worst.lat_deg, "lon_deg": worst.lon_deg, "alt_rel_home_m": worst.alt_rel_home_m},
        "raised_m": way.raised_m,
        "rises_m": way.rises_m,
        "length_m": way.length_m,
        "seconds": way.seconds,
        "places": [dict(zip(("lat_deg", "lon_deg", "alt_rel_home_m"), place, strict=True)) for place in way.places],
        "reasons": [reason.text for reason in way.certificate.reasons],
    }


def _finite(value_m: float) -> float | None:
    return value_m if math.isfinite(value_m) else None


def way_words(way: GuidedWay) -> str:
    """In a few short sentences."""
    kept_m, required_m = max(0.0, way.clearance_m), way.certificate.required_clearance_m
    figures = (
        f"{way.length_m:.0f} m, about {way.seconds:.0f} s; at least {rounded_down(kept_m)} m from the surface,"
        f" required {rounded_up(required_m)} m."
    )
    return " ".join([figures, *way_notes(way)])


def way_notes(way: GuidedWay) -> list[str]:
    """Where it is not what was asked for."""
    notes = []
    if way.rises_m > 0.05 and np.ptp(way.points_m[:, :2], axis=0).any():
        notes.append(f"It first climbs {rounded_up(way.rises_m)} m straight up.")
    if way.turns:
        notes.append("It passes beside the fence.")
    if way.raised_m > 0.05:
        notes.append(f"It ends {rounded_up(way.raised_m)} m higher than asked: lower is not certified.")
    return notes
