"""Occupancy maps: the rules of a scan, what is said about voxels, what has changed, what does not fit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.errors import CapacityError, ParameterError
from mapping.voxels import map as map_module
from mapping.voxels.map import VoxelMap
from mapping.voxels.store import N_PAGES
from tests.reference.octomap_rules import SlowMap

SMALL_BYTES = 2_000_000
CLAMP = (0.12, 0.97)
ORIGIN = (0.13, -0.21, 0.37)

coordinates = st.floats(-6.0, 6.0, width=32)
clouds = arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)), elements=coordinates)


def small_map(resolution_m: float = 0.5, **options: float) -> VoxelMap:
    return VoxelMap(resolution_m=resolution_m, memory_limit_bytes=SMALL_BYTES, **options)  # type: ignore[arg-type]


def content(voxels: VoxelMap) -> dict[tuple[int, ...], tuple[float, bool]]:
    """Probability and explained by key."""
    keys, probability, explained = voxels.known()
    values = zip(probability.tolist(), explained.tolist(), strict=True)
    return dict(zip(map(tuple, keys.tolist()), values, strict=True))


def test_a_hit_is_occupied_and_the_way_to_it_is_free() -> None:
    voxels = small_map()
    voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    assert voxels.occupied().tolist() == [[2.25, 0.25, 0.25]]
    assert voxels.probability([[2.25, 0.25, 0.25], [1.1, 0.1, 0.1], [2.75, 0.25, 0.25]]) == pytest.approx(
        [0.7, 0.4, math.nan], nan_ok=True
    )
    assert (voxels.voxel_count, voxels.occupied_count) == (5, 1)


def test_beyond_the_range_a_ray_is_carved_but_hits_nothing() -> None:
    voxels = small_map()
    voxels.insert([[9.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=3.0)
    assert voxels.occupied().shape == (0, 3)
    assert voxels.probability([[2.75, 0.25, 0.25], [3.75, 0.25, 0.25]]) == pytest.approx([0.4, math.nan], nan_ok=True)


def test_each_voxel_is_updated_once_per_scan_and_a_hit_comes_before_misses() -> None:
    voxels = small_map()
    through = [[4.25, 0.25, 0.25], [2.25, 0.25, 0.25], [2.3, 0.3, 0.3]]
    voxels.insert(through, origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    assert voxels.probability([[2.25, 0.25, 0.25], [1.25, 0.25, 0.25]]) == pytest.approx([0.7, 0.4])


def test_hits_without_rays_leave_free_space_unknown() -> None:
    voxels = small_map(1.0)
    voxels.insert_hits([[-3.5, 2.5, 1e5], [-3.4, 2.6, 1e5 + 0.1]])
    assert voxels.occupied_keys().tolist() == [[-4, 2, 100_000]]
    assert voxels.voxel_count == 1


def test_probabilities_stay_within_the_clamp() -> None:
    voxels = small_map()
    for _ in range(20):
        voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    assert voxels.probability([[2.25, 0.25, 0.25], [1.25, 0.25, 0.25]]) == pytest.approx([0.97, 0.12])
    before = voxels.revision
    voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    assert voxels.revision == before, "at the clamp nothing changes any more"


@settings(max_examples=60)
@given(st.integers(0, 1_000_000), st.integers(1, 30), st.booleans())
def test_as_octomaps_rules_written_slowly(seed: int, count: int, discretize: bool) -> None:
    """At places anywhere: on a border of voxels it is rounding that decides."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-6.0, 6.0, (count, 3))
    x, y, z = rng.uniform(-0.9, 0.9, 3).tolist()
    fast, slow = small_map(), SlowMap(0.5, 0.7, 0.4, CLAMP)
    for part in (points, points[::2] * 0.9):
        fast.insert(part, origin_enu=(x, y, z), max_range_m=5.0, discretize=discretize)
        slow.insert([(p[0], p[1], p[2]) for p in part.tolist()], (x, y, z), 5.0, discretize)
    expected = {key: (pytest.approx(1 / (1 + math.exp(-odds))), False) for key, odds in slow.voxels.items()}
    assert content(fast) == expected


