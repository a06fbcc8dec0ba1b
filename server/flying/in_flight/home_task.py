"""What the flight lane's worker does with home that is to be set, or was moved: its place on the surface model, and
what the vehicle's own return is worth with it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from mapping.errors import DescribedError
from planning.guided.guided_model import GuidedWay
from server.flying.in_flight.way_task import WayAsked, judge_way
from server.library.documents import demands_from_doc
from server.library.terrains import load_terrain
from server.schemas import PlaceDoc, ReasonDoc, ReturnDoc, WayBody
from server.work.jobs import Progress
from telemetry.errors import NotAllowedError
from telemetry.flight.home_watch import HomePlace, home_of
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.vehicle import VehicleState


@dataclass(frozen=True, slots=True)
class Led:
    """Where a return that was judged leads."""

    required_m: float = 0.0
    """That it must keep from everything."""
    rally_deg: tuple[tuple[float, float], ...] = ()
    """(lat_deg, lon_deg) of rally points: autopilots return to the nearest of these and home."""
    instead_deg: tuple[tuple[float, float], ...] = ()
    """(lat_deg, lon_deg) along the guided way that is certified in its place; none where it is certified itself."""


@dataclass(frozen=True, slots=True)
class HomeJudged:
    home: HomePlace
    ret: ReturnDoc | None
    """Of the vehicle's own return to it; None: the vehicle stands on the ground."""
    led: Led = Led()


def judge_home(asked: WayAsked, place: tuple[float, float] | None, *, report: Progress) -> HomeJudged:
    """``place``: lat_deg, lon_deg; None: where the vehicle is. Raises NotAllowedError where home cannot be there."""
    report("Judging home", None)
    home = _home_at(asked, place)
    if not is_in_the_air(asked.state):
        return HomeJudged(home, None)
    # Without a take-off that was heard, home as it is now was found to lie on the ground.
    took_off = asked.took_off or home_of(asked.state)
    there = replace(asked, state=_with_home(asked.state, home), took_off=took_off)
    return HomeJudged(home, *_judged_return(there, report))


def judge_return(asked: WayAsked, *, report: Progress) -> tuple[ReturnDoc, Led]:
    """From where the vehicle is; where that is not certified, whether a guided way home is."""
    return _judged_return(asked, report)


def _judged_return(asked: WayAsked, report: Progress) -> tuple[ReturnDoc, Led]:
    now_s = time.monotonic()
    try:
        lat_deg, lon_deg = _at(asked.state)
        here = WayBody(action="look", place=PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg))
        judged = judge_way(replace(asked, body=here), report=report)
    except DescribedError as error:
        reason = ReasonDoc(code="home", text=error.what, mend=error.advice)
        return ReturnDoc(state="unknown", reasons=[reason], judged_mono_s=now_s), Led()
    way = judged.way
    instead = None if way.problem is None else _certified_way_home(asked, report)
    reasons = [ReasonDoc(code=each.code, text=each.text, mend=each.mend) for each in way.certificate.reasons]
    doc = ReturnDoc(
        state="certified" if way.problem is None else "not_certified",
        reasons=reasons,
        clearance_m=way.clearance_m if math.isfinite(way.clearance_m) else None,
        instead=instead is not None,
        judged_mono_s=now_s,
    )
    if instead is None:
        return doc, Led(way.certificate.required_clearance_m, judged.rally_deg)
    along_deg = tuple(place[:2] for place in instead.places)
    return doc, Led(instead.certificate.required_clearance_m, judged.rally_deg, along_deg)


def _certified_way_home(asked: WayAsked, report: Progress) -> GuidedWay | None:
    try:
        way = judge_way(replace(asked, body=WayBody(action="home")), report=report).way
    except DescribedError:
        return None
    return way if way.problem is None else None


def _home_at(asked: WayAsked, place: tuple[float, float] | None) -> HomePlace:
    """In the air its height is that of the take-off's home, and what the surface model rises from there: home as it
    is now may have been moved to any height."""
    from planning.certificate.home_stand import ground_at
    from telemetry.flight.home_height import home_off_m

    if place is not None and not is_in_the_air(asked.state):
        what = "On the ground home can only be set where the vehicle stands: its height is known there alone."
        raise NotAllowedError(what, where="home", advice="Ask for home here.")
    state, ground = asked.state, load_terrain(asked.terrain)
    lat_deg, lon_deg = _at(state) if place is None else place
    x_m, y_m = ground.xy_from_lat_lon(np.array([[lat_deg, lon_deg]]))[0]
    if not np.isfinite([x_m, y_m]).all():
        raise NotAllowedError("Home cannot be there: the surface model's CRS has no such place.", where="home")
    found = ground_at(ground, (float(x_m), float(y_m)), demands_from_doc(asked.document).clearance())
    if found.obstacle is not None:
        what = f"Home cannot be there: {found.obstacle}."
        raise NotAllowedError(what, where="home", advice="Choose open ground that the surface model knows.")
    if not is_in_the_air(state):
        return HomePlace(
            lat_deg, lon_deg, _stands_amsl_m(state, found.low_dsm_m, found.high_dsm_m, ground.vertical_datum)
        )
    took_off = asked.took_off
    if took_off is None:
        home_off_m(ground, None, state)  # refuses one whose height nobody knows
    began = took_off or home_of(state)
    assert began is not None
    began_xy_m = ground.xy_from_lat_lon(np.array([[began.lat_deg, began.lon_deg]]))
    rises_m = found.alt_dsm_m - float(ground.elevation_at(began_xy_m)[0])
    if not math.isfinite(rises_m):
        what = "The surface model knows no height where home was at first: how much the other lies higher is not known."
        raise NotAllowedError(what, where="home", advice="Open the model that the flight began over.")
    return HomePlace(lat_deg, lon_deg, began.alt_amsl_m + rises_m)


def _stands_amsl_m(state: VehicleState, low_dsm_m: float, high_dsm_m: float, datum: str | None) -> float:
    """Refuses what the receiver and the surface model cannot both be right about."""
    from telemetry.flight.preflight.preflight import own_ground

    if state.alt_amsl_m is None:
        raise NotAllowedError("The vehicle does not tell its height.", where="home", advice="Wait for its position.")
    own_m = own_ground(state, datum)
    if own_m is not None and (own_m[0] > high_dsm_m or own_m[1] < low_dsm_m):
        what = (
            f"By its receiver the ground under the vehicle lies at {own_m[0]:.1f} to {own_m[1]:.1f} m, by the surface"
            f" model at {low_dsm_m:.1f} to {high_dsm_m:.1f} m."
        )
        raise NotAllowedError(what, where="home", advice="One of the two is wrong: see the model's datum, and the fix.")
    return state.alt_amsl_m


def _at(state: VehicleState) -> tuple[float, float]:
    if state.lat_deg is None or state.lon_deg is None:
        raise NotAllowedError("Where the vehicle is now is not known.", advice="Wait for its position.")
    return state.lat_deg, state.lon_deg


def _with_home(state: VehicleState, home: HomePlace) -> VehicleState:
    """As it will tell its height then."""
    now = home_of(state)
    up_m = (
        None if now is None or state.alt_rel_home_m is None else state.alt_rel_home_m + now.alt_amsl_m - home.alt_amsl_m
    )
    return replace(
        state,
        alt_rel_home_m=up_m,
        home_lat_deg=home.lat_deg,
        home_lon_deg=home.lon_deg,
        home_alt_amsl_m=home.alt_amsl_m,
    )
