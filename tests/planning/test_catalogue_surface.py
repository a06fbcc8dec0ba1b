"""The surface of several models: never below the worse end of those that count, against the slow way."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planning.errors import RasterTooLargeError
from planning.terrain.catalogue.best import NO_MODEL, layers_of, surface_of
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel, Opened
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.header import RasterLimits
from tests.planning.catalogue_samples import in_memory, worse_end

ROUNDING_M = 1e-3


@st.composite
def models(draw: st.DrawFn) -> tuple[CatalogueModel, ...]:
    made = []
    for number in range(draw(st.integers(1, 3))):
        rows, columns = draw(st.integers(2, 7)), draw(st.integers(2, 7))
        random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        heights = random.uniform(0.0, 50.0, (rows, columns)).astype(np.float32)
        heights[random.random(heights.shape) < draw(st.sampled_from([0.0, 0.2]))] = np.nan
        cell_m = draw(st.sampled_from([5.0, 5.0, 7.3, 12.0]))
        model = in_memory(
            heights,
            cell_m=cell_m,
            east_m=draw(st.sampled_from([0.0, 5.0, 11.7, 40.0, -20.0])),
            south_m=draw(st.sampled_from([0.0, 5.0, 3.1, 40.0, -20.0])),
            rms_m=draw(st.sampled_from([0.05, 0.2, 1.0])),
            told=draw(st.booleans()),
            horizontal_m=draw(st.sampled_from([0.1, 6.0])),
            year=draw(st.sampled_from([None, 2015, 2024])),
            name=f"m{number}",
        )
        made.append(model)
    return tuple(sorted(made, key=lambda model: (model.order, model.name)))


def catalogue_of(found: tuple[CatalogueModel, ...], *, limits: RasterLimits | None = None) -> Catalogue:
    return Catalogue(Opened(found, (), ()), "c", limits or RasterLimits())


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(models())
def test_never_below_the_worse_end(found: tuple[CatalogueModel, ...]) -> None:
    catalogue = catalogue_of(found)
    shape = (catalogue.height_px, catalogue.width_px)
    highest, lowest, best = worse_end(catalogue.layers, catalogue.transform, shape)
    dsm = catalogue.whole()
    known = best >= 0
    np.testing.assert_array_equal(np.isfinite(dsm.elevation_m), known)
    assert (dsm.elevation_m[known] >= highest[known] - ROUNDING_M).all()
    assert dsm.lowest_m is not None
    assert (dsm.lowest_m[known] <= lowest[known] + ROUNDING_M).all()
    # Nothing is made up either: no square is higher than what some model says of the squares it counts in.
    made = surface_of(catalogue.layers, catalogue.transform, shape)
    np.testing.assert_array_equal(np.where(made.best == NO_MODEL, -1, made.best.astype(int)), best)
    alone = known & ~made.seam
    np.testing.assert_allclose(dsm.elevation_m[alone], highest[alone], atol=ROUNDING_M)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(models(), st.data())
def test_a_part_is_that_of_the_whole(found: tuple[CatalogueModel, ...], data: st.DataObject) -> None:
    whole = catalogue_of(found).whole()
    row, column = (data.draw(st.integers(0, side - 1)) for side in whole.elevation_m.shape)
    rows, columns = data.draw(st.integers(1, 6)), data.draw(st.integers(1, 6))
    surface = catalogue_of(found)
    monkey = pytest.MonkeyPatch()
    with monkey.context() as patch:
        patch.setattr("planning.terrain.catalogue.joined_models.AHEAD_PX", 0)
        part = surface.window(row, column, rows, columns)
    expected = whole.window(row, column, rows, columns)
    np.testing.assert_array_equal(part.elevation_m, expected.elevation_m)
    np.testing.assert_array_equal(cast(np.ndarray, part.lowest_m), cast(np.ndarray, expected.lowest_m))
    assert part.transform == expected.transform


def test_one_model_alone_is_the_model_itself() -> None:
    heights = np.random.default_rng(1).uniform(0, 9, (12, 14)).astype(np.float32)
    heights[3, 4] = np.nan
    catalogue = catalogue_of((in_memory(heights, rms_m=0.2),))
    np.testing.assert_array_equal(catalogue.whole().elevation_m, heights)
    np.testing.assert_array_equal(cast(np.ndarray, catalogue.whole().lowest_m), heights)
    assert catalogue.rms_m == 0.2


def test_a_hole_is_filled_from_the_next_best_and_the_higher_counts_around_it() -> None:
    new = np.full((41, 41), 10.0, np.float32)
    new[20, 20] = np.nan
    old = np.full((41, 41), 12.0, np.float32)
    best, second = in_memory(new, name="new", year=2024), in_memory(old, name="old", year=2010)
    dsm = catalogue_of((best, second)).whole()
    assert dsm.elevation_m[20, 20] == 12.0
    assert dsm.elevation_m[20, 24] == 12.0  # 15 m beside the hole
    assert dsm.elevation_m[20, 40] == 10.0
    assert dsm.elevation_m[0, 0] == 10.0


def test_what_an_edge_cell_knows_is_not_lost() -> None:
    """A square that the better model covers in part is the next one's, and what stands in that part still counts."""
    better = np.full((4, 4), 5.0, np.float32)
    better[:, 3] = 40.0
    fine = in_memory(np.full((8, 12), 6.0, np.float32), name="fine", cell_m=5.0, year=2010)
    over = in_memory(better, name="over", cell_m=7.0, year=2024)
    dsm = catalogue_of((over, fine)).whole()
    assert float(dsm.elevation_m[0, 5]) == 40.0  # 25 to 30 m east; the mast's cell ends at 28 m


def test_errors_raise_and_lower() -> None:
    heights = np.zeros((4, 4), np.float32)
    good = in_memory(heights, rms_m=0.1, name="good", year=2024)
    bad = in_memory(heights, rms_m=0.3, name="bad", east_m=20.0, year=2010)
    layers = layers_of((good, bad))
    assert [round(layer.raise_m, 6) for layer in layers] == [0.0, 0.6]
    assert [round(layer.drop_m, 6) for layer in layers] == [0.3, 0.9]
    untold = tuple(in_memory(heights, rms_m=0.5, told=False, name=name) for name in "ab")
    assert [(layer.raise_m, layer.drop_m) for layer in layers_of(untold)] == [(0.0, 0.0), (0.0, 0.0)]


def test_the_digest_tells_of_every_change() -> None:
    heights = np.zeros((4, 4), np.float32)
    one, two = in_memory(heights, name="a", year=2024), in_memory(heights, name="b", east_m=20.0, year=2010)
    digests = {
        catalogue_of(found).sha256
        for found in (
            (one, two),
            (two, one),
            (one,),
            (in_memory(heights, name="a", rms_m=0.2, year=2024), two),
            (in_memory(heights, name="a", horizontal_m=2.0, year=2024), two),
        )
    }
    assert len(digests) == 5
    assert catalogue_of((one, two)).sha256 in digests


def test_too_much_at_once_is_refused() -> None:
    small = in_memory(np.zeros((4, 4), np.float32), name="small", cell_m=1.0)
    far = in_memory(np.zeros((4, 4), np.float32), name="far", cell_m=1.0, east_m=900.0, south_m=900.0)
    catalogue = catalogue_of((small, far), limits=RasterLimits(max_px=100_000))
    assert isinstance(catalogue.window(0, 0, 4, 4), Dsm)
    with pytest.raises(RasterTooLargeError, match="more than the limit"):
        catalogue.whole()
