"""A path as a mission."""

import math
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.basics.plan_model import Home, Mission, MissionParams, Poi, SampledPath, VehicleProfile
from planning.errors import CapacityError, DatumError, MissionError
from planning.missions.home import home_from_dsm
from planning.missions.mission import EXCESSES_M, BuiltMission, build_mission, decimation_trade
from planning.missions.vehicle_profile import load_profile, path_params
from planning.route.path import sampled_path
from planning.terrain.dsm import Dsm

QUAD = load_profile("generic-quad")
PX4 = load_profile("x500-rtk-px4")
LOITER_S = (0.0, 2.4, 3.0, 0.0)


def terrain(vertical_datum: str | None = None) -> Dsm:
    row, col = np.mgrid[0:200, 0:300]
    height = 300 + 8 * np.sin(col / 15) + 5 * np.cos(row / 11) + 1.5 * np.sin(col / 3)
    transform = Affine(1, 0, 500_000, 0, -1, 5_000_200)
    return Dsm(height.astype(np.float32), transform, CRS.from_epsg(32633), vertical_datum, "0")


DSM = terrain()
CORNERS = np.array([[20.0, 20.0], [270.0, 40.0], [250.0, 180.0], [30.0, 170.0]]) + np.array([500_000.0, 5_000_000.0])
POIS = tuple(
    Poi(float(lat), float(lon), f"P{i}", loiter_s)
    for i, ((lat, lon), loiter_s) in enumerate(zip(DSM.lat_lon_from_xy(CORNERS), LOITER_S, strict=True))
)
HOME = home_from_dsm(DSM, (POIS[0].lat_deg, POIS[0].lon_deg))


def the_path(profile: VehicleProfile = QUAD) -> SampledPath:
    return sampled_path(DSM, lambda xy: DSM.elevation_at(xy) + 5, CORNERS, (0, 1, 2, 3), path_params(profile))


PATH = the_path()


def build(
    params: MissionParams | None = None, profile: VehicleProfile = QUAD, path: SampledPath = PATH
) -> BuiltMission:
    return build_mission(path, HOME, params or MissionParams(), profile, DSM, POIS)


def commands(mission: Mission) -> list[int]:
    """Commands, neighbours of the same kind once."""
    all_of_them = [item.command for item in mission.items]
    return [c for i, c in enumerate(all_of_them) if i == 0 or c != all_of_them[i - 1]]


def test_a_plain_mission() -> None:
    built = build()
    mission = built.mission
    assert commands(mission) == [178, 22, 16, 20]
    assert mission.items[0].params[:2] == (1.0, QUAD.max_speed_m_s)
    assert mission.items[1].alt_m == mission.items[2].alt_m == pytest.approx(5.012, abs=0.02)
    assert {item.frame for item in mission.items} == {2, 3}
    assert (mission.home, mission.pois, mission.firmware) == (HOME, POIS, "ardupilot")
    assert built.warnings == ()
    assert built.waypoints == len(mission.items) - 3
    assert built.excess_height_m == 1.0


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([0.0, 0.1, 0.5, 2.0]), st.floats(-5000, 5000))
def test_the_uploaded_line_is_never_below_the_path(excess_m: float, home_alt_m: float) -> None:
    """After the vehicle has cut heights to centimetres and places to 1e-7 degrees."""
    home = replace(HOME, alt_dsm_m=home_alt_m)
    params = MissionParams(excess_height_m=excess_m, max_items=100_000)
    mission = build_mission(PATH, home, params, replace(QUAD, max_items=100_000), DSM, POIS).mission
    flown = [item for item in mission.items if item.command == 16]
    xy = DSM.xy_from_lat_lon(np.array([[i.lat_deg, i.lon_deg] for i in flown]))
    alt = home_alt_m + np.array([int(np.float32(i.alt_m) * np.float32(100)) for i in flown]) / 100
    at = [int(np.argmin(np.hypot(*(PATH.xy_m - p).T))) for p in xy]
    for a, b, i, j in zip(at[:-1], at[1:], range(len(at) - 1), range(1, len(at)), strict=True):
        along = xy[j] - xy[i]
        share = np.clip((PATH.xy_m[a : b + 1] - xy[i]) @ along / (along @ along), 0, 1)
        line = alt[i] + share * (alt[j] - alt[i])
        assert np.all(line >= PATH.alt_dsm_m[a : b + 1] - 1e-6)
        assert np.all(line <= PATH.alt_dsm_m[a : b + 1] + max(excess_m, 0.02) + 0.03)


def test_every_point_of_interest_is_a_waypoint_with_its_loiter_time_rounded_up() -> None:
    mission = build().mission
    held = {(i.lat_deg, i.lon_deg): i.params[0] for i in mission.items if i.command == 16}
    for poi in POIS:
        assert held[round(poi.lat_deg, 7), round(poi.lon_deg, 7)] == math.ceil(poi.loiter_s)
    assert sum(held.values()) == 6


