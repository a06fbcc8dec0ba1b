"""What is certified over several models holds over whatever of them is true; and where a vehicle may stand on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F32, F64
from planning.basics.plan_model import FlownLine, Poi, VehicleProfile
from planning.certificate.certificate_model import Certificate, ClearanceParams, with_accuracy
from planning.certificate.clearance import certify
from planning.certificate.home_ground import home_ground
from planning.certificate.home_search import nearest_standing
from planning.ground.traversable import traversable_ground
from planning.margins.words import uncovered_words
from planning.missions.vehicle_terms import budget_of
from planning.planner.request import PlanRequest
from planning.terrain.catalogue.best import SEAM_M, Layer
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel, Opened
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from planning.terrain.rasters.header import RasterLimits
from planning.terrain.spikes import find_spikes, remove_spikes
from tests.planning.catalogue_samples import NORTH_M, WEST_M, in_memory, slow_square

PROFILE = VehicleProfile("quad", position_error_m=0.5, following_m=0.5)
BUDGET = budget_of(PROFILE)
PARAMS = ClearanceParams(BUDGET.total_m, PROFILE.radius_m, 0.5, rtl_height_m=45.0, budget=BUDGET)


def catalogue_of(*found: CatalogueModel) -> Catalogue:
    return Catalogue(Opened(tuple(sorted(found, key=lambda model: model.order)), (), ()), "c", RasterLimits())


def line_of(xy_m: F64, up_m: F64, home_alt_m: float) -> FlownLine:
    points_m = np.column_stack([xy_m, home_alt_m + up_m])
    home = float(xy_m[0, 0]), float(xy_m[0, 1])
    return FlownLine(points_m, np.arange(len(xy_m) - 1), home, home_alt_m, float(points_m[0, 2]), True)


@dataclass(frozen=True, slots=True)
class Truth:
    """What may be true where several models lie, square by square, worked out slowly."""

    best: np.ndarray
    may_m: F64
    """(models, rows, columns) what each says where it may be right; NaN elsewhere."""
    like: Dsm

    said_m: F64
    """(models, rows, columns) what each says anywhere."""

    def drawn(
        self, random: np.random.Generator, layers: tuple[Layer, ...], *, seams: bool, beside: bool = False
    ) -> Dsm:
        """Each model off by as much as it may be; at seams either of them may be right, at each place another one.

        ``beside``: it shows each thing as far beside its place as it may, all of them to the same side.
        """
        off_m = [random.choice([-1.0, 1.0, random.uniform(-1, 1)]) * layer.model.bound_m for layer in layers]
        chosen = self.best
        if seams:
            order = random.random(self.may_m.shape) * np.isfinite(self.may_m)
            chosen = np.where(order.max(axis=0) > 0, order.argmax(axis=0), chosen)
        heights = np.full(chosen.shape, np.nan)
        for number, off in enumerate(off_m):
            may_m = self.may_m[number]
            if beside:
                angle = random.uniform(0.0, 2.0 * math.pi)
                away_px = (
                    layers[number].model.place_m / self.like.resolution_m * np.array([np.cos(angle), np.sin(angle)])
                )
                shown_m = moved(self.said_m[number], *np.trunc(away_px).astype(int).tolist())
                may_m = np.where(np.isfinite(may_m) & np.isfinite(shown_m), shown_m, may_m)
            heights = np.where(chosen == number, may_m + off, heights)
        return Dsm(heights.astype(np.float32), self.like.transform, self.like.crs, None, "")


def moved(heights_m: F64, rows: int, columns: int) -> F64:
    """What lies so many cells farther; NaN from outside."""
    wide = np.pad(heights_m, ((abs(rows),) * 2, (abs(columns),) * 2), constant_values=np.nan)
    row, column = abs(rows) + rows, abs(columns) + columns
    return wide[row : row + heights_m.shape[0], column : column + heights_m.shape[1]]


def truth_of(layers: tuple[Layer, ...], dsm: Dsm) -> Truth:
    t, side_m = dsm.transform, dsm.resolution_m
    rows, columns = dsm.elevation_m.shape
    best, high_m = np.full((rows, columns), -1), np.full((len(layers), rows, columns), np.nan)
    for row, column in np.ndindex(rows, columns):
        square = slow_square(layers, *(t @ (column, row)), side_m)
        best[row, column], high_m[:, row, column] = square.best, square.high_m
    may_m = np.full(high_m.shape, np.nan)
    for row, column in np.argwhere(best >= 0):
        for number in near_bests(best, row, column, side_m):
            may_m[number, row, column] = high_m[number, row, column]
    return Truth(best, may_m, dsm, high_m)


def near_bests(best: np.ndarray, row: int, column: int, side_m: float) -> set[int]:
    rows, columns = np.indices(best.shape)
    apart = np.hypot(np.maximum(0, abs(rows - row) - 1), np.maximum(0, abs(columns - column) - 1)) * side_m
    return set(best[apart <= SEAM_M].tolist()) - {-1}


@st.composite
def models(draw: st.DrawFn) -> tuple[CatalogueModel, ...]:
    """Two or three: tilted, a step apart or 20 m, half unknown, with holes, with masts; of any date and error."""
    made = []
    for number in range(draw(st.integers(2, 3))):
        random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        rows, columns = draw(st.integers(8, 14)), draw(st.integers(8, 14))
        heights = random.uniform(0.0, draw(st.sampled_from([0.2, 0.6, 2.0])), (rows, columns))
        heights += draw(st.sampled_from([0.0, 0.0, 0.2])) * np.indices((rows, columns))[1]
        heights += draw(st.sampled_from([0.0, 0.0, 0.0, 1.5, 20.0]))
        kind = draw(st.sampled_from(["whole", "whole", "half", "holes", "masts"]))
        if kind == "half":
            heights[:, : columns // 2] = np.nan
        elif kind != "whole":
            odd = random.random(heights.shape) < 0.03
            heights[odd] = np.nan if kind == "holes" else 12.0
        model = in_memory(
            heights.astype(np.float32),
            cell_m=draw(st.sampled_from([4.0, 4.0, 6.0])),
            east_m=draw(st.sampled_from([0.0, 4.0, 24.0, 36.0])),
            south_m=draw(st.sampled_from([0.0, 2.0, 20.0])),
            rms_m=draw(st.sampled_from([0.03, 0.1, 0.3, 1.0])),
            horizontal_m=draw(st.sampled_from([0.1, 3.0])),
            year=draw(st.sampled_from([None, 2015, 2024])),
            name=f"m{number}",
        )
        made.append(model)
    return tuple(made)


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(models(), st.integers(0, 2**32 - 1))
def test_what_is_certified_over_a_catalogue_is_over_every_truth(found: tuple[CatalogueModel, ...], seed: int) -> None:
    """Home included: the truth demands nothing for errors of the model, it has none."""
    random, catalogue = np.random.default_rng(seed), catalogue_of(*found)
    dsm = catalogue.whole()
    truth = truth_of(catalogue.layers, dsm)
    squares = np.argwhere(truth.best >= 0)
    bare = BUDGET.with_value("dsm_accuracy", 0.0)
    exact = replace(PARAMS, required_clearance_m=bare.total_m, budget=bare)
    for _ in range(12):
        places = squares[random.integers(0, len(squares), 3)] + random.uniform(0.05, 0.95, (3, 2))
        xy_m = np.array([dsm.transform @ (float(column), float(row)) for row, column in places])
        up_m = random.uniform(4.0, 30.0) + random.uniform(-2.0, 2.0, 3)
        over = certify(dsm, line_of(xy_m, up_m, float(dsm.elevation_at(xy_m[:1])[0])), PARAMS)
        if not (over.certified or over.home_column_clear):
            continue
        for seams in (False, True):
            real = truth.drawn(random, catalogue.layers, seams=seams)
            flown = certify(real, line_of(xy_m, up_m, float(real.elevation_at(xy_m[:1])[0])), exact)
            assert flown.home_column_clear or not over.home_column_clear
            assert flown.certified or not over.certified, [reason.text for reason in flown.reasons]


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(models(), st.lists(st.sampled_from([0.0, 4.0, 9.0]), min_size=3, max_size=3), st.integers(0, 2**32 - 1))
def test_what_is_certified_with_the_models_around_alone_is_over_every_truth(
    found: tuple[CatalogueModel, ...], places_m: list[float], seed: int
) -> None:
    """On the grid and with the error in place of what lies within the bare clearance of the line and no farther."""
    random = np.random.default_rng(seed)
    placed = (
        replace(model, place_m=place_m, horizontal_m=max(place_m, model.horizontal_m))
        for model, place_m in zip(found, places_m, strict=False)
    )
    catalogue = catalogue_of(*placed)
    whole = catalogue.whole()
    truth = truth_of(catalogue.layers, whole)
    squares = np.argwhere(truth.best >= 0)
    bare = BUDGET.with_value("dsm_accuracy", 0.0)
    exact = replace(PARAMS, required_clearance_m=bare.total_m, budget=bare)
    for _ in range(12):
        places = squares[random.integers(0, len(squares), 1)] + random.uniform(0.05, 0.95, (3, 2))
        places[1:] += random.uniform(-3.0, 3.0, (2, 2))
        xy_m = np.array([whole.transform @ (float(column), float(row)) for row, column in places])
        up_m = random.uniform(4.0, 30.0) + random.uniform(-2.0, 2.0, 3)
        dsm = catalogue.over(xy_m, PARAMS.required_clearance_m).whole()
        over = certify(dsm, line_of(xy_m, up_m, float(dsm.elevation_at(xy_m[:1])[0])), PARAMS)
        if not (over.certified or over.home_column_clear):
            continue
        for seams in (False, True):
            real = truth.drawn(random, catalogue.layers, seams=seams, beside=True)
            flown = certify(real, line_of(xy_m, up_m, float(real.elevation_at(xy_m[:1])[0])), exact)
            assert flown.home_column_clear or not over.home_column_clear
            assert flown.certified or not over.certified, [reason.text for reason in flown.reasons]


def pair(left: F32, right: F32, *, rms_m: float, east_m: float | None = None) -> Catalogue:
    """Side by side, the left one newer, of the same size and in cells of 1 m."""
    begins_m = float(left.shape[1]) if east_m is None else east_m
    return catalogue_of(
        in_memory(left, cell_m=1.0, rms_m=0.02, horizontal_m=0.1, year=2024, name="left"),
        in_memory(right, cell_m=1.0, rms_m=rms_m, horizontal_m=0.1, year=2010, name="right", east_m=begins_m),
    )


def level(height_m: float = 0.0) -> F32:
    return np.full((60, 60), height_m, np.float32)


def at(east_m: float, south_m: float = 30.5) -> tuple[float, float]:
    return WEST_M + east_m, NORTH_M - south_m


def stand(dsm: Dsm, east_m: float, **known: float | None):
    return home_ground(dsm, at(east_m), centre_m=1.0, radius_m=0.5, **known)


def test_a_wall_that_another_model_covers_up_is_still_in_the_way() -> None:
    """At a seam the higher counts: a level roof of 2019 hid the wall of this year's model below it."""
    walled = level()
    walled[:, 55:] = 3.0
    catalogue = pair(walled, level(5.0), rms_m=0.02, east_m=20.0)
    dsm = catalogue.whole()
    assert float(dsm.elevation_at(np.array([at(54.5)]))[0]) == float(dsm.elevation_at(np.array([at(55.5)]))[0]) == 5.0
    found = stand(dsm, 54.5)
    assert found.obstacle is not None
    assert "leave 5.1 m open" in found.obstacle
    assert found.low_dsm_m == pytest.approx(-0.06)
    assert stand(dsm, 10.5).obstacle is None
    # Two that agree there do not stand in the way.
    assert stand(pair(level(), level(), rms_m=0.02, east_m=20.0).whole(), 54.5).obstacle is None


