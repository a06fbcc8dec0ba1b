"""Flights with random errors against probabilities that are known, and against a slow search."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from affine import Affine
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS

from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import HomeStand
from planning.certificate.nearest import nearest_distances
from planning.errors import ParameterError
from planning.margins.budget import ClearanceBudget, Term, TermCode
from planning.risk.flights import RiskGround, errors_m, fly, risk_ground
from planning.risk.tally import Risk, risk_of, share_of
from planning.risk.uncertain import ErrorCode, RandomError, Uncertain, uncertain_of
from planning.terrain.dsm import Dsm

RADIUS_M = 0.5
NORMAL = NormalDist()


def model(elevation_m: np.ndarray) -> Dsm:
    rows = len(elevation_m)
    transform = Affine(1, 0, 500_000, 0, -1, 5_000_000 + rows)
    return Dsm(elevation_m.astype(np.float32), transform, CRS.from_epsg(32633), None, "0")


FLAT = model(np.zeros((60, 200)))


def line_at(height_m: float, *, east_m: tuple[float, float] = (60.0, 140.0), north_m: float = 30.0) -> FlownLine:
    ends = [(500_000 + x, 5_000_000 + north_m, height_m) for x in east_m]
    return FlownLine(np.array(ends), np.array([1]), (500_060.0, 5_000_030.0), 0.0, height_m, True)


def error(code: ErrorCode, sigma_m: float, correlation_m: float = math.inf) -> RandomError:
    return RandomError(code, 3 * sigma_m, sigma_m, correlation_m, "")


def uncertain(*errors: RandomError, home_m: tuple[float, float] | None = None) -> Uncertain:
    return Uncertain(errors, home_m, RADIUS_M, 3.0)


def estimated(height_m: float, what: Uncertain, flights: int, dsm: Dsm = FLAT, step_m: float = 20.0) -> Risk:
    ground = risk_ground(dsm, line_at(height_m), step_m=step_m)
    return risk_of(fly(ground, what, range(flights), 7), ground, dsm, RADIUS_M)


def is_near(risk: Risk, probability: float) -> bool:
    """Four standard deviations of a binomial: one of 16,000 seeds would lie beyond."""
    share = risk.contact
    return abs(share.estimate - probability) < 4 * math.sqrt(probability * (1 - probability) / share.flights)


@pytest.mark.parametrize("beyond", [0.0, 0.5, 1.0, 2.0])
def test_over_a_plane_of_uncertain_height_it_is_the_gaussian_s_tail(beyond: float) -> None:
    found = estimated(RADIUS_M + beyond * 0.7, uncertain(error("dsm_accuracy", 0.7)), 8000)
    assert is_near(found, 1 - NORMAL.cdf(beyond))
    assert found.contact.low < found.contact.estimate < found.contact.high


def test_errors_of_two_kinds_add_as_their_squares_do() -> None:
    what = uncertain(error("dsm_accuracy", 0.3), error("position_error", 0.4))
    assert is_near(estimated(RADIUS_M + 0.5, what, 8000), 1 - NORMAL.cdf(1.0))


def test_what_lies_elsewhere_touches_nothing_over_a_plane() -> None:
    assert estimated(RADIUS_M + 0.1, uncertain(error("dsm_place", 3.0)), 500).contact.hits == 0


def test_what_the_vehicle_stands_on_at_home_moves_the_whole_line() -> None:
    assert is_near(estimated(RADIUS_M + 0.3, uncertain(home_m=(-1.0, 0.5)), 8000), 0.7 / 1.5)


def test_errors_that_change_along_the_line_have_more_chances() -> None:
    """The same process drawn in another way: all places at once, by their covariance."""
    step_m, length_m, flights = 4.0, 12.0, 8000
    places = round(80.0 / step_m) + 1
    at_m = step_m * np.arange(places)
    root = np.linalg.cholesky(np.exp(-np.abs(at_m[:, None] - at_m) / length_m))
    slow = np.random.default_rng(3).standard_normal((40_000, places)) @ root.T
    probability = float((slow.max(axis=1) >= 2.0).mean())
    assert probability > 3 * (1 - NORMAL.cdf(2.0))
    found = estimated(RADIUS_M + 2.0, uncertain(error("dsm_accuracy", 1.0, length_m)), flights, step_m=step_m)
    assert abs(found.contact.estimate - probability) < 5 * math.sqrt(probability * (1 - probability) / flights)


def test_an_error_keeps_what_its_length_says() -> None:
    ground = risk_ground(FLAT, line_at(5.0), step_m=5.0)
    what = uncertain(error("following", 2.0, 10.0))
    drawn = np.array([errors_m(ground, what, np.random.default_rng([1, k])) for k in range(4000)])
    np.testing.assert_allclose(drawn.std(axis=(0, 1)), 2.0, rtol=0.03)
    for lag in (1, 2, 4):
        kept = (drawn[:, lag:] * drawn[:, :-lag]).mean(axis=(0, 1)) / 4.0
        np.testing.assert_allclose(kept, math.exp(-lag * 5.0 / 10.0), atol=0.05)
    between_axes = (drawn[:, :, 0] * drawn[:, :, 2]).mean() / 4.0
    assert abs(between_axes) < 0.05


def slowly(ground: RiskGround, what: Uncertain, flight: int, seed: int) -> tuple[float, np.ndarray]:
    """Every piece looked at."""
    moved_m = ground.places_m + errors_m(ground, what, np.random.default_rng([seed, flight]))
    framed_m = ground.layout.in_frame(moved_m)
    distance_m, _ = nearest_distances(ground.pyramid, framed_m[:-1], framed_m[1:])
    return float(distance_m.min()), distance_m


@given(seed=st.integers(0, 2**31 - 1))
def test_pieces_that_are_passed_over_are_farther(seed: int) -> None:
    rough = model(np.random.default_rng(seed).uniform(0.0, 6.0, (60, 200)))
    ground = risk_ground(rough, line_at(7.0), step_m=2.0)
    what = uncertain(error("position_error", 0.5, 40.0), error("following", 0.6, 5.0), error("dsm_place", 1.0))
    found = fly(ground, what, range(6), seed)
    for flight in range(6):
        least_m, distances_m = slowly(ground, what, flight, seed)
        assert found.distance_m[flight] == least_m
        assert distances_m[found.piece[flight]] == least_m


def test_a_flight_is_that_of_its_seed_and_number_alone() -> None:
    ground = risk_ground(FLAT, line_at(5.0), step_m=2.0)
    what = uncertain(error("following", 0.5, 15.0), home_m=(-0.2, 0.1))
    together = fly(ground, what, range(20), 5).distance_m
    apart = [fly(ground, what, numbers, 5).distance_m for numbers in (range(13), range(13, 20))]
    np.testing.assert_array_equal(together, np.concatenate(apart))
    assert len(set(together.tolist())) == 20
    assert not (fly(ground, what, range(20), 6).distance_m == together).any()


def test_the_worst_place_is_where_the_wall_stands() -> None:
    elevation = np.zeros((60, 200))
    elevation[:, 100] = 4.0
    walled = model(elevation)
    found = estimated(RADIUS_M + 4.8, uncertain(error("following", 0.5, 15.0)), 400, walled, 0.5)
    assert found.contact.hits > 10
    assert found.worst.contacts > 0.5 * found.contact.hits
    assert found.worst.s_m == pytest.approx(40.5, abs=2.0)
    assert found.worst.planned_m == pytest.approx(RADIUS_M + 0.8, abs=0.3)
    high = estimated(RADIUS_M + 9.0, uncertain(error("following", 0.5, 15.0)), 100, walled, 0.5)
    assert (high.contact.hits, high.worst.contacts) == (0, 0)
    assert high.worst.s_m == pytest.approx(40.5, abs=2.0)
    assert high.nearest_hull_m == min(high.hull_m.values()) > 0


def test_unknown_ground_counts_as_infinitely_high() -> None:
    unknown = np.zeros((60, 200))
    unknown[:, 100] = np.nan
    assert estimated(50.0, uncertain(error("dsm_accuracy", 0.1)), 10, model(unknown)).contact.hits == 10


def at_most(hits: int, flights: int, probability: float) -> float:
    terms = (math.comb(flights, k) * probability**k * (1 - probability) ** (flights - k) for k in range(hits + 1))
    return sum(terms)


@given(flights=st.integers(1, 60), data=st.data(), confidence=st.sampled_from([0.8, 0.95, 0.99]))
def test_bounds_are_those_of_the_binomial(flights: int, data: st.DataObject, confidence: float) -> None:
    hits = data.draw(st.integers(0, flights))
    share = share_of(hits, flights, confidence)
    assert share.low <= share.estimate <= share.high
    if hits == 0:
        assert at_most(0, flights, share.high) == pytest.approx(1 - confidence)
        return
    assert 1 - at_most(hits - 1, flights, share.low) == pytest.approx((1 - confidence) / 2, rel=1e-6)
    if hits < flights:
        assert at_most(hits, flights, share.high) == pytest.approx((1 - confidence) / 2, rel=1e-6)


def test_without_contacts_it_is_about_three_in_so_many() -> None:
    assert share_of(0, 10_000).high == pytest.approx(3.0 / 10_000, rel=0.01)


STAND = HomeStand(100.0, 99.5, 100.25, 0.5, 1.0, "model", 3.0)


def budget(**values_m: float) -> ClearanceBudget:
    codes: tuple[TermCode, ...] = ("vehicle_radius", "position_error", "following", "dsm_accuracy", "downwash")
    return ClearanceBudget(tuple(Term(code, values_m.get(code, 0.0), code) for code in codes))


def test_each_term_s_worse_end_is_so_many_standard_deviations_away() -> None:
    found = uncertain_of(budget(vehicle_radius=0.4, position_error=0.3, following=1.2, downwash=0.5), STAND, sigmas=3.0)
    assert [(each.code, each.sigma_m) for each in found.errors] == [
        ("position_error", pytest.approx(0.1)),
        ("following", pytest.approx(0.4)),
    ]
    assert (found.radius_m, found.home_m) == (0.4, (-0.5, 0.25))
    longer = uncertain_of(budget(following=1.2), STAND, sigmas=2.0, correlation_m={"following": math.inf})
    assert [(each.sigma_m, each.correlation_m) for each in longer.errors] == [(pytest.approx(0.6), math.inf)]


def test_home_that_is_not_known_is_left_out() -> None:
    assert uncertain_of(budget(), None).home_m is None
    assert uncertain_of(budget(), replace(STAND, drop_m=math.nan, low_dsm_m=math.nan)).home_m is None


@pytest.mark.parametrize("sigmas", [0.0, -1.0, math.inf, math.nan])
def test_bounds_that_are_none_are_refused(sigmas: float) -> None:
    with pytest.raises(ParameterError, match="--sigmas"):
        uncertain_of(budget(), STAND, sigmas=sigmas)


@pytest.mark.parametrize("length_m", [0.0, -3.0, math.nan])
def test_lengths_that_are_none_are_refused(length_m: float) -> None:
    with pytest.raises(ParameterError, match="following the line cannot be alike"):
        uncertain_of(budget(), STAND, correlation_m={"following": length_m})


@pytest.mark.parametrize("confidence", [0.0, 1.0, 2.0, math.nan])
def test_confidence_that_is_none_is_refused(confidence: float) -> None:
    with pytest.raises(ParameterError, match="--confidence"):
        share_of(0, 10, confidence)
