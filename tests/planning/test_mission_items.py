"""Single mission items."""

import math

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.basics.plan_model import Home, MissionParams
from planning.errors import MissionError, ParameterError
from planning.missions.mission_items import (
    Heights,
    Place,
    aiming,
    fixed_heading_deg,
    landing,
    starting,
    stopping,
    takeoff,
    unset,
    waypoint,
)
from planning.terrain.dsm import Dsm

RELATIVE = Heights(3, 100.0)
HOME = Home(45.15, 15.0, 100.0)
DSM = Dsm(
    np.full((50, 50), 104.0, np.float32), Affine(1, 0, 500_000, 0, -1, 5_000_050), CRS.from_epsg(32633), None, "0"
)


@settings(deadline=None)
@given(st.integers(-50_000, 500_000))
def test_a_vehicle_that_cuts_a_float32_to_centimetres_keeps_the_height(centimetres: int) -> None:
    item_m = RELATIVE.item_m(100.0 + centimetres / 100)
    kept = int(np.float32(item_m) * np.float32(100.0))
    assert kept >= centimetres
    assert kept <= centimetres + 2
    assert kept != 0


def test_take_off_rises_two_metres_at_least() -> None:
    assert takeoff(HOME, RELATIVE, 100.5, "ardupilot").alt_m == pytest.approx(2.002)
    item = takeoff(HOME, RELATIVE, 113.55, "px4")
    assert (item.command, item.frame, item.lat_deg, item.lon_deg) == (22, 3, 45.15, 15.0)
    assert item.alt_m == pytest.approx(13.552)
    assert math.isnan(item.params[3])


def test_waypoints_are_rounded_to_what_a_vehicle_keeps() -> None:
    item = waypoint(Place(45.123456789, 15.987654321, 112.0), RELATIVE, hold_s=0.4, yaw_deg=0.0)
    assert (item.command, item.lat_deg, item.lon_deg) == (16, 45.1234568, 15.9876543)
    assert item.params == (1.0, 0.0, 0.0, 0.0)


def test_yaw_that_is_not_given() -> None:
    assert unset("ardupilot") == 0.0
    assert math.isnan(unset("px4"))


def test_the_gimbal_has_a_command_for_each_firmware() -> None:
    params = MissionParams(gimbal_pitch_deg=-90)
    (mount,) = aiming(params, "ardupilot", RELATIVE, DSM)
    (gimbal,) = aiming(params, "px4", RELATIVE, DSM)
    assert (mount.command, mount.params[0], mount.alt_m) == (205, -90, 2.0)
    assert (gimbal.command, gimbal.params[:2]) == (1000, (-90, 0.0))
    assert math.isnan(gimbal.params[2])
    with pytest.raises(ParameterError, match="pitch"):
        aiming(MissionParams(gimbal_pitch_deg=float("nan")), "px4", RELATIVE, DSM)


def test_looking_at_a_point_sets_it_on_the_ground_and_frees_the_nose_at_the_end() -> None:
    lat, lon = DSM.lat_lon_from_xy(np.array([[500_020.0, 5_000_020.0]]))[0]
    params = MissionParams(heading="point", look_at=(float(lat), float(lon)))
    (roi,) = aiming(params, "ardupilot", RELATIVE, DSM)
    assert (roi.command, roi.frame) == (195, 3)
    assert roi.alt_m == pytest.approx(4.002)
    assert [item.command for item in stopping(params)] == [197]
    for bad in (None, (0.0, 0.0)):
        with pytest.raises(ParameterError, match="look at"):
            aiming(MissionParams(heading="point", look_at=bad), "ardupilot", RELATIVE, DSM)


def test_the_camera_runs_from_the_first_waypoint_to_the_last() -> None:
    params = MissionParams(camera_trigger_m=4.5)
    (on,), (off,) = starting(params, "ardupilot"), stopping(params)
    assert (on.command, on.params) == (206, (4.5, 0.0, 1.0, 0.0))
    assert (off.command, off.params[0]) == (206, 0.0)
    with pytest.raises(ParameterError, match="photos"):
        starting(MissionParams(camera_trigger_m=0.0), "px4")


def test_a_fixed_heading_is_a_command_only_on_ardupilot() -> None:
    params = MissionParams(heading="fixed", heading_deg=-90)
    assert [i.command for i in starting(params, "ardupilot")] == [115]
    assert starting(params, "ardupilot")[0].params[0] == 270
    assert starting(params, "px4") == []
    with pytest.raises(ParameterError, match="heading"):
        fixed_heading_deg(MissionParams(heading_deg=float("inf")))


def test_a_landing_climbs_goes_home_level_and_lands() -> None:
    last = Place(45.16, 15.01, 112.0)
    climb, over, land = landing(HOME, last, RELATIVE, transit_alt_dsm_m=130.0, yaw_deg=0.0)
    assert (climb.lat_deg, climb.lon_deg, climb.alt_m) == (45.16, 15.01, pytest.approx(30.002))
    assert (over.lat_deg, over.lon_deg, over.alt_m) == (45.15, 15.0, pytest.approx(30.002))
    assert (land.command, land.lat_deg, land.lon_deg, land.alt_m) == (21, 45.15, 15.0, 0.0)


def test_a_landing_needs_no_climb_from_above_and_no_way_from_home() -> None:
    above = landing(HOME, Place(45.16, 15.01, 150.0), RELATIVE, transit_alt_dsm_m=130.0, yaw_deg=0.0)
    assert [item.command for item in above] == [16, 21]
    assert above[0].alt_m == pytest.approx(50.002)
    over_home = landing(HOME, Place(45.15, 15.0, 150.0), RELATIVE, transit_alt_dsm_m=130.0, yaw_deg=0.0)
    assert [item.command for item in over_home] == [21]
    with pytest.raises(MissionError, match="clear"):
        landing(HOME, Place(45.16, 15.01, 112.0), RELATIVE, transit_alt_dsm_m=math.inf, yaw_deg=0.0)