def test_a_step_between_models_that_do_not_overlap_is_in_the_way() -> None:
    """Raised by its error, the right one ends level with the left: 1.4 m lower it may as well be."""
    catalogue = pair(level(), level(-0.84), rms_m=0.3)
    dsm = catalogue.whole()
    assert np.ptp(dsm.elevation_m) < 1e-5
    assert stand(dsm, 59.9).obstacle is not None
    assert stand(dsm, 25.5).obstacle is None


def test_no_better_home_is_sought_where_models_are_apart() -> None:
    catalogue = pair(level(), level(5.0), rms_m=0.02, east_m=30.0)
    near, _ = nearest_standing(catalogue, at(59.5), centre_m=1.0, radius_m=0.5, most_drop_m=0.5)
    assert near is not None
    assert stand(catalogue.whole(), near.xy_m[0] - WEST_M).obstacle is None
    assert near.away_m >= 2.0


def test_a_vehicle_that_tells_its_height_may_stand_on_a_model_that_is_raised() -> None:
    """RTK says 0 m as the older model does, raised by 2.9 m; what rises beside it is in the way all the same."""
    walled = level()
    walled[:, 45:] = 2.5
    dsm = pair(level(), walled, rms_m=1.0).whole()
    assert float(dsm.elevation_at(np.array([at(90.5)]))[0]) == pytest.approx(2.94)
    assert stand(dsm, 90.5, stands_dsm_m=0.0).obstacle is None
    assert stand(dsm, 90.5).obstacle is None
    for stands_m in (0.0, None):
        assert stand(dsm, 104.5, stands_dsm_m=stands_m).obstacle is not None
    # In a pit that the model does not know.
    assert stand(dsm, 90.5, stands_dsm_m=-5.0).obstacle is not None