@given(clouds, st.randoms(use_true_random=False), st.floats(1.0, 12.0))
def test_the_order_of_points_does_not_matter(points: np.ndarray, random: object, max_range_m: float) -> None:
    shuffled = points[np.argsort([random.random() for _ in points])]  # type: ignore[attr-defined]
    a, b = small_map(), small_map()
    a.insert(points, origin_enu=ORIGIN, max_range_m=max_range_m)
    b.insert(np.concatenate([shuffled, shuffled]), origin_enu=ORIGIN, max_range_m=max_range_m)
    assert content(a) == content(b)


@given(clouds, st.integers(-3, 3))
def test_a_map_moved_by_whole_voxels_is_the_same_map(points: np.ndarray, step: int) -> None:
    points = np.round(points * 8) / 8
    origin, shift = np.array([0.125, 0.25, 0.375]), np.array([step * 4.0, -step * 400_000.0, step * 8.0])
    a, b = small_map(), small_map()
    a.insert(points, origin_enu=origin, max_range_m=8.0)
    b.insert(points + shift, origin_enu=origin + shift, max_range_m=8.0)
    moved = {tuple(np.add(key, (shift / 0.5).astype(int))): value for key, value in content(a).items()}
    assert moved == content(b)


@given(clouds)
def test_a_scan_too_wide_for_the_grid_gives_the_same_map(points: np.ndarray) -> None:
    around, boxed, paged = small_map(), small_map(), small_map()
    for part in (points, points[:5], points[::3] * 0.7):
        around.insert(part, origin_enu=ORIGIN, max_range_m=14.0)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(map_module, "VOXELS_FOR_A_STEP", math.inf)
            boxed.insert(part, origin_enu=ORIGIN, max_range_m=math.inf)
            patch.setattr(map_module, "LARGEST_GRID", 0)
            paged.insert(part, origin_enu=ORIGIN, max_range_m=math.inf)
    assert content(around) == content(boxed) == content(paged)
    assert around.blocks.counts[N_PAGES] == boxed.blocks.counts[N_PAGES] == 0 < paged.blocks.counts[N_PAGES]


@given(st.lists(clouds, min_size=2, max_size=4), st.integers(0, 3))
def test_who_follows_the_changes_has_the_map(scans: list[np.ndarray], cleared_after: int) -> None:
    voxels = small_map()
    follower: dict[tuple[int, ...], tuple[float, bool]] = {}
    revision = voxels.revision
    for number, points in enumerate(scans):
        voxels.insert(points, origin_enu=ORIGIN, max_range_m=4.0, explained=points[:, 0] > 0)
        if number == cleared_after:
            voxels.clear()
            voxels.insert_hits(points[:2])
        changes = voxels.changed_since(revision)
        if changes.whole:
            follower.clear()
        keys = list(map(tuple, changes.keys.tolist()))
        assert len(set(keys)) == len(keys)
        values = zip(changes.probability.tolist(), changes.explained.tolist(), strict=True)
        follower |= dict(zip(keys, values, strict=True))
        revision = changes.revision
        assert follower == content(voxels)
    assert len(voxels.changed_since(revision).keys) == 0


@given(clouds, clouds, st.booleans())
def test_changes_name_the_voxels_that_changed_and_no_neighbours(
    before: np.ndarray, now: np.ndarray, with_rays: bool
) -> None:
    voxels = small_map()
    voxels.insert(before, origin_enu=ORIGIN, max_range_m=4.0, explained=before[:, 0] > 0)
    was, revision = content(voxels), voxels.revision
    if with_rays:
        voxels.insert(now, origin_enu=ORIGIN, max_range_m=5.0)
    else:
        voxels.insert_hits(now)
    changes = voxels.changed_since(revision)
    assert not changes.whole
    changed = {key for key, value in content(voxels).items() if was.get(key) != value}
    assert sorted(map(tuple, changes.keys.tolist())) == sorted(changed)


