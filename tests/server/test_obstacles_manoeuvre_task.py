"""What the worker makes of a situation: ways over and around what stands there, sidesteps of what comes near."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from planning.basics.plan_model import Poi, VehicleProfile
from planning.formats.wpl import write_wpl
from planning.missions.vehicle_profile import dump_profile
from planning.missions.vehicle_terms import budget_of
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from server.library.terrains import store_terrain
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.manoeuvre_task import NO_LINE, NO_PLACE, prepare, required_m
from server.scene.mirror import MapMirror
from server.schemas.plan_docs import ClearanceDoc, PlanDoc
from telemetry.perception.mission_line import mission_line
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.obstacles import MapOrigin, Sensor
from telemetry.topics.tracks import VelocityProposal
from telemetry.topics.vehicle import VehicleState
from tests.server.obstacle_messages import alert, approach, delta
from tests.server.scene_fixtures import hill
from tests.server.track_messages import track, tracks_status


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Dsm, PlanRecord, Path]:
    """A flight along the foot of the hill, certified for 2 m."""
    root, dsm = tmp_path_factory.mktemp("data"), hill(hole=False)
    xy = np.array([[500_008.0, 3_999_945.0], [500_072.0, 3_999_945.0]])
    pois = tuple(Poi(lat, lon) for lat, lon in dsm.lat_lon_from_xy(xy).tolist())
    plan = plan_mission(dsm, PlanRequest(pois=pois, profile=VehicleProfile("quad")))
    (root / "terrains").mkdir()
    doc = store_terrain(root, dsm, name="Hill")
    record = PlanRecord(
        t_utc_s=time.time(),
        name="Foot",
        mission_wpl=write_wpl(plan.mission),
        digest="d",
        firmware="ardupilot",
        terrain_id=doc.id,
        terrain_name="Hill",
        terrain_sha256=dsm.sha256,
        home_alt_dsm_m=plan.line.home_alt_dsm_m,
        vertical_datum=None,
        profile_toml=dump_profile(VehicleProfile("quad")),
        certificate_json='{"required_clearance_m": 2.0}',
    )
    return dsm, record, root / "terrains" / doc.id


def situation(planned: tuple[Dsm, PlanRecord, Path], above_line_m: int, sensor: Sensor = "vision") -> Situation:
    """A wall from the ground to so much above the line."""
    dsm, record, directory = planned
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[500_008.0, 3_999_945.0]]))[0].tolist()
    origin = MapOrigin(lat_deg, lon_deg, 900.0)
    mirror = MapMirror(sensor)
    line = mission_line(record, origin)
    assert line is not None
    up_m, top_m = np.interp([12.0, 30.0], line.points_enu[:, 0], line.points_enu[:, 2]).tolist()
    wall = [(30, n, up) for n in range(-4, 5) for up in range(round(top_m) + above_line_m)]
    mirror.fold(delta(wall, origin=origin, whole=True))
    at = dsm.lat_lon_from_xy(np.array([[500_020.0, 3_999_945.0]]))[0].tolist()
    state = replace(
        VehicleState(system_id=1, component_id=1),
        lat_deg=at[0],
        lon_deg=at[1],
        alt_rel_home_m=up_m,
        armed=True,
    )
    flight = FlightStatus(way="auto", phase="flying", target=2)
    return Situation(alert(), state, flight, 0.0, record, directory, origin, (mirror.voxels(),))


def test_over_and_around_a_wall_on_the_mission(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    there = situation(planned, 4)
    assert there.state.alt_rel_home_m is not None
    ways = prepare(there, report=lambda step, share: None)
    assert [way.doc.kind for way in ways] == ["over", "around"]
    for way in ways:
        assert way.doc.possible, way.doc.text
        assert way.doc.clearance_m is not None
        assert way.doc.clearance_m >= 1.9
        assert way.rejoin_item is not None
        ups = [up for _, _, up in way.points_enu_m]
        assert min(ups) >= there.state.alt_rel_home_m - 1e-6
        assert [t.alt_rel_home_m for t in way.targets] == pytest.approx(ups[1:])
        assert all(t.speed_m_s > 0 for t in way.targets)
    assert ways[0].height_offset_m > 4.0


def test_a_way_keeps_what_the_mission_itself_must_keep(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    there = situation(planned, 4)
    quad = VehicleProfile("quad")
    asked = PlanDoc(clearance=ClearanceDoc(required_clearance_m=3.4)).model_dump_json()
    records = {
        2.0: there.record,
        3.4: replace(there.record, plan_json=asked),
        budget_of(quad).total_m: replace(there.record, certificate_json=""),
    }
    climbs = []
    for must_m, record in records.items():
        assert required_m(record) == pytest.approx(must_m)
        over = prepare(replace(there, record=record), report=lambda *_: None)[0]
        assert over.doc.clearance_m is not None
        assert over.doc.clearance_m >= must_m - 0.01
        climbs.append(over.doc.climb_m)
    assert climbs == sorted(climbs)
    assert climbs[0] < climbs[-1]


def test_of_a_wall_that_a_radar_has_seen_the_top_is_not_known(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    there = situation(planned, 4, "radar")
    over, around = prepare(there, report=lambda step, share: None)
    seen = prepare(situation(planned, 4), report=lambda step, share: None)
    assert over.doc.possible
    assert "top has not been seen" in over.doc.text
    assert "top has not been seen" not in seen[0].doc.text
    # Up to where the radar's gate ends, 10 m before the wall.
    assert over.height_offset_m > seen[0].height_offset_m + 2.0
    # North of it the hill is as high, south of it the surface model ends, and above it nothing is known.
    assert not around.doc.possible


def test_on_the_way_to_where_the_mission_is_joined_again_what_stands_before_it_counts(
    planned: tuple[Dsm, PlanRecord, Path],
) -> None:
    there = situation(planned, 4)
    line = mission_line(there.record, there.origin)
    assert line is not None
    assert line.points_enu[-2, 0] > 35.0  # the last leg begins behind the wall
    late = replace(there, flight=replace(there.flight, target=line.leg_item[-1]))
    ways = prepare(late, report=lambda step, share: None)
    assert [way.doc.possible for way in ways] == [True, True]
    assert all(way.points_enu_m[-1][0] > 31.0 for way in ways)


def test_a_mission_that_nothing_blocks_needs_no_manoeuvre(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    ways = prepare(situation(planned, -6), report=lambda step, share: None)
    assert [way.doc.possible for way in ways] == [False, False]
    assert all("keeps" in way.doc.text for way in ways)


def test_without_a_position_or_a_line_each_way_says_why_not(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    both = replace(situation(planned, 4), approach=approach(), tracks=None)
    lost = prepare(replace(both, state=replace(both.state, lat_deg=None)), report=lambda *_: None)
    assert [way.doc.kind for way in lost] == ["over", "around", "sidestep"]
    assert {way.doc.text for way in lost} == {NO_PLACE}
    pointless = prepare(replace(both, record=replace(both.record, mission_wpl="none")), report=lambda *_: None)
    assert [(way.doc.kind, way.doc.text) for way in pointless[:2]] == [("over", NO_LINE), ("around", NO_LINE)]
    assert "not followed" in pointless[2].doc.text


def test_a_sidestep_that_fails_takes_no_other_way_with_it(
    planned: tuple[Dsm, PlanRecord, Path], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: Any) -> None:
        raise ZeroDivisionError("unforeseen")

    monkeypatch.setattr("server.obstacles.sidestep_task.sidestep", broken)
    ways = prepare(coming(planned, alert=alert()), report=lambda *_: None)
    assert [way.doc.kind for way in ways] == ["over", "around", "sidestep"]
    assert not ways[2].doc.possible
    assert ways[2].doc.text
    assert all(way.doc.text != ways[2].doc.text for way in ways[:2])
    assert "Looking for the way: sidestep failed." in caplog.text


def test_the_ceiling_counts_from_the_plan_and_the_vehicle_is_as_large_as_it_is(
    planned: tuple[Dsm, PlanRecord, Path],
) -> None:
    here = situation(planned, 4)
    assert here.state.alt_rel_home_m is not None
    higher = replace(here, state=replace(here.state, alt_rel_home_m=here.state.alt_rel_home_m + 28.0))
    low_wall = replace(situation(planned, 40), state=higher.state, height_offset_m=28.0)
    over = prepare(low_wall, report=lambda *_: None)[0]
    assert not over.doc.possible
    assert "up to 2 m" in over.doc.text
    usual, large = (prepare(each, report=lambda *_: None)[0] for each in (here, replace(here, radius_m=2.5)))
    assert usual.doc.climb_m is not None
    assert large.doc.climb_m is not None
    assert large.doc.climb_m > usual.doc.climb_m


def test_a_map_with_a_slightly_different_home_counts_where_its_things_stand(
    planned: tuple[Dsm, PlanRecord, Path],
) -> None:
    here = situation(planned, 4)
    moved = replace(here, origin=replace(here.origin, lat_deg=here.origin.lat_deg + 0.5 / 111_195))
    ways = [prepare(each, report=lambda *_: None) for each in (here, moved)]
    assert all(way.doc.possible for way in (*ways[0], *ways[1]))
    assert ways[0][0].targets[-1].lon_deg == pytest.approx(ways[1][0].targets[-1].lon_deg, abs=1e-6)


def coming(planned: tuple[Dsm, PlanRecord, Path], **more: Any) -> Situation:
    """Something flies towards the vehicle along the mission's line; nothing stands there."""
    here = situation(planned, -6)
    state = replace(here.state, position_t_mono_s=10.0)
    at = planned[0].lat_lon_from_xy(np.array([[500_045.0, 3_999_945.0]]))[0].tolist()
    other = track(lat_deg=at[0], lon_deg=at[1], velocity_enu_m_s=(-3.0, 0.0))
    ahead = VelocityProposal((2.8, 0.8), 5.0, 3.3, "Turn 16 deg left, 2.9 m/s.")
    status = tracks_status(tracks=(other,), proposal=ahead, origin=here.origin)
    fields: dict[str, Any] = {"alert": None, "state": state, "approach": approach(), "tracks": status, **more}
    return replace(here, **fields)