def over_right(dsm: Dsm, up_m: float, **changes: float) -> Certificate:
    xy_m = np.array([at(20.5), at(100.5)])
    params = replace(PARAMS, max_height_above_ground_m=20.0, **changes)
    return certify(dsm, line_of(xy_m, np.full(2, up_m), 0.0), params)


def test_heights_above_ground_count_from_the_lowest_that_it_may_be() -> None:
    dsm = pair(level(), level(-4.0), rms_m=1.0).whole()
    assert float(dsm.elevation_at(np.array([at(100.5)]))[0]) == pytest.approx(-1.06)
    found = over_right(dsm, 14.0)
    assert found.max_height_above_ground_m == pytest.approx(14.0 + 4.0 + 3.0, abs=1e-4)
    assert [reason.code for reason in found.reasons] == ["height_above_ground"]
    assert over_right(dsm, 12.5).certified


def test_places_far_from_the_models_corner_are_looked_up_where_they_are() -> None:
    """Over some places distances on the ground are longer than the grid's: the frame is another one then."""
    lower = level()
    lower[:, 50:52] = -9.0
    dsm = replace(pair(level(), lower, rms_m=0.02).whole(), transform=Affine(1.0, 0.0, 150_000.0, 0.0, -1.0, NORTH_M))
    xy_m = np.array([[150_020.5, NORTH_M - 30.5], [150_100.5, NORTH_M - 30.5]])
    found = certify(dsm, line_of(xy_m, np.full(2, 14.0), 0.0), PARAMS)
    assert found.max_height_above_ground_m == pytest.approx(14.06, abs=1e-4)


