"""The line that a vehicle flies through mission items."""

from __future__ import annotations

import math

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import Firmware, FlownLine, Home, Mission, MissionItem
from planning.certificate.unjudged import unjudged_words
from planning.errors import MissionError
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm

NAN = math.nan
GROUND_M = 120.0


def flat_dsm(*, vertical_datum: str | None = None, elevation_m: np.ndarray | None = None) -> Dsm:
    cells = np.full((100, 100), GROUND_M, np.float32) if elevation_m is None else elevation_m
    return Dsm(
        cells, Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 5_000_100.0), CRS.from_epsg(32633), vertical_datum, "0" * 64
    )


def at(east_m: float, north_m: float) -> tuple[float, float]:
    """Latitude and longitude of a place given from the model's south-west corner."""
    lat, lon = flat_dsm().lat_lon_from_xy(np.array([[500_000.0 + east_m, 5_000_000.0 + north_m]]))[0]
    return float(lat), float(lon)


HOME = Home(*at(50, 50), alt_dsm_m=NAN)


def item(command: int, east_m: float = NAN, north_m: float = NAN, alt_m: float = 0.0, *, frame: int = 3) -> MissionItem:
    lat, lon = (0.0, 0.0) if math.isnan(east_m) else at(east_m, north_m)
    return MissionItem(command, frame, lat_deg=lat, lon_deg=lon, alt_m=alt_m)


def fly(*items: MissionItem, dsm: Dsm | None = None, home: Home = HOME, firmware: Firmware = "ardupilot") -> FlownLine:
    return flown_line(Mission(home, items, firmware=firmware), dsm or flat_dsm())


def local(line: FlownLine) -> list[list[float]]:
    """Metres from the model's south-west corner, altitude above home's ground."""
    return np.round(line.points_m - [500_000.0, 5_000_000.0, GROUND_M], 3).tolist()


TAKE_OFF, RTL = item(22, alt_m=10.0), item(20, frame=2)


@pytest.mark.parametrize(
    ("alt_m", "stored_m"), [(12.0, 12.0), (12.349, 12.34), (32.94, 32.93), (-5.499, -5.49), (32.942, 32.94)]
)
def test_arducopter_cuts_altitudes_to_centimetres(alt_m, stored_m):
    assert local(fly(TAKE_OFF, item(16, 60, 50, alt_m)))[-1][2] == pytest.approx(stored_m, abs=1e-9)
    assert local(fly(TAKE_OFF, item(16, 60, 50, alt_m), firmware="px4"))[-1][2] == pytest.approx(alt_m, abs=1e-9)


def test_an_altitude_no_vehicle_can_store_is_left_to_the_judge():
    assert fly(TAKE_OFF, item(16, 60, 50, 1e300)).points_m[-1, 2] == 1e300


def words(line: FlownLine) -> list[str]:
    return [text for text, _ in unjudged_words(line.unjudged)]


@pytest.mark.parametrize("command", [180, 209, 212, 221, 222, 223])
def test_what_changes_later_items_or_the_engines_is_not_judged(command):
    assert f"(command {command})" in words(fly(TAKE_OFF, item(command, frame=2), item(16, 60, 50, 12.0)))[0]


def test_a_plain_mission_becomes_its_polyline():
    line = fly(TAKE_OFF, item(16, 60, 50, 12.0), item(178, frame=2), item(16, 60, 70, 15.0), RTL)
    assert local(line) == [[50, 50, 10], [60, 50, 12], [60, 70, 15]]
    assert line.leg_item.tolist() == [1, 3]
    assert line.home_alt_dsm_m == GROUND_M
    assert line.takeoff_alt_dsm_m == GROUND_M + 10.0
    assert line.ends_with_rtl
    assert line.unjudged == ()
    assert line.notes == ()
    assert line.landing_xy_m is None


def test_arducopter_rises_over_home_whatever_the_take_off_says_and_px4_flies_on():
    items = (item(22, 70, 70, 10.0), item(16, 60, 50, 12.0))
    assert local(fly(*items)) == [[50, 50, 10], [60, 50, 12]]
    assert local(fly(*items, firmware="px4")) == [[50, 50, 10], [70, 70, 10], [60, 50, 12]]


def test_a_place_not_given_is_the_present_one():
    nowhere = MissionItem(16, 3, lat_deg=NAN, lon_deg=NAN, alt_m=20.0)
    line = fly(TAKE_OFF, item(16, 60, 50, 12.0), item(17, alt_m=18.0), nowhere)
    assert local(line) == [[50, 50, 10], [60, 50, 12], [60, 50, 18], [60, 50, 20]]


@pytest.mark.parametrize(("firmware", "height_m"), [("ardupilot", 10.0), ("px4", 0.0)])
def test_altitude_zero_keeps_arducopters_height(firmware, height_m):
    assert local(fly(TAKE_OFF, item(16, 60, 50, 0.0), firmware=firmware))[-1] == [60, 50, height_m]


