"""Traversability in the 3D view: colours in the terrain's texture, at their place, and numbered landing sites."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.payload import OverlayScene, SiteMark
from server.scene.geometry.stage import Drawing
from server.scene.layers.ground_layers import laid_over
from server.scene.layers.layers import layers, unchanged
from server.scene.layers.mark_layers import poi_places
from server.scene.layers.site_layer import site_nodes
from server.schemas import SelectionDoc
from tests.server.scene_fixtures import exaggerated, hill, state_over


def overlay(rgba: np.ndarray, *, west_m: float = 500_000.0, cell_m: float = 1.0) -> OverlayScene:
    return OverlayScene("hill", rgba.astype(np.uint8), west_m, 4_000_000.0, cell_m)


def drawn(**changes: object) -> Drawing:
    dsm = hill(hole=False)
    made = Drawing.of(dsm, replace(state_over(dsm), **changes))  # pyright: ignore[reportArgumentType]
    assert made is not None
    return made


def test_opaque_colours_hide_the_texture_and_clear_ones_do_not() -> None:
    terrain = drawn().terrain
    rgba = np.zeros((60, 80, 4))
    rgba[10, 20] = (1, 2, 3, 255)
    texture = laid_over(terrain, overlay(rgba))
    assert texture[10, 20].tolist() == [1, 2, 3]
    assert (texture != terrain.texture_rgb).any(axis=2).sum() == 1


def test_half_clear_colours_mix() -> None:
    terrain = drawn().terrain
    rgba = np.zeros((60, 80, 4))
    rgba[:] = (200, 100, 0, 128)
    mixed = laid_over(terrain, overlay(rgba)).astype(float)
    share = 128 / 255
    assert mixed == pytest.approx(share * np.array([200, 100, 0]) + (1 - share) * terrain.texture_rgb, abs=0.51)


def test_another_grid_and_one_that_reaches_beyond_the_model_lie_where_they_belong() -> None:
    terrain = drawn().terrain
    rgba = np.zeros((20, 100, 4))
    rgba[0, 2] = (9, 9, 9, 255)
    texture = laid_over(terrain, overlay(rgba, west_m=500_000.0 - 6.0, cell_m=3.0))
    changed = np.argwhere((texture != terrain.texture_rgb).any(axis=2))
    assert changed.min(axis=0).tolist() == [0, 0]
    assert changed.max(axis=0).tolist() == [2, 2]


def test_nothing_laid_over_costs_nothing() -> None:
    terrain = drawn().terrain
    assert laid_over(terrain, None) is terrain.texture_rgb


def marks(*xy_m: tuple[float, float]) -> tuple[SiteMark, ...]:
    places = hill(hole=False).lat_lon_from_xy(np.array(xy_m)).tolist()
    return tuple(SiteMark(rank, *place) for rank, place in enumerate(places, 1))


def labels(nodes: list[Node]) -> list[Node]:
    return [node for node in nodes if node.kind == "label"]


def test_sites_are_numbered_on_the_ground() -> None:
    dsm = hill(hole=False)
    places = dsm.lat_lon_from_xy(np.array([[500_020.5, 3_999_980.5], [500_040.5, 3_999_970.5]])).tolist()
    made = drawn(sites=tuple(SiteMark(rank, *place) for rank, place in enumerate(places, 1)))
    nodes = site_nodes(made)
    assert [n.props["text"] for n in labels(nodes)] == ["L1", "L2"]
    balls = [n.props["position"] for n in nodes if n.kind == "mesh_simple"]
    for at, (lat_deg, lon_deg) in zip(balls, places, strict=True):
        xy = dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg]]))
        expected = made.frame.scene_from_model(np.column_stack([xy, dsm.elevation_at(xy)]))[0]
        assert at == pytest.approx(expected, abs=0.6)
    assert site_nodes(drawn()) == []


@pytest.mark.parametrize("gap_m", [0.0, 0.1, 1.0, 20.0])
def test_numbers_of_sites_near_one_another_stand_apart(gap_m: float) -> None:
    """Five in a row of a model 80 m wide, whose marks are half a metre in radius."""
    made = drawn(sites=marks(*((500_005.0 + gap_m * n, 3_999_970.0) for n in range(4)), (500_004.0, 3_999_969.0)))
    nodes = site_nodes(made)
    xy = np.array([node.props["position"][:2] for node in labels(nodes)])
    distance = np.linalg.norm(xy[:, None] - xy[None], axis=2)[np.triu_indices(5, 1)]
    assert distance.min() > 6.5 * made.mark_m
    # Each pole begins at its own site.
    for number, pole in enumerate(n for n in nodes if n.kind == "line_segments"):
        ball = [n for n in nodes if n.kind == "mesh_simple"][number].props["position"]
        assert pole.props["points"][0, 0] == pytest.approx(ball, abs=1e-4)


def test_numbers_keep_off_the_names_of_points_of_interest() -> None:
    """Two to the north and the south of the middle one of three points."""
    made = drawn(sites=marks((500_040.0, 3_999_971.0), (500_040.5, 3_999_969.0)))
    north, south = (node.props["position"][1] for node in labels(site_nodes(made)))
    name = poi_places(made)[1][1, 1]
    assert north > name + 6 * made.mark_m
    assert south < name - 6 * made.mark_m


def test_the_selected_site_is_pointed_out() -> None:
    made = drawn(sites=marks((500_020.5, 3_999_980.5), (500_025.5, 3_999_980.5)), selection=SelectionDoc(site_rank=2))
    nodes = site_nodes(made)
    assert [n.props["text"] for n in labels(nodes)] == ["L1", "L2"]
    assert labels(nodes)[1].props["font_screen_scale"] > labels(nodes)[0].props["font_screen_scale"]
    colors = [n.props["color"] for n in nodes if n.kind == "mesh_simple"]
    assert colors == [palette.SITE, palette.ACCENT]


def test_only_what_changes_is_drawn_again() -> None:
    found = {layer.name: layer for layer in layers(lambda handle: None)}
    dsm, laid = hill(), overlay(np.zeros((60, 80, 4)))
    state = state_over(dsm)

    def keys(**changes: object) -> tuple[object, ...]:
        made = Drawing.of(dsm, replace(exaggerated(state, 1.0), **changes))  # pyright: ignore[reportArgumentType]
        assert made is not None
        return found["terrain"].key(made), found["sites"].key(made)

    terrain, sites = keys(overlay=laid)
    again, marked = keys(overlay=laid, sites=(SiteMark(1, 37.0, 15.0),))
    assert unchanged(terrain, again)  # pyright: ignore[reportArgumentType]
    assert not unchanged(sites, marked)  # pyright: ignore[reportArgumentType]
    pointed_out = keys(overlay=laid, sites=(SiteMark(1, 37.0, 15.0),), selection=SelectionDoc(site_rank=1))[1]
    assert not unchanged(marked, pointed_out)  # pyright: ignore[reportArgumentType]
    assert not unchanged(terrain, keys()[0])  # pyright: ignore[reportArgumentType]
