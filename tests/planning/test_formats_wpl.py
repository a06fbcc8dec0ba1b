import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.errors import FormatError
from planning.formats.detect import read_mission
from planning.formats.wpl import read_wpl, write_wpl
from tests.planning.format_examples import make_dsm, make_mission, make_path

lat = st.floats(-89, 89, width=64)
lon = st.floats(-179, 179, width=64)
items = st.builds(
    MissionItem,
    command=st.sampled_from([16, 19, 20, 21, 22, 178, 206]),
    frame=st.sampled_from([0, 2, 3, 10]),
    params=st.tuples(*[st.floats(-1000, 1000, width=32)] * 4),
    lat_deg=lat,
    lon_deg=lon,
    alt_m=st.floats(-500, 9000),
    autocontinue=st.booleans(),
)


def example() -> Mission:
    dsm = make_dsm()
    return make_mission(dsm, make_path(dsm))


def test_a_mission_survives_the_round_trip():
    mission = example()
    back = read_wpl(write_wpl(mission))
    assert back.home.vertical_datum == "EGM96 height"
    assert back.home.alt_dsm_m == pytest.approx(mission.home.alt_dsm_m, abs=1e-4)
    assert (back.home.lat_deg, back.home.lon_deg) == pytest.approx(
        (mission.home.lat_deg, mission.home.lon_deg), abs=1e-9
    )
    assert [(i.command, i.frame, i.params) for i in back.items] == [
        (i.command, i.frame, i.params) for i in mission.items
    ]
    assert [i.alt_m for i in back.items] == [i.alt_m for i in mission.items]
    assert back.cruise_speed_m_s == 3.0
    assert back.warnings == ()


@given(st.lists(items, max_size=8), lat, lon)
def test_any_mission_survives_and_is_never_lowered(mission_items, home_lat, home_lon):
    mission = Mission(Home(home_lat or 1.0, home_lon or 1.0, 12.5), tuple(mission_items))
    back = read_wpl(write_wpl(mission))
    assert len(back.items) == len(mission_items)
    for given_item, read in zip(mission_items, back.items, strict=True):
        assert -1e-7 <= read.alt_m - given_item.alt_m <= 0.0101
        assert read.lat_deg == pytest.approx(given_item.lat_deg, abs=1e-9)
        assert read.params == pytest.approx(given_item.params, rel=1e-9)
        assert read.autocontinue == given_item.autocontinue


def test_a_missing_parameter_is_0_for_ardupilot_and_stays_for_px4():
    item = MissionItem(16, 3, (0.0, 0.0, 0.0, math.nan), 47.0, 8.0, 5.0)
    mission = Mission(Home(47.0, 8.0, 400.0), (item,))
    assert read_wpl(write_wpl(mission)).items[0].params[3] == 0.0
    px4 = read_wpl(write_wpl(replace(mission, firmware="px4")))
    assert math.isnan(px4.items[0].params[3])
    assert px4.firmware == "px4"


def test_without_comments_every_line_is_a_row():
    assert "#" not in write_wpl(example(), comments=False)


def test_the_recorded_flights_mission_is_read(shared_data):
    mission = read_mission("m", (shared_data / "logs/arducopter/mission.waypoints").read_bytes())
    assert len(mission.items) == 87
    assert mission.home == Home(-37.12445073, 175.68928790, 803.15, None)
    assert mission.items[0].command == 22
    assert mission.items[-1].command == 20


def test_a_file_without_home_row_keeps_its_first_item(shared_data):
    mission = read_mission("m.txt", (shared_data / "missions/mavsdk/mission_planner_sample.txt").read_bytes())
    assert [i.command for i in mission.items] == [22, 16, 16, 20]
    assert [i.frame for i in mission.items] == [0, 0, 0, 0]
    assert math.isnan(mission.home.alt_dsm_m)
    assert "no home" in mission.warnings[0]


def test_dronekits_mission_is_read(shared_data):
    mission = read_mission("m.txt", (shared_data / "logs/dronekit/mpmission.txt").read_bytes())
    assert mission.home.alt_dsm_m == 584.0
    assert len(mission.items) > 1


def test_windows_lines_blank_lines_spaces_and_comments_do_no_harm():
    rows = ("0 1 0 16 0 0 0 0 47 8 400 1", "1\t0\t3\t16\t0\t0\t0\t0\t47.001\t8.001\t20\t1")
    text = "\r\n".join(("QGC WPL 110", "# by hand", "", *rows, "", ""))
    mission = read_mission("a.waypoints", b"\xef\xbb\xbf" + text.encode())
    assert mission.items == (MissionItem(16, 3, (0, 0, 0, 0), 47.001, 8.001, 20.0),)


def test_swapped_coordinates_are_noticed():
    text = "QGC WPL 110\n0 1 0 16 0 0 0 0 47.39 8.54 400 1\n1 0 3 16 0 0 0 0 8.5401 47.3901 20 1\n"
    assert any("swapped" in w for w in read_wpl(text).warnings)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("1 0 3 16 0 0 0 0 47 8 400", "12 fields"),
        ("1 0 3 16 0 0 0 0 147 8 400 1", "swapped"),
        ("1 0 3 16 0 0 0 0 nan 8 400 1", "finite"),
        ("1 0 3 16 0 inf 0 0 47 8 400 1", "finite"),
        ("1 0 3 1.5 0 0 0 0 47 8 400 1", "whole"),
        ("1 0 3 x 0 0 0 0 47 8 400 1", "number"),
    ],
)
def test_a_bad_row_is_named_with_its_line(rows, words):
    with pytest.raises(FormatError, match=words) as caught:
        read_wpl(f"QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n{rows}\n")
    assert "line 3" in caught.value.where


@pytest.mark.parametrize("text", ["", "QGC WPL 120\n", "lat,lon\n1,2\n", "<kml/>", "[1]"])
def test_other_files_are_no_missions(text):
    with pytest.raises(FormatError):
        read_mission("x", text.encode())
