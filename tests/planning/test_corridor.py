"""The corridor over a profile and the bends offered in it."""

import numpy as np
import pytest

from planning.missions.band import HEIGHT_UNIT_M, bends, corridor

S = np.arange(400, dtype=np.float64) * 0.1
HILLS = 3 * np.sin(S / 4) + 0.4 * np.sin(2 * S)
VERTEX = np.array([0, 150, 399])


def band(excess_m: float, origin_m: float = 0.0):
    return corridor(S, HILLS, VERTEX, excess_m=excess_m, climb=2.0, descent=2.0, grid_origin_m=origin_m)


@pytest.mark.parametrize("excess_m", [0.0, 0.1, 2.0])
def test_the_corridor_holds_a_height_of_the_grid_everywhere(excess_m: float) -> None:
    c = band(excess_m)
    assert np.all(c.bottom_m > HILLS)
    assert np.all(c.on_grid(c.bottom_m) <= c.top_m + 1e-9)
    assert np.all(c.top_m <= HILLS + max(excess_m, 0.03))


def test_bends_are_where_the_terrain_is_and_hold_every_vertex() -> None:
    tight, wide = bends(band(0.05)), bends(band(3.0))
    for choice in (tight, wide):
        assert np.all(np.diff(choice.sample) > 0)
        assert choice.sample[choice.is_vertex].tolist() == VERTEX.tolist()
    assert len(wide.sample) < len(tight.sample)


def test_levels_are_on_the_grid_and_in_the_corridor() -> None:
    c = band(1.0, origin_m=0.123)
    choice = bends(c)
    for z, n, i in zip(choice.level_m, choice.levels, choice.sample, strict=True):
        assert n >= 1
        steps = (z[:n] - 0.123) / HEIGHT_UNIT_M
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
        assert z[0] >= c.bottom_m[i] - 1e-9
        assert z[n - 1] <= c.top_m[i] + 1e-9
        assert not np.isfinite(z[n:]).any()


def test_a_profile_steeper_than_the_limits_is_followed_anyway() -> None:
    c = corridor(S, HILLS, VERTEX, excess_m=0.5, climb=0.1, descent=0.1, grid_origin_m=0.0)
    assert c.climb == pytest.approx(np.diff(HILLS).max() / 0.1, rel=1e-6)
    assert c.descent == pytest.approx(-np.diff(HILLS).min() / 0.1, rel=1e-6)
