"""The fence of a plan document: drawn by clicks, moved by drags, made planning's own, and written."""

from __future__ import annotations

import pytest

from planning.errors import FormatError
from planning.formats.fence_files import read_fence
from server.errors import NotReadyError
from server.library.documents import taken_words
from server.library.edits import clicked, moved, picked
from server.library.fences import fence_from_doc, with_fence, written_fence
from server.schemas import FenceDoc, FencePolygonDoc, PlaceDoc, PlanDoc, PoiDoc, ProfileDoc, SelectionDoc

SQUARE = ((46.0, 7.0), (46.0, 7.001), (46.001, 7.001), (46.001, 7.0))


def click(
    document: PlanDoc, selection: SelectionDoc, *places: tuple[float, float]
) -> tuple[str, PlanDoc, SelectionDoc]:
    label = ""
    for lat_deg, lon_deg in places:
        outcome = clicked(document, selection, lat_deg, lon_deg)
        assert outcome is not None
        label, document, selection = outcome
    return label, document, selection


def drawn() -> PlanDoc:
    """A polygon, a circle and a rally point."""
    _, document, _ = click(PlanDoc(), SelectionDoc(tool="fence_polygon"), *SQUARE)
    _, document, _ = click(document, SelectionDoc(tool="fence_circle"), (46.002, 7.0))
    return click(document, SelectionDoc(tool="rally"), (46.003, 7.0))[1]


def test_two_clicks_are_no_polygon_yet_and_the_plan_stays_as_it_is() -> None:
    before = PlanDoc(name="kept")
    label, document, selection = click(before, SelectionDoc(tool="fence_polygon", poi_id="a"), *SQUARE[:2])
    assert (label, document) == ("", before)
    assert [(p.lat_deg, p.lon_deg) for p in selection.draft] == list(SQUARE[:2])
    assert selection.poi_id is None


def test_the_third_click_makes_a_polygon_that_is_kept_out_of_and_the_fourth_gives_it_a_corner() -> None:
    label, document, selection = click(PlanDoc(), SelectionDoc(tool="fence_polygon"), *SQUARE[:3])
    (shape,) = document.fence.polygons
    assert (label, shape.inclusion, len(shape.corners)) == ("Add polygon 1", False, 3)
    assert (selection.tool, selection.draft, selection.fence_mark) == ("fence_polygon", [], f"{shape.id}.2")
    label, document, selection = click(document, selection, SQUARE[3])
    assert (label, selection.fence_mark) == ("Add corner to polygon 1", f"{shape.id}.3")
    assert [(c.lat_deg, c.lon_deg) for c in document.fence.polygons[0].corners] == list(SQUARE)


def test_a_corner_is_added_after_the_selected_one() -> None:
    document = drawn()
    shape = document.fence.polygons[0]
    chosen = SelectionDoc(tool="fence_polygon", fence_mark=f"{shape.id}.0")
    _, document, selection = click(document, chosen, (45.9995, 7.0005))
    assert document.fence.polygons[0].corners[1] == PlaceDoc(lat_deg=45.9995, lon_deg=7.0005)
    assert selection.fence_mark == f"{shape.id}.1"


def test_a_corner_that_stands_where_the_selected_one_does_is_not_added() -> None:
    document = drawn()
    shape = document.fence.polygons[0]
    assert clicked(document, SelectionDoc(tool="fence_polygon", fence_mark=f"{shape.id}.1"), *SQUARE[1]) is None
    assert clicked(document, SelectionDoc(tool="fence_polygon", fence_mark=shape.id), *SQUARE[3]) is None


def test_a_mark_of_a_polygon_that_is_gone_begins_a_new_one() -> None:
    chosen = SelectionDoc(tool="fence_polygon", fence_mark="gone.1")
    _, document, selection = click(PlanDoc(), chosen, SQUARE[0])
    assert (document.fence.polygons, len(selection.draft)) == ([], 1)


