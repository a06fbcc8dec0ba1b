import io
import json
import zipfile
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.plan_model import Poi
from planning.errors import FormatError
from planning.formats import safe_text
from planning.formats.geojson import write_geojson
from planning.formats.kml import write_kml
from planning.formats.poi_files import looks_swapped, read_pois, warn_swapped
from planning.formats.qgc_plan import write_plan
from planning.formats.wpl import write_wpl
from tests.planning.format_examples import HOSTILE, make_dsm, make_mission, make_path, write_pois_csv

TWO = (Poi(47.1, 8.2, "a", 3.0), Poi(47.2, 8.3, "b", 0.0))
KML = "<?xml version='1.0' encoding='UTF-8'?><kml xmlns='http://www.opengis.net/kml/2.2'><Document>{}</Document></kml>"


def kml(body: str) -> bytes:
    return KML.format(body).encode()


def kmz(text: bytes, name: str = "doc.kml") -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)  # without the time of day
    return packed.getvalue()


@pytest.mark.parametrize(
    "text",
    [
        "lat_deg,lon_deg,name,loiter_s\n47.1,8.2,a,3\n47.2,8.3,b,0\n",
        "47.1,8.2,a,3\n\n47.2,8.3,b\n",
        "Longitude;loiter_s;Latitude;Name\n8,2;3;47,1;a\n8,3;;47,2;b\n",
        "name\tlat\tlng\tloiter\r\na\t47.1\t8.2\t3\r\nb\t47.2\t8.3\t\r\n",
        "\ufefflatitude,longitude,label,hold\n# remark\n47.1,8.2,a,3\n47.2,8.3,b,0\n",
    ],
)
def test_csv_of_many_makes(text):
    assert read_pois("p.csv", text.encode()).pois == TWO


names = st.text(max_size=60).map(safe_text.clean_name)
pois = st.builds(Poi, st.floats(-90, 90), st.floats(-180, 180), names, st.sampled_from([0.0, 2.5, 60.0]))


@given(st.lists(pois, min_size=1, max_size=5))
def test_csv_survives_the_round_trip(points):
    back = read_pois("p.csv", write_pois_csv(points).encode()).pois
    assert [(p.name, p.loiter_s) for p in back] == [(p.name, p.loiter_s) for p in points]
    assert [p.lat_deg for p in back] == pytest.approx([p.lat_deg for p in points], abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lat,lon\n47.1,8.2\n47.2,\n", "row 3"),
        ("lat,lon\n47.1,abc\n", "row 2"),
        ("47.1,nan\n", "row 1"),
        ("147.1,8.2\n", "swapped"),
        ("lat,name\n47,a\n", "no column lon_deg"),
        ("lat,lon\n", "no rows"),
        ("", "no rows"),
        ("47,8,a,-5\n", "negative"),
        ('47,8,"a\n', "row 1"),
    ],
)
def test_bad_csv_is_named_with_its_row(text, words):
    with pytest.raises(FormatError, match=words):
        read_pois("p.csv", text.encode())


def test_the_recorded_pois_are_read_and_their_swap_is_noticed(shared_data):
    found = read_pois("pois.csv", (shared_data / "logs/arducopter/pois.csv").read_bytes())
    assert [p.name for p in found.pois] == ["P1", "P2", "P3", "P4", "P5"]
    assert [p.loiter_s for p in found.pois] == [0, 2, 3, 2, 0]


def test_swapped_points_are_noticed_only_where_the_swap_would_mend_them():
    dsm = make_dsm()
    right = make_mission(dsm, make_path(dsm)).pois
    swapped = [Poi(p.lon_deg, p.lat_deg) for p in right]
    assert not looks_swapped(right, dsm)
    assert looks_swapped(swapped, dsm)
    assert looks_swapped([*swapped, *[Poi(0.0, 0.0)] * 9], dsm)
    assert not looks_swapped([Poi(10.0, 10.0)], dsm)
    assert not looks_swapped([], dsm)
    assert "swapped" in warn_swapped(swapped, dsm)[0]
    assert warn_swapped(right, dsm) == ()


HOME_ROW = "0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.2\t100\t1\n"


def test_a_negative_wait_is_refused_in_every_kind_of_file_with_its_place():
    dsm = make_dsm()
    path = make_path(dsm)
    mission = make_mission(dsm, path)
    mission = replace(mission, pois=(replace(mission.pois[0], loiter_s=-5.0),))
    point = {"type": "Point", "coordinates": [8.2, 47.1]}
    for text, where in (
        (json.dumps({"type": "Feature", "geometry": point, "properties": {"loiter_s": -5}}), "feature 1"),
        (write_kml(path, mission, dsm), "placemark"),
        (write_plan(mission), r"\.pois\[0\]"),
        ("47.1,8.2,a,-5\n", "row 1"),
        (f"QGC WPL 110\n{HOME_ROW}1\t0\t3\t16\t-5\t0\t0\t0\t47.1\t8.2\t20\t1\n", "item 1"),
    ):
        with pytest.raises(FormatError, match=f"{where}.*negative: -5 s"):
            read_pois("f", text.encode())


