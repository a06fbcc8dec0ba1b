"""Guided ways: certified ones keep their distance by brute force, and what cannot be certified is refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from mapping.geometry.arrays import F64
from planning.certificate.certificate_model import ClearanceParams
from planning.errors import MissionError, ParameterError
from planning.fence.fence_model import RallyPoint
from planning.guided.guided_model import (
    Back,
    Demand,
    GoTo,
    GuidedWay,
    Here,
    LatLon,
    Look,
    Orbit,
    Rally,
    TakeOff,
    ToHome,
    Wish,
)
from planning.guided.shapes import BESIDE_M, simplified
from planning.guided.ways import guided_way
from planning.terrain.dsm import Dsm
from tests.reference.clearance import segment_distance

WEST, NORTH, SIDE_M = 500_000.0, 4_170_000.0, 120
REQUIRED_M = 3.0
CLEARANCE = ClearanceParams(REQUIRED_M, vehicle_radius_m=0.5, position_error_m=0.5, rtl_height_m=80.0)
DEMAND = Demand(CLEARANCE, speed_m_s=4.0, climb_m_s=2.0, descent_m_s=1.0)
HOME = (60.0, 60.0)


def model(elevation_m: F64) -> Dsm:
    transform = Affine(1.0, 0, WEST, 0, -1.0, NORTH)
    return Dsm(elevation_m.astype(np.float32), transform, CRS.from_epsg(32633), None, "")


def flat(height_m: float = 100.0) -> F64:
    return np.full((SIDE_M, SIDE_M), height_m)


def walled() -> F64:
    """A wall of 12 m to the east of home, from south to north."""
    z = flat()
    z[:, 80:82] = 112.0
    return z


def at(dsm: Dsm, east_m: float, south_m: float) -> LatLon:
    lat, lon = dsm.lat_lon_from_xy(np.array([[WEST + east_m, NORTH - south_m]]))[0]
    return float(lat), float(lon)


def here(dsm: Dsm, east_m: float = 60.0, south_m: float = 60.0, up_m: float = 5.0) -> Here:
    return Here(at(dsm, east_m, south_m), up_m, at(dsm, *HOME))


def asked(z: F64, wish: Wish, *, start: Here | None = None, demand: Demand = DEMAND) -> GuidedWay:
    dsm = model(z)
    return guided_way(dsm, dsm, here(dsm) if start is None else start, wish, demand)


def nearest_m(z: F64, way: GuidedWay) -> float:
    """Of the whole way but its first rise, by the slow reference."""
    points = np.column_stack([way.points_m[:, 0] - WEST, NORTH - way.points_m[:, 1], way.points_m[:, 2]])
    if way.rises_m > 0:
        assert points[0, :2] == pytest.approx(points[1, :2], abs=1e-6)  # straight up
        points[0, 2] += way.rises_m
    return min(segment_distance(z.astype(np.float32), 1.0, a, b) for a, b in pairwise(points))


def test_over_flat_ground_it_flies_straight_to_the_height_that_was_asked_for() -> None:
    dsm = model(flat())
    way = asked(flat(), GoTo(7.0, at(dsm, 90.0, 60.0)))
    assert way.problem is None
    assert len(way.places) == 2
    assert way.places[-1][2] == pytest.approx(7.0)
    assert way.raised_m == 0.0
    assert way.clearance_m == pytest.approx(5.0)
    assert way.length_m == pytest.approx(np.hypot(30.0, 2.0))
    assert way.seconds == pytest.approx(30.0 / 4.0)


def test_over_a_wall_it_goes_up_over_and_down_no_higher_than_it_must() -> None:
    dsm, z = model(walled()), walled()
    way = asked(z, GoTo(5.0, at(dsm, 100.0, 60.0)))
    assert way.problem is None
    assert [round(up, 1) for *_, up in way.places] == [5.0, 15.0, 15.0, 5.0]
    assert way.raised_m == 0.0
    assert nearest_m(z, way) == pytest.approx(REQUIRED_M, abs=0.03)


def test_a_place_beside_a_wall_is_raised_until_it_keeps_the_distance_and_that_is_said() -> None:
    dsm, z = model(walled()), walled()
    way = asked(z, GoTo(2.0, at(dsm, 83.0, 60.0)))
    assert way.problem is None
    assert way.raised_m > 5.0
    assert nearest_m(z, way) >= REQUIRED_M


def test_too_near_to_the_surface_it_climbs_straight_up_first() -> None:
    z = walled()
    way = asked(z, GoTo(8.0, at(model(z), 60.0, 90.0)), start=here(model(z), 78.5, 60.0))
    assert way.problem is None
    assert way.rises_m > 5.0
    assert nearest_m(z, way) >= REQUIRED_M


def test_inside_the_surface_nothing_is_laid() -> None:
    with pytest.raises(MissionError, match="inside what stands here"):
        asked(walled(), GoTo(8.0), start=here(model(walled()), 81.0, 60.0))


def test_it_keeps_away_from_unknown_ground_and_the_models_edge() -> None:
    z = flat()
    z[60, 85] = np.nan
    for place in ((85.5, 60.5), (87.0, 61.0), (119.0, 30.0)):
        with pytest.raises(MissionError, match="knows no height"):
            asked(z, GoTo(8.0, at(model(z), *place)))
    over = asked(z, GoTo(8.0, at(model(z), 100.0, 60.5)))
    assert over.problem == "way"
    assert "unknown terrain" in over.reasons[0]


def test_a_home_that_may_lie_lower_raises_the_way() -> None:
    z = flat()
    z[58:62, 58:62] = 99.0
    z[59:61, 59:61] = 99.2  # home; around it 0.2 m lower
    way = asked(z, GoTo(3.0, at(model(z), 90.0, 60.0)))
    assert way.problem is None
    assert way.certificate.home is not None
    assert way.certificate.home.drop_m == pytest.approx(0.2, abs=0.01)
    assert way.clearance_m >= REQUIRED_M
    assert way.raised_m == pytest.approx(0.5, abs=0.02)


def test_a_height_limit_is_not_raised_over() -> None:
    demand = replace(DEMAND, clearance=replace(CLEARANCE, max_height_above_ground_m=10.0))
    way = asked(walled(), GoTo(5.0, at(model(walled()), 100.0, 60.0)), demand=demand)
    assert way.problem == "way"
    assert any("limit is 10.00 m" in reason for reason in way.reasons)


def test_where_only_the_vehicles_own_return_is_not_clear_that_is_another_problem() -> None:
    z = flat()
    z[:, 70:72] = 160.0
    low = replace(DEMAND, clearance=replace(CLEARANCE, rtl_height_m=15.0))
    way = asked(z, GoTo(8.0, at(model(z), 90.0, 90.0)), start=here(model(z), 90.0, 60.0), demand=low)
    assert way.problem == "return"
    assert nearest_m(z, way) >= REQUIRED_M
    assert "return height" in way.reasons[0]


@pytest.mark.parametrize("clockwise", [True, False])
def test_an_orbit_is_level_round_and_ends_where_it_began(clockwise: bool) -> None:
    z = walled()
    way = asked(z, Orbit(at(model(z), 60.0, 60.0), 15.0, 6.0, laps=2, clockwise=clockwise))
    assert way.problem is None
    circle_m = way.points_m[-73:]
    centre = np.array([WEST + 60.0, NORTH - 60.0])
    assert np.hypot(*(circle_m[:, :2] - centre).T) == pytest.approx(np.full(73, 15.0))
    assert circle_m[0] == pytest.approx(circle_m[-1])
    assert np.ptp(circle_m[:, 2]) == 0.0
    a, b = circle_m[0, :2] - centre, circle_m[1, :2] - centre
    assert (a[0] * b[1] - a[1] * b[0] < 0) == clockwise


def test_an_orbit_may_go_around_what_is_higher_than_itself() -> None:
    z = flat()
    z[58:62, 58:62] = 150.0
    way = asked(z, Orbit(at(model(z), 60.0, 60.0), 15.0, 0.5), start=here(model(z), 60.0, 90.0))
    assert way.places[-1][2] == pytest.approx(-50.0 + 50.5, abs=51.0)
    low = asked(z, Orbit(at(model(z), 55.0, 60.0), 20.0, 6.0), start=here(model(z), 60.0, 90.0))
    assert low.problem in (None, "return")
    assert low.places[-1][2] < 20.0
    assert nearest_m(z, low) >= REQUIRED_M


def test_a_take_off_ends_over_home_and_needs_a_free_column() -> None:
    dsm = model(flat())
    up = asked(flat(), TakeOff(6.0), start=here(dsm, up_m=0.0))
    assert up.problem is None
    assert [place[2] for place in up.places] == [0.0, 6.0]
    z = flat()
    z[60, 60] = 104.0
    assert asked(z, TakeOff(6.0), start=here(model(z), up_m=0.0)).problem is not None


def test_a_take_off_from_anywhere_but_home_is_refused() -> None:
    """Armed where it has landed, it would fly straight from there to over its home, through whatever stands between."""
    dsm = model(walled())
    for east_m in (61.5, 100.0):
        with pytest.raises(MissionError, match="from its home") as error:
            asked(walled(), TakeOff(6.0), start=here(dsm, east_m, up_m=0.0))
        assert "Disarm" in error.value.advice


def test_a_look_stays_where_it_is() -> None:
    dsm = model(flat())
    way = asked(flat(), Look(at(dsm, 90.0, 60.0)))
    assert way.problem is None
    assert way.length_m == 0.0


def test_ways_home_are_offered_although_the_own_return_is_too_low() -> None:
    z = flat()
    z[:, 80:82] = 130.0
    low = replace(DEMAND, clearance=replace(CLEARANCE, rtl_height_m=15.0))
    start = here(model(z), 100.0, 60.0)
    home = asked(z, ToHome(5.0), start=start, demand=low)
    assert home.problem is None
    assert max(up for *_, up in home.places) == pytest.approx(33.0, abs=0.1)
    assert home.places[-1][:2] == pytest.approx(start.home_lat_lon_deg)
    rally = RallyPoint(*at(model(z), 100.0, 90.0), 5.0)
    beside = asked(z, Rally(rally, 5.0), start=start, demand=low)
    assert beside.problem is None
    assert beside.length_m < home.length_m


def test_a_rally_point_in_a_bush_is_refused() -> None:
    z = flat()
    z[90, 100] = 102.0
    rally = RallyPoint(*at(model(z), 100.5, 90.5), 5.0)
    way = asked(z, Rally(rally, 5.0), start=here(model(z), 100.0, 60.0))
    assert way.problem == "way"
    assert "landing place is not clear" in way.reasons[0]


def test_back_along_the_flown_way_is_the_way_that_was_flown() -> None:
    z = walled()
    dsm = model(z)
    flown = [(*at(dsm, *HOME), 16.0), *((*at(dsm, 60.0 + k, 60.0), 16.0) for k in range(1, 41))]
    way = asked(z, Back(tuple(flown)), start=here(dsm, 100.0, 60.0, 16.0))
    assert way.problem is None
    assert len(way.places) == 2
    assert way.places[-1][:2] == pytest.approx(at(dsm, *HOME))
    through = [(*at(dsm, *HOME), 5.0), (*at(dsm, 100.0, 60.0), 5.0)]
    raised = asked(z, Back(tuple(through)), start=here(dsm, 100.0, 60.0, 5.0))
    assert raised.raised_m > 0.0
    assert nearest_m(z, raised) >= REQUIRED_M


def test_back_does_not_land_where_nobody_has_looked() -> None:
    """The flown way is known from where the ground station began to listen on: that need not be home."""
    dsm, start = model(flat()), here(model(flat()), 100.0, 60.0, 16.0)
    cut = tuple((*at(dsm, 60.0 + k, 60.0), 16.0) for k in range(10, 41))
    with pytest.raises(MissionError, match=r"10\.0 m beside home") as error:
        asked(flat(), Back(cut), start=start)
    assert error.value.advice
    z = flat()
    z[60, 57] = 102.0
    beside = tuple((*at(dsm, 57.5 + k, 60.5), 16.0) for k in range(41))
    way = asked(z, Back(beside), start=start)
    assert way.problem == "way"
    assert "landing place is not clear" in " ".join(way.reasons)


@pytest.mark.parametrize(
    "wish",
    [GoTo(0.1), GoTo(float("nan")), GoTo(5.0, (91.0, 0.0)), Orbit((37.6, 15.0), 1.0, 5.0), TakeOff(-3.0), TakeOff(9e9)],
)
def test_what_no_way_can_be_is_a_clear_error(wish: Wish) -> None:
    with pytest.raises(ParameterError) as error:
        asked(flat(), wish)
    assert error.value.advice


def test_too_many_laps_and_too_far_a_place_are_refused() -> None:
    dsm = model(flat())
    with pytest.raises(ParameterError, match="laps"):
        asked(flat(), Orbit(at(dsm, 60, 60), 10.0, 5.0, laps=0))
    with pytest.raises(MissionError, match=r"knows no height|km away"):
        asked(flat(), GoTo(5.0, (30.0, 15.0)))


def test_without_a_place_nothing_is_laid() -> None:
    start = replace(here(model(flat())), alt_rel_home_m=float("nan"))
    with pytest.raises(MissionError, match="not known"):
        asked(flat(), GoTo(5.0), start=start)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_certified_keeps_its_distance_by_brute_force(seed: int) -> None:
    random = np.random.default_rng(seed)
    z = flat() + random.normal(0.0, 0.3, (SIDE_M, SIDE_M))
    z[55:66, 55:66] = 100.0
    for _ in range(6):
        row, col = random.integers(10, SIDE_M - 15, 2)
        if max(abs(row - 60), abs(col - 60)) > 12:
            z[row : row + random.integers(1, 5), col : col + random.integers(1, 5)] += random.uniform(2.0, 25.0)
    dsm = model(z)
    place = at(dsm, *random.uniform(12.0, SIDE_M - 12.0, 2))
    start = here(dsm, *random.uniform(15.0, SIDE_M - 15.0, 2), up_m=random.uniform(3.0, 30.0))
    height_m = random.uniform(0.5, 20.0)
    wish = [GoTo(height_m, place), Orbit(place, random.uniform(3.0, 9.0), height_m), ToHome(height_m)][seed % 3]
    try:
        way = asked(z, wish, start=start)
    except MissionError:
        return
    if way.problem != "way":
        assert nearest_m(z, way) >= REQUIRED_M - 1e-6
        assert way.clearance_m >= REQUIRED_M
        assert way.raised_m >= 0.0


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_a_simplified_track_stays_beside_the_whole(seed: int) -> None:
    random = np.random.default_rng(seed)
    track = np.cumsum(random.normal(0.0, 0.4, (80, 3)), axis=0)
    kept = simplified(track)
    assert np.array_equal(kept[[0, -1]], track[[0, -1]])
    for point in track:
        assert min(_away_m(point, a, b) for a, b in pairwise(kept)) <= BESIDE_M + 1e-9


def _away_m(p: F64, a: F64, b: F64) -> float:
    share = np.linspace(0.0, 1.0, 401)[:, None]
    return float(np.linalg.norm(a + share * (b - a) - p, axis=1).min()) - float(np.linalg.norm(b - a)) / 400