def test_circles_and_rally_points_are_put_once_and_can_be_dragged_at_once() -> None:
    document = PlanDoc(profile=ProfileDoc(name="x", rtl_height_m=33.0))
    _, document, selection = click(document, SelectionDoc(tool="fence_circle"), SQUARE[0])
    (circle,) = document.fence.circles
    assert (circle.inclusion, selection.tool, selection.fence_mark) == (False, "select", circle.id)
    _, document, selection = click(document, SelectionDoc(tool="rally"), SQUARE[1])
    (point,) = document.rally
    assert (point.alt_rel_home_m, selection.tool, selection.fence_mark) == (33.0, "select", point.id)


def test_every_mark_moves_and_nothing_else_does() -> None:
    document = drawn()
    shape, circle, rally = document.fence.polygons[0], document.fence.circles[0], document.rally[0]
    marks = {f"{shape.id}.2": "corner of polygon 1", circle.id: "circle 1", rally.id: "rally point 1"}
    for mark, words in marks.items():
        outcome = moved(document, mark, 46.5, 7.5)
        assert outcome is not None
        label, after = outcome
        assert label == f"Move {words}"
        assert str(after).count("46.5") == 1
    for nothing in (shape.id, f"{shape.id}.9", f"{shape.id}.x", "gone"):
        assert moved(document, nothing, 46.5, 7.5) is None


def test_a_point_and_a_mark_are_never_selected_both() -> None:
    document = drawn().model_copy(update={"pois": [PoiDoc(id="a", lat_deg=1.0, lon_deg=2.0)]})
    both = SelectionDoc(poi_id="a", fence_mark="b")
    assert picked(document, both, "a") == SelectionDoc(poi_id="a")
    assert picked(document, both, document.rally[0].id) == SelectionDoc(fence_mark=document.rally[0].id)


def test_documents_and_planning_s_own_types_agree_both_ways() -> None:
    document = drawn()
    heights = document.fence.model_copy(update={"floor_rel_home_m": -5.0, "ceiling_rel_home_m": 80.0})
    fence, rally = fence_from_doc(document.model_copy(update={"fence": heights}))
    assert fence.polygons[0].corners_lat_lon_deg == SQUARE
    assert (fence.floor_rel_home_m, fence.ceiling_rel_home_m) == (-5.0, 80.0)
    assert fence_from_doc(with_fence(PlanDoc(), fence, rally)) == (fence, rally)


@pytest.mark.parametrize(
    ("fence", "where"),
    [
        (
            FenceDoc(
                polygons=[
                    FencePolygonDoc(
                        id="a",
                        inclusion=True,
                        corners=[PlaceDoc(lat_deg=SQUARE[k][0], lon_deg=SQUARE[k][1]) for k in (0, 2, 1, 3)],
                    )
                ]
            ),
            "The plan's fence, polygon 1",
        ),
        (FenceDoc(floor_rel_home_m=50.0, ceiling_rel_home_m=20.0), "The plan's fence"),
    ],
)
def test_a_fence_that_is_none_says_where(fence: FenceDoc, where: str) -> None:
    with pytest.raises(FormatError) as caught:
        fence_from_doc(PlanDoc(fence=fence))
    assert caught.value.where == where


@pytest.mark.parametrize("file", ["fence.plan", "fence.kml", "fence.geojson"])
def test_what_is_exported_is_read_again_as_it_was(file: str) -> None:
    document = drawn()
    found = read_fence(file, written_fence(document, file))
    assert (found.fence, found.rally) == fence_from_doc(document)


def test_wpl_holds_one_of_both() -> None:
    document = drawn()
    assert read_fence("f", written_fence(document, "fence.waypoints")).rally == ()
    assert not read_fence("r", written_fence(document, "rally.waypoints")).fence
    with pytest.raises(NotReadyError, match="no rally points to export"):
        written_fence(document.model_copy(update={"rally": []}), "rally.waypoints")


def test_what_was_read_is_said() -> None:
    assert taken_words(drawn()) == "Fence: 1 polygon, 1 circle, 1 rally point"