def test_geojson_points_lines_and_polygons():
    square = [[8, 47], [8.1, 47], [8.1, 47.1], [8, 47]]
    features = [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [8.2, 47.1]}, "properties": {"name": "a"}},
        {
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": [[1, 2, 99], [3, 4]]},
            "properties": None,
        },
        {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [square]}},
        {"type": "Feature", "geometry": {"type": "MultiPolygon", "coordinates": []}},
    ]
    found = read_pois("f", json.dumps({"type": "FeatureCollection", "features": features}).encode())
    assert found.pois == (Poi(47.1, 8.2, "a"), Poi(2, 1), Poi(4, 3))
    assert found.polygon == ((47, 8), (47, 8.1), (47.1, 8.1))
    assert "MultiPolygon" in found.warnings[0]


@pytest.mark.parametrize(
    "document",
    [
        {"type": "FeatureCollection", "features": 3},
        {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": None}]},
        {"type": "Point", "coordinates": "x"},
        {"type": "Point", "coordinates": [8]},
        {"type": "Polygon", "coordinates": [[[8, 47], [8, 47], [8, 47]]]},
        {"type": "FeatureCollection", "features": []},
        [],
    ],
)
def test_bad_geojson_is_refused(document):
    with pytest.raises(FormatError):
        read_pois("f", json.dumps(document).encode())


def test_kml_points_lines_and_polygons():
    body = (
        "<Folder><Placemark><name>&lt;b&gt;</name><Point><coordinates>\n8.2,47.1,0 </coordinates></Point></Placemark>"
        "</Folder>"
        "<Placemark><LineString><coordinates>1,2 3,4</coordinates></LineString></Placemark>"
        "<Placemark><Polygon><innerBoundaryIs/><outerBoundaryIs><LinearRing><coordinates>8,47 8.1,47 8.1,47.1 8,47"
        "</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark><Placemark/>"
    )
    for data in (kml(body), kmz(kml(body))):
        found = read_pois("k", data)
        assert found.pois == (Poi(47.1, 8.2, "<b>"), Poi(2, 1), Poi(4, 3))
        assert found.polygon == ((47, 8), (47, 8.1), (47.1, 8.1))


@pytest.mark.parametrize(
    "data",
    [
        b"<!DOCTYPE x [<!ENTITY a SYSTEM 'file:///etc/hostname'>]><kml>&a;</kml>",
        b"<!DOCTYPE x [<!ENTITY a 'aaaa'>]><kml>&a;</kml>",
        b"<kml>",
        b"<a>" * 5000,
        b"<a>" * 70 + b"</a>" * 70,
        kml("<Placemark><Point><coordinates>8;47</coordinates></Point></Placemark>"),
        kml("<Placemark><Point><coordinates>8,947</coordinates></Point></Placemark>"),
        kml("<Placemark><Point/></Placemark>"),
        kml(""),
        b"PK\x03\x04 not an archive",
        kmz(b"<kml/>", "readme.txt"),
        kmz(kml("x"))[:-30],
        kmz(b" " * (safe_text.MAX_BYTES + 1)),
    ],
)
def test_hostile_kml_and_kmz_are_refused(data):
    with pytest.raises(FormatError):
        read_pois("k", data)


def test_our_own_exports_give_back_the_chosen_points():
    dsm = make_dsm()
    path = make_path(dsm)
    mission = make_mission(dsm, path, ("P1", HOSTILE, "P3"))
    for text in (write_kml(path, mission, dsm), write_plan(mission), write_geojson(path, mission, dsm)):
        found = read_pois("own", text.encode()).pois
        assert [p.name for p in found] == ["P1", safe_text.clean_name(HOSTILE), "P3"]
        assert [p.loiter_s for p in found] == [2.0, 2.0, 2.0]


def test_a_waypoint_files_places_become_points():
    dsm = make_dsm()
    mission = make_mission(dsm, make_path(dsm))
    found = read_pois("m.waypoints", write_wpl(mission).encode()).pois
    assert [p.lat_deg for p in found] == pytest.approx([p.lat_deg for p in mission.pois], abs=1e-9)
    assert [p.loiter_s for p in found] == [1.5, 1.5, 1.5]


def is_readable(data: bytes) -> bool:
    try:
        return len(read_pois("noise", data).pois) > 0
    except FormatError:
        return False


@given(st.binary(max_size=400))
def test_noise_is_refused_and_never_crashes(data):
    assert not is_readable(data) or b"," in data or b";" in data or b"\t" in data
