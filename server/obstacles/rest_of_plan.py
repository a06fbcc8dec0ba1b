"""The plan that is flown, cut to what is left of it: the mission ahead or the way home, from the vehicle's place on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import ValidationError

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, apart_m
from mapping.geometry.polyline import Polyline, along_m
from server.errors import NotReadyError
from server.schemas import PlaceDoc, PlanDoc, PoiDoc
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from planning.basics.plan_model import Mission
    from telemetry.perception.mission_line import FlightLine

Part = Literal["ahead", "home"]
SAME_PLACE_M = 2.0
"""Of a point and the line that leads over it; nearer to the vehicle than this a point is where it already is."""


@dataclass(frozen=True, slots=True)
class Underway:
    """A mission and the vehicle that flies it."""

    record: PlanRecord
    flight: FlightStatus
    state: VehicleState


def rest_of_plan(part: Part, underway: Underway | None, *, terrain_id: str) -> dict[str, Any]:
    """Fields of a plan document: points from the vehicle's place on, over the flown plan's home. Raises NotReadyError.

    Of a survey, whose points are not the operator's, the turns that are left are the points.
    """
    from planning.formats.wpl import read_wpl

    here = None if underway is None else _place(underway.state)
    if underway is None or here is None or underway.state.landed not in (None, "in_air", "taking_off"):
        raise NotReadyError("No mission is being flown.", advice="Plan the whole anew.")
    record = underway.record
    if record.terrain_id != terrain_id:
        raise NotReadyError(
            f'The open plan is not the one that is flown, "{record.name}".', advice="Open the plan that is flown."
        )
    mission = read_wpl(record.mission_wpl, record.name)
    home = PlaceDoc(lat_deg=mission.home.lat_deg, lon_deg=mission.home.lon_deg)
    left = [_poi("home", "Home", home)] if part == "home" else _left(underway, mission, here)
    if not left:
        raise NotReadyError("Nothing is left of the mission.", advice="Plan the way home.")
    if apart_m((here.lat_deg, here.lon_deg), (left[0].lat_deg, left[0].lon_deg)) > SAME_PLACE_M:
        left.insert(0, _poi("here", "From here", here))
    return {"source": "pois", "pois": _numbered(left), "home": home, **_survey_fields(_flown(record), part)}


def _survey_fields(flown: PlanDoc, part: Part) -> dict[str, Any]:
    """What a survey brings beside its lines: their height, and on the mission ahead the photos."""
    from planning.basics.plan_model import Camera
    from planning.route.camera import LOOKS_DOWN_DEG, footprint_m, height_from_gsd_m

    if flown.source != "survey" or flown.profile.camera is None:
        return {}
    camera = Camera(**flown.profile.camera.model_dump())
    height_m = height_from_gsd_m(camera, flown.survey.gsd_cm)
    trigger_m = footprint_m(camera, height_m)[1] * (1 - flown.survey.front_overlap)
    photos = {
        "camera_trigger_m": flown.mission.camera_trigger_m or trigger_m,
        "gimbal_pitch_deg": LOOKS_DOWN_DEG
        if flown.mission.gimbal_pitch_deg is None
        else flown.mission.gimbal_pitch_deg,
    }
    return {
        "surface": flown.surface.model_copy(update={"height_m": height_m}),
        "mission": flown.mission.model_copy(update=photos if part == "ahead" else {"camera_trigger_m": None}),
    }


def _left(underway: Underway, mission: Mission, here: PlaceDoc) -> list[PoiDoc]:
    """Points that the mission has not come to, in their order."""
    from telemetry.perception.mission_line import mission_line

    origin = MapOrigin(mission.home.lat_deg, mission.home.lon_deg, 0.0)
    line = mission_line(underway.record, origin)
    if line is None:
        raise NotReadyError("The mission is no line that could be gone on with.", advice="Plan the whole anew.")
    frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
    s_m = along_m(line.points_enu[:, :2])
    at_m = _flown_m(line, s_m, underway.flight.target or 0, _flat(frame, here))
    points = _points(underway.record, mission)
    met_m = _met_m(line, s_m, np.array([_flat(frame, point) for point in points]))
    return [point for point, there_m in zip(points, met_m, strict=True) if there_m > at_m]


def _points(record: PlanRecord, mission: Mission) -> list[PoiDoc]:
    from planning.formats.commands import has_position

    flown = _flown(record)
    if flown.source == "pois" and flown.pois:
        return list(flown.pois)
    turns = [item for item in mission.items if has_position(item)]
    return [
        PoiDoc(id=f"item-{number}", lat_deg=item.lat_deg, lon_deg=item.lon_deg) for number, item in enumerate(turns, 1)
    ]


def _flown(record: PlanRecord) -> PlanDoc:
    """The document of the flown plan; an empty one where the record has none."""
    try:
        return PlanDoc.model_validate_json(record.plan_json)
    except ValidationError:
        return PlanDoc()


def _flown_m(line: FlightLine, s_m: F64, target: int, here: F64) -> float:
    """How far along the line the vehicle is, by the item that it flies to."""
    leg = next((n for n, item in enumerate(line.leg_item) if item >= target), len(line.leg_item) - 1)
    return float(s_m[leg]) + _nearest(line, leg, here)[0]


def _met_m(line: FlightLine, s_m: F64, points: F64) -> list[float]:
    """Where the line meets points (N, 2), one after the other."""
    met, leg = [], 0
    for point in points:
        found = [(n, *_nearest(line, n, point)) for n in range(leg, len(line.leg_item))]
        nearest_m = min(away_m for _, _, away_m in found)
        leg, passed_m, _ = next(f for f in found if f[2] <= max(SAME_PLACE_M, nearest_m))
        met.append(float(s_m[leg]) + passed_m)
    return met


def _nearest(line: FlightLine, leg: int, point: F64) -> tuple[float, float]:
    """(metres from the leg's begin, metres away) of the place that is nearest over ground."""
    return Polyline(line.points_enu[leg : leg + 2, :2]).nearest(point)


def _place(state: VehicleState) -> PlaceDoc | None:
    if state.lat_deg is None or state.lon_deg is None:
        return None
    return PlaceDoc(lat_deg=state.lat_deg, lon_deg=state.lon_deg)


def _poi(name: str, words: str, place: PlaceDoc) -> PoiDoc:
    return PoiDoc(id=name, name=words, lat_deg=place.lat_deg, lon_deg=place.lon_deg)


def _flat(frame: LocalFrame, place: PlaceDoc | PoiDoc) -> F64:
    return frame.to_enu(place.lat_deg, place.lon_deg, frame.alt_m)[0, :2]


def _numbered(pois: list[PoiDoc]) -> list[PoiDoc]:
    """Each id once: a plan that began "here" may be cut again."""
    seen: set[str] = set()
    out = []
    for poi in pois:
        name, number = poi.id, 2
        while name in seen:
            name, number = f"{poi.id[:28]}-{number}", number + 1
        seen.add(name)
        out.append(poi.model_copy(update={"id": name}))
    return out
