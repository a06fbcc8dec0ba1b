"""What a worker does after a climb: the rest of the flight planned again over the surface model with what was seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, apart_m
from planning.errors import DescribedError
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.rest_of_plan import Underway, rest_of_plan
from server.scene.mirror import Voxels
from server.schemas import PlanDoc, PoiDoc
from server.work.jobs import Progress
from telemetry.flight.avoidance.coming_down import between
from telemetry.flight.home_watch import HomePlace
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from planning.basics.plan_model import Mission
    from planning.evading.seen import Columns
    from planning.terrain.dsm import Dsm
    from telemetry.perception.mission_line import FlightLine

SHADOW_M = 25.0
"""Behind what was seen nobody has looked: it is taken to be as deep as this, along the flight, and as high."""
HERE_M = 3.0
"""A target this near to where the vehicle was is the first of the rest."""
SAME_M = 0.5
STEEP_M, PIECE_M = 0.5, 5.0
"""A leg that climbs or sinks by more is handed over in pieces: height and place are flown each for itself."""


@dataclass(frozen=True, slots=True)
class RestPlanned:
    """``targets`` empty: it stays higher, and ``why``."""

    targets: tuple[GuidedTarget, ...] = ()
    why: str = ""


def plan_rest(situation: Situation, *, report: Progress) -> RestPlanned:
    """Certified from where the vehicle is on, or the reason why it is not."""
    try:
        return _planned(situation, report)
    except DescribedError as error:
        return RestPlanned(why=error.what)


def _planned(situation: Situation, report: Progress) -> RestPlanned:
    from planning.certificate.clearance import certify
    from planning.planner.plan import plan_mission
    from server.library.documents import clearance_of, request_from_doc, seen_in
    from server.library.seen_columns import load_planned_terrain

    state, record = situation.state, situation.record
    if not record.plan_json:
        return RestPlanned(why="The plan that is flown is not known here.")
    underway = Underway(record, situation.flight, state)
    document = PlanDoc.model_validate_json(record.plan_json)
    fields = rest_of_plan("ahead", underway, terrain_id=record.terrain_id)
    fields["pois"] = _apart(fields["pois"])
    document = PlanDoc.model_validate({**document.model_dump(), **fields})
    dsm = burned(load_planned_terrain(situation.terrain, seen_in(record)), situation.maps, state, situation.took_off)
    plan = plan_mission(dsm, request_from_doc(document, dsm), report=report)
    here = dsm.xy_from_lat_lon(np.array([[state.lat_deg, state.lon_deg]]))[0]
    first = int(np.argmax(np.hypot(*(plan.line.points_m[:, :2] - here).T) <= HERE_M))
    line = replace(plan.line, points_m=plan.line.points_m[first:], leg_item=plan.line.leg_item[first:])
    if len(line.points_m) < 2:
        return RestPlanned(why="Nothing is left of the mission.")
    certificate = certify(plan.dsm, line, clearance_of(record))
    if not certificate.certified:
        return RestPlanned(why=certificate.reasons[0].text)
    targets = _targets(plan.mission, situation)
    return RestPlanned(targets) if len(targets) > 1 else RestPlanned(why="Nothing is left of the mission.")


def _apart(pois: list[PoiDoc]) -> list[PoiDoc]:
    """Turns of a mission may stand one above the other: as points they are one."""
    out: list[PoiDoc] = []
    for poi in pois:
        if not out or apart_m((out[-1].lat_deg, out[-1].lon_deg), (poi.lat_deg, poi.lon_deg)) > SAME_M:
            out.append(poi)
    return out


def burned(dsm: Dsm, maps: tuple[Voxels, ...], state: VehicleState, took_off: HomePlace | None) -> Dsm:
    """The model with all that was seen, and its shadow, as columns. Raises NotAllowedError where nobody knows how high
    that stands: each map counts its heights from the home that it was begun under, wherever that lay."""
    from planning.evading.seen import burn, columns_from_voxels
    from telemetry.flight.home_height import home_on_ground, up_zero_m

    seen = [(map_.origin, map_.centres_enu_m[~map_.explained], map_.resolution_m) for map_ in maps]
    stands = [(origin, centres, edge_m) for origin, centres, edge_m in seen if origin is not None and len(centres)]
    if not stands:
        return dsm
    ground, home = dsm, home_on_ground([origin for origin, _, _ in stands], took_off, state)
    for origin, centres, edge_m in stands:
        frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        zero_m = up_zero_m(ground, home, origin)
        columns = columns_from_voxels(centres, edge_m, frame=frame, dsm=dsm, home_alt_dsm_m=zero_m)
        dsm = burn(dsm, with_shadow(columns, _forward(dsm, state)))
    return dsm


def with_shadow(columns: Columns, forward: F64) -> Columns:
    """As deep as what was seen may be: the same columns, moved on along ``forward`` (2,), too."""
    steps = np.arange(0.0, SHADOW_M + columns.edge_m, columns.edge_m)
    moved = [columns.xy_m + step * forward for step in steps]
    return replace(columns, xy_m=np.vstack(moved), top_alt_dsm_m=np.tile(columns.top_alt_dsm_m, len(steps)))


def _forward(dsm: Dsm, state: VehicleState) -> F64:
    """The leg's direction that is flown, in the model's plane."""
    heading = state.heading_rad or 0.0
    v = (state.v_north_m_s or 0.0, state.v_east_m_s or 0.0)
    north, east = v if math.hypot(*v) > 0.5 else (math.cos(heading), math.sin(heading))
    lat, lon = state.lat_deg or 0.0, state.lon_deg or 0.0
    ahead = [lat + 1e-4 * north, lon + 1e-4 * east / math.cos(math.radians(lat))]
    a, b = dsm.xy_from_lat_lon(np.array([[lat, lon], ahead]))
    return (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)


def _targets(mission: Mission, situation: Situation) -> tuple[GuidedTarget, ...]:
    """From where the vehicle was on, with the numbers that the mission on board has for them."""
    from telemetry.flight.guided.script_targets import guided_plan
    from telemetry.perception.mission_line import mission_line

    line, state = mission_line(situation.record, situation.origin), situation.state
    frame = LocalFrame(situation.origin.lat_deg, situation.origin.lon_deg, situation.origin.alt_amsl_m)
    targets = guided_plan(mission).targets
    enu = np.array([frame.to_enu(t.lat_deg, t.lon_deg, frame.alt_m)[0, :2] for t in targets])
    here = frame.to_enu(state.lat_deg or 0.0, state.lon_deg or 0.0, frame.alt_m)[0, :2]
    first = int(np.argmax(np.hypot(*(enu - here).T) <= HERE_M))
    numbers = _items(line, enu[first:], situation.flight.target or 1)
    numbered = [replace(t, item=n) for t, n in zip(targets[first:], numbers, strict=True)]
    return tuple(piece for k in range(len(numbered)) for piece in _pieces(numbered[k - 1] if k else None, numbered[k]))


def _items(line: FlightLine | None, enu: F64, target: int) -> list[int]:
    """Of the mission on board: each place's on the leg that is nearest to it, never back."""
    if line is None:
        return [target] * len(enu)
    leg = next((n for n, item in enumerate(line.leg_item) if item >= target), len(line.leg_item) - 1)
    out: list[int] = []
    for place in enu:
        away = [_away_m(line, n, place) for n in range(leg, len(line.leg_item))]
        leg += next(n for n, away_m in enumerate(away) if away_m <= min(away) + 1.0)
        out.append(line.leg_item[leg])
    return out


def _away_m(line: FlightLine, leg: int, place: F64) -> float:
    a, d = line.points_enu[leg, :2], line.points_enu[leg + 1, :2] - line.points_enu[leg, :2]
    share = float(np.clip((place - a) @ d / max(float(d @ d), 1e-9), 0.0, 1.0))
    return float(np.linalg.norm(a + share * d - place))


def _pieces(before: GuidedTarget | None, target: GuidedTarget) -> list[GuidedTarget]:
    if before is None or abs(target.alt_rel_home_m - before.alt_rel_home_m) <= STEEP_M:
        return [target]
    apart = LocalFrame(before.lat_deg, before.lon_deg, 0.0).to_enu(target.lat_deg, target.lon_deg, 0.0)[0, :2]
    count = max(1, math.ceil(float(np.linalg.norm(apart)) / PIECE_M))
    shares = [k / count for k in range(1, count)]
    return [*(between(before, target, share) for share in shares), target]
