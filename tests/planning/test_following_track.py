"""Which part of a flight is judged, how late it was, and what its figures are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS, Geod

from planning.following.figures import judge
from planning.following.lag import late_s, planned_alt_dsm_m, planned_s
from planning.following.live import Following, follow_on
from planning.following.nearest import follow
from planning.following.surface_distance import SurfaceDistance
from planning.following.track import Track
from planning.terrain.dsm import Dsm
from tests.planning.following_lines import flown, line
from tests.reference import clearance as clearance_oracle
from tests.reference import following as oracle

SQUARE = line([(10, 10, 12), (60, 10, 12), (60, 60, 20), (10, 60, 12)])


def figures_of(track, reference=SQUARE, surface=None):
    figures = judge(reference, track, surface).figures
    assert figures is not None
    return figures


def test_a_flight_exactly_as_planned():
    t_s, xyz_m = flown(SQUARE)
    figures = figures_of(Track(t_s + 1000.0, xyz_m))
    assert figures.completed
    assert figures.told_by == "geometry"
    assert figures.cross_track.max_m == pytest.approx(0.0, abs=1e-9)
    assert (figures.height_lowest_m, figures.height_highest_m) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert figures.flight_s == pytest.approx(figures.predicted_s, abs=0.1)
    assert figures.lag_s == pytest.approx(0.0, abs=1e-6)
    assert figures.nearest is None


@given(delay_s=st.floats(0, 20), speed_m_s=st.floats(0.8, 4.0))
@settings(max_examples=25, deadline=None)
def test_the_lag_agrees_with_the_slow_one(delay_s, speed_m_s):
    t_s, xyz_m = flown(SQUARE, speed_m_s=speed_m_s)
    waiting = t_s + delay_s * (t_s > 0)  # stands at the first waypoint for that long
    figures = figures_of(Track(waiting, xyz_m))
    s_m = np.minimum(t_s * speed_m_s, SQUARE.length_m)
    slow_s = oracle.lag(SQUARE.s_m, SQUARE.arrive_s - SQUARE.takeoff_s, s_m, waiting, 0.5)
    assert figures.lag_s == pytest.approx(slow_s, abs=0.02)
    if speed_m_s == 2.0:
        assert figures.lag_s == pytest.approx(delay_s, abs=0.05)


def test_a_flight_that_is_delayed_lags_by_the_delay():
    held = line([(10, 10, 12), (60, 10, 12), (60, 60, 20), (10, 60, 12)], hold_s=4.0)
    t_s, xyz_m = flown(held)
    assert figures_of(Track(t_s, xyz_m), held).lag_s == pytest.approx(-4.0, abs=0.1)  # it held nowhere: 0, 4 and 8 s


def test_errors_are_measured_beside_and_above():
    t_s, xyz_m = flown(SQUARE)
    figures = figures_of(Track(t_s, xyz_m + np.array([0.0, 0.0, 0.3])))
    assert figures.height.mean_m == pytest.approx(0.3)
    assert (figures.height_lowest_m, figures.height_highest_m) == pytest.approx((0.3, 0.3))
    assert figures.cross_track.max_m == pytest.approx(0.0, abs=1e-9)


def test_the_histogram_counts_every_position_once():
    t_s, xyz_m = flown(SQUARE)
    rng = np.random.default_rng(6)
    figures = figures_of(Track(t_s, xyz_m + rng.normal(0.0, 0.4, xyz_m.shape)))
    assert figures.histogram_counts.sum() == figures.positions
    assert figures.histogram_edges_m[0] == 0.0
    assert figures.histogram_edges_m[-1] >= figures.cross_track.max_m
    assert len(figures.histogram_edges_m) == len(figures.histogram_counts) + 1


def test_what_the_vehicle_said_it_reached_bounds_the_window():
    t_s, xyz_m = flown(SQUARE)
    figures = figures_of(Track(t_s, xyz_m, reached=((3.0, 0), (20.0, 1), (70.0, 3))))
    assert (figures.start_s, figures.end_s, figures.told_by) == (3.0, 70.0, "vehicle")
    broken = figures_of(Track(t_s, xyz_m, reached=((3.0, 0), (20.0, 1)), on_mission=((0.0, 40.0),)))
    assert (broken.end_s, broken.completed) == (40.0, False)


def test_take_off_and_way_home_are_left_out():
    t_s, xyz_m = flown(SQUARE)
    up = np.column_stack([np.full(50, 10.0), np.full(50, 10.0), np.linspace(0, 11.9, 50)])
    home = np.linspace(xyz_m[-1], [10.0, 10.0, 12.0], 100)[1:]
    both = np.vstack([up, xyz_m, home])
    figures = figures_of(Track(np.linspace(0.0, 0.1 * (len(both) - 1), len(both)), both))
    assert figures.completed
    assert figures.start_s == pytest.approx(5.0, abs=0.11)
    assert figures.end_s == pytest.approx(5.0 + t_s[-1], abs=0.11)
    assert figures.height.max_m < 0.2


def test_an_interruption_and_the_way_back_do_not_count():
    t_s, xyz_m = flown(SQUARE)
    away = xyz_m.copy()
    away[(t_s > 20) & (t_s < 40)] += [0.0, 0.0, 30.0]
    spans = ((0.0, 20.0), (35.0, 200.0))  # on the mission again, but still high above the line until 40 s
    figures = figures_of(Track(t_s, away, on_mission=spans))
    assert figures.height.max_m == pytest.approx(0.0, abs=1e-9)
    assert figures.completed
    assert figures_of(Track(t_s, away)).height.max_m > 29


def test_a_flight_that_never_came_to_the_line():
    t_s, xyz_m = flown(SQUARE)
    judged = judge(SQUARE, Track(t_s, xyz_m + np.array([0.0, 0.0, 500.0])), None)
    assert judged.figures is None
    assert judged.window is None
    assert len(judged.found.s_m) == len(t_s)


def test_a_flight_taken_up_in_the_middle():
    t_s, xyz_m = flown(SQUARE)
    later = t_s > 35
    figures = figures_of(Track(t_s[later], xyz_m[later]))
    assert figures.completed
    assert figures.start_s == pytest.approx(35.1, abs=0.11)
    assert figures.lag_s == pytest.approx(0.0, abs=0.1)
    assert figures.predicted_s == pytest.approx(figures.flight_s, abs=0.2)


def test_waypoints_handed_over_one_by_one_go_on_to_the_end_of_the_span():
    part = SQUARE.ending_at(1)
    t_s, xyz_m = flown(SQUARE)
    spans = ((0.0, 27.0),)  # four metres past the last waypoint that was handed over
    figures = figures_of(Track(t_s, xyz_m, on_mission=spans, one_by_one=True), part)
    assert not figures.completed
    assert figures.cross_track.max_m == pytest.approx(4.0, abs=0.01)
    assert figures_of(Track(t_s, xyz_m, on_mission=spans), part).cross_track.max_m < 0.01


def hills(unknown=()):
    rng = np.random.default_rng(7)
    cells = rng.uniform(0.0, 6.0, (80, 90)).astype(np.float32)
    for row, col in unknown:
        cells[row, col] = np.nan
    true_here = CRS.from_user_input("+proj=tmerc +lat_0=37 +lon_0=15 +k=1 +ellps=WGS84")
    return Dsm(cells, Affine(1.0, 0.0, -5.0, 0.0, -1.0, 75.0), true_here, None, "")


def test_distances_agree_with_the_slow_ones():
    dsm = hills()
    surface = SurfaceDistance(dsm)
    _, xyz_m = flown(SQUARE, rate_hz=1.0)
    places = (xyz_m - [-5.0, 75.0, 0.0]) * [1.0, -1.0, 1.0]
    slow = [clearance_oracle.point_distance(dsm.elevation_m, 1.0, place) for place in places]
    assert surface.distances_m(xyz_m) == pytest.approx(slow)
    assert np.all(surface.distances_m(xyz_m) <= surface.heights_m(xyz_m) + 1e-9)
    x, y, z = xyz_m[7]
    assert surface.distance_m((x, y, z)) == pytest.approx(slow[7])
    assert surface.height_m((x, y, z)) == pytest.approx(surface.heights_m(xyz_m)[7])


def test_over_unknown_terrain_nothing_is_said():
    surface = SurfaceDistance(hills(unknown=[(r, c) for r in range(60, 70) for c in range(30, 45)]))
    t_s, xyz_m = flown(SQUARE)
    figures = figures_of(Track(t_s, xyz_m), surface=surface)
    assert figures.unknown_positions > 20
    assert figures.nearest is not None
    over = np.isnan(surface.heights_m(xyz_m))
    assert over.sum() == figures.unknown_positions
    assert np.isnan(surface.distances_m(xyz_m)[over]).all()
    assert surface.distance_m((1e6, 1e6, 50.0)) is None
    assert surface.height_m((1e6, 1e6, 50.0)) is None


def test_the_nearest_place_is_named_on_the_way_and_on_the_way_home():
    surface = SurfaceDistance(hills())
    t_s, xyz_m = flown(SQUARE)
    home = np.linspace(xyz_m[-1], [10.0, 10.0, 9.0], 120)[1:]
    track = Track(np.linspace(0.0, 80.0, len(t_s) + len(home)), np.vstack([xyz_m, home]))
    figures = figures_of(track, surface=surface)
    assert figures.nearest is not None
    assert figures.nearest_on_way_home is not None
    at = np.flatnonzero(track.t_s == figures.nearest.t_s)[0]
    assert tuple(track.xyz_m[at]) == figures.nearest.xyz_m
    assert figures.nearest.distance_m == pytest.approx(np.nanmin(surface.distances_m(xyz_m)))
    assert figures.nearest_on_way_home.t_s > figures.end_s
    assert math.hypot(*(np.array(figures.nearest_on_way_home.xyz_m[:2]) - [10, 10])) > 3.0


def test_following_live_tells_progress_delay_and_time_left():
    t_s, xyz_m = flown(SQUARE)
    kept, progress = Following(), None
    up = [(10.0, 10.0, z, 100.0 + k) for k, z in enumerate((0.0, 4.0, 8.0))]
    for x, y, z, when in up:
        kept, progress = follow_on(kept, SQUARE, (x, y, z), when)
        assert (progress.share, progress.behind_plan_s) == (0.0, None)
        assert progress.time_left_s == pytest.approx(SQUARE.total_s)
    for t, (x, y, z) in zip(t_s, xyz_m, strict=True):
        kept, progress = follow_on(kept, SQUARE, (x, y, z), 110.0 + 1.25 * t)  # a fifth slower than planned
    assert progress is not None
    assert progress.share == pytest.approx(1.0)
    assert progress.time_left_s == pytest.approx(20.0, abs=0.1)
    assert progress.behind_plan_s == pytest.approx(0.25 * t_s[-1], abs=1.0)


def test_following_live_from_the_middle_is_on_time_there():
    kept, progress = follow_on(Following(), SQUARE, (60.0, 30.0, 15.2), 500.0)
    assert kept.begun
    assert progress.behind_plan_s == pytest.approx(0.0)
    assert 0.4 < progress.share < 0.6


def test_without_times_there_is_no_delay_and_no_lag():
    unknown = np.full(4, math.nan)
    timeless = replace(SQUARE, arrive_s=unknown, leave_s=unknown, takeoff_s=math.nan, flight_s=math.nan)
    t_s, xyz_m = flown(SQUARE)
    figures = figures_of(Track(t_s, xyz_m), timeless)
    assert figures.lag_s is None
    assert figures.predicted_s is None
    at = follow(timeless, (60.0, 30.0, 15.2))
    assert late_s(timeless, at, 3.0) is None
    assert math.isnan(planned_s(timeless, 1, 0.5))


def test_the_plans_own_clock_tells_its_height_and_waits_where_it_holds():
    heights = np.linspace(10.0, 50.0, len(SQUARE.points_m))
    climbing = replace(SQUARE, points_m=np.column_stack([SQUARE.points_m[:, :2], heights]))
    held = replace(climbing, leave_s=climbing.leave_s + 0.0)
    held.leave_s[1] = (held.arrive_s[1] + held.arrive_s[2]) / 2
    half_s = (held.arrive_s[1] + held.leave_s[1]) / 2 - held.takeoff_s
    assert planned_alt_dsm_m(held, np.array([half_s]))[0] == pytest.approx(heights[1])
    after_s = (held.leave_s[1] + held.arrive_s[2]) / 2 - held.takeoff_s
    assert planned_alt_dsm_m(held, np.array([after_s]))[0] == pytest.approx(heights[1:3].mean())
    outside = np.array([-1e6, 1e6])
    assert np.isnan(planned_alt_dsm_m(held, outside)).all()
    untimed = replace(held, arrive_s=np.full(len(heights), np.nan), leave_s=np.full(len(heights), np.nan))
    assert np.isnan(planned_alt_dsm_m(untimed, np.array([0.0]))).all()


def test_distances_to_the_surface_are_those_on_the_ground():
    """At 5.4 degrees of latitude a metre is 1.0044 m of EPSG:3857."""
    cells = np.zeros((60, 100), np.float32)
    cells[:, 60:] = 200.0
    dsm = Dsm(cells, Affine(1.0, 0.0, 1.67e6, 0.0, -1.0, 6.0e5), CRS.from_epsg(3857), None, "")
    place = 1.67e6 + 40.0, 6.0e5 - 30.0
    ends = dsm.lat_lon_from_xy(np.array([place, (1.67e6 + 60.0, place[1])]))
    true_m = Geod(ellps="WGS84").inv(*ends[0, ::-1], *ends[1, ::-1])[2]
    assert true_m == pytest.approx(19.91, abs=0.01)
    assert SurfaceDistance(dsm).distance_m((*place, 90.0)) == pytest.approx(true_m, abs=1e-3)
