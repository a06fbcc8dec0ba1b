"""What the flight lane's worker does when an obstacle is alerted: the ways over and around it, with their clearance."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from planning.missions.vehicle_profile import parse_profile
from server.library.documents import clearance_of
from server.library.terrains import ground_notice
from server.obstacles.manoeuvre_situation import (
    PAST,
    MissionAhead,
    Prepared,
    Situation,
    cruise_m_s,
    handle_of,
    impossible,
    none_possible,
)
from server.scene.mirror import Voxels
from server.schemas import ManoeuvreDoc
from server.work.jobs import Progress
from telemetry.topics.messages import FlightStatus, GuidedTarget, PlanRecord
from telemetry.topics.obstacles import GroundNotice, MapOrigin, ObstacleAlert

if TYPE_CHECKING:
    from mapping.perceiving.ground import GroundGrid
    from planning.evading.keep_clear import Seen
    from planning.evading.way_past import Kind, Manoeuvre, NoWay
    from telemetry.perception.mission_line import FlightLine

log = logging.getLogger("hedgehop.obstacles")

BESIDE_M = 3.0
"""A vehicle farther than this from where its leg begins is on its way to it."""
NEAR_M = 250.0
"""Farther from the vehicle no way leads."""
NO_PLACE = "Where the vehicle is now is not known."
NO_LINE = "The mission on board is no line that could be gone on along. Hold, and fly past it by hand."
NO_MISSION = "A guided way is flown, not the mission. Hold, then ask for another way."


def prepare(situation: Situation, *, report: Progress) -> tuple[Prepared, ...]:
    """Each possible or with the reason why not. Over and around what stands only where a mission is flown."""
    from planning.evading.manoeuvres import AvoidanceParams, around, over
    from server.obstacles.sidestep_task import Around, sidestepped
    from telemetry.perception.mission_line import mission_line

    report("Looking for a way past the obstacle", None)
    line, state = mission_line(situation.record, situation.origin), situation.state
    if state.lat_deg is None or state.lon_deg is None or state.alt_rel_home_m is None:
        return none_possible(NO_PLACE, situation.alert, situation.approach)
    frame = LocalFrame(situation.origin.lat_deg, situation.origin.lon_deg, situation.origin.alt_amsl_m)
    position = frame.to_enu(state.lat_deg, state.lon_deg, situation.origin.alt_amsl_m + state.alt_rel_home_m)[0]
    flies_way = _flies_way(situation.flight)
    ahead = None if line is None or flies_way else _ahead(line, position, situation)
    reach_up = math.tan(math.radians(situation.radar_high_deg))
    seen = [_seen(voxels, situation.origin, frame, position, reach_up) for voxels in situation.maps if len(voxels.keys)]
    surface = _surface(ground_notice(situation.terrain), situation.origin)
    params = AvoidanceParams(
        radius_m=situation.radius_m,
        required_m=required_m(situation.record),
        ceiling_m=max(0.0, situation.ceiling_m - situation.height_offset_m),
    )
    alert, approach, prepared = situation.alert, situation.approach, list[Prepared]()
    if alert is not None and ahead is None:
        prepared += none_possible(NO_MISSION if flies_way else NO_LINE, alert, None)
    elif alert is not None and ahead is not None:
        for kind, find in zip(PAST, (over, around), strict=True):
            way = partial(find, position, ahead.points_enu_m, seen, surface, params)
            prepared.append(_or_why(kind, alert, lambda way=way: _prepared(way(), alert, situation, ahead, frame)))
    if approach is not None:
        there = Around(seen, surface, params, frame)
        prepared.append(_or_why("sidestep", approach, lambda: sidestepped(situation, approach, position, ahead, there)))
    return tuple(prepared)


def _or_why(kind: Kind, alert: ObstacleAlert, find: Callable[[], Prepared]) -> Prepared:
    """One that fails takes none of the others with it, and says so."""
    try:
        return find()
    except Exception as error:
        from server.errors import reported

        return impossible(kind, reported(error, log, f"Looking for the way: {kind}").what, alert)


def _flies_way(flight: FlightStatus) -> bool:
    """A guided way, whose places are no items of a mission: none can be gone on from after another way."""
    return flight.way == "guided" and flight.phase in ("flying", "paused") and flight.target is None


def required_m(record: PlanRecord) -> float:
    """That the mission keeps from the ground, or was certified for; else all that its vehicle needs."""
    from planning.missions.vehicle_terms import budget_of

    if record.plan_json:
        return clearance_of(record).required_clearance_m
    if record.certificate_json:
        return float(json.loads(record.certificate_json)["required_clearance_m"])
    return budget_of(parse_profile(record.profile_toml.encode(), where="the plan's profile")).total_m


def _seen(voxels: Voxels, origin: MapOrigin, frame: LocalFrame, position: F64, reach_up: float) -> Seen:
    """What may matter to any way from there; a radar does not tell how high things are."""
    from planning.evading.columns import standing
    from planning.evading.keep_clear import Seen

    centres = _centres_enu_m(voxels, origin, frame)
    centres = centres[np.hypot(*(centres[:, :2] - position[:2]).T) <= NEAR_M]
    seen = Seen(centres, voxels.resolution_m)
    return standing(seen, position, reach_up=reach_up) if voxels.sensor == "radar" else seen


def _centres_enu_m(voxels: Voxels, origin: MapOrigin, frame: LocalFrame) -> F64:
    """(N, 3) of what known ground does not explain, in the frame of ``origin``."""
    centres, own = voxels.centres_enu_m[~voxels.explained], voxels.origin
    if own is None or own == origin or not len(centres):
        return centres
    return frame.to_enu(*LocalFrame(own.lat_deg, own.lon_deg, own.alt_amsl_m).to_geodetic(centres).T)


@lru_cache(maxsize=1)
def _surface(notice: GroundNotice, origin: MapOrigin) -> GroundGrid:
    from telemetry.perception.known_ground import ground_around

    return ground_around(notice, origin)


def _ahead(line: FlightLine, position: F64, situation: Situation) -> MissionAhead:
    """The rest of the mission from the place of the leg that is flown which is nearest to the vehicle."""
    points = line.points_enu + np.array([0.0, 0.0, situation.height_offset_m])
    target = situation.flight.target or 0
    leg = next((n for n, item in enumerate(line.leg_item) if item >= target), len(line.leg_item) - 1)
    a, d = points[leg], points[leg + 1] - points[leg]
    share = float(np.clip((position - a) @ d / max(float(d @ d), 1e-9), 0.0, 1.0))
    if share == 0.0 and math.dist(position[:2], a[:2]) > BESIDE_M:
        return MissionAhead(line, np.vstack([position, points[leg:]]), leg - 1)
    return MissionAhead(line, np.vstack([a + share * d, points[leg + 1 :]]), leg)


def _prepared(
    way: Manoeuvre | NoWay, alert: ObstacleAlert, situation: Situation, ahead: MissionAhead, frame: LocalFrame
) -> Prepared:
    from planning.evading.way_past import NoWay

    if isinstance(way, NoWay):
        return impossible(way.kind, way.reason, alert)
    speed_m_s = cruise_m_s(situation.record)
    item = ahead.item(way.leg)
    clearance_m, climb_m = min(way.seen_m, way.surface_m), float(np.ptp(way.points_enu_m[:, 2]))
    doc = ManoeuvreDoc(
        id=handle_of(way.kind, alert),
        kind=way.kind,
        for_alert=alert.id,
        possible=True,
        text=_words(way, climb_m),
        clearance_m=clearance_m if math.isfinite(clearance_m) else None,
        length_m=way.length_m,
        seconds=way.length_m / speed_m_s,
        climb_m=climb_m,
        top_unseen=way.top_unseen,
    )
    geodetic = frame.to_geodetic(way.points_enu_m[1:])
    targets = tuple(
        GuidedTarget(item, lat, lon, float(up), speed_m_s)
        for (lat, lon, _), up in zip(geodetic.tolist(), way.points_enu_m[1:, 2], strict=True)
    )
    points = tuple((e, n, u) for e, n, u in way.points_enu_m.tolist())
    begins = frame.to_geodetic(way.points_enu_m[:1])[0].tolist()
    height_offset_m = situation.height_offset_m + way.height_offset_m
    return Prepared(doc, targets, item, height_offset_m, points, (begins[0], begins[1]))


def _words(way: Manoeuvre, climb_m: float) -> str:
    if way.kind == "over":
        top = " Its top has not been seen: the vehicle climbs on if it must." if way.top_unseen else ""
        return f"Climb {climb_m:.0f} m straight up, then on along the mission, {way.height_offset_m:.0f} m higher.{top}"
    rest = "" if way.height_offset_m < 0.5 else f", {way.height_offset_m:.0f} m higher"
    return f"Sideways past it and back onto the mission{rest}."
