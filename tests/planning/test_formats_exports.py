"""Trajectory CSV, KML and GeoJSON: written, and read back by their own readers."""

import json

import numpy as np
import pytest

from planning.errors import FormatError
from planning.formats.geojson import write_geojson
from planning.formats.kml import read_kml_track, write_kml
from planning.formats.kml_reader import read_placemarks
from planning.formats.trajectory_csv import read_trajectory, write_trajectory
from tests.planning.format_examples import HOSTILE, geojson_by_role, make_dsm, make_mission, make_path, make_timing

DATUMS = [None, "WGS 84 ellipsoid", "EGM96 height"]


@pytest.mark.parametrize("datum", DATUMS)
def test_a_trajectory_survives_the_round_trip(datum):
    dsm = make_dsm(datum)
    path = make_path(dsm)
    timing, home = make_timing(path), make_mission(dsm, path).home
    back = read_trajectory(write_trajectory(path, timing, home, dsm))
    np.testing.assert_allclose(back.lat_lon_deg, dsm.lat_lon_from_xy(path.xy_m), atol=1e-9)
    np.testing.assert_allclose(back.alt_rel_home_m, path.alt_dsm_m - home.alt_dsm_m, atol=6e-4)
    np.testing.assert_allclose(
        np.cumsum(back.time_to_next_s)[:-1] + np.cumsum(back.loiter_s)[1:], timing.t_s[1:], atol=1e-3
    )
    assert back.loiter_s[path.vertex[1]] == 2.5
    assert back.home.vertical_datum == datum
    assert back.home.alt_dsm_m == pytest.approx(home.alt_dsm_m, abs=1e-4)
    if datum == "EGM96 height":
        np.testing.assert_allclose(back.alt_amsl_m, path.alt_dsm_m, atol=6e-4)
    else:
        assert np.isnan(back.alt_amsl_m).all()


def test_a_trajectory_without_home_or_with_bad_rows_is_refused():
    dsm = make_dsm()
    path = make_path(dsm, 5)
    text = write_trajectory(path, make_timing(path), make_mission(dsm, path).home, dsm)
    with pytest.raises(FormatError, match="home_lat_deg"):
        read_trajectory(text.replace("# home_lat_deg", "# x"))
    with pytest.raises(FormatError, match="row 8"):
        read_trajectory("\n".join(text.splitlines()[:7]) + "\n1,2,3\n")
    with pytest.raises(FormatError, match="header"):
        read_trajectory("1,2\n")


@pytest.mark.parametrize("datum", DATUMS)
def test_kml_survives_the_round_trip(datum):
    dsm = make_dsm(datum)
    path = make_path(dsm)
    mission = make_mission(dsm, path, (HOSTILE, "", "P3"))
    text = write_kml(path, mission, dsm, title=HOSTILE)
    back = read_kml_track(text.encode())
    assert "<script>" not in text
    assert back.altitude_mode == ("absolute" if datum == "EGM96 height" else "clampToGround")
    assert back.home.vertical_datum == datum
    assert [p.name for p in back.pois] == ["<script>alert(1)</script>&\"']]>, line break", "", "P3"]
    assert [p.loiter_s for p in back.pois] == [2.0, 2.0, 2.0]
    np.testing.assert_allclose(back.lat_lon_deg, dsm.lat_lon_from_xy(path.xy_m), atol=1e-9)
    np.testing.assert_allclose(back.alt_rel_home_m, path.alt_dsm_m - mission.home.alt_dsm_m, atol=6e-4)


def test_absolute_kml_heights_are_those_of_the_path():
    dsm = make_dsm()
    path = make_path(dsm)
    marks = read_placemarks("k", write_kml(path, make_mission(dsm, path), dsm).encode())
    np.testing.assert_allclose([z for _, _, z in marks[0].coordinates], path.alt_dsm_m, atol=6e-4)


def test_geojson_survives_the_round_trip():
    dsm = make_dsm(None)
    path = make_path(dsm)
    mission = make_mission(dsm, path)
    text = write_geojson(path, mission, dsm, summary={"certified": True})
    marks = geojson_by_role(text)
    [home], [line] = marks["home"], marks["path"]
    assert line["properties"]["summary"] == {"certified": True}
    assert home["properties"]["home_alt_dsm_m"] == mission.home.alt_dsm_m
    above_home_m = [mark["properties"]["alt_m"] for mark in marks["waypoint"]]
    assert above_home_m == [i.alt_m for i in mission.items if i.command in (16, 22)]
    lon_lat_deg = np.array(line["geometry"]["coordinates"])
    np.testing.assert_allclose(lon_lat_deg[:, ::-1], dsm.lat_lon_from_xy(path.xy_m), atol=1e-9)
    heights_m = np.array(line["properties"]["alt_rel_home_m"])
    np.testing.assert_allclose(heights_m, path.alt_dsm_m - mission.home.alt_dsm_m, atol=6e-4)


def test_geojson_puts_longitude_first_and_no_third_coordinate():
    dsm = make_dsm()
    path = make_path(dsm, 5)
    document = json.loads(write_geojson(path, make_mission(dsm, path), dsm))
    lat, lon = dsm.lat_lon_from_xy(path.xy_m[:1])[0]
    assert document["features"][0]["geometry"]["coordinates"][0] == pytest.approx([lon, lat], abs=1e-9)


def test_infinite_figures_never_reach_the_json():
    dsm = make_dsm()
    path = make_path(dsm, 5)
    with pytest.raises(ValueError, match="JSON"):
        write_geojson(path, make_mission(dsm, path), dsm, summary={"x": float("inf")})
