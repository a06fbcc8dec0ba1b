"""Colours of the path: nothing looks safer than the certificate says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from server.scene.geometry import palette
from server.scene.geometry.stage import Drawing
from server.scene.layers.flight_layers import flight_nodes, path_clearance_m
from tests.server.scene_fixtures import hill, plan_over, state_over

DSM = hill()


@pytest.mark.parametrize(
    ("clearance_m", "color"),
    [
        (3.0, palette.SAFE),
        (2.99, palette.CLOSE),
        (0.0, palette.INSIDE),
        (-1.0, palette.INSIDE),
        (np.nan, palette.INSIDE),
        (-np.inf, palette.INSIDE),
    ],
)
def test_clearance_has_three_colours(clearance_m: float, color: tuple[int, int, int]) -> None:
    assert tuple(palette.clearance_rgb(np.array([clearance_m]), 3.0)[0]) == color


def test_a_requirement_below_zero_makes_nothing_inside_safe() -> None:
    assert tuple(palette.clearance_rgb(np.array([0.0]), -1.0)[0]) == palette.INSIDE


def test_a_piece_never_looks_safer_than_its_leg() -> None:
    legs = np.full(7, 5.0)
    legs[2] = 0.5
    clearance = path_clearance_m(replace(plan_over(DSM), flown_distance_m=legs))
    assert (clearance[20:30] == 0.5).all()
    assert np.delete(clearance, np.s_[20:30]) == pytest.approx(5.0, abs=0.01)


def test_unknown_ground_below_is_no_clearance() -> None:
    plan = plan_over(DSM)
    ground = plan.path_ground_alt_dsm_m.copy()
    ground[10] = np.nan
    clearance = path_clearance_m(replace(plan, path_ground_alt_dsm_m=ground))
    assert np.isneginf(clearance[[9, 10]]).all()


@pytest.mark.parametrize(
    ("distance_m", "words"), [(0.844, "Nearest 0.84 m"), (0.0, "Inside terrain"), (-np.inf, "Unknown terrain")]
)
def test_the_worst_point_says_how_near_it_is(distance_m: float, words: str) -> None:
    state = state_over(DSM)
    plan = replace(plan_over(DSM), flown_distance_m=np.full(7, distance_m))
    drawing = Drawing.of(DSM, replace(state, plan=plan))
    assert drawing is not None
    labels = [node.props["text"] for node in flight_nodes(drawing) if node.kind == "label"]
    assert labels == [words]


def test_where_the_path_begins_to_turn_around_a_shape_stands_which() -> None:
    state, plan = state_over(DSM), plan_over(DSM)
    around = ("exclusion circle 1", "exclusion circle 1", "inclusion polygon 2")
    turning = replace(plan, around_m=plan.path_m[[20, 24, 40]], around=around)
    drawing = Drawing.of(DSM, replace(state, plan=turning))
    assert drawing is not None
    labels = [node.props["text"] for node in flight_nodes(drawing) if node.kind == "label"]
    assert labels[:2] == ["around exclusion circle 1", "around inclusion polygon 2"]
