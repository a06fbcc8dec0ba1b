"""The tracker: objects found, followed, kept apart and forgotten."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackerParams, TrackState
from tests.mapping.radar_scenes import Frame, Radar, frames, movers, stepped

COORDINATES = ("cartesian", "polar")
CLEAN = Radar(detection_probability=1.0, false_alarms=0.0)
HERE = {"position_enu_m": (0.0, 0.0), "velocity_enu_m_s": (0.0, 0.0), "heading_rad": 0.0}
ONE = np.array([[-8.0, 40.0, 1.5, 0.0]])


def follow(scene: list[Frame], params: TrackerParams | None = None, tracker: Tracker | None = None):
    tracker = tracker or Tracker(params)
    return [stepped(tracker, frame) for frame in scene]


def objects(states: list[TrackState]) -> list[TrackState]:
    return [state for state in states if state.confirmed]


@pytest.mark.parametrize("coordinates", COORDINATES)
def test_an_object_is_found_with_its_velocity_over_ground(coordinates):
    scene = frames(ONE, seed=1, count=80, radar=CLEAN)
    [found] = objects(follow(scene, TrackerParams(coordinates=coordinates))[-1])
    assert np.hypot(*(found.position_enu_m - scene[-1].truth[0, :2])) < 0.8
    assert np.hypot(*(found.velocity_enu_m_s - ONE[0, 2:])) < 1.2
    assert found.seen
    assert found.updates == 80
    assert found.age_s == pytest.approx(7.9)


@pytest.mark.parametrize("coordinates", COORDINATES)
def test_a_thing_that_stands_still_has_no_velocity_however_the_vehicle_turns_and_brakes(coordinates):
    tracker, states, place, speed = Tracker(TrackerParams(coordinates=coordinates)), [], 0.0, 5.0
    for k in range(60):
        speed = 5.0 if k < 20 else max(1.0, speed - 0.25)
        place += 0.1 * speed
        heading, off = 0.5 * math.sin(0.1 * k), np.array([3.0, 40.0 - place])
        range_m, bearing = math.hypot(*off), math.atan2(off[0], off[1])
        detection = [[range_m, bearing - heading, -speed * off[1] / range_m]]
        states = tracker.step(
            0.1 * k, detection, position_enu_m=(0, place), velocity_enu_m_s=(0, speed), heading_rad=heading
        )
    [found] = objects(states)
    assert np.hypot(*found.velocity_enu_m_s) < 0.25
    assert np.hypot(*(found.position_enu_m - [3.0, 40.0])) < 0.15


def test_objects_whose_ways_cross_keep_their_ids():
    crossing = np.array([[-6.0, 30.0, 2.0, 0.0], [6.0, 33.0, -2.0, 0.0]])
    told = follow(frames(crossing, seed=3, count=60, radar=CLEAN, velocity_enu_m_s=(0.0, 0.0), turn_rad_s=0.0))
    first = {state.id: state.velocity_enu_m_s[0] > 0 for state in objects(told[15])}
    last = {state.id: state.velocity_enu_m_s[0] > 0 for state in objects(told[-1])}
    assert first == last
    assert sorted(first.values()) == [False, True]


def test_a_false_alarm_is_a_candidate_for_a_moment_and_never_an_object():
    tracker = Tracker()
    [only] = tracker.step(0.0, [[30.0, 0.1, 1.0]], **HERE)
    assert not only.confirmed
    counts = [len(tracker.step(0.1 * k, np.empty((0, 3)), **HERE)) for k in range(1, 30)]
    assert counts[-1] == 0
    assert counts.index(0) <= 10


def test_an_object_that_is_gone_grows_uncertain_and_is_forgotten():
    tracker = Tracker()
    [before] = objects(follow(frames(ONE, seed=1, count=30, radar=CLEAN), tracker=tracker)[-1])
    spread = [np.trace(before.covariance)]
    for k in range(30, 200):
        states = tracker.step(0.1 * k, np.empty((0, 3)), **HERE)
        if not states:
            break
        assert states[0].confirmed
        assert not states[0].seen
        spread.append(np.trace(states[0].covariance))
    assert 10 < len(spread) < 100
    assert np.all(np.diff(spread) > 0)


@pytest.mark.parametrize("coordinates", COORDINATES)
def test_what_turns_behind_the_radar_is_forgotten_there(coordinates):
    """It is lost 2 m ahead of the nose, and its predicted way leads through the vehicle and beyond."""
    tracker = Tracker(TrackerParams(coordinates=coordinates))
    for k in range(20):
        away = 12.0 - 0.5 * k
        tracker.step(0.1 * k, [[away, 0.0, -5.0]], **HERE)
    states = tracker.step(2.1, np.empty((0, 3)), **HERE)
    for k in range(22, 100):
        for state in states:
            assert np.isfinite(state.position_enu_m).all()
            assert np.isfinite(state.covariance).all()
            assert np.hypot(*state.position_enu_m) < 60.0
        states = tracker.step(0.1 * k, np.empty((0, 3)), **HERE)
    assert states == []


def test_parts_of_an_object_that_was_seen_begin_nothing():
    tracker, lonely = Tracker(), Tracker(TrackerParams(apart_m=0.0))
    for k in range(20):
        parts = [[30.0, 0.0, 0.0], [30.6, 0.005, 0.0]]
        tracker.step(0.1 * k, parts[: 1 + (k > 5)], **HERE)
        lonely.step(0.1 * k, parts[: 1 + (k > 5)], **HERE)
    assert len(tracker.step(2.0, [[30.0, 0.0, 0.0]], **HERE)) == 1
    assert len(objects(lonely.step(2.0, [[30.0, 0.0, 0.0]], **HERE))) == 2


def test_radial_speeds_that_are_folded_still_fit():
    """At 15 m/s towards the radar, which cannot tell speeds 20.8 m/s apart from each other."""
    folded = 20.8
    tracker = Tracker(TrackerParams(radial_speed_folded_m_s=folded, speed_m_s=15.0))
    states = []
    for k in range(30):
        seen_m_s = math.remainder(-15.0, folded)
        states = tracker.step(0.1 * k, [[100.0 - 1.5 * k, 0.0, seen_m_s]], **HERE)
    [found] = objects(states)
    assert found.velocity_enu_m_s[1] == pytest.approx(-15.0, abs=0.5)
    assert found.updates > 25


@pytest.mark.parametrize("speed_m_s", [-28.0, -17.0, 16.0])
def test_what_is_much_faster_than_expected_is_followed_although_its_speed_is_folded(speed_m_s):
    """A small plane, with the default idea of how fast objects are; a pole beside it stays one candidate."""
    folded = 20.77
    tracker, states, start_m = Tracker(TrackerParams(radial_speed_folded_m_s=folded)), [], 60.0 - 15.0 * speed_m_s / 10
    for k in range(30):
        seen_m_s = math.remainder(speed_m_s, folded)
        plane = [start_m + 0.1 * k * speed_m_s, 0.0, seen_m_s]
        states = tracker.step(0.1 * k, [plane, [40.0, 0.6, 0.31 * (k % 2)]], **HERE)
        if k == 0:
            assert len(states) == 1 + 3
    pole, *plane = sorted(objects(states), key=lambda state: math.hypot(*state.velocity_enu_m_s))
    assert math.hypot(*pole.velocity_enu_m_s) < 0.5
    assert [state.velocity_enu_m_s[1] for state in plane] == [pytest.approx(speed_m_s, abs=0.5)]


def test_a_detection_without_a_radial_speed_counts_with_the_rest():
    tracker, states = Tracker(), []
    for k in range(40):
        states = tracker.step(0.1 * k, [[40.0 - 0.2 * k, 0.1, math.nan]], **HERE)
    [found] = objects(states)
    assert found.updates == 40
    assert np.hypot(*found.velocity_enu_m_s) == pytest.approx(2.0, abs=0.3)


def test_ids_are_never_used_twice_not_even_after_clearing():
    tracker = Tracker()
    follow(frames(movers(5, 1), seed=1, count=20), tracker=tracker)
    before = {state.id for state in tracker.step(10.0, [[20.0, 0.0, 0.0]], **HERE)}
    tracker.clear()
    after = {state.id for state in tracker.step(1.0, [[20.0, 0.0, 0.0]], **HERE)}
    assert min(after) > max(before)


def test_after_a_long_gap_old_objects_are_forgotten_and_new_ones_begin():
    tracker = Tracker()
    follow(frames(ONE, seed=1, count=30, radar=CLEAN), tracker=tracker)
    states = tracker.step(1e9, [[20.0, 0.0, 0.0]], **HERE)
    assert [state.updates for state in states] == [1]


@pytest.mark.parametrize(("coordinates", "acceleration_m_s2"), [("cartesian", 0.5), ("polar", 2.0)])
def test_errors_are_as_large_as_the_covariance_says(coordinates, acceleration_m_s2):
    """Normalised squared errors of four numbers: their median is 3.4 if no noise is made up, as polar ones need it."""
    params = TrackerParams(coordinates=coordinates, extent_m=0.0, acceleration_m_s2=acceleration_m_s2, speed_m_s=2.5)
    squares = []
    for seed in range(3):
        scene = frames(movers(5, seed), seed=seed, count=60, radar=CLEAN)
        for frame, states in list(zip(scene, follow(scene, params), strict=True))[20:]:
            for state in objects(states):
                off = frame.truth - np.concatenate([state.position_enu_m, state.velocity_enu_m_s])
                nearest = off[np.argmin(np.hypot(off[:, 0], off[:, 1]))]
                squares.append(nearest @ np.linalg.solve(state.covariance, nearest))
    assert len(squares) > 300
    assert 0.5 < np.median(squares) < 5.0


@settings(max_examples=25)
@given(
    st.sampled_from(COORDINATES),
    st.lists(
        st.lists(
            st.tuples(st.floats(0.01, 150.0), st.floats(-3.2, 3.2), st.floats(-30.0, 30.0) | st.just(math.nan)),
            max_size=6,
        ),
        max_size=8,
    ),
    st.floats(0.001, 3.0),
    st.floats(-10.0, 10.0),
    st.floats(-7.0, 7.0),
)
def test_whatever_is_seen_covariances_stay_covariances(coordinates, seen, every_s, own_m_s, heading_rad):
    tracker = Tracker(TrackerParams(coordinates=coordinates))
    for k, rows in enumerate(seen):
        states = tracker.step(
            every_s * k,
            np.array(rows).reshape(-1, 3),
            position_enu_m=(own_m_s * every_s * k, 0.0),
            velocity_enu_m_s=(own_m_s, 0.0),
            heading_rad=heading_rad,
        )
        for state in states:
            assert np.isfinite(state.position_enu_m).all()
            np.testing.assert_allclose(state.covariance, state.covariance.T, rtol=1e-9, atol=1e-9)
            assert np.linalg.eigvalsh(state.covariance).min() > -1e-6 * np.trace(state.covariance)


@settings(max_examples=15)
@given(st.floats(-math.pi, math.pi), st.sampled_from(COORDINATES))
def test_north_is_no_special_direction(turn_rad, coordinates):
    """The same scene turned about the origin gives the same tracks, turned."""
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    R = np.array([[c, s], [-s, c]])
    params = TrackerParams(coordinates=coordinates)
    scene = frames(movers(3, 2), seed=2, count=25)
    turned = Tracker(params)
    for frame, states in zip(scene, follow(scene, params), strict=True):
        others = turned.step(
            frame.t_s,
            frame.detections,
            position_enu_m=R @ frame.position_enu_m,
            velocity_enu_m_s=R @ frame.velocity_enu_m_s,
            heading_rad=frame.heading_rad + turn_rad,
        )
        mine, theirs = ({state.id: state for state in some} for some in (states, others))
        assert mine.keys() == theirs.keys()
        for number, state in mine.items():
            np.testing.assert_allclose(theirs[number].position_enu_m, R @ state.position_enu_m, atol=1e-5)
            np.testing.assert_allclose(theirs[number].velocity_enu_m_s, R @ state.velocity_enu_m_s, atol=1e-5)