def test_camera_gimbal_and_point_of_interest_frame_the_waypoints() -> None:
    look_at = (POIS[2].lat_deg, POIS[2].lon_deg)
    params = MissionParams(heading="point", look_at=look_at, gimbal_pitch_deg=-45, camera_trigger_m=3.0)
    assert commands(build(params).mission) == [178, 22, 195, 205, 16, 206, 16, 206, 197, 20]
    assert commands(build(params, PX4, the_path(PX4)).mission) == [178, 22, 195, 1000, 16, 206, 16, 206, 197, 20]


def test_a_fixed_heading() -> None:
    params = MissionParams(heading="fixed", heading_deg=30)
    built = build(params)
    assert commands(built.mission) == [178, 22, 16, 115, 16, 20]
    assert "WP_YAW_BEHAVIOR" in built.warnings[0]
    px4 = build(params, PX4, the_path(PX4))
    assert {i.params[3] for i in px4.mission.items if i.command == 16} == {30}
    assert px4.warnings == ()


def test_a_landing_at_home() -> None:
    mission = build(MissionParams(end="land", land_transit_height_m=40.0)).mission
    climb, over, land = mission.items[-3:]
    assert (climb.lat_deg, climb.lon_deg) == (mission.items[-4].lat_deg, mission.items[-4].lon_deg)
    assert climb.alt_m == over.alt_m == pytest.approx(40.002)
    assert (land.command, land.alt_m) == (21, 0.0)
    assert (land.lat_deg, land.lon_deg) == (round(HOME.lat_deg, 7), round(HOME.lon_deg, 7))


def test_the_transit_height_of_a_landing() -> None:
    def height_m(needed_m: float | None) -> float:
        built = build_mission(PATH, HOME, MissionParams(end="land"), QUAD, DSM, POIS, rtl_height_needed_m=needed_m)
        return built.mission.items[-2].alt_m

    assert height_m(None) == pytest.approx(QUAD.rtl_height_m, abs=0.003)
    assert height_m(61.23) == pytest.approx(61.3, abs=0.003)
    with pytest.raises(MissionError, match="clear"):
        height_m(math.inf)


def test_sea_level_heights_need_and_use_the_datum() -> None:
    asked = MissionParams(altitude_reference="amsl")
    with pytest.raises(DatumError):
        build(asked)
    mission = build_mission(PATH, HOME, asked, QUAD, terrain("EGM96 height"), POIS).mission
    flown = [item for item in mission.items if item.command in (16, 22)]
    assert {item.frame for item in flown} == {0}
    assert min(item.alt_m for item in flown) > 285


@pytest.mark.parametrize("end", ["rtl", "land"])
@pytest.mark.parametrize("profile", [QUAD, PX4])
def test_the_excess_is_raised_to_fit_the_limit_and_that_is_said(end: str, profile: VehicleProfile) -> None:
    limit = 25
    params = MissionParams(end=end, max_items=limit, excess_height_m=0.05, camera_trigger_m=5.0)  # type: ignore[arg-type]
    built = build(params, profile, the_path(profile))
    assert len(built.mission.items) + (profile.firmware == "ardupilot") <= limit
    assert built.excess_height_m > 0.05
    assert "raised from 0.05 m" in built.warnings[0]


def test_the_smaller_limit_counts() -> None:
    small = build(MissionParams(max_items=25, excess_height_m=0.05))
    assert (
        small.excess_height_m == build(MissionParams(excess_height_m=0.05), replace(QUAD, max_items=25)).excess_height_m
    )


def test_too_many_points_are_refused_with_the_counts() -> None:
    with pytest.raises(CapacityError, match=r"at least 8 items .*4 for its points.* takes 7") as error:
        build(MissionParams(max_items=7))
    assert error.value.advice
    assert len(build(MissionParams(max_items=8)).mission.items) == 7


def test_a_path_that_starts_elsewhere_is_refused() -> None:
    away = Home(POIS[1].lat_deg, POIS[1].lon_deg, 300.0)
    with pytest.raises(MissionError, match="from home"):
        build_mission(PATH, away, MissionParams(), QUAD, DSM, POIS)


def test_a_closer_fit_costs_waypoints_and_time() -> None:
    rows = decimation_trade(PATH, HOME, MissionParams(max_items=30), QUAD, DSM, POIS)
    assert [row.excess_height_m for row in rows] == list(EXCESSES_M)
    counts = [row.waypoints for row in rows]
    assert counts == sorted(counts, reverse=True)
    assert rows[0].waypoints > 100
    assert rows[0].duration_s > 1.5 * rows[-1].duration_s
    assert all(row.items == row.waypoints + 3 for row in rows)
