"""Fewest waypoints over the sampled path."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.basics.plan_model import PathParams, SampledPath
from planning.errors import CapacityError, ParameterError
from planning.missions.band import HEIGHT_UNIT_M, Bends, bends, corridor
from planning.missions.decimate import decimate, decimate_to_fit, fewest_bends
from planning.route.slopes import limited_heights, slope_limits
from tests.reference.decimate import fewest

PARAMS = PathParams()
CLIMB, DESCENT = slope_limits(PARAMS)


def hills(n: int, seed: int, vertices: int = 3) -> SampledPath:
    rng = np.random.default_rng(seed)
    s = np.arange(n, dtype=np.float64) * 0.1
    surface = np.zeros(n)
    for wave_m, height_m in ((50, 5), (17, 1.5), (5, 0.3)):
        surface += height_m * np.sin(2 * np.pi * s / wave_m + rng.uniform(0, 6))
    alt = limited_heights(s, surface, PARAMS)
    vertex = np.unique(np.linspace(0, n - 1, vertices).astype(int))
    return SampledPath(np.column_stack([s, 0 * s]), s, surface, surface, alt, vertex, tuple(range(len(vertex))))


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 900), st.sampled_from([0.0, 0.03, 0.1, 0.5, 1.0, 4.0]))
def test_lines_are_never_below_the_path_and_at_most_the_excess_above(seed: int, n: int, excess_m: float) -> None:
    path = hills(n, seed)
    kept = decimate(path, excess_height_m=excess_m, climb=CLIMB, descent=DESCENT, grid_origin_m=0.377)
    flown = np.interp(path.s_m, path.s_m[kept.sample], kept.alt_dsm_m)
    assert np.all(flown >= path.alt_dsm_m)
    assert np.all(flown <= path.alt_dsm_m + max(excess_m, 0.02) + 1e-8)
    assert set(path.vertex.tolist()) <= set(kept.sample.tolist())
    assert np.all(np.diff(kept.sample) > 0)
    run, rise = np.diff(path.s_m[kept.sample]), np.diff(kept.alt_dsm_m)
    assert np.all(rise <= CLIMB * run + HEIGHT_UNIT_M + 1e-8)
    assert np.all(rise >= -DESCENT * run - HEIGHT_UNIT_M - 1e-8)
    cm = (kept.alt_dsm_m - 0.377) / HEIGHT_UNIT_M
    np.testing.assert_allclose(cm, np.round(cm), atol=1e-6)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.05, 0.3, 1.0]))
def test_no_way_through_the_bends_has_fewer_waypoints(seed: int, excess_m: float) -> None:
    path = hills(60, seed)
    band = corridor(
        path.s_m, path.alt_dsm_m, path.vertex, excess_m=excess_m, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0
    )
    choice = bends(band)
    keep = min(5, choice.level_m.shape[1])
    few = Bends(choice.sample, choice.is_vertex, choice.level_m[:, :keep].copy(), np.minimum(choice.levels, keep))
    finite = np.isfinite(few.level_m).sum(axis=1)
    few = replace(few, levels=np.minimum(few.levels, finite))
    assert len(fewest_bends(band, choice)[0]) <= fewest(band, few)
    ends = few.level_m[:, 0]
    assert np.isfinite(ends).all()


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10_000), st.sampled_from([0.2, 0.6]))
def test_thinning_the_bends_costs_hardly_any_waypoints(seed: int, excess_m: float) -> None:
    path = hills(600, seed)
    band = corridor(
        path.s_m, path.alt_dsm_m, path.vertex, excess_m=excess_m, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0
    )
    base = band.on_grid(band.bottom_m)
    level_m = base[:, None] + np.arange(0, int(excess_m * 100) - 1) * HEIGHT_UNIT_M
    level_m[level_m > band.top_m[:, None]] = np.inf
    every = Bends(np.arange(600), np.isin(np.arange(600), path.vertex), level_m, np.isfinite(level_m).sum(axis=1))
    assert len(fewest_bends(band, every)[0]) >= len(fewest_bends(band, bends(band))[0]) - 1


def test_level_ground_needs_only_its_vertices() -> None:
    path = hills(1000, 1, vertices=4)
    level = replace(path, alt_dsm_m=np.full(1000, 12.345))
    kept = decimate(level, excess_height_m=0.0, climb=CLIMB, descent=DESCENT)
    assert kept.sample.tolist() == path.vertex.tolist()
    np.testing.assert_allclose(kept.alt_dsm_m, 12.35)


def test_a_steady_slope_needs_only_its_vertices() -> None:
    path = hills(1000, 1, vertices=2)
    slope = replace(path, alt_dsm_m=CLIMB * path.s_m)
    assert len(decimate(slope, excess_height_m=0.05, climb=CLIMB, descent=DESCENT).sample) == 2


def test_more_excess_needs_fewer_waypoints() -> None:
    path = hills(4000, 5)
    counts = [
        len(decimate(path, excess_height_m=e, climb=CLIMB, descent=DESCENT).sample) for e in (0, 0.1, 0.5, 1, 4, 50)
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 10 * counts[-1]
    assert counts[-1] == 3


def test_a_path_steeper_than_the_limits_is_followed() -> None:
    path = hills(300, 3)
    steep = replace(path, alt_dsm_m=3 * path.alt_dsm_m)
    kept = decimate(steep, excess_height_m=0.5, climb=CLIMB, descent=DESCENT)
    flown = np.interp(steep.s_m, steep.s_m[kept.sample], kept.alt_dsm_m)
    assert np.max(flown - steep.alt_dsm_m) <= 0.5 + 1e-9


def test_the_excess_is_raised_until_the_waypoints_fit() -> None:
    path = hills(4000, 5)
    asked = decimate(path, excess_height_m=0.1, climb=CLIMB, descent=DESCENT)
    fitted = decimate_to_fit(path, 20, excess_height_m=0.1, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0)
    assert len(asked.sample) > 20 >= len(fitted.sample)
    assert fitted.excess_height_m > 0.1
    tighter = decimate(path, excess_height_m=fitted.excess_height_m / 1.16, climb=CLIMB, descent=DESCENT)
    assert len(tighter.sample) > 20
    same = decimate_to_fit(path, 10_000, excess_height_m=0.1, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0)
    assert same.excess_height_m == 0.1


def test_the_vertices_alone_fit_when_the_lines_may_be_high() -> None:
    path = hills(2000, 8, vertices=30)
    kept = decimate_to_fit(path, 30, excess_height_m=0.1, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0)
    assert kept.sample.tolist() == path.vertex.tolist()


def test_too_many_vertices_are_refused_with_both_counts() -> None:
    with pytest.raises(CapacityError, match=r"at least 30 .* 29"):
        decimate_to_fit(
            hills(2000, 8, vertices=30), 29, excess_height_m=1, climb=CLIMB, descent=DESCENT, grid_origin_m=0.0
        )


@pytest.mark.parametrize("excess_m", [-1.0, float("nan"), float("inf")])
def test_a_useless_excess_is_refused(excess_m: float) -> None:
    with pytest.raises(ParameterError):
        decimate(hills(100, 1), excess_height_m=excess_m, climb=CLIMB, descent=DESCENT)