def test_changes_can_leave_out_what_no_point_ever_lay_in() -> None:
    voxels = small_map()
    voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    before = voxels.revision
    voxels.insert([[4.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    changed = voxels.changed_since(before, ever_hit_only=True)
    assert not changed.whole
    assert sorted(changed.keys.tolist()) == [[4, 0, 0], [8, 0, 0]]


def test_more_changes_than_are_kept_come_as_the_whole_map() -> None:
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=300_000)
    points = np.stack(np.meshgrid(*[np.arange(16) + 0.5] * 3), axis=-1).reshape(-1, 3)
    for _ in range(3):
        voxels.insert_hits(points)
    changes = voxels.changed_since(1)
    assert changes.whole
    assert len(changes.keys) == voxels.voxel_count == 4096


def test_a_revision_from_another_life_gets_the_whole_map() -> None:
    voxels = small_map()
    voxels.insert_hits([[1.0, 1.0, 1.0]])
    assert voxels.changed_since(99).whole


def test_one_unexplained_point_makes_a_voxel_unexplained_for_good() -> None:
    voxels = small_map()
    place = np.array([[1.1, 1.1, 1.1]])
    voxels.insert_hits(np.repeat(place, 2, axis=0), explained=[True, True])
    assert voxels.explained(place).tolist() == [True]
    assert (voxels.occupied_count, voxels.explained_count) == (1, 1)
    voxels.insert_hits(np.repeat(place, 2, axis=0), explained=[True, False])
    assert voxels.explained(place).tolist() == [False]
    voxels.insert_hits(place, explained=[True])
    assert voxels.explained(place).tolist() == [False]
    assert voxels.explained_count == 0


def test_what_was_only_passed_through_takes_the_verdict_of_its_first_hit() -> None:
    voxels = small_map()
    voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    voxels.insert_hits([[1.25, 0.25, 0.25]], explained=[True])
    assert voxels.explained([[1.25, 0.25, 0.25], [2.25, 0.25, 0.25]]).tolist() == [True, False]


def test_voxels_are_marked_as_explained_and_back() -> None:
    voxels = small_map(1.0)
    voxels.insert_hits([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]])
    voxels.mark_explained([[0, 0, 0], [77, 0, 0]], True)
    assert voxels.occupied_keys(explained=True).tolist() == [[0, 0, 0]]
    assert voxels.occupied_keys(explained=False).tolist() == [[1, 0, 0]]
    assert len(voxels.occupied()) == 2
    assert voxels.voxel_count == 2, "an unknown voxel stays unknown"
    revision = voxels.revision
    voxels.mark_explained([[0, 0, 0]], [False])
    assert voxels.changed_since(revision).keys.tolist() == [[0, 0, 0]]
    assert voxels.explained_count == 0


def test_an_emptied_map_knows_nothing_and_takes_everything_anew() -> None:
    voxels = small_map()
    voxels.insert([[2.25, 0.25, 0.25]], origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0, explained=[True])
    voxels.clear()
    assert (voxels.voxel_count, voxels.occupied_count, voxels.explained_count) == (0, 0, 0)
    assert np.isnan(voxels.probability([[2.25, 0.25, 0.25]])).all()
    voxels.insert_hits([[2.25, 0.25, 0.25]])
    assert content(voxels) == {(4, 0, 0): (pytest.approx(0.7), False)}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300, 1e12])
def test_points_without_a_place_are_left_out(bad: float) -> None:
    voxels = small_map()
    voxels.insert([[bad, 0.0, 0.0], [1.0, 1.0, 1.0]], origin_enu=ORIGIN, max_range_m=10.0)
    voxels.insert_hits([[0.0, bad, 0.0]])
    assert voxels.occupied_count == 1
    assert np.isnan(voxels.probability([[0.0, 0.0, bad]])).all()


def test_a_full_map_refuses_counts_and_goes_on_with_what_it_knows() -> None:
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=100_000)
    rng = np.random.default_rng(3)
    first = np.array([[0.5, 0.5, 0.5]])
    voxels.insert_hits(first)
    voxels.insert_hits(rng.uniform(-500.0, 500.0, (5_000, 3)))
    assert voxels.is_full
    assert voxels.refused_updates > 4_000
    assert voxels.size_bytes <= 100_000
    voxels.insert_hits(first)
    assert voxels.probability(first) > 0.8
    voxels.insert(first + 30.0, origin_enu=(300.0, 300.0, 300.0), max_range_m=20.0)
    voxels.insert(first + 30.0, origin_enu=(300.0, 300.0, 300.0), max_range_m=math.inf)
    assert voxels.occupied_count + voxels.refused_updates >= 5_000
    voxels.clear()
    assert not voxels.is_full
    assert voxels.refused_updates == 0


