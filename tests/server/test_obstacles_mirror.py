"""The server's copy of a map: the same voxels as the deltas add up to, in chunks, at several degrees of detail."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from server.scene.mirror import DETAILS, MapMirror, coarser
from tests.server.obstacle_messages import ORIGIN, delta, voxels_in

KEYS = st.tuples(*[st.integers(-40, 40)] * 3)
STEP = st.tuples(st.booleans(), st.dictionaries(KEYS, st.tuples(st.integers(0, 255), st.booleans()), max_size=20))


@settings(max_examples=60, deadline=None)
@given(st.lists(STEP, max_size=6))
def test_it_is_what_the_deltas_add_up_to(steps: list[Any]) -> None:
    mirror, told = MapMirror("radar"), {}
    for whole, voxels in steps:
        told = ({} if whole else told) | voxels
        values = list(voxels.values())
        mirror.fold(delta(list(voxels), [p for p, _ in values], [e for _, e in values], whole=whole))
    assert voxels_in(mirror) == {key: value for key, value in told.items() if value[0] > 127}
    boxes = mirror.boxes()
    assert boxes[0] == mirror.voxel_count
    assert list(boxes) == sorted(boxes, reverse=True)
    assert len(mirror.voxels().keys) == sum(len(mirror.chunk(key).keys) for key in mirror.chunk_keys)  # pyright: ignore


def test_only_touched_chunks_are_dirty_and_emptied_ones_are() -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([(0, 0, 0), (100, 0, 0), (-1, 0, 0)]))
    assert mirror.taken_dirty() == {(0, 0, 0), (3, 0, 0), (-1, 0, 0)}
    mirror.fold(delta([(1, 0, 0)]))
    assert mirror.taken_dirty() == {(0, 0, 0)}
    mirror.fold(delta([(100, 0, 0)], 20))
    assert mirror.taken_dirty() == {(3, 0, 0)}
    assert mirror.chunk((3, 0, 0)) is None
    mirror.fold(delta([], whole=True))
    assert mirror.taken_dirty() == {(0, 0, 0), (-1, 0, 0)}


def test_another_origin_or_resolution_begins_afresh() -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([(0, 0, 0)]))
    before = mirror.generation
    mirror.fold(delta([(5, 5, 5)], resolution_m=0.5))
    assert mirror.generation == before + 1
    assert voxels_in(mirror).keys() == {(5, 5, 5)}


@pytest.mark.parametrize(
    ("since", "revision", "whole", "complete"),
    [(4, 5, False, True), (3, 5, False, False), (2, 4, False, True), (0, 9, True, True)],
    ids=["follows", "gap", "another part", "whole"],
)
def test_a_missing_part_is_noticed(since: int, revision: int, whole: bool, complete: bool) -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([(0, 0, 0)], revision=4, whole=True))
    assert mirror.fold(delta([(1, 0, 0)], since=since, revision=revision, whole=whole)) is complete


def test_what_does_not_belong_together_is_refused_and_absurd_keys_are_left_out() -> None:
    mirror = MapMirror("radar")
    broken = delta([(0, 0, 0), (1, 0, 0)])
    with pytest.raises(ValueError, match="2 keys, 1 prob"):
        mirror.fold(type(broken)(**{**_fields(broken), "probability": b"\xff"}))
    mirror.fold(delta([(2_000_000_000, 0, 0), (1, 2, 3)]))
    assert voxels_in(mirror).keys() == {(1, 2, 3)}
    assert mirror.origin == ORIGIN


def test_a_coarse_box_is_as_probable_as_its_most_probable_voxel_and_explained_if_all_are() -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([(0, 0, 0), (1, 1, 1), (2, 0, 0), (3, 0, 0)], [200, 250, 180, 170], [1, 0, 1, 1]))
    boxes = coarser(mirror.voxels(), 2)
    assert boxes.resolution_m == 2.0
    assert boxes.keys.tolist() == [[0, 0, 0], [1, 0, 0]]
    assert boxes.probability.tolist() == [250, 180]
    assert boxes.explained.tolist() == [False, True]
    assert mirror.boxes()[DETAILS.index(2)] == 2


def _fields(message: Any) -> dict[str, Any]:
    return {name: getattr(message, name) for name in message.__dataclass_fields__}
