"""Files of fences and rally points: each format there and back, by other programs' readers, and what is wrong told."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from pymavlink import mavutil

from planning.errors import FormatError
from planning.fence.fence_model import Fence, RallyPoint, circle, polygon
from planning.formats.detect import read_mission
from planning.formats.fence_files import FenceFile, read_fence, write_fence
from planning.formats.fence_items import rally_items

RING = [(47.0, 8.0), (47.0, 8.002), (47.002, 8.002), (47.001, 8.0005)]
FENCE = Fence(
    polygons=(
        polygon(RING, inclusion=True, where="t"),
        polygon([(47.0002, 8.001), (47.0004, 8.001), (47.0004, 8.0013)], inclusion=False, where="t"),
    ),
    circles=(
        circle(47.0001234, 8.0004321, 12.25, inclusion=False, where="t"),
        circle(47.001, 8.001, 900.0, inclusion=True, where="t"),
    ),
    floor_rel_home_m=2.5,
    ceiling_rel_home_m=120.0,
)
RALLY = (RallyPoint(47.0001, 8.0001, 25.5), RallyPoint(-33.0000001, -70.1, 40.0))


@pytest.mark.parametrize("name", ["f.plan", "f.kml", "f.geojson", "f.json"])
def test_a_fence_with_rally_points_goes_there_and_back(name: str) -> None:
    found = read_fence(name, write_fence(name, FENCE, RALLY).encode())
    assert found == FenceFile(FENCE, RALLY)


@pytest.mark.parametrize("name", ["f.waypoints", "f.txt"])
def test_wpl_holds_one_of_both(name: str) -> None:
    assert read_fence(name, write_fence(name, FENCE, ()).encode()) == FenceFile(FENCE, ())
    assert read_fence(name, write_fence(name, Fence(), RALLY).encode()) == FenceFile(Fence(), RALLY)
    with pytest.raises(FormatError, match="not both"):
        write_fence(name, FENCE, RALLY)
    with pytest.raises(FormatError, match="No fence is written"):
        write_fence("f.csv", FENCE, RALLY)


def test_pymavlinks_own_loader_reads_the_wpl_and_writes_one_that_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil.set_dialect("ardupilotmega")
    from pymavlink import mavwp  # it looks at the dialect when it is imported

    for kind, shapes, rally in (("Fence", FENCE, ()), ("Rally", Fence(), RALLY)):
        ours, theirs = tmp_path / f"{kind}.waypoints", tmp_path / f"{kind}.again"
        ours.write_text(write_fence(ours.name, shapes, rally))
        loader = getattr(mavwp, f"MissionItemProtocol_{kind}")()
        loader.load(str(ours))
        assert loader.count() == (9 if kind == "Fence" else 2)
        if kind == "Fence":
            first = loader.item(0)
            assert (first.command, first.param1, first.x, first.y) == (5001, 4.0, 47.0, 8.0)
        loader.save(str(theirs))
        again = read_fence(theirs.name, theirs.read_bytes())
        # It knows nothing of our comments, floor and ceiling, and writes six decimals.
        assert numbers(again.fence, again.rally) == pytest.approx(numbers(shapes, rally), abs=6e-7)


def numbers(shapes: Fence, rally: tuple[RallyPoint, ...]) -> list[float]:
    corners = [value for each in shapes.polygons for place in each.corners_lat_lon_deg for value in place]
    circles = [value for each in shapes.circles for value in (*each.centre_lat_lon_deg, each.radius_m, each.inclusion)]
    return [*corners, *circles, *(value for p in rally for value in (p.lat_deg, p.lon_deg, p.alt_rel_home_m))]


def test_the_home_row_that_mission_planner_writes_is_left_out() -> None:
    lines = write_fence("f.waypoints", FENCE, ()).splitlines()
    home = "0\t1\t0\t16\t0\t0\t0\t0\t47.0\t8.0\t500\t1"
    assert read_fence("f.waypoints", "\n".join([lines[0], home, *lines[1:]]).encode()).fence == FENCE


def test_ardupilot_gets_rally_heights_that_are_never_lower() -> None:
    assert [item.alt_m for item in rally_items(RALLY, "ardupilot")] == [26.0, 40.0]
    assert [item.alt_m for item in rally_items(RALLY, "px4")] == [25.5, 40.0]


def geojson(*features: dict) -> bytes:
    return json.dumps({"type": "FeatureCollection", "features": list(features)}).encode()


def drawn(kind: str, coordinates: object, **properties: object) -> dict:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}


RING_LON_LAT = [[8.0, 47.0], [8.002, 47.0], [8.002, 47.002], [8.0, 47.0]]


def test_a_drawn_shape_may_say_what_it_is_in_its_name() -> None:
    found = read_fence("f.json", geojson(drawn("Polygon", [RING_LON_LAT], name="Exclusion around the mast")))
    assert not found.fence.polygons[0].inclusion
    track = drawn("LineString", [[8, 47], [8, 48]])
    found = read_fence("f.json", geojson(track, drawn("Polygon", [RING_LON_LAT], fence="inclusion")))
    assert found.fence.polygons[0].inclusion
    assert "was not read" in found.warnings[0]


@pytest.mark.parametrize(
    ("feature", "said"),
    [
        (drawn("Polygon", [RING_LON_LAT]), "does not say whether it is an inclusion"),
        (drawn("Polygon", [RING_LON_LAT], fence="maybe"), "maybe"),
        (drawn("Polygon", [RING_LON_LAT, RING_LON_LAT], fence="inclusion"), "without holes"),
        (drawn("Point", [8.0, 47.0], fence="inclusion"), "radius_m should be a number"),
        (drawn("Point", [8.0, 47.0], fence="inclusion", radius_m=0), "radius of 0 m"),
        (drawn("Point", [8.0, 47.0], role="rally"), "alt_rel_home_m should be a number"),
        (drawn("Point", [8.0, 97.0], role="rally", alt_rel_home_m=3), "no place on Earth"),
        (drawn("Polygon", [RING_LON_LAT], fence="inclusion", ceiling_rel_home_m="high"), "should be a number"),
        (drawn("Point", [8.0, 47.0], name="a point"), "no fence and no rally points"),
    ],
)
def test_what_is_wrong_with_a_drawn_fence_is_said_and_where(feature: dict, said: str) -> None:
    with pytest.raises(FormatError, match=said) as caught:
        read_fence("f.json", geojson(feature))
    assert caught.value.where.startswith("f.json")


def test_two_ceilings_contradict_each_other() -> None:
    shapes = [drawn("Polygon", [RING_LON_LAT], fence="inclusion", ceiling_rel_home_m=m) for m in (50, 60)]
    with pytest.raises(FormatError, match="50 and 60"):
        read_fence("f.json", geojson(*shapes))


WPL = "QGC WPL 110\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WPL + "0\t0\t0\t5001\t4\t0\t0\t0\t47\t8\t0\t1\n", "4 corners, and 1 follow"),
        (WPL + "".join(f"{k}\t0\t0\t{5001 + k}\t3\t0\t0\t0\t47.{k}\t8\t0\t1\n" for k in range(3)), "not all of them"),
        (WPL + "0\t0\t0\t5003\tnan\t0\t0\t0\t47\t8\t0\t1\n", "radius"),
        (WPL + "0\t0\t0\t5003\t5\t0\t0\t0\t97\t8\t0\t1\n", "no place on Earth"),
        (WPL + "0\t0\t0\t5001\tnan\t0\t0\t0\t47\t8\t0\t1\n", "corners"),
        (WPL + "0\t0\t0\t5100\t0\t0\t0\t0\t47\t8\t30\t1\n", "above mean sea level"),
        (WPL + "1\t0\t3\t16\t0\t0\t0\t0\t47\t8\t30\t1\n", "no rally point"),
        (WPL, "no fence and no rally points"),
        ("hello", "This is no fence"),
        ('{"fileType": "Other"}', "no plan of QGroundControl"),
        ('{"fileType": "Plan", "geoFence": []}', "should be an object"),
        ('{"fileType": "Plan", "geoFence": {"version": 1, "polygon": [[47, 8]]}}', "Version 1 of it is not read"),
        ('{"fileType": "Plan", "geoFence": {"polygons": 3}}', "should be a list"),
        ('{"fileType": "Plan", "rallyPoints": {"points": [[47, 8]]}}', "latitude, longitude, height"),
        ('{"fileType": "Plan", "geoFence": {"circles": [{"inclusion": 1}]}}', "should be an object"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(text: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read_fence("f.txt", text.encode())


def test_a_fence_is_no_mission() -> None:
    with pytest.raises(FormatError, match="not a mission") as caught:
        read_mission("f.waypoints", write_fence("f.waypoints", FENCE, ()).encode())
    assert "--fence" in caught.value.advice


def test_a_return_point_is_said_not_to_be_read() -> None:
    text = write_fence("f.txt", FENCE, ()) + "9\t0\t0\t5000\t0\t0\t0\t0\t47\t8\t0\t1\n"
    found = read_fence("f.txt", text.encode())
    assert found.fence == FENCE
    assert "return point was not read" in found.warnings[0]


def test_no_height_is_nan() -> None:
    with pytest.raises(FormatError):
        read_fence("f.plan", b'{"fileType": "Plan", "rallyPoints": {"points": [[47, 8, NaN]]}}')
    assert not math.isnan(RALLY[0].alt_rel_home_m)
