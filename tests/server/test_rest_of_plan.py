"""The plan that is flown, cut to what is left of it from where the vehicle is."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from planning.basics.plan_model import Poi, VehicleProfile
from planning.formats.commands import has_position
from planning.formats.wpl import read_wpl, write_wpl
from planning.missions.vehicle_profile import dump_profile
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from server.errors import NotReadyError
from server.obstacles.rest_of_plan import Part, Underway, rest_of_plan
from server.schemas import CameraDoc, PlanDoc, PoiDoc, ProfileDoc, SurveyDoc
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.vehicle import VehicleState
from tests.server.scene_fixtures import hill

EAST_M = (8.0, 30.0, 50.0, 72.0)
NORTH_M = 3_999_945.0


def lat_lon(dsm: Dsm, east_m: float) -> tuple[float, float]:
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[500_000.0 + east_m, NORTH_M]]))[0].tolist()
    return lat_deg, lon_deg


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    return hill(hole=False)


@pytest.fixture(scope="module")
def record(dsm: Dsm) -> PlanRecord:
    """East along the foot of the hill, and back to the second point."""
    places = [lat_lon(dsm, east_m) for east_m in (*EAST_M, EAST_M[1])]
    plan = plan_mission(dsm, PlanRequest(pois=tuple(Poi(*place) for place in places), profile=VehicleProfile("quad")))
    pois = [PoiDoc(id=f"p{k}", lat_deg=lat, lon_deg=lon) for k, (lat, lon) in enumerate(places)]
    return PlanRecord(
        t_utc_s=time.time(),
        name="Foot",
        mission_wpl=write_wpl(plan.mission),
        digest="d",
        firmware="ardupilot",
        terrain_id="t1",
        terrain_name="Hill",
        terrain_sha256=dsm.sha256,
        home_alt_dsm_m=plan.line.home_alt_dsm_m,
        vertical_datum=None,
        profile_toml=dump_profile(VehicleProfile("quad")),
        certificate_json="",
        plan_json=PlanDoc(pois=pois).model_dump_json(),
    )


def underway(dsm: Dsm, record: PlanRecord, east_m: float, *, back: bool = False) -> Underway:
    """At a place of the line, flying to the waypoint that comes next there."""
    lat_deg, lon_deg = lat_lon(dsm, east_m)
    items = enumerate(read_wpl(record.mission_wpl, "Foot").items, 1)
    places = [(number, item.lat_deg, item.lon_deg) for number, item in items if has_position(item)]
    xy_m = dsm.xy_from_lat_lon(np.array([place[1:] for place in places]))
    east = [(place[0], x - 500_000.0) for place, x in zip(places, xy_m[:, 0], strict=True)]
    turn = max(east, key=lambda item: item[1])[0]
    if back:
        target = next(number for number, at_m in east if number > turn and at_m < east_m)
    else:
        target = next(number for number, at_m in east if at_m > east_m)
    state = replace(
        VehicleState(1, 1), lat_deg=lat_deg, lon_deg=lon_deg, alt_rel_home_m=6.0, armed=True, landed="in_air"
    )
    return Underway(record, FlightStatus(way="auto", phase="flying", target=target), state)


def rest(part: Part, there: Underway | None, terrain_id: str = "t1") -> list[PoiDoc]:
    fields = rest_of_plan(part, there, terrain_id=terrain_id)
    assert PlanDoc(**fields).home is not None
    return fields["pois"]


@pytest.mark.parametrize(
    ("east_m", "back", "left"),
    [
        (20.0, False, ["here", "p1", "p2", "p3", "p4"]),
        (40.0, False, ["here", "p2", "p3", "p4"]),
        (60.0, False, ["here", "p3", "p4"]),
        (40.0, True, ["here", "p4"]),
        (49.0, False, ["p2", "p3", "p4"]),
    ],
)
def test_the_mission_ahead_is_what_has_not_been_flown_to(
    dsm: Dsm, record: PlanRecord, east_m: float, back: bool, left: list[str]
) -> None:
    there = underway(dsm, record, east_m, back=back)
    pois = rest("ahead", there)
    assert [poi.id for poi in pois] == left
    if left[0] == "here":
        assert (pois[0].lat_deg, pois[0].lon_deg) == (there.state.lat_deg, there.state.lon_deg)


def test_the_way_home_leads_from_the_vehicle_to_where_it_took_off(dsm: Dsm, record: PlanRecord) -> None:
    fields = rest_of_plan("home", underway(dsm, record, 60.0), terrain_id="t1")
    here, home = fields["pois"]
    assert (here.id, home.id) == ("here", "home")
    at_home = dsm.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]]))[0]
    assert at_home == pytest.approx([500_008.0, NORTH_M], abs=0.02)
    assert (fields["home"].lat_deg, fields["home"].lon_deg) == (home.lat_deg, home.lon_deg)


def test_the_rest_is_a_mission_that_is_certified(dsm: Dsm, record: PlanRecord) -> None:
    for part in ("ahead", "home"):
        fields = rest_of_plan(part, underway(dsm, record, 40.0), terrain_id="t1")
        pois = tuple(Poi(poi.lat_deg, poi.lon_deg) for poi in fields["pois"])
        home = (fields["home"].lat_deg, fields["home"].lon_deg)
        plan = plan_mission(
            dsm, PlanRequest(pois=pois, home_lat_lon_deg=home, profile=VehicleProfile("quad", position_error_m=0.3))
        )
        assert plan.certificate.certified, plan.certificate.reasons


def test_a_rest_is_cut_again(dsm: Dsm, record: PlanRecord) -> None:
    """Its own first point has the name of the new one."""
    flown = PlanDoc.model_validate_json(record.plan_json)
    later = [poi if poi.id != "p3" else poi.model_copy(update={"id": "here"}) for poi in flown.pois]
    again = replace(record, plan_json=PlanDoc(pois=later).model_dump_json())
    assert [poi.id for poi in rest("ahead", underway(dsm, again, 60.0))] == ["here", "here-2", "p4"]


def test_of_a_survey_the_turns_that_are_left_are_the_points(dsm: Dsm, record: PlanRecord) -> None:
    survey = replace(record, plan_json=PlanDoc(source="survey").model_dump_json())
    pois = rest("ahead", underway(dsm, survey, 40.0))
    assert len(pois) > 2
    east = dsm.xy_from_lat_lon(np.array([[poi.lat_deg, poi.lon_deg] for poi in pois]))[:, 0] - 500_000.0
    assert east.max() == pytest.approx(72.0, abs=0.1)
    assert east[-1] == pytest.approx(30.0, abs=0.1)
    assert east[0] == pytest.approx(40.0, abs=2.0)
    assert east.min() > 29.0


def test_the_rest_of_a_survey_keeps_its_height_and_takes_photos_only_ahead(dsm: Dsm, record: PlanRecord) -> None:
    camera = CameraDoc(
        image_width_px=4000, image_height_px=3000, focal_mm=8.8, sensor_width_mm=13.2, sensor_height_mm=8.8
    )
    flown = PlanDoc(source="survey", profile=ProfileDoc(name="P", camera=camera), survey=SurveyDoc(gsd_cm=0.5))
    there = underway(dsm, replace(record, plan_json=flown.model_dump_json()), 40.0)
    ahead, home = (PlanDoc(**rest_of_plan(part, there, terrain_id="t1")) for part in ("ahead", "home"))
    height_m = 4000 * 0.5 * 8.8 / (13.2 * 100)
    assert ahead.surface.height_m == home.surface.height_m == pytest.approx(height_m)
    assert ahead.mission.camera_trigger_m == pytest.approx(height_m * 8.8 / 8.8 * (1 - flown.survey.front_overlap))
    assert ahead.mission.gimbal_pitch_deg == -90.0
    assert home.mission.camera_trigger_m is None


def test_without_a_flight_or_with_another_plan_open_it_is_refused(dsm: Dsm, record: PlanRecord) -> None:
    there = underway(dsm, record, 40.0)
    landed = replace(there, state=replace(there.state, landed="on_ground"))
    for nothing in (None, landed, replace(there, state=replace(there.state, lat_deg=None))):
        with pytest.raises(NotReadyError, match="No mission is being flown"):
            rest_of_plan("ahead", nothing, terrain_id="t1")
    with pytest.raises(NotReadyError, match='not the one that is flown, "Foot"'):
        rest_of_plan("home", there, terrain_id="t2")
    over = replace(there, flight=replace(there.flight, target=999), state=underway(dsm, record, 31.0, back=True).state)
    over = replace(over, state=replace(over.state, lon_deg=lat_lon(dsm, EAST_M[1])[1]))
    with pytest.raises(NotReadyError, match="Nothing is left"):
        rest_of_plan("ahead", over, terrain_id="t1")
