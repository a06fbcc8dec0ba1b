"""The bricks of a map's blocks: against a plain dictionary, at the edges of blocks and of memory, through growth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.voxels import map as map_module
from mapping.voxels import store
from mapping.voxels.map import VoxelMap
from tests.mapping.clouds import car_clouds, forest_clouds, gicp_clouds
from tests.mapping.test_voxels import CLAMP, SMALL_BYTES, content

Key = tuple[int, ...]

FARTHEST = (1 << 30) - 8
"""A voxel's key: the last block but one before keys end."""
HIT, MISS, LOWEST, HIGHEST = (math.log(p / (1.0 - p)) for p in (0.7, 0.4, *CLAMP))

STEPS = ["hits", "wide", "paged", "near", "assign", "free", "explain", "clear"]


class PlainMap:
    """What a map of 1 m is to be: two dictionaries and a set."""

    def __init__(self) -> None:
        self.log_odds: dict[Key, float] = {}
        self.explained: dict[Key, bool] = {}
        self.ever_hit: set[Key] = set()

    def scan(self, hits: list[Key], explained: list[bool], misses: set[Key]) -> None:
        verdicts: dict[Key, bool] = {}
        for key, truth in zip(hits, explained, strict=True):
            verdicts[key] = verdicts.get(key, True) and truth
        for key in misses - verdicts.keys():
            self.log_odds[key] = max(LOWEST, self.log_odds.get(key, 0.0) + MISS)
        for key, truth in verdicts.items():
            self.log_odds[key] = min(HIGHEST, self.log_odds.get(key, 0.0) + HIT)
            self.explained[key] = truth and (key not in self.ever_hit or self.explained[key])
            self.ever_hit.add(key)

    def assign(self, keys: list[Key], occupied: list[bool]) -> None:
        for key, truth in zip(keys, occupied, strict=True):
            self.log_odds[key] = HIGHEST if truth else LOWEST
            if truth:
                self.explained[key] = False
                self.ever_hit.add(key)

    def assert_is(self, voxels: VoxelMap) -> None:
        held = content(voxels)
        assert held.keys() == self.log_odds.keys()
        assert {key for key, (_, explained) in held.items() if explained} == {
            key for key in held if self.explained.get(key)
        }
        expected = 1.0 / (1.0 + np.exp([-self.log_odds[key] for key in held]))
        np.testing.assert_allclose([probability for probability, _ in held.values()], expected, atol=1e-6)


def along_axes(rng: np.random.Generator, centre: Key) -> tuple[list[Key], set[Key]]:
    """Ends of rays from the middle of ``centre``, and the voxels on their way, which no rounding can be in doubt of."""
    ends, crossed = [], set()
    for _ in range(int(rng.integers(1, 12))):
        axis, length = int(rng.integers(3)), int(rng.integers(-20, 21))
        way = [list(centre) for _ in range(abs(length) + 1)]
        for n, key in enumerate(way):
            key[axis] += n if length > 0 else -n
        keys = [(x, y, z) for x, y, z in way]
        ends.append(keys[-1])
        crossed |= set(keys[:-1])
    return ends, crossed


@settings(max_examples=30)
@given(
    st.integers(0, 1_000_000),
    st.lists(st.sampled_from(STEPS), min_size=3, max_size=12),
    st.sampled_from([0, 1_000_000, -1_000_000]),
)
def test_whatever_is_done_to_a_map_it_is_the_plain_one(seed: int, steps: list[str], shift: int) -> None:
    rng = np.random.default_rng(seed)
    voxels, plain = VoxelMap(resolution_m=1.0, memory_limit_bytes=SMALL_BYTES), PlainMap()
    for step in steps:
        points = shift + rng.normal(0.0, rng.uniform(1.0, 12.0), (int(rng.integers(1, 40)), 3))
        keys = [(x, y, z) for x, y, z in np.floor(points).astype(int).tolist()]
        truths = (rng.random(len(keys)) < 0.5).tolist()
        if step == "clear":
            voxels.clear()
            plain = PlainMap()
        elif step == "hits":
            voxels.insert_hits(points, explained=truths)
            plain.scan(keys, truths, set())
        elif step in ("wide", "paged", "near"):
            ends, crossed = along_axes(rng, keys[0])
            truths = (rng.random(len(ends)) < 0.5).tolist()
            origin, reach_m = voxels.centres([keys[0]])[0], 20.5 if step == "near" else math.inf
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(map_module, "LARGEST_GRID", 0 if step == "paged" else map_module.LARGEST_GRID)
                patch.setattr(map_module, "VOXELS_FOR_A_STEP", math.inf)
                voxels.insert(voxels.centres(ends), origin_enu=origin, max_range_m=reach_m, explained=truths)
            plain.scan(ends, truths, crossed)
        elif step == "explain":
            voxels.mark_explained(keys, truths)
            plain.explained |= {key: truth for key, truth in zip(keys, truths, strict=True) if key in plain.log_odds}
        else:
            occupied = truths if step == "assign" else [False] * len(keys)
            voxels.assign(keys, occupied)
            plain.assign(keys, occupied)
        plain.assert_is(voxels)
        assert_counts_agree(voxels)


