"""Labels give way to vehicles and to one another."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from viser import transforms

from server.scene.cameras.labels import Label, Screen, hidden, labels_of
from server.scene.cameras.projection import FOV_RAD, Lens
from server.scene.geometry.canvas import Node
from server.scene.geometry.mark_shapes import label_node

FROM_SOUTH = Lens.of(transforms.SO3.from_x_radians(-np.pi / 2).wxyz.astype(np.float64), np.zeros(3), FOV_RAD, 1.5)
"""Looks north: x is right, z is up."""
SCREEN = Screen(FROM_SOUTH, 1200, 800)


def label(name: str, east: float, up: float, *, away: float = 100.0, text: str = "Point 1") -> Label:
    return Label(name, text, np.array([east, away, up]), 1.0, "bottom-center")


def test_the_nearest_place_gives_way_to_a_point_and_a_point_to_a_conflict() -> None:
    worst, point = label("/worst_label", 0, 0, text="Nearest 2.25 m"), label("/poi_label/a", 1, 0)
    assert hidden([worst, point], [], SCREEN) == {"/worst_label"}
    conflict = label("/now_live/conflict", 1, 0.2, text="In the way: 12 m ahead")
    assert hidden([worst, point, conflict], [], SCREEN) == {"/worst_label", "/poi_label/a"}


def test_labels_beside_each_other_both_stay() -> None:
    assert not hidden([label("/poi_label/a", -20, 0), label("/poi_label/b", 20, 0)], [], SCREEN)


def test_nothing_lies_over_a_vehicle_but_its_own_word_stays() -> None:
    at = np.array([0.0, 100.0, 0.0])
    names = hidden([label("/poi_label/a", 0, -1), label("/vehicle_replay/label", 0, 1)], [(at, 1.6)], SCREEN)
    assert names == {"/poi_label/a"}
    near = np.array([0.0, 10.0, 0.0])
    assert hidden([label("/poi_label/a", 8, -1)], [(near, 1.6)], SCREEN) == {"/poi_label/a"}


def test_what_is_behind_the_camera_hides_nothing() -> None:
    assert not hidden([label("/poi_label/a", 0, 0, away=-5.0), label("/worst_label", 0, 0)], [], SCREEN)


@given(seed=st.integers(0, 2**32 - 1))
def test_of_what_stays_nothing_overlaps(seed: int) -> None:
    random = np.random.default_rng(seed)
    labels = [label(f"/poi_label/{n}", *random.uniform(-30, 30, 2)) for n in range(12)]
    away = hidden(labels, [], SCREEN)
    left = [one for one in labels if one.name not in away]
    assert left
    assert not hidden(left, [], SCREEN)


def test_a_label_on_something_that_moves_stands_where_that_is() -> None:
    parent = Node("/vehicle_replay", "frame", {"position": (5.0, 6.0, 7.0)})
    (found,) = labels_of([parent, label_node("/vehicle_replay/label", "REPLAY", np.array([0.0, 0.0, 1.0]))])
    assert found.at.tolist() == [5.0, 6.0, 8.0]
