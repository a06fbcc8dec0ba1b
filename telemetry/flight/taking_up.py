"""A plan that is taken up in the air: the way there from where the vehicle holds, and the plan's rest, as one mission.

The way is laid and proved as every guided way is, the whole mission as every mission is: once before it is sent, and
once more as it was read back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Firmware, Home, Mission
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.certificate.clearance import certify
from planning.flight_time.predict import predict_duration
from planning.flight_time.return_speeds import ReturnSpeeds
from planning.formats.commands import has_position
from planning.guided.guided_model import GuidedWay, Join
from planning.missions.flown import flown_line
from planning.missions.joined_mission import Joining, joined_mission, joining
from planning.missions.mission_items import Place
from planning.planner.part import needed_part, rally_places
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from telemetry.errors import NotAllowedError
from telemetry.flight.certified_way import Flown, demanded, judged_way
from telemetry.flight.preflight import checks
from telemetry.flight.preflight.parameters import return_speeds
from telemetry.flight.preflight.preflight import actual_home
from telemetry.flight.preflight.rereference import rereference
from telemetry.mavlink.items import mission_from_onboard
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.vehicle import VehicleState


@dataclass(frozen=True, slots=True)
class FlownOver:
    """The surface that is flown over."""

    ground: Dsm
    """As it came: home and landings are judged by it."""
    seen: Dsm | None
    """The same with what sensors have seen in it; None: nothing was."""


@dataclass(frozen=True, slots=True)
class _Part:
    """So much of it as decides about one flight."""

    ground: Dsm
    seen: Dsm | None
    filled: Dsm
    """From which heights are counted."""
    surface: Dsm
    """From which distance is kept."""


@dataclass(frozen=True, slots=True)
class TakenUp:
    """What is flown in place of the mission on board."""

    mission: Mission
    """From its first item's place on, where the vehicle hovers; its heights count from the vehicle's own home."""
    begins: tuple[float, float, float]
    """lat_deg, lon_deg, alt_rel_home_m of the vehicle as it was judged."""
    way: GuidedWay
    joined: Joining
    certificate: Certificate
    """Of way and rest."""
    battery: checks.Row


def taken_up(
    over: FlownOver, planned: Mission, state: VehicleState, flown: Flown, *, flown_items: int, now_s: float
) -> TakenUp:
    """The way from where the vehicle hovers into a plan, and the rest of it. Takes up to seconds: for a worker.

    ``flown_items``: so many items at the plan's beginning were flown already. Raises NotAllowedError with what is in
    the way, MissionError, ParameterError and CapacityError.
    """
    home = _home(state, over.ground)
    part = _part(over, _places(over.ground, planned, state, home, flown))
    mission = replace(_from_home(planned, home, part.ground), fence=flown.kept_fence(state), rally=flown.rally)
    if (row := checks.amsl_row(mission, state, home)) is not None:
        raise NotAllowedError(row.text, where="home", advice=row.mend)
    at_m = np.array([*_xy(part.ground, state.lat_deg, state.lon_deg), home.alt_dsm_m + (state.alt_rel_home_m or 0.0)])
    joined = joining(mission, flown_line(mission, part.filled), part.ground, at_m, flown_items=flown_items)
    way = _way(part, joined, home, mission, state, flown, now_s)
    # A vehicle that is too low rises on the spot: that is no leg of the mission, which begins above it.
    places = [Place(lat, lon, home.alt_dsm_m + up_m) for lat, lon, up_m in way.places[1 if way.rises_m > 0.0 else 0 :]]
    rest = joined_mission(mission, joined, places, most_items=flown.profile.max_items)
    certificate = _certified(part, rest, demanded(state, flown))
    returns = return_speeds(flown.parameters, mission.firmware)
    battery = checks.battery_row(state, flown.profile, _left_s(rest, flown, part.filled, returns))
    return TakenUp(rest, way.places[0], way, joined, certificate, battery)


def certified_on_board(
    over: FlownOver, onboard: OnboardMission, firmware: Firmware, state: VehicleState, flown: Flown
) -> Certificate:
    """Of what was read back. Raises NotAllowedError, MissionError."""
    home = _home(state, over.ground)
    mission = mission_from_onboard(onboard, firmware, home=home)
    mission = replace(mission, fence=flown.kept_fence(state), rally=flown.rally)
    part = _part(over, _places(over.ground, mission, state, home, flown))
    return _certified(part, mission, demanded(state, flown))


def _way(
    part: _Part, joined: Joining, home: Home, mission: Mission, state: VehicleState, flown: Flown, now_s: float
) -> GuidedWay:
    wish = Join((joined.lat_deg, joined.lon_deg), joined.alt_dsm_m - home.alt_dsm_m)
    speed_m_s = min(mission.cruise_speed_m_s or flown.profile.mean_speed_m_s, flown.profile.max_speed_m_s)
    way = judged_way(part.ground, part.seen, state, wish, flown, speed_m_s=speed_m_s, now_s=now_s)
    if way.problem is not None:
        raise _refused(way.certificate, f"the way into the plan, {joined.away_m:.0f} m")
    return way


def _certified(part: _Part, mission: Mission, clearance: ClearanceParams) -> Certificate:
    """Of a mission that begins where the vehicle hovers. Raises NotAllowedError where it is not clear."""
    line = flown_line(mission, part.filled, begins_in_air=True)
    certificate = certify(part.surface, line, clearance, ground=part.ground)
    if not certificate.certified:
        raise _refused(certificate, "the way into the plan and its rest")
    return certificate


def _part(over: FlownOver, xy_m: F64) -> _Part:
    ground = needed_part(over.ground, xy_m)
    filled, _ = fill_holes(ground)
    if over.seen is None:
        return _Part(ground, None, filled, filled)
    seen = needed_part(over.seen, xy_m)
    return _Part(ground, seen, filled, fill_holes(seen)[0])


def _home(state: VehicleState, ground: Dsm) -> Home:
    home = actual_home(state, ground)
    if home is None or not np.isfinite(home.alt_dsm_m):
        what = "The surface model knows no height where the vehicle's home is."
        raise NotAllowedError(what, where="home", advice="Return home, and plan over the model that it stands on.")
    return home


def _from_home(planned: Mission, home: Home, ground: Dsm) -> Mission:
    """Its heights counted from where the vehicle's heights begin. Raises NotAllowedError."""
    planned_m = float(ground.elevation_at(np.array([_xy(ground, planned.home.lat_deg, planned.home.lon_deg)]))[0])
    if not np.isfinite(planned_m):
        what = "The surface model knows no height where the plan's home is."
        raise NotAllowedError(what, where="the plan's home", advice="Put the plan's home where the vehicle's is.")
    return rereference(planned, home.alt_dsm_m - planned_m, home=home)