def assert_counts_agree(voxels: VoxelMap) -> None:
    """What a map counts is what it lists, and each voxel is found where it is listed."""
    keys, probability, explained = voxels.known()
    assert len(keys) == voxels.voxel_count == len(np.unique(keys, axis=0))
    assert (probability > 0.5).sum() == voxels.occupied_count == len(voxels.occupied_keys())
    assert (explained & (probability > 0.5)).sum() == voxels.explained_count
    assert np.array_equal(voxels.probability(voxels.centres(keys)), probability)
    assert np.array_equal(voxels.explained(voxels.centres(keys)), explained)


@pytest.mark.parametrize("corner", [0, -8, FARTHEST, -FARTHEST - 8])
def test_each_voxel_of_a_block_is_its_own_in_whatever_order_they_come(corner: int) -> None:
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=SMALL_BYTES)
    keys = corner + np.stack(np.meshgrid(*[np.arange(8)] * 3), axis=-1).reshape(-1, 3)
    np.random.default_rng(7).shuffle(keys)
    for count in (1, 8, 65, 300, 512):
        voxels.clear()
        voxels.insert_hits(voxels.centres(keys[:count]))
        voxels.assign(keys[: count // 2], False)
        assert {tuple(key): p for key, (p, _) in content(voxels).items()} == {
            tuple(key): pytest.approx(0.12 if n < count // 2 else 0.7) for n, key in enumerate(keys[:count].tolist())
        }
        assert np.isnan(voxels.probability(voxels.centres(keys[count:]))).all()
    assert voxels.blocks.counts[store.N_BLOCKS] == 1
    assert voxels.blocks.counts[store.N_CHUNKS] == 8


@settings(max_examples=15)
@given(st.integers(0, 1_000_000), st.integers(100_000, 400_000))
def test_no_map_takes_more_than_its_limit_and_none_loses_what_it_has(seed: int, limit_bytes: int) -> None:
    rng = np.random.default_rng(seed)
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=limit_bytes)
    for life in range(3):
        known: set[tuple[int, ...]] = set()
        scattered = bool(rng.integers(2))
        for _ in range(6):
            spread_m = 3_000.0 if scattered else 60.0
            points = rng.uniform(-spread_m, spread_m, (400, 3))
            voxels.insert_hits(points)
            if not scattered:
                origin = rng.uniform(-20.0, 20.0, 3)
                with pytest.MonkeyPatch.context() as patch:
                    patch.setattr(map_module, "LARGEST_GRID", int(rng.integers(2)) * map_module.LARGEST_GRID)
                    voxels.insert(points[:40] / 3.0, origin_enu=origin / 3.0, max_range_m=math.inf)
            assert voxels.size_bytes <= limit_bytes
            assert_counts_agree(voxels)
            now = set(map(tuple, voxels.known()[0].tolist()))
            assert known <= now
            known = now
            refused = voxels.refused_updates
            assert voxels.is_full or refused == 0
        hits = voxels.occupied()[:20]
        before = voxels.probability(hits)
        voxels.insert_hits(hits)
        assert np.all((voxels.probability(hits) > before) | (before > 0.969)), f"life {life}"
        voxels.clear()
        assert not voxels.is_full
        assert (voxels.voxel_count, voxels.refused_updates) == (0, 0)


def test_an_emptied_map_has_room_again_in_other_proportions() -> None:
    """Scattered points fill it with blocks, whole blocks with chunks."""
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=400_000)
    voxels.insert_hits(np.random.default_rng(8).uniform(-3_000.0, 3_000.0, (5_000, 3)))
    assert voxels.is_full
    voxels.clear()
    whole = np.stack(np.meshgrid(*[np.arange(24) + 0.5] * 3), axis=-1).reshape(-1, 3)
    voxels.insert_hits(whole)
    assert voxels.occupied_count == len(whole)
    assert voxels.refused_updates == 0


@pytest.mark.parametrize("before", ["whole", "scattered"])
@pytest.mark.parametrize("now", ["whole", "scattered"])
def test_an_emptied_map_holds_as_much_as_a_new_one(before: str, now: str) -> None:
    """Whatever it was full of: a ball known whole, or scattered points."""
    side = np.arange(-38, 38) + 0.5
    ball = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
    ball = ball[np.argsort(np.linalg.norm(ball, axis=1))][:200_000]
    looks = {"whole": ball, "scattered": np.random.default_rng(12).uniform(-3_000.0, 3_000.0, (4_000, 3))}
    new, emptied = (VoxelMap(resolution_m=1.0, memory_limit_bytes=500_000) for _ in range(2))
    for share in (0.2, 1.0, 1.0):
        emptied.insert_hits(looks[before][: int(share * len(looks[before]))])
        revision = emptied.revision
        emptied.clear()
        assert emptied.changed_since(revision).whole
        assert emptied.revision > revision
        assert (emptied.voxel_count, emptied.refused_updates, emptied.is_full) == (0, 0, False)
    new.insert_hits(looks[now])
    emptied.insert_hits(looks[now])
    assert new.is_full
    assert emptied.refused_updates == new.refused_updates > 0
    assert content(emptied) == content(new)
    assert emptied.size_bytes <= 500_000


@pytest.mark.parametrize("largest_grid", [0, 512**3])
def test_of_the_last_room_of_a_map_hits_come_first(largest_grid: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wall far away, and more to see on the way than there is room for."""
    monkeypatch.setattr(map_module, "LARGEST_GRID", largest_grid)
    monkeypatch.setattr(map_module, "VOXELS_FOR_A_STEP", math.inf)
    rng = np.random.default_rng(3)
    wall = np.column_stack([rng.normal(60.0, 0.5, 90), rng.uniform(-30.0, 30.0, 90), rng.uniform(0.0, 10.0, 90)])
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=500_000 if largest_grid else 27_000)
    if largest_grid:  # the grid is no larger than the map's memory, of which little is left
        voxels.assign([[-10_000, 8 * block, 0] for block in range(955)], False)
    voxels.insert(wall, origin_enu=(0.1, 0.2, 5.3), max_range_m=200.0)
    assert voxels.is_full
    assert voxels.refused_updates > 0
    assert (voxels.probability(wall) > 0.5).all()
    assert_counts_agree(voxels)


@pytest.mark.parametrize("is_emptied", [False, True])
def test_a_map_with_little_room_left_has_no_block_without_a_voxel(is_emptied: bool) -> None:
    """Dense ground first, then points far apart: what is left goes into blocks that hold them."""
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=1_000_000)
    whole = np.stack(np.meshgrid(*[np.arange(8) + 0.5] * 3), axis=-1).reshape(-1, 3)
    if is_emptied:
        voxels.insert_hits(np.random.default_rng(10).uniform(-3_000.0, 3_000.0, (300, 3)))
        voxels.clear()
    for block in range(620):
        voxels.insert_hits(whole + np.array([8.0 * block, 0.0, 0.0]))
    assert not voxels.is_full
    scattered = np.random.default_rng(11).uniform(1e4, 2e4, (400, 3))
    voxels.insert_hits(scattered)
    counts = voxels.blocks.counts
    assert np.all(voxels.blocks.filled[: counts[store.N_BLOCKS]] > 0)
    assert voxels.is_full
    kept = int((voxels.probability(scattered) > 0.5).sum())
    assert kept == counts[store.N_BLOCKS] - 620 > 100
    assert voxels.refused_updates == 400 - kept


@pytest.mark.parametrize("cleared_at", [None, 9, 600])
def test_nothing_is_lost_while_blocks_move_to_a_larger_table(
    cleared_at: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "FIRST_TABLE", 4)
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=SMALL_BYTES)
    rng, moving = np.random.default_rng(9), 0
    points = rng.uniform(-500.0, 500.0, (1_500, 3))
    first = 0
    for n in range(len(points)):
        if n == cleared_at:
            assert voxels.blocks.counts[store.N_ENTERED] > 0, "in the middle of a growth"
            voxels.clear()
            first = n
        before = int(voxels.blocks.counts[store.N_ENTERED])
        voxels.insert_hits(points[n : n + 1])
        moved = int(voxels.blocks.counts[store.N_ENTERED]) - before
        assert moved <= store.ENTERED_AT_ONCE
        moving += moved > 0
        if n % 50 == 0 or n < 40:
            assert (voxels.probability(points[first : n + 1]) > 0.69).all()
            assert np.isnan(voxels.probability(points[:first])).all()
    assert moving > 100
    assert_counts_agree(voxels)


SPARSE = {"car": car_clouds, "gicp": gicp_clouds}


@pytest.mark.parametrize("name", sorted(SPARSE))
def test_what_a_laser_sees_costs_at_most_eight_bytes_a_voxel(name: str, shared_data: Path) -> None:
    """Two scans of a street each: a block of what they pass through is known to a fifth."""
    voxels = VoxelMap(resolution_m=0.2)
    for points, origin in SPARSE[name](shared_data):
        voxels.insert(points, origin_enu=origin, max_range_m=40.0)
    blocks = voxels.blocks.counts[store.N_BLOCKS]
    assert voxels.voxel_count / (blocks * store.VOXELS) < 0.3
    assert voxels.size_bytes / voxels.voxel_count <= 8.0


def test_a_laser_in_a_forest_costs_at_most_eight_bytes_a_voxel() -> None:
    voxels = VoxelMap(resolution_m=0.2)
    for points, origin in forest_clouds(3):
        voxels.insert(points, origin_enu=origin, max_range_m=50.0)
    assert voxels.voxel_count > 500_000
    assert voxels.size_bytes / voxels.voxel_count <= 8.0
