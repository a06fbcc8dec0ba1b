"""Documents to planning's types: no field is lost on the way."""

from __future__ import annotations

from dataclasses import asdict, fields, replace

import pytest

from planning.basics.plan_model import Poi, VehicleProfile
from planning.formats.poi_files import PoiFile, read_pois
from planning.formats.wpl import write_wpl
from planning.ground.demo_hillside import demo_dsm, demo_pois, demo_survey_polygon
from planning.missions.vehicle_profile import load_profile, shipped_profiles
from planning.planner.plan import plan_mission
from server.library.documents import (
    doc_from_profile,
    doc_of_points,
    missing,
    profile_from_doc,
    request_from_doc,
    with_points,
)
from server.library.planned_on import on_another_model, other_model
from server.schemas import (
    CameraDoc,
    MissionDoc,
    PathDoc,
    PlaceDoc,
    PlanDoc,
    PoiDoc,
    ProfileDoc,
    SurfaceDoc,
    SurveyDoc,
    TerrainDoc,
)

DSM = demo_dsm()
POIS = [PoiDoc(id=f"p{i}", lat_deg=p.lat_deg, lon_deg=p.lon_deg, name=p.name) for i, p in enumerate(demo_pois())]
CORNERS = [PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in demo_survey_polygon().tolist()]


def test_imported_points_remember_the_model_that_they_were_planned_on() -> None:
    mission = plan_mission(replace(DSM, name="spring.tif"), request_from_doc(PlanDoc(pois=POIS), DSM)).mission
    found = read_pois("mission.waypoints", write_wpl(mission).encode())
    document = with_points(PlanDoc(terrain_id="t"), doc_of_points(found))
    assert other_model(document, DSM) == ""
    raised = replace(DSM.with_elevation(DSM.elevation_m + 2.0), sha256="ab" * 32, name="autumn.tif")
    said = other_model(document, raised)
    assert '"autumn.tif" (SHA-256 abababab)' in said
    assert '"spring.tif" (SHA-256' in said
    assert "home's ground is 2.00 m higher here" in said
    assert with_points(document, doc_of_points(PoiFile(found.pois))).planned_on is None


def test_a_plan_that_is_given_another_model_remembers_its_first() -> None:
    first, other, same = (
        TerrainDoc.model_construct(id=name, name=f"{name}.tif", sha256=digest * 32)
        for name, digest in (("first", "ab"), ("other", "cd"), ("same", "ab"))
    )
    terrains = [first, other, same]
    before = PlanDoc(terrain_id="first", pois=POIS)
    after = on_another_model(before, before.model_copy(update={"terrain_id": "other"}), terrains)
    assert after.planned_on is not None
    assert (after.planned_on.name, after.planned_on.sha256) == ("first.tif", "ab" * 32)
    said = other_model(after, replace(DSM, sha256="cd" * 32, name="other.tif"))
    assert said.endswith("heights are counted from home's ground, which may lie higher or lower here.")
    assert other_model(after, replace(DSM, sha256="ab" * 32)) == ""
    again = on_another_model(after, after.model_copy(update={"terrain_id": "same"}), terrains)
    assert again.planned_on == after.planned_on
    for unchanged in ({"terrain_id": "same"}, {"terrain_id": "other", "pois": []}, {"name": "x"}):
        assert on_another_model(before, before.model_copy(update=unchanged), terrains).planned_on is None


@pytest.mark.parametrize("name", shipped_profiles())
def test_profiles_come_back(name: str) -> None:
    profile = load_profile(name)
    assert profile_from_doc(doc_from_profile(profile)) == profile


def test_profile_fields_are_the_same() -> None:
    assert set(ProfileDoc.model_fields) == {field.name for field in fields(VehicleProfile)}