def _places(ground: Dsm, mission: Mission, state: VehicleState, home: Home, flown: Flown) -> F64:
    """(N, 2) of vehicle, home, items and rally points."""
    lat_lon_deg = [(state.lat_deg, state.lon_deg), (home.lat_deg, home.lon_deg)]
    lat_lon_deg += [(item.lat_deg, item.lon_deg) for item in mission.items if has_position(item)]
    known = np.array([place for place in lat_lon_deg if None not in place], np.float64)
    return np.vstack([ground.xy_from_lat_lon(known), rally_places(ground, flown.rally)])


def _xy(ground: Dsm, lat_deg: float | None, lon_deg: float | None) -> Sequence[float]:
    if lat_deg is None or lon_deg is None:
        raise NotAllowedError("Where the vehicle is now is not known.", advice="Wait for its position.")
    return ground.xy_from_lat_lon(np.array([[lat_deg, lon_deg]]))[0].tolist()


def _left_s(mission: Mission, flown: Flown, dsm: Dsm, returns: ReturnSpeeds) -> float:
    """From its first item to the ground at home."""
    predicted = predict_duration(mission, flown.profile, dsm, returns=returns)
    return predicted.flight_s + predicted.return_s


def _refused(certificate: Certificate, where: str) -> NotAllowedError:
    reason = certificate.reasons[0]
    more = len(certificate.reasons) - 1
    what = f"It is not certified: {reason.text}{f' (and {more} more)' if more else ''}"
    return NotAllowedError(what, where=where, advice=reason.mend)