def test_memory_is_what_has_been_filled() -> None:
    voxels = VoxelMap(resolution_m=1.0)
    empty_bytes = voxels.size_bytes
    voxels.insert_hits(np.random.default_rng(0).uniform(0.0, 64.0, (20_000, 3)))
    assert 460_000 < voxels.size_bytes - empty_bytes < 486_000


def test_an_empty_scan_changes_nothing() -> None:
    voxels = small_map()
    voxels.insert(np.empty((0, 3)), origin_enu=ORIGIN, max_range_m=10.0)
    voxels.insert_hits([])
    assert (voxels.revision, voxels.voxel_count) == (0, 0)
    assert voxels.probability([]).shape == (0,)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"resolution_m": 0.0}, "0.0 m"),
        ({"resolution_m": -1.0}, "-1.0 m"),
        ({"resolution_m": math.nan}, "nan m"),
        ({"resolution_m": 0.5, "prob_hit": 0.4}, "prob_hit: 0.4"),
        ({"resolution_m": 0.5, "prob_miss": 0.6}, "prob_miss: 0.6"),
        ({"resolution_m": 0.5, "clamp": (0.6, 0.9)}, "0.6 to 0.9"),
        ({"resolution_m": 0.5, "occupied": 0.99}, "0.99"),
    ],
)
def test_a_map_that_contradicts_itself_is_refused(options: dict[str, float], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        VoxelMap(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"resolution_m": 1e-9}, "1.07 m"),
        ({"resolution_m": 0.5, "memory_limit_bytes": 1_000}, "1,000 bytes"),
        ({"resolution_m": 0.01, "reach_m": 40.0}, r"67,020,643,277 voxels of 0.01 m.*Choose 0.06 m or coarser"),
        ({"resolution_m": 0.001, "reach_m": 120.0}, "120,000 voxels of 0.001 m"),
    ],
)
def test_a_map_that_cannot_fit_is_refused_with_the_number(options: dict[str, float], said: str) -> None:
    with pytest.raises(CapacityError, match=said):
        VoxelMap(**options)  # type: ignore[arg-type]


def test_the_resolution_that_is_advised_fits() -> None:
    assert VoxelMap(resolution_m=0.07, reach_m=40.0).voxel_count == 0
    assert VoxelMap(resolution_m=0.5, reach_m=40.0, memory_limit_bytes=20_000_000).voxel_count == 0


@pytest.mark.parametrize(
    ("points", "origin", "max_range_m", "error"),
    [
        ([[1.0, 2.0]], ORIGIN, 10.0, ParameterError),
        ([1.0, 2.0, 3.0], ORIGIN, 10.0, ParameterError),
        ([[1.0, 2.0, 3.0]], (math.nan, 0.0, 0.0), 10.0, ParameterError),
        ([[1.0, 2.0, 3.0]], (1e300, 0.0, 0.0), 10.0, ParameterError),
        ([[1.0, 2.0, 3.0]], (0.0, 0.0), 10.0, ParameterError),
        ([[1.0, 2.0, 3.0]], ORIGIN, 0.0, ParameterError),
        ([[1.0, 2.0, 3.0]], ORIGIN, math.nan, ParameterError),
        ([[1.0, 2.0, 3.0]], ORIGIN, 1e6, CapacityError),
    ],
)
def test_a_scan_that_makes_no_sense_is_refused(
    points: list[list[float]], origin: tuple[float, ...], max_range_m: float, error: type[Exception]
) -> None:
    voxels = small_map()
    with pytest.raises(error):
        voxels.insert(points, origin_enu=origin, max_range_m=max_range_m)
    assert voxels.voxel_count == 0


def test_verdicts_must_be_as_many_as_points() -> None:
    with pytest.raises(ParameterError, match="2 verdicts for 3 points"):
        small_map().insert_hits(np.ones((3, 3)), explained=[True, False])