def test_an_item_that_stays_at_the_same_point_makes_no_leg():
    line = fly(TAKE_OFF, item(16, 50, 50, 10.0), item(19, alt_m=10.0), item(16, 60, 50, 10.0))
    assert line.leg_item.tolist() in ([3], [1, 3])
    assert local(line)[0] == [50, 50, 10]
    assert local(line)[-1] == [60, 50, 10]


def test_landing_elsewhere_flies_there_at_the_present_height():
    line = fly(TAKE_OFF, item(16, 60, 50, 12.0), item(21, 70, 60, 0.0))
    assert local(line) == [[50, 50, 10], [60, 50, 12], [70, 60, 12]]
    assert line.landing_xy_m == pytest.approx((500_070.0, 5_000_060.0), abs=1e-3)
    assert not line.ends_with_rtl


def test_landing_without_coordinates_lands_here():
    line = fly(TAKE_OFF, item(16, 60, 50, 12.0), item(21))
    assert local(line) == [[50, 50, 10], [60, 50, 12]]
    assert line.landing_xy_m == pytest.approx((500_060.0, 5_000_050.0), abs=1e-3)


@pytest.mark.parametrize("command", [93, 112, 114, 115, 178, 181, 183, 195, 197, 201, 203, 205, 206, 1000, 2000, 2500])
def test_commands_that_do_not_move_the_vehicle_are_passed_over(command):
    line = fly(TAKE_OFF, item(command, 1, 1, 99.0, frame=2), item(16, 60, 50, 12.0))
    assert local(line) == [[50, 50, 10], [60, 50, 12]]
    assert line.unjudged == ()


@pytest.mark.parametrize("command", [85, 92, 113, 176, 177, 179, 186, 189, 192, 9999, 31010])
def test_commands_that_cannot_be_judged_are_named(command):
    line = fly(TAKE_OFF, item(command, frame=2), item(16, 60, 50, 12.0))
    assert len(line.unjudged) == 1
    assert f"Item 2 (command {command})" in words(line)[0]


@pytest.mark.parametrize("command", [18, 31, 82])
def test_bent_legs_are_named_and_shown_straight(command):
    line = fly(TAKE_OFF, item(command, 60, 50, 12.0))
    assert local(line)[-1] == [60, 50, 12]
    assert "no straight line" in words(line)[0]


@pytest.mark.parametrize("frame", [10, 11])
def test_the_terrain_frame_cannot_be_judged(frame):
    assert "terrain data" in words(fly(TAKE_OFF, item(16, 60, 50, 12.0, frame=frame)))[0]


@pytest.mark.parametrize("frame", [1, 2, 7, 21])
def test_other_frames_cannot_be_judged(frame):
    assert f"uses frame {frame}" in words(fly(TAKE_OFF, item(16, 60, 50, 12.0, frame=frame)))[0]


@pytest.mark.parametrize("frame", [0, 5])
def test_altitudes_above_sea_level_need_a_model_above_sea_level(frame):
    items = (item(22, alt_m=130.0, frame=frame), item(16, 60, 50, 140.0, frame=frame))
    line = fly(*items, dsm=flat_dsm(vertical_datum="EGM96 height"))
    assert local(line) == [[50, 50, 10], [60, 50, 20]]
    assert line.unjudged == ()
    for datum in (None, "WGS 84 ellipsoid"):
        line = fly(*items, dsm=flat_dsm(vertical_datum=datum))
        assert (datum or "unknown") in words(line)[-1]


def test_a_cause_that_many_items_share_is_said_once_with_their_numbers() -> None:
    items = [item(16, 60 + n, 50, 12.0, frame=10) for n in range(5)]
    mixed = [TAKE_OFF, *items[:3], item(177, frame=2), items[3], item(16, 90, 50, 12.0), items[4], *items[:4:2]]
    said = unjudged_words(fly(*mixed).unjudged)
    assert [text for text, _ in said] == [
        "7 items (command 16: 2 to 4, 6, 8 to 10), each follows the autopilot's own terrain data"
        " (frame above terrain).",
        "Item 5 (command 177) jumps to another item.",
    ]
    apart = [take for n in range(5) for take in (items[n], item(16, 90 + n, 50, 12.0))]
    assert "(command 16: 2, 4, 6 and 2 more)" in words(fly(TAKE_OFF, *apart))[0]


@pytest.mark.parametrize(
    ("items", "mend"),
    [
        ([item(16, 60, 50, 12.0)], "Begin the mission with a take-off."),
        ([TAKE_OFF, item(177, frame=2), item(16, 60, 50, 12.0)], "Write the repeated items out"),
        ([TAKE_OFF, item(82, 60, 50, 12.0)], "Make it a plain waypoint."),
        ([TAKE_OFF, item(16, 60, 50, 12.0, frame=10)], "Give the height above home (frame 3) instead."),
        ([TAKE_OFF, RTL, item(16, 60, 50, 12.0)], "Remove what comes after item 2."),
        ([TAKE_OFF, item(180, frame=2), item(16, 60, 50, 12.0)], "set the parameter on the vehicle"),
        ([item(22, alt_m=0.0), item(16, 60, 50, 12.0)], "Give it the height above home"),
        ([TAKE_OFF, item(9999, frame=2), item(16, 60, 50, 12.0)], "Remove it, or replace it by plain waypoints."),
    ],
)
def test_each_cause_has_the_mend_that_fits_it(items: list[MissionItem], mend: str) -> None:
    assert mend in unjudged_words(fly(*items).unjudged)[0][1]