def test_what_is_cut_down_or_filled_is_so_at_both_ends() -> None:
    right = level()
    right[30, 30] = 14.0
    right[40, 40] = np.nan
    dsm = pair(level(), right, rms_m=0.1).whole()
    assert dsm.lowest_m is not None
    assert dsm.seam is not None
    cut = remove_spikes(dsm, find_spikes(dsm))
    assert cut.lowest_m is not None
    assert float(cut.elevation_m[30, 90]) == pytest.approx(0.24)
    assert float(cut.lowest_m[30, 90]) == pytest.approx(-0.3)
    filled, report = fill_holes(cut)
    assert report.count == 1
    assert filled.lowest_m is not None
    assert np.isfinite(filled.lowest_m).all()
    assert (filled.lowest_m <= filled.elevation_m).all()
    part = filled.window(20, 50, 30, 40)
    np.testing.assert_array_equal(part.lowest_m, filled.lowest_m[20:50, 50:90])
    np.testing.assert_array_equal(part.seam, dsm.seam[20:50, 50:90])


def test_what_may_stand_beside_where_a_model_shows_it_is_kept_clear_of() -> None:
    """A line 10 m beside a wall was certified on a model that is off by up to 15 m."""
    heights = np.zeros((120, 120), np.float32)
    heights[:, 60:65] = 40.0
    exact = catalogue_of(in_memory(heights, cell_m=1.0, horizontal_m=15.0))
    off = catalogue_of(replace(exact.models[0], place_m=15.0))
    assert (off.place_m, off.whole().place_m, off.window(0, 0, 9, 9).place_m) == (15.0, 15.0, 15.0)
    assert "±15 m in place" in off.models[0].words
    bound_m = PARAMS.required_clearance_m + 15.0
    told = with_accuracy(with_accuracy(PARAMS, off), off.whole())
    assert told.required_clearance_m == pytest.approx(with_accuracy(PARAMS, exact).required_clearance_m + 15.0)
    for away_m, model, certified in ((10.0, exact, True), (10.0, off, False), (bound_m + 2.0, off, True)):
        east_m = WEST_M + 60.0 - away_m
        xy_m = np.array([[east_m, NORTH_M - 90.0], [east_m, NORTH_M - 40.0]])
        found = certify(model.whole(), line_of(xy_m, np.array([30.0, 30.0]), 0.0), PARAMS)
        assert found.certified == certified, found.reasons
    assert found.required_clearance_m == pytest.approx(told.required_clearance_m)
    assert found.budget is not None
    assert next(term for term in found.budget.terms if term.code == "dsm_place").value_m == 15.0
    assert found.home is not None
    assert found.home.reach_m > 15.0


