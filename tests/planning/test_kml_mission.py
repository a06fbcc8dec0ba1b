"""Missions in KML, KMZ and DJI's waylines, and what is refused."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path

import pytest

from planning.certificate.clearance import certify
from planning.errors import FormatError
from planning.formats.detect import read_flight, read_mission
from planning.formats.kml import write_kml
from planning.formats.safe_text import said_once
from planning.missions.flown import flown_line
from planning.planner.plan import plan_mission
from tests.planning.plan_examples import request_over, small_dsm

HEAD = '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:wpml="http://www.dji.com/wpmz/1.0.2"><Document>'
TAIL = "</Document></kml>"


def line(mode: str, coordinates: str = "8.0,46.0,510 8.001,46.0,520") -> bytes:
    shape = f"<LineString><altitudeMode>{mode}</altitudeMode><coordinates>{coordinates}</coordinates></LineString>"
    return f"{HEAD}<Placemark>{shape}</Placemark>{TAIL}".encode()


def waylines(mode: str = "relativeToStartPoint", finish: str = "goHome", point: str = "", head: str = "") -> bytes:
    marks = "".join(
        f"<Placemark><Point><coordinates>8.00{n},46.0</coordinates></Point>"
        f"<wpml:executeHeight>{30 + n}</wpml:executeHeight>{point}</Placemark>"
        for n in range(3)
    )
    return (
        f"{HEAD}<wpml:missionConfig><wpml:finishAction>{finish}</wpml:finishAction>{head}</wpml:missionConfig>"
        f"<Folder><wpml:executeHeightMode>{mode}</wpml:executeHeightMode>{marks}</Folder>{TAIL}"
    ).encode()


def kmz(**entries: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in entries.items():
            archive.writestr(name.replace("__", "/").replace("_", "."), data)
    return stream.getvalue()


def test_a_line_is_flown_from_its_first_point_to_its_last_and_home() -> None:
    for data in (line("absolute"), kmz(doc_kml=line("absolute"))):
        mission = read_flight("route.kml", data)
        assert [i.command for i in mission.items] == [22, 16, 16, 20]
        assert [i.frame for i in mission.items[:3]] == [0, 0, 0]
        assert [i.alt_m for i in mission.items[:3]] == [510.0, 510.0, 520.0]
        assert (mission.home.lat_deg, mission.home.lon_deg) == (46.0, 8.0)
        assert "a return home was added" in mission.warnings[0]


def test_heights_above_ground_are_those_of_a_terrain_model_that_nobody_has() -> None:
    assert {i.frame for i in read_flight("route.kml", line("relativeToGround")).items[:3]} == {10}


def test_our_own_track_is_judged_above_home() -> None:
    dsm = small_dsm()
    plan = plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.6)]))
    mission = read_flight("trajectory.kml", write_kml(plan.path, plan.mission, dsm).encode())
    flown = flown_line(mission, dsm)
    assert not flown.unjudged
    certificate = certify(dsm, flown, plan.request.clearance())
    assert certificate.min_distance_m == pytest.approx(plan.certificate.min_distance_m, abs=1.0)


def test_dji_waylines_in_a_kmz_are_preferred_to_its_template() -> None:
    archive = kmz(wpmz__template_kml=line("absolute"), wpmz__waylines_wpml=waylines())
    mission = read_flight("flight.kmz", archive)
    assert [i.command for i in mission.items] == [22, 16, 16, 16, 20]
    assert [(i.frame, i.alt_m) for i in mission.items[:4]] == [(3, 30.0), (3, 30.0), (3, 31.0), (3, 32.0)]


@pytest.mark.parametrize(
    ("finish", "last"), [("goHome", 20), ("autoLand", 21), ("gotoFirstWaypoint", 16), ("noAction", 16)]
)
def test_how_waylines_end(finish: str, last: int) -> None:
    mission = read_flight("a.wpml", waylines(finish=finish))
    assert mission.items[-1].command == last
    assert ("not judged" in " ".join(mission.warnings)) == (finish == "noAction")


def test_waylines_climb_to_the_security_height_first_and_curves_are_no_straight_lines() -> None:
    head = "<wpml:takeOffSecurityHeight>45</wpml:takeOffSecurityHeight>"
    curve = (
        "<wpml:useStraightLine>0</wpml:useStraightLine>"
        "<wpml:waypointTurnMode>toPointAndPassWithContinuityCurvature</wpml:waypointTurnMode>"
    )
    mission = read_flight("a.wpml", waylines(head=head, point=curve))
    assert mission.items[0].alt_m == 45.0
    assert {i.command for i in mission.items[1:4]} == {82}


def test_real_dji_waylines(shared_data: Path) -> None:
    file = shared_data / "missions" / "dji_waygen" / "waylines.wpml"
    mission = read_flight(file.name, file.read_bytes())
    assert len(mission.items) > 10
    assert {i.alt_m for i in mission.items[:-1]} == {50.0}
    assert mission.items[-1].command == 20
    assert math.isnan(mission.home.alt_dsm_m)


POINT = "<Placemark><Point><coordinates>8,46,9</coordinates></Point></Placemark>"
ABOVE_ELLIPSOID = "Heights are given as 'WGS84', which no mission item has"


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (line("clampToGround"), "no line with heights"),
        (line("absolute", "8,46 8.1,46"), "A point of the line has no height"),
        (f"{HEAD}{POINT}{TAIL}".encode(), "no line with heights"),
        (waylines(mode="WGS84"), ABOVE_ELLIPSOID),
        (waylines(mode="WGS84").replace(b"<wpml:executeHeightMode>WGS84</wpml:executeHeightMode>", b""), "nothing"),
        (kmz(readme_txt=b"x"), "no readable .kml"),
        (b"<kml", "not valid XML"),
        (waylines().replace(b"8.001,46.0", b"8.001"), "no coordinates"),
        (waylines().replace(b">31<", b">high<"), "executeHeight"),
    ],
)
def test_what_cannot_be_judged_is_refused(data: bytes, what: str) -> None:
    with pytest.raises(FormatError) as refused:
        read_flight("route.kml", data)
    assert what in refused.value.what


def test_a_vehicle_takes_no_kml() -> None:
    for data in (line("absolute"), b"\xef\xbb\xbf " + line("absolute"), kmz(doc_kml=line("absolute"))):
        with pytest.raises(FormatError, match="not a mission that a vehicle takes"):
            read_mission("route.kml", data)


def test_the_same_sentence_is_said_once_with_a_count() -> None:
    said = said_once([f"a.plan, item {n}: The frame was taken." for n in range(1, 501)] + ["Other.", "b: One."])
    assert said == ("a.plan, item 1 and 499 more: The frame was taken.", "Other.", "b: One.")
