"""Maps that travel in parts come out as they went in, and what was said last counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.voxels.map import VoxelMap
from telemetry.perception.map_changes import LEAST_APART_S, ChangeTeller, told_probability
from telemetry.topics import deltas as d
from telemetry.topics.deltas import FoldedMap, in_parts
from telemetry.topics.obstacles import MapDelta, MapOrigin

ORIGIN = MapOrigin(45.0, 10.0, 120.0)
HEAD = MapDelta("radar", 1.0, 2.0, 3, True, 0, 1, ORIGIN, 0.5, b"", b"", b"")


@given(st.lists(st.lists(st.tuples(*[st.integers(-5, 5)] * 3), max_size=8), min_size=1, max_size=6), st.booleans())
@settings(max_examples=60)
def test_folding_is_the_dictionary_of_what_was_said_last(steps: list[list[tuple[int, int, int]]], again: bool) -> None:
    folded, known = FoldedMap(), dict[tuple[int, int, int], int]()
    for number, step in enumerate(steps):
        whole = again and number == len(steps) // 2
        step = list(dict.fromkeys(step))
        if whole:
            known.clear()
        known |= dict.fromkeys(step, number)
        parts = in_parts(
            replace(HEAD, whole=whole),
            np.array(step, np.int32).reshape(-1, 3),
            np.full(len(step), number, np.uint8),
            np.zeros(len(step), np.uint8),
        )
        folded = folded.folded(parts)
    found = dict(zip(map(tuple, folded.voxels.keys.tolist()), folded.voxels.probability.tolist(), strict=True))
    assert found == known
    assert FoldedMap().folded(folded.whole()).voxels.keys.tolist() == folded.voxels.keys.tolist()


def test_large_maps_are_cut_and_empty_ones_told() -> None:
    keys = np.arange(3 * 50_001, dtype=np.int32).reshape(-1, 3)
    parts = in_parts(HEAD, keys, np.full(len(keys), 200, np.uint8), np.zeros(len(keys), np.uint8))
    assert [(part.part, part.parts) for part in parts] == [(0, 3), (1, 3), (2, 3)]
    assert max(len(part.probability) for part in parts) == d.MOST_VOXELS
    np.testing.assert_array_equal(FoldedMap().folded(parts).voxels.keys, keys)
    (empty,) = in_parts(HEAD, keys[:0], np.empty(0, np.uint8), np.empty(0, np.uint8))
    assert FoldedMap().folded([*parts, empty]).voxels.keys.shape == (0, 3)
    assert FoldedMap().whole() == []


def test_what_is_told_adds_up_to_the_map() -> None:
    the_map, teller, folded = VoxelMap(resolution_m=0.5), ChangeTeller("radar", 0.0), FoldedMap()
    rng = np.random.default_rng(1)
    for step in range(12):
        if step == 6:
            the_map.clear()
        if step == 9:
            the_map = VoxelMap(resolution_m=0.5)
        points = rng.uniform(-8, 8, (200, 3))
        the_map.insert(points, origin_enu=np.zeros(3), max_range_m=20.0, explained=points[:, 2] < 0)
        before = folded.last
        told = teller.changes(the_map, ORIGIN, float(step))
        folded = folded.folded(told)
        occupied = folded.voxels.occupied()
        order = np.lexsort(the_map.occupied_keys().T[::-1])
        np.testing.assert_array_equal(occupied.keys, the_map.occupied_keys()[order])
        centres = (occupied.keys + 0.5) * 0.5
        np.testing.assert_array_equal(occupied.probability, told_probability(the_map.probability(centres)))
        np.testing.assert_array_equal(occupied.explained, the_map.explained(centres))
        assert told[0].whole == (step in (0, 6, 9))
        began_s = 9.0 if step >= 9 else LEAST_APART_S
        assert {part.began_mono_s for part in told} == {began_s}, "the one that was emptied is the same map"
        assert told[0].whole or before is None or told[0].since == before.revision
    assert teller.changes(the_map, ORIGIN, 20.0) == []
    assert teller.changes(the_map, None, 20.0) == []
    teller.forget()
    again = teller.changes(the_map, ORIGIN, 20.0)[0]
    assert (again.whole, again.began_mono_s) == (True, 9.0), "the same map, told again"
    another = VoxelMap(resolution_m=0.5)
    assert teller.changes(another, ORIGIN, 9.0)[0].began_mono_s > 9.0


def test_occupied_is_above_one_half_and_nothing_else() -> None:
    told = told_probability(np.array([0.0, 0.4999, 0.5, 0.50001, 0.7, 1.0]))
    assert (told > 127).tolist() == [False, False, False, True, True, True]
    assert told[-1] == 255
    assert told[4] / 255 == pytest.approx(0.7, abs=0.003)