def test_the_proposed_velocity_is_flown_level_and_then_back_to_the_mission(
    planned: tuple[Dsm, PlanRecord, Path],
) -> None:
    there = coming(planned)
    (way,) = prepare(there, report=lambda *_: None)
    assert (way.doc.kind, way.doc.for_alert, way.doc.possible) == ("sidestep", "t7", True), way.doc.text
    assert way.doc.text.startswith("Turn 16 deg left, 2.9 m/s for 5 s, passes")
    assert way.doc.text.endswith("then back to the mission.")
    a, b = np.array(way.points_enu_m[0]), np.array(way.points_enu_m[1])
    assert b - a == pytest.approx([14.0, 4.0, 0.0], abs=0.01)
    assert way.targets[0].speed_m_s == pytest.approx(np.hypot(2.8, 0.8))
    assert way.rejoin_item is not None
    assert min(t.alt_rel_home_m for t in way.targets) >= a[2] - 1e-6
    assert way.doc.seconds is not None
    assert way.doc.seconds > 5.0


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"tracks": None}, "not followed at the moment"),
        ({"tracks": tracks_status(proposal=None)}, "leads into nothing"),
        ({"tracks": tracks_status(proposal=None, no_proposal="Too slow.")}, "Too slow"),
        ({"radius_m": 50.0}, "only"),
    ],
)
def test_why_there_is_no_sidestep_is_said(
    planned: tuple[Dsm, PlanRecord, Path], changes: dict[str, Any], why: str
) -> None:
    (way,) = prepare(coming(planned, **changes), report=lambda *_: None)
    assert not way.doc.possible
    assert why in way.doc.text