def test_nothing_is_flown_after_the_end():
    for end in (RTL, item(21, 70, 60)):
        line = fly(TAKE_OFF, item(16, 60, 50, 12.0), end, item(181, frame=2), item(16, 80, 50, 12.0))
        assert len(line.unjudged) == 1
        assert "comes after item 3" in words(line)[0]
        assert local(line)[-1][:2] != [80, 50]


def test_a_mission_without_take_off_is_not_judged():
    line = fly(item(16, 60, 50, 12.0), RTL)
    assert "before any take-off" in words(line)[0]
    assert local(line) == [[50, 50, 12], [60, 50, 12]]


@pytest.mark.parametrize("alt_m", [0.0, -3.0])
def test_a_take_off_that_does_not_rise_is_not_judged(alt_m):
    line = fly(item(22, alt_m=alt_m), item(16, 60, 50, 12.0))
    assert "not above home" in words(line)[0]


def test_a_second_take_off_is_not_judged():
    assert "take-off in flight" in words(fly(TAKE_OFF, item(16, 60, 50, 12.0), TAKE_OFF))[0]


def test_up_and_down_is_one_leg_without_length():
    line = fly(TAKE_OFF, RTL)
    assert local(line) == [[50, 50, 10], [50, 50, 10]]
    assert line.leg_item.tolist() == [0]


@pytest.mark.parametrize("nowhere", [Home(NAN, NAN, NAN), Home(0.0, 0.0, 0.0)])
def test_without_a_home_the_first_place_is_home(nowhere):
    line = fly(item(22, alt_m=10.0), item(16, 60, 50, 12.0), item(16, 70, 50, 12.0), home=nowhere)
    assert line.home_xy_m == pytest.approx((500_060.0, 5_000_050.0), abs=1e-3)
    assert "no home" in line.notes[0]


def test_a_home_at_another_height_in_the_same_datum_is_noted():
    dsm = flat_dsm(vertical_datum="EGM96 height")
    items = (TAKE_OFF, item(16, 60, 50, 12.0))
    far = fly(*items, dsm=dsm, home=Home(*at(50, 50), 123.5, "EGM2008 height"))
    near = fly(*items, dsm=dsm, home=Home(*at(50, 50), 120.5, "EGM96 height"))
    other = fly(*items, dsm=dsm, home=Home(*at(50, 50), 163.5, "WGS 84 ellipsoid"))
    assert "123.50 m" in far.notes[0]
    assert near.notes == other.notes == ()
    assert far.home_alt_dsm_m == GROUND_M


def test_a_home_on_unknown_terrain_needs_an_altitude_in_the_same_datum():
    cells = np.full((100, 100), GROUND_M, np.float32)
    cells[40:60, 40:60] = np.nan
    items = (TAKE_OFF, item(16, 80, 50, 12.0))
    with pytest.raises(MissionError, match="unknown terrain"):
        fly(*items, dsm=flat_dsm(elevation_m=cells))
    dsm = flat_dsm(elevation_m=cells, vertical_datum="EGM96 height")
    line = fly(*items, dsm=dsm, home=Home(*at(50, 50), 121.0, "EGM96 height"))
    assert line.home_alt_dsm_m == 121.0
    assert "does not know home" in line.notes[0]


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (MissionItem(16, 3, lat_deg=95.0, lon_deg=10.0, alt_m=5.0), "not a place on Earth"),
        (MissionItem(16, 3, lat_deg=45.0, lon_deg=NAN, alt_m=5.0), "not a place on Earth"),
        (MissionItem(16, 3, lat_deg=math.inf, lon_deg=15.0, alt_m=5.0), "not a place on Earth"),
        (item(16, 60, 50, NAN), "altitude is nan"),
        (item(16, 60, 50, math.inf), "altitude is inf"),
        (MissionItem(16, 3, lat_deg=0.5, lon_deg=105.0, alt_m=5.0), "cannot be placed"),
    ],
)
def test_items_that_cannot_be_placed_are_errors(bad, said):
    with pytest.raises(MissionError, match=said):
        fly(TAKE_OFF, bad)


@pytest.mark.parametrize("items", [(), (RTL,), (item(178, frame=2), item(21, 60, 50))])
def test_a_mission_that_never_flies_is_an_error(items):
    with pytest.raises(MissionError):
        fly(*items)


def test_a_mission_without_any_place_is_an_error():
    with pytest.raises(MissionError, match="neither a home nor a place"):
        fly(TAKE_OFF, home=Home(NAN, NAN, NAN))
