"""Which of what is followed goes, and how fast: told once, by seconds of its way, and while nobody sees it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from mapping.geometry.poses import Pose
from mapping.tracking.blobs import Blobs
from mapping.tracking.tracker_params import TrackState
from telemetry.tracking.followed import AGAIN_ECHOES, DRIFT_S, UNSEEN_S, Followed, TrackMemory

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


def out_of_sight_then(echoes: int, *, lost_again: bool = False, moves: bool = False) -> Followed:
    """What stood (or moved) 20 m to the north-east for 2 s, was out of sight, and of which then so many echoes told
    that it is 0.8 m further west and goes there: as a filter makes of one echo in a gate that grew wide.
    """
    memory, found = TrackMemory(), list[Followed]()
    spread = np.diag([SIGMA_M**2, SIGMA_M**2, 0.1**2, 0.1**2])
    was_seen_for, unseen = 20, round(10 * UNSEEN_S) + 2
    for k in range(was_seen_for + unseen + echoes + (10 if lost_again else 0)):
        after = k - was_seen_for - unseen
        speed = np.array([-0.72, 0.07]) if moves or after >= 0 else np.zeros(2)
        at = np.array([20.0, 20.0]) if after < 0 else np.array([19.2, 20.0]) + 0.1 * after * speed
        is_seen = k < was_seen_for or 0 <= after < echoes
        state = TrackState(1, at, speed, spread, k / 10, min(k, was_seen_for) + 1, is_seen, True)
        found = memory.observe([state], NOTHING, Pose(100.0 + k / 10, np.zeros(3), np.zeros(3), HOVERING))
    return found[0]


@pytest.mark.parametrize("echoes", range(AGAIN_ECHOES))
@pytest.mark.parametrize("lost_again", [False, True])
def test_what_stood_and_is_out_of_sight_is_where_it_stood_whatever_a_single_echo_says(
    echoes: int, lost_again: bool
) -> None:
    one = out_of_sight_then(echoes, lost_again=lost_again)
    assert one.state.position_enu_m.tolist() == [20.0, 20.0]
    assert one.offset_m.tolist() == [20.0, 20.0]
    assert not one.velocity_enu_m_s.any()
    assert one.sigma_m == pytest.approx(SIGMA_M)


def test_echoes_enough_tell_that_it_went_on() -> None:
    one = out_of_sight_then(AGAIN_ECHOES)
    assert one.state.position_enu_m[0] < 19.3
    assert one.velocity_enu_m_s == pytest.approx([-0.72, 0.07])


def test_what_went_is_believed_at_once_when_it_is_seen_again() -> None:
    one = out_of_sight_then(1, moves=True)
    assert one.state.position_enu_m[0] < 19.3
    assert one.velocity_enu_m_s.any()
