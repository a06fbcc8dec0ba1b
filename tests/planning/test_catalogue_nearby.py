"""A flight meets the models around it, whatever else a catalogue holds: their cells, their errors in place."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.certificate.clearance import certify
from planning.errors import RasterTooLargeError
from planning.planner.part import looked_over, needed_part
from planning.terrain.catalogue.best import NO_MODEL, surface_of
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel, Opened
from planning.terrain.catalogue.nearby import is_aligned
from planning.terrain.dsm import FLIGHT_MARGIN_M
from planning.terrain.rasters.header import RasterLimits
from tests.planning.catalogue_samples import NORTH_M, WEST_M, in_memory, who_counts, worse_end
from tests.planning.test_catalogue_certificates import PARAMS, line_of
from tests.planning.test_catalogue_surface import ROUNDING_M, catalogue_of, models


def at(*east_south_m: tuple[float, float]) -> F64:
    return np.array([(WEST_M + east, NORTH_M - south) for east, south in east_south_m])


@st.composite
def looked_at(draw: st.DrawFn) -> tuple[Catalogue, F64, float]:
    """A catalogue whose models are off in place by 0 to 9 m, a place on it and how far around it is looked."""
    found = [replace(model, place_m=draw(st.sampled_from([0.0, 2.0, 9.0]))) for model in draw(models())]
    west, south, east, north = draw(st.sampled_from(found)).file.bounds_m
    share = draw(st.floats(0.0, 1.0)), draw(st.floats(0.0, 1.0))
    place = np.array([[west + share[0] * (east - west), south + share[1] * (north - south)]])
    return catalogue_of(tuple(found)), place, draw(st.sampled_from([0.0, 6.0, 15.0]))


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(looked_at())
def test_on_the_grid_of_the_models_around_nothing_is_below_the_worse_end(asked: tuple[Catalogue, F64, float]) -> None:
    catalogue, place, margin_m = asked
    look = catalogue.over(place, margin_m)
    shape = look.height_px, look.width_px
    highest, lowest, best = worse_end(look.layers, look.transform, shape)
    dsm, known = look.whole(), best >= 0
    np.testing.assert_array_equal(np.isfinite(dsm.elevation_m), known)
    assert (dsm.elevation_m[known] >= highest[known] - ROUNDING_M).all()
    assert dsm.lowest_m is not None
    assert (dsm.lowest_m[known] <= lowest[known] + ROUNDING_M).all()
    made = surface_of(look.layers, look.transform, shape)
    np.testing.assert_array_equal(np.where(made.best == NO_MODEL, -1, made.best.astype(int)), best)
    assert dsm.sha256 == catalogue.sha256


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(looked_at())
def test_whoever_counts_around_is_allowed_for_in_place(asked: tuple[Catalogue, F64, float]) -> None:
    catalogue, place, margin_m = asked
    look = catalogue.over(place, margin_m)
    t, ((x, y),) = look.transform, place.tolist()
    counting = who_counts(look.layers, t, (look.height_px, look.width_px))
    least_m = 0.0
    for (row, column), (_, numbers) in counting.items():
        west, north = t @ (column, row)
        if west < x + margin_m and x - margin_m < west + t.a and north > y - margin_m and y + margin_m > north - t.a:
            least_m = max([least_m, *(look.layers[number].model.place_m for number in numbers)])
    assert look.place_m >= least_m
    assert look.place_m in {0.0, *(model.place_m for model in look.models)}
    assert look.whole().place_m == look.place_m


def survey(*, place_m: float = 0.0) -> CatalogueModel:
    """A national one: 4 x 4 km in cells of 20 m."""
    heights = np.random.default_rng(2).uniform(0.0, 9.0, (200, 200)).astype(np.float32)
    return in_memory(heights, cell_m=20.0, rms_m=0.4, year=2010, name="survey", place_m=place_m)


def flight() -> CatalogueModel:
    """A newer one in its middle: 1.6 x 1.6 km in cells of 4 m."""
    heights = np.random.default_rng(3).uniform(0.0, 9.0, (400, 400)).astype(np.float32)
    return in_memory(heights, cell_m=4.0, rms_m=0.1, year=2024, name="flight", east_m=1200.0, south_m=1200.0)


def speck(east_m: float, south_m: float) -> CatalogueModel:
    """A few metres in cells of 1 cm."""
    return in_memory(
        np.zeros((300, 300), np.float32),
        cell_m=0.01,
        rms_m=0.1,
        year=2023,
        name="speck",
        east_m=east_m,
        south_m=south_m,
        horizontal_m=0.01,
    )


def test_a_speck_of_fine_cells_far_away_changes_nothing_here() -> None:
    places = at((1900.0, 1900.0), (2100.0, 2000.0))
    before, after = catalogue_of((flight(), survey())), catalogue_of((flight(), speck(150.0, 150.0), survey()))
    assert after.resolution_m == 0.01
    one, other = (looked_over(each, places).around(places, FLIGHT_MARGIN_M) for each in (before, after))
    assert (one.resolution_m, other.resolution_m) == (4.0, 4.0)
    assert is_aligned(one.transform, other.transform)
    np.testing.assert_allclose(other.bounds_m, one.bounds_m, atol=1e-6)
    np.testing.assert_array_equal(other.elevation_m, one.elevation_m)
    np.testing.assert_array_equal(cast(np.ndarray, other.lowest_m), cast(np.ndarray, one.lowest_m))
    np.testing.assert_array_equal(cast(np.ndarray, other.seam), cast(np.ndarray, one.seam))
    up_m = np.array([40.0, 35.0])
    made = [certify(part, line_of(places, up_m, 4.0), PARAMS) for part in (one, other)]
    assert made[0].min_distance_m == pytest.approx(made[1].min_distance_m, abs=1e-6)
    assert made[0].required_clearance_m == made[1].required_clearance_m


def test_where_the_fine_cells_are_they_count() -> None:
    catalogue = catalogue_of((flight(), speck(150.0, 150.0), survey()))
    beside = at((150.0, 150.0))
    assert catalogue.over(beside, 1.0).resolution_m == 0.01
    # Within its seams, too: there the survey's squares are those of the place beside.
    assert catalogue.over(beside - (15.0, 0.0), 1.0).resolution_m == 0.01
    assert catalogue.over(beside - (40.0, 0.0), 1.0).resolution_m == 20.0
    assert catalogue.over(at((1000.0, 150.0)), 100.0).resolution_m == 20.0
    with pytest.raises(RasterTooLargeError) as error:
        Catalogue(Opened(catalogue.models, (), ()), "c", RasterLimits(max_px=10_000_000)).over(beside).window(
            0, 0, 9000, 9000
        )
    assert "speck, the finest model here" in error.value.where


def test_an_error_in_place_costs_clearance_where_its_model_counts() -> None:
    catalogue = catalogue_of((flight(), survey(place_m=15.0)))
    assert catalogue.place_m == 15.0
    inside, edge, outside = at((2000.0, 2000.0)), at((1500.0, 2000.0)), at((500.0, 500.0))
    assert [looked_over(catalogue, places).place_m for places in (inside, edge, outside)] == [0.0, 15.0, 15.0]
    assert needed_part(catalogue, inside).place_m == 0.0
    # A hole, in which the survey is the best.
    heights = flight().file.whole().elevation_m.copy()
    heights[200, 230] = np.nan
    holed = in_memory(heights, cell_m=4.0, rms_m=0.1, year=2024, name="flight", east_m=1200.0, south_m=1200.0)
    assert looked_over(catalogue_of((holed, survey(place_m=15.0))), inside).place_m == 15.0


def test_the_same_places_are_looked_at_in_the_same_way() -> None:
    """However it is asked: by plan, certificate or flight, for one model of the catalogue, or from another look."""
    catalogue = catalogue_of((flight(), speck(150.0, 150.0), survey(place_m=15.0)))
    places = at((1900.0, 1900.0), (2100.0, 2000.0))
    look = looked_over(catalogue, places)
    assert look.over(places) is look
    assert looked_over(catalogue.over(at((150.0, 150.0)), 1.0), places) is look
    part = look.around(places, 20.0)
    assert is_aligned(part.transform, look.transform)
    np.testing.assert_array_equal(catalogue.elevation_at(places), look.elevation_at(places))
    shares, _ = catalogue.shares_of(part)
    assert [share.model.name for share in shares] == ["flight"]


def test_a_place_that_no_model_reaches_asks_for_nothing() -> None:
    catalogue = catalogue_of((flight(), survey()))
    assert catalogue.over(at((-9e6, 0.0))) is catalogue
    assert catalogue.over(np.array([[np.inf, np.nan]])) is catalogue
