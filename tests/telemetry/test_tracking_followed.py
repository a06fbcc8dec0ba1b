"""Which of what is followed goes, and how fast: told once, by seconds of its way, and while nobody sees it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from mapping.geometry.poses import Pose
from mapping.tracking.blobs import Blobs
from mapping.tracking.tracker_params import TrackState
from telemetry.tracking.followed import DRIFT_S, Followed, TrackMemory

HOVERING = np.array([1.0, 0.0, 0.0, 0.0])
NOTHING = Blobs(np.empty(0), np.empty(0), np.empty(0), np.empty(0, np.bool_))
SIGMA_M, SIGMA_M_S = 0.3, 0.5


def followed(
    seconds: float, place: Callable[[float], tuple[float, float]], velocity: Callable[[float], tuple[float, float]]
) -> list[Followed]:
    """Ten times a second, by a radar at the origin; after five seconds it sees nothing more."""
    memory, out = TrackMemory(), list[Followed]()
    spread = np.diag([SIGMA_M**2, SIGMA_M**2, SIGMA_M_S**2, SIGMA_M_S**2])
    for k in range(round(10 * seconds)):
        t_s = k / 10
        grown = spread * (1.0 + 10.0 * max(0.0, t_s - 5.0))
        at, speed = np.array(place(t_s)), np.array(velocity(t_s))
        state = TrackState(1, at, speed, grown, t_s, k + 1, t_s < 5.0, k >= 3)
        pose = Pose(100.0 + t_s, np.zeros(3), np.zeros(3), HOVERING)
        out += memory.observe([state], NOTHING, pose)
    return out


def goes(found: list[Followed]) -> list[bool]:
    return [bool(one.velocity_enu_m_s.any()) for one in found]


def test_whose_speed_was_told_once_is_not_taken_for_standing_by_the_next_frames_noise() -> None:
    found = followed(4.0, lambda t: (20.0, 20.0), lambda t: (-2.2, 0.0) if t < 1.0 else (-1.3, 0.0))
    assert all(goes(found))
    assert not any(goes(followed(1.5, lambda t: (20.0, 20.0), lambda t: (-1.3, 0.0))))


def test_it_stops_when_its_speed_is_plainly_gone() -> None:
    found = followed(4.0, lambda t: (20.0, 20.0), lambda t: (-2.2, 0.0) if t < 1.0 else (-0.4, 0.0))
    assert goes(found)[0]
    assert not any(goes(found)[10:])


def test_unseen_it_goes_on_as_it_went_though_its_speed_is_known_worse() -> None:
    found = followed(7.0, lambda t: (20.0 - 2.2 * t, 20.0), lambda t: (-2.2, 0.0))
    assert all(goes(found))
    assert found[-1].velocity_enu_m_s.tolist() == [-2.2, 0.0]
    assert found[-1].unseen_s == pytest.approx(2.0, abs=0.11)


def test_a_slow_walker_is_told_by_its_way() -> None:
    found = followed(5.0, lambda t: (20.0 - 0.8 * t, 20.0), lambda t: (-0.8, 0.0))
    assert not any(goes(found)[: round(10 * DRIFT_S) - 1])
    assert goes(found)[-1]
    assert found[-1].velocity_enu_m_s == pytest.approx([-0.8, 0.0], abs=0.05)
    assert found[-1].closest_m == pytest.approx(20.0, abs=0.1)


def test_echoes_that_wander_over_what_stands_are_no_way() -> None:
    found = followed(5.0, lambda t: (20.0 + 0.8 * math.sin(2.0 * t), 20.0), lambda t: (0.0, 0.0))
    assert not any(goes(found))
