"""The tracker and what no radar should give: numbers that are none, clocks set back, a thousand things at once."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

from mapping.errors import ParameterError
from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackerParams

HERE = {"position_enu_m": (0.0, 0.0), "velocity_enu_m_s": (0.0, 0.0), "heading_rad": 0.0}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("column", [0, 1])
def test_a_detection_that_is_no_number_is_left_out(bad, column):
    tracker = Tracker()
    row = [20.0, 0.1, 0.5]
    row[column] = bad
    assert len(tracker.step(0.0, [row, [30.0, 0.0, 0.0]], **HERE)) == 1


def test_absurd_ranges_and_speeds_are_left_out():
    tracker = Tracker()
    absurd = [[0.0, 0.1, 0.0], [-3.0, 0.0, 0.0], [1e300, 0.0, 0.0], [5.0, 0.0, math.inf], [5.0, 0.0, 1e300]]
    assert tracker.step(0.0, absurd, **HERE) == []


def test_a_bearing_may_have_any_number_of_turns():
    tracker = Tracker()
    [plain] = tracker.step(0.0, [[5.0, 0.1, 0.0]], **HERE)
    [turned] = tracker.step(0.1, [[5.0, 0.1 + 40 * math.pi, 0.0]], **(HERE | {"heading_rad": -60 * math.pi}))
    assert turned.id == plain.id
    assert turned.updates == 2


@pytest.mark.parametrize("shape", [(3,), (2, 4), (1, 2), (2, 3, 1)])
def test_detections_of_another_shape_are_refused(shape):
    with pytest.raises(ParameterError, match="shape"):
        Tracker().step(0.0, np.ones(shape), **HERE)


@pytest.mark.parametrize("nothing", [[], np.empty((0, 3)), np.empty((0, 4))])
def test_a_frame_without_detections_is_one(nothing):
    assert Tracker().step(0.0, nothing, **HERE) == []


@pytest.mark.parametrize("t_s", [1.0, 0.5, math.nan])
def test_a_frame_that_is_not_later_is_refused_and_changes_nothing(t_s):
    tracker, other = Tracker(), Tracker()
    for one in (tracker, other):
        one.step(0.9, [[30.0, 0.0, 0.0]], **HERE)
        one.step(1.0, [[30.0, 0.0, 0.0]], **HERE)
    with pytest.raises(ParameterError):
        tracker.step(t_s, [[30.0, 0.0, 0.0]], **HERE)
    [ours], [theirs] = (one.step(1.1, [[30.0, 0.0, 0.0]], **HERE) for one in (tracker, other))
    np.testing.assert_array_equal(ours.covariance, theirs.covariance)
    assert ours.updates == theirs.updates == 3


@pytest.mark.parametrize("name", ["position_enu_m", "velocity_enu_m_s", "heading_rad"])
def test_a_vehicle_that_is_nowhere_is_refused(name):
    where: dict[str, Any] = HERE | {name: math.nan if name == "heading_rad" else (math.nan, 0.0)}
    with pytest.raises(ParameterError, match="nan"):
        Tracker().step(0.0, np.empty((0, 3)), **where)


def test_a_thousand_detections_a_frame_take_a_bounded_time_and_room():
    tracker, random = Tracker(), np.random.default_rng(0)
    began_s = time.thread_time()
    for k in range(6):
        noise = random.uniform([2.0, -0.78, -10.0], [120.0, 0.78, 10.0], (1000, 3))
        states = tracker.step(0.1 * k, noise, **HERE)
        assert len(states) <= tracker.params.most
    assert time.thread_time() - began_s < 60.0


def test_a_thousand_detections_in_one_place_take_a_bounded_time():
    tracker, random, states = Tracker(), np.random.default_rng(0), []
    began_s = time.thread_time()
    for k in range(3):
        states = tracker.step(0.1 * k, random.normal([20.0, 0.0, 0.0], [0.3, 0.02, 0.2], (1000, 3)), **HERE)
    assert len(states) <= 2000
    assert time.thread_time() - began_s < 60.0


def test_too_many_candidates_leave_the_nearest():
    tracker = Tracker(TrackerParams(most=10))
    detections = np.column_stack([np.arange(5.0, 105.0, 5.0), np.zeros(20), np.zeros(20)])
    states = tracker.step(0.0, detections, **HERE)
    assert [round(float(state.position_enu_m[1])) for state in states] == list(range(5, 55, 5))


@pytest.mark.parametrize(
    "changes",
    [
        {"range_sigma_m": 0.0},
        {"bearing_sigma_rad": math.nan},
        {"detection_probability": 1.0},
        {"gate": -1.0},
        {"birth": 9.5},
        {"most": 0},
        {"birth_updates": 0},
        {"coordinates": "spherical"},
    ],
)
def test_parameters_that_make_no_tracker_are_refused(changes):
    with pytest.raises(ParameterError) as caught:
        TrackerParams(**changes)
    assert caught.value.where in changes
