"""A file's points, and its fence, taken into the console's plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from planning.errors import FormatError
from planning.fence.fence_model import Fence, RallyPoint, circle, polygon
from planning.formats.fence_files import write_fence
from planning.formats.qgc_plan import write_plan
from server.library.documents import with_points
from server.library.fences import fence_from_doc
from server.plan.file_tasks import read_points
from server.schemas import PlanDoc, PoiDoc
from tests.planning.format_examples import make_dsm, make_mission, make_path

FENCE = Fence(
    polygons=(polygon([(47.0, 8.0), (47.0, 8.01), (47.01, 8.0)], inclusion=True, where="test"),),
    circles=(circle(47.001, 8.001, 50.0, inclusion=False, where="test"),),
    ceiling_rel_home_m=80.0,
)
RALLY = (RallyPoint(47.002, 8.002, 30.0),)
PRESENT = PlanDoc(pois=[PoiDoc(id="a", lat_deg=47.0, lon_deg=8.0)])


def read(file: Path, *, only_fence: bool = False) -> tuple[PlanDoc, tuple[str, ...]]:
    found, remarks = read_points(file, file.name, None, only_fence=only_fence, report=lambda step, share: None)
    return with_points(PRESENT, found), remarks


def mission_file(tmp_path: Path, fence: Fence, rally: tuple[RallyPoint, ...] = ()) -> Path:
    dsm, file = make_dsm(), tmp_path / "mission.plan"
    file.write_text(write_plan(replace(make_mission(dsm, make_path(dsm)), fence=fence, rally=rally)))
    return file


def test_a_plan_brings_its_points_and_its_fence(tmp_path: Path) -> None:
    document, _ = read(mission_file(tmp_path, FENCE, RALLY))
    assert len(document.pois) == 3
    assert fence_from_doc(document) == (FENCE, RALLY)


def test_a_mission_without_a_fence_leaves_the_plan_s_own(tmp_path: Path) -> None:
    fenced, _ = read(mission_file(tmp_path, FENCE, RALLY))
    found, _ = read_points(mission_file(tmp_path, Fence()), "mission.plan", None, report=lambda step, share: None)
    assert fence_from_doc(with_points(fenced, found)) == (FENCE, RALLY)


def test_of_a_plan_only_the_fence_is_taken_where_only_that_was_asked_for(tmp_path: Path) -> None:
    document, _ = read(mission_file(tmp_path, FENCE, RALLY), only_fence=True)
    assert document.pois == PRESENT.pois
    assert fence_from_doc(document) == (FENCE, RALLY)


@pytest.mark.parametrize("name", ["fence.kml", "fence.geojson"])
def test_a_dropped_fence_is_no_survey_area_and_no_point_to_fly_to(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_text(write_fence(name, FENCE, RALLY))
    document, _ = read(file)
    assert (document.pois, document.source, document.survey.polygon) == (PRESENT.pois, "pois", [])
    assert fence_from_doc(document) == (FENCE, RALLY)


def test_a_dropped_wpl_of_a_fence_is_one(tmp_path: Path) -> None:
    file = tmp_path / "fence.waypoints"
    file.write_text(write_fence(file.name, FENCE, ()))
    document, _ = read(file)
    assert fence_from_doc(document) == (FENCE, ())


def test_an_area_that_does_not_say_that_it_is_a_fence_stays_a_survey_s(tmp_path: Path) -> None:
    file = tmp_path / "area.geojson"
    ring = [[8.0, 47.0], [8.01, 47.0], [8.0, 47.01], [8.0, 47.0]]
    file.write_text(f'{{"type": "Polygon", "coordinates": [{ring}]}}')
    assert read(file)[0].source == "survey"
    with pytest.raises(FormatError, match="does not say whether it is an inclusion"):
        read(file, only_fence=True)
    bad = tmp_path / "bad.geojson"
    bad.write_text('{"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": null}]}')
    with pytest.raises(FormatError) as caught:
        read(bad, only_fence=True)
    assert caught.value.where == "bad.geojson, feature 1"