def test_a_request_carries_every_choice() -> None:
    document = PlanDoc(
        terrain_id="t",
        pois=POIS,
        home=CORNERS[0],
        profile=ProfileDoc(name="P", mean_speed_m_s=2.0, max_speed_m_s=4.0, max_climb_m_s=1.5, max_items=77),
        surface=SurfaceDoc(radius_m=11.0, height_m=4.0, smooth_sigma_m=1.5, floor=False),
        path=PathDoc(step_m=0.25, on_steep="slow"),
        mission=MissionDoc(
            excess_height_m=2.0, end="land", heading="point", look_at=CORNERS[1], gimbal_pitch_deg=-60.0
        ),
    )
    request = request_from_doc(document, DSM)
    assert request.pois == tuple(Poi(p.lat_deg, p.lon_deg, p.name, p.loiter_s) for p in POIS)
    for key, value in document.surface.model_dump().items():
        assert asdict(request.surface)[key] == value
    assert (request.path.step_m, request.path.on_steep) == (0.25, "slow")
    assert (request.path.mean_speed_m_s, request.path.max_climb_m_s) == (2.0, 1.5)
    assert (request.mission.max_items, request.mission.end, request.mission.gimbal_pitch_deg) == (77, "land", -60.0)
    assert request.mission.look_at == (CORNERS[1].lat_deg, CORNERS[1].lon_deg)
    assert request.home_lat_lon_deg == (CORNERS[0].lat_deg, CORNERS[0].lon_deg)


def test_a_survey_brings_its_lines_and_photo_distance() -> None:
    camera = CameraDoc(
        image_width_px=4000, image_height_px=3000, focal_mm=8.8, sensor_width_mm=13.2, sensor_height_mm=8.8
    )
    profile = ProfileDoc(name="P", camera=camera)
    document = PlanDoc(terrain_id="t", source="survey", survey=SurveyDoc(polygon=CORNERS), profile=profile)
    request = request_from_doc(document, DSM)
    assert len(request.pois) >= 2
    assert request.survey is not None
    assert request.pois == request.survey.pois
    assert request.surface.height_m == request.survey.height_m == pytest.approx(4000 * 1.0 * 8.8 / (13.2 * 100))
    assert request.mission.camera_trigger_m == request.survey.trigger_distance_m
    assert request.mission.gimbal_pitch_deg == -90.0
    own = document.model_copy(update={"mission": MissionDoc(camera_trigger_m=7.0)})
    assert request_from_doc(own, DSM).mission.camera_trigger_m == 7.0


def test_points_and_polygons_of_files() -> None:
    pois = (Poi(1.0, 2.0, "A", 3.0), Poi(4.0, 5.0))
    taken = with_points(PlanDoc(source="survey"), doc_of_points(PoiFile(pois)))
    assert (taken.source, [(p.name, p.loiter_s) for p in taken.pois]) == ("pois", [("A", 3.0), ("", 0.0)])
    assert len({p.id for p in taken.pois}) == 2
    corners = ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0))
    drawn = with_points(PlanDoc(pois=POIS), doc_of_points(PoiFile((), polygon=corners)))
    assert (drawn.source, drawn.pois) == ("survey", POIS)
    assert [(c.lat_deg, c.lon_deg) for c in drawn.survey.polygon] == list(corners)


@pytest.mark.parametrize(
    ("document", "hint"),
    [
        (PlanDoc(), "Choose or drop"),
        (PlanDoc(terrain_id="t", pois=POIS[:1]), "Add at least two points"),
        (PlanDoc(terrain_id="t", source="survey", survey=SurveyDoc(polygon=CORNERS[:2])), "Draw the survey area"),
        (PlanDoc(terrain_id="t", pois=POIS, mission=MissionDoc(heading="point")), "Choose the place to look at"),
        (PlanDoc(terrain_id="t", pois=POIS), ""),
    ],
)
def test_what_is_missing(document: PlanDoc, hint: str) -> None:
    assert missing(document).startswith(hint)
    assert bool(missing(document)) == bool(hint)