def test_on_the_way_home_it_holds_after_the_sidestep(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    home = coming(planned, flight=FlightStatus(way="auto", phase="returning", target=2))
    (way,) = prepare(home, report=lambda *_: None)
    assert (way.rejoin_item, len(way.targets)) == (None, 1)
    assert way.doc.text.endswith("then it holds there.")


@pytest.mark.parametrize("phase", ["flying", "paused"])
def test_on_a_guided_way_nothing_leads_back_to_the_mission(
    planned: tuple[Dsm, PlanRecord, Path], phase: Literal["flying", "paused"]
) -> None:
    flight = FlightStatus(way="guided", phase=phase)
    ways = prepare(replace(situation(planned, 4), flight=flight), report=lambda *_: None)
    assert [(way.doc.kind, way.doc.possible) for way in ways] == [("over", False), ("around", False)]
    assert all("ask for another way" in way.doc.text for way in ways)
    (aside,) = prepare(coming(planned, flight=flight), report=lambda *_: None)
    assert (aside.rejoin_item, len(aside.targets)) == (None, 1)
    assert aside.doc.text.endswith("then it holds there.")


def test_where_the_object_is_by_now_counts(planned: tuple[Dsm, PlanRecord, Path]) -> None:
    there = coming(planned)
    late = replace(there, state=replace(there.state, position_t_mono_s=16.0))
    (way,) = prepare(late, report=lambda *_: None)
    assert way.doc.text != prepare(there, report=lambda *_: None)[0].doc.text
