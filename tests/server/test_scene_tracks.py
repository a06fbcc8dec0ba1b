"""Moving objects in the 3D view: at their place, their uncertainty to scale, the dangerous ones not by colour alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from server.scene.geometry import palette
from server.scene.layers.track_layer import ARROW_S, MOST, SIGMAS, ellipse_enu_m, track_nodes
from tests.server.test_scene_obstacles import placed
from tests.server.track_messages import track, tracks_status


def test_an_object_stands_at_its_place_and_its_arrow_ends_where_it_will_be() -> None:
    drawing, placing = placed()
    here = tracks_status(tracks=(track(enu_m=(5.0, 8.0, 6.0), velocity_enu_m_s=(2.0, -1.0)),), origin=placing.origin)
    nodes = {node.name: node for node in track_nodes(drawing, placing, here, prefix="/n")}
    expected = drawing.frame.scene_from_model(
        placing.model_from_enu(np.array([[5.0, 8.0, 6.0], [5.0 + 2 * ARROW_S, 8.0 - ARROW_S, 6.0]]))
    )
    assert np.array(nodes["/n/track/7/at"].props["position"]) == pytest.approx(expected[0])
    shaft = nodes["/n/track/7/arrow"].props["points"][0]
    assert shaft == pytest.approx(expected, abs=1e-3)
    assert nodes["/n/track/7/words"].props["text"] == "7: 30 m, 2.2 m/s, for 2 s"
    assert nodes["/n/track/7/closest_words"].props["text"] == "7: passes 0.4 m away in 5 s"


def test_a_dangerous_one_is_thicker_and_says_where_it_passes() -> None:
    drawing, placing = placed()
    calm, close = track(1, dangerous=False), track(2)
    nodes = {n.name: n for n in track_nodes(drawing, placing, tracks_status(tracks=(calm, close)), prefix="")}
    assert nodes["/track/2/arrow"].props["thickness"] > nodes["/track/1/arrow"].props["thickness"]
    assert nodes["/track/2/at"].props["color"] == palette.INSIDE
    assert nodes["/track/1/at"].props["color"] != palette.INSIDE
    assert "/track/1/closest" not in nodes


def test_what_stands_still_has_no_arrow() -> None:
    drawing, placing = placed()
    still = track(moving=False, dangerous=False)
    names = [n.name for n in track_nodes(drawing, placing, tracks_status(tracks=(still,)), prefix="")]
    assert names == ["/track/7/at", "/track/7/ellipse", "/track/7/words"]


@pytest.mark.parametrize("covariance", [(4.0, 0.0, 1.0), (2.5, 1.5, 2.5), (0.0, 0.0, 0.0), (1.0, 0.0, -1e-12)])
def test_the_ellipse_is_that_of_the_covariance(covariance: tuple[float, float, float]) -> None:
    outline = ellipse_enu_m(track(covariance_m2=covariance))
    ee, en, nn = covariance
    spread = np.array([[ee, en], [en, nn]])
    assert np.isfinite(outline).all()
    for angle in np.linspace(0, math.pi, 7):
        way = np.array([math.cos(angle), math.sin(angle)])
        # A polygon of 24 corners reaches to within one per cent of the ellipse's support line.
        assert (outline @ way).max() == pytest.approx(SIGMAS * math.sqrt(max(way @ spread @ way, 0.0)), rel=0.01)


def test_hidden_stale_or_absent_ones_are_not_drawn_and_many_are_cut() -> None:
    drawing, placing = placed()
    view = drawing.state.view.model_copy(update={"show_tracks": False})
    hidden = replace(drawing, state=replace(drawing.state, view=view))
    assert track_nodes(hidden, placing, tracks_status(), prefix="") == []
    assert track_nodes(drawing, placing, tracks_status("stale"), prefix="") == []
    assert track_nodes(drawing, placing, None, prefix="") == []
    crowd = tracks_status(tracks=tuple(track(n, dangerous=False) for n in range(60)))
    assert len(track_nodes(drawing, placing, crowd, prefix="")) == 4 * MOST


def test_an_origin_of_its_own_moves_nothing() -> None:
    drawing, placing = placed()
    moved = replace(placing.origin, lat_deg=placing.origin.lat_deg + 1.0 / 111_195)
    at = [
        np.array(track_nodes(drawing, placing, status, prefix="")[0].props["position"])
        for status in (
            tracks_status(tracks=(track(enu_m=(3.0, 5.0, 6.0)),), origin=placing.origin),
            tracks_status(tracks=(track(enu_m=(3.0, 4.0, 6.0)),), origin=moved),
        )
    ]
    assert at[0] == pytest.approx(at[1], abs=0.02)
