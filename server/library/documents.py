"""Plan documents to planning's own types and back."""

from __future__ import annotations

from dataclasses import asdict, replace

from planning.basics.plan_model import Camera, MissionParams, Poi, SurfaceParams, VehicleProfile
from planning.certificate.certificate_model import ClearanceParams
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, fence_words
from planning.formats.poi_files import PoiFile
from planning.missions.vehicle_profile import path_params
from planning.planner.request import PlanRequest, survey_request
from planning.route.survey import SurveyPlan, survey_lines
from planning.terrain.dsm import Dsm
from server.library.fences import fence_from_doc, with_fence
from server.library.planned_on import planned_on
from server.library.whole_files import new_id
from server.schemas import FenceDoc, PlaceDoc, PlanDoc, PoiDoc, ProfileDoc, SurveyDoc
from telemetry.topics.messages import PlanRecord


def profile_from_doc(doc: ProfileDoc) -> VehicleProfile:
    fields = doc.model_dump(exclude={"camera"})
    return VehicleProfile(**fields, camera=None if doc.camera is None else Camera(**doc.camera.model_dump()))


def doc_from_profile(profile: VehicleProfile) -> ProfileDoc:
    return ProfileDoc.model_validate(asdict(profile))


def request_from_doc(document: PlanDoc, dsm: Dsm) -> PlanRequest:
    """Raises PlanningError when the survey polygon or camera cannot be flown, or the fence is none."""
    fence, rally = fence_from_doc(document)
    mission = document.mission
    place = mission.look_at
    request = replace(
        demands_from_doc(document),
        pois=tuple(Poi(p.lat_deg, p.lon_deg, p.name, p.loiter_s) for p in document.pois),
        surface=SurfaceParams(**document.surface.model_dump()),
        mission=MissionParams(
            max_items=document.profile.max_items,
            excess_height_m=mission.excess_height_m,
            end=mission.end,
            altitude_reference=mission.altitude_reference,
            heading=mission.heading,
            heading_deg=mission.heading_deg,
            look_at=None if place is None else (place.lat_deg, place.lon_deg),
            gimbal_pitch_deg=mission.gimbal_pitch_deg,
            camera_trigger_m=mission.camera_trigger_m,
        ),
        home_lat_lon_deg=None if document.home is None else (document.home.lat_deg, document.home.lon_deg),
        fence=fence,
        rally=rally,
    )
    return request if document.source == "pois" else survey_request(request, _survey(document, dsm))


def demands_from_doc(document: PlanDoc) -> PlanRequest:
    """Vehicle, limits and what is demanded of the line: all that a check needs, without points."""
    profile = profile_from_doc(document.profile)
    return PlanRequest(
        pois=(),
        profile=profile,
        path=replace(path_params(profile), **document.path.model_dump()),
        required_clearance_m=document.clearance.required_clearance_m,
        max_height_above_ground_m=document.clearance.max_height_above_ground_m,
        way=document.clearance.way,
    )


def seen_in(record: PlanRecord) -> str | None:
    """What was seen before and taken into the plan: what is flown is checked against it as well."""
    return PlanDoc.model_validate_json(record.plan_json).seen_id


def clearance_of(record: PlanRecord) -> ClearanceParams:
    """What the plan demands."""
    return demands_from_doc(PlanDoc.model_validate_json(record.plan_json)).clearance()


def places_of(record: PlanRecord) -> tuple[Fence, tuple[RallyPoint, ...]]:
    """The plan's fence and rally points."""
    return fence_from_doc(PlanDoc.model_validate_json(record.plan_json)) if record.plan_json else (NO_FENCE, ())


def _survey(document: PlanDoc, dsm: Dsm) -> SurveyPlan:
    survey = document.survey
    return survey_lines(
        [(corner.lat_deg, corner.lon_deg) for corner in survey.polygon],
        dsm,
        camera=profile_from_doc(document.profile).camera,
        gsd_cm=survey.gsd_cm,
        side_overlap=survey.side_overlap,
        front_overlap=survey.front_overlap,
        angle_deg=survey.angle_deg,
    )


def doc_of_points(points: PoiFile) -> PlanDoc:
    """A document of nothing but a file's points, or its polygon, and the fence that its mission carries."""
    if points.polygon is not None and not points.pois:
        corners = [PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in points.polygon]
        return PlanDoc(survey=SurveyDoc(polygon=corners), source="survey")
    pois = [
        PoiDoc(id=new_id(), lat_deg=p.lat_deg, lon_deg=p.lon_deg, name=p.name, loiter_s=p.loiter_s) for p in points.pois
    ]
    document, mission = PlanDoc(pois=pois, planned_on=planned_on(points.mission)), points.mission
    return document if mission is None else with_fence(document, mission.fence, mission.rally)


def with_points(document: PlanDoc, found: PlanDoc) -> PlanDoc:
    """The document with what was found in a file in place of its own: points or a polygon, fence and rally points."""
    if found.fence != FenceDoc() or found.rally:
        document = document.model_copy(update={"fence": found.fence, "rally": found.rally})
    if not found.pois and not found.survey.polygon:
        return document
    if found.source == "survey":
        survey = document.survey.model_copy(update={"polygon": found.survey.polygon})
        return document.model_copy(update={"survey": survey, "source": "survey"})
    return document.model_copy(update={"pois": found.pois, "source": "pois", "planned_on": found.planned_on})


def taken_words(found: PlanDoc) -> str:
    """What was found in a file."""
    points = [f"{len(found.pois)} points"] if found.pois else []
    corners = [f"{len(found.survey.polygon)} corners of a survey's area"] if found.survey.polygon else []
    fence = fence_from_doc(found)
    return "; ".join([*points, *corners, *([fence_words(*fence)] if any(fence) else [])])


def missing(document: PlanDoc) -> str:
    """What the operator has to do before there is anything to compute; empty when nothing is missing."""
    if document.terrain_id is None:
        return "Choose or drop a surface model."
    if document.source == "pois" and len(document.pois) < 2:
        return "Add at least two points: choose Add, then click the surface."
    if document.source == "survey" and len(document.survey.polygon) < 3:
        return "Draw the survey area: choose Corners, then click at least three corners."
    if document.mission.heading == "point" and document.mission.look_at is None:
        return "Choose the place to look at: press Pick it under Mission, then click the surface."
    return ""