def test_what_the_models_tell_of_their_error_is_demanded_once_and_everywhere() -> None:
    request = PlanRequest(pois=(Poi(0.0, 0.0),), profile=PROFILE)
    model = pair(level(), level(), rms_m=0.5)
    own, told = request.clearance(), request.clearance_over(model)
    assert own.budget is not None
    more_m = 3 * 0.02 - own.budget.value_m("dsm_accuracy")
    assert more_m < 0.0, "the profile's own is more"
    assert told == own
    worse = catalogue_of(*(replace(each, rms_m=0.4) for each in model.models))
    told = request.clearance_over(worse)
    more_m = 3 * 0.4 - own.budget.value_m("dsm_accuracy")
    assert told.required_clearance_m == pytest.approx(own.required_clearance_m + more_m)
    assert told.budget is not None
    assert told.budget.total_m == pytest.approx(told.required_clearance_m)
    assert with_accuracy(told, worse) == told
    # Set by hand it stays, and what it does not cover is told.
    by_hand = replace(request, required_clearance_m=own.required_clearance_m + 0.01).clearance_over(worse)
    assert by_hand.required_clearance_m == pytest.approx(own.required_clearance_m + 0.01)
    assert uncovered_words(by_hand.budget, by_hand.required_clearance_m) is not None
    assert math.isclose(over_right(worse.whole(), 12.0).required_clearance_m, PARAMS.required_clearance_m + more_m)


def test_where_models_are_apart_nobody_lands() -> None:
    dsm = pair(level(), level(5.0), rms_m=0.02, east_m=30.0).whole()
    known = np.isfinite(traversable_ground(dsm, 1.0).dsm.elevation_m)
    assert not known[:, 40:60].any()
    assert known[:, :5].all()
    assert known[:, 85:].all()
