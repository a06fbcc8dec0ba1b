"""How well the places of the navigation script are followed: as the real ArduCopter did, and in straight legs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.geometry.arrays import F64
from telemetry.flight.guided.feed import Feed
from tests.telemetry.guided_flights import ScriptedFlight, off_line
from tests.telemetry.guided_recordings import Replay, Stretch, replayed_stretch
from tests.telemetry.simulator_bench import SLICE_S

TURNING = (
    Stretch("arducopter-4.7_guided_below_certified", 63.5, 153.5),
    Stretch("arducopter-4.7_console_b", 48.2, 99.5),
)
STRAIGHT = Stretch("arducopter-4.7_console_a", 41.5, 54.5)
"""One leg; the other two have corners."""


@pytest.fixture(scope="module")
def replay_of(shared_data: Path) -> Callable[[Stretch], Replay]:
    return functools.cache(functools.partial(replayed_stretch, shared_data / "logs" / "real_flights"))


def within(off_m: F64) -> float:
    return float(np.percentile(np.abs(off_m), 95))


@pytest.mark.fact("A5")
@pytest.mark.parametrize("stretch", TURNING, ids=lambda stretch: stretch.recording)
def test_the_simulated_vehicle_leaves_the_straight_leg_as_the_recorded_one_did(
    replay_of: Callable[[Stretch], Replay], stretch: Stretch
) -> None:
    replay = replay_of(stretch)
    real, ours = (off_line(flown[:, 1:], replay.line) for flown in (replay.real, replay.simulated))
    assert within(real[0]) > 0.25
    for one, other in zip(ours, real, strict=True):
        assert within(one) == pytest.approx(within(other), rel=0.2)
        assert np.abs(one).max() == pytest.approx(np.abs(other).max(), rel=0.25)


@pytest.mark.parametrize("stretch", [*TURNING, STRAIGHT], ids=lambda stretch: stretch.recording)
def test_it_is_where_the_recorded_one_was_then(replay_of: Callable[[Stretch], Replay], stretch: Stretch) -> None:
    replay = replay_of(stretch)
    away = replay.simulated[:, 1:] - replay.real[:, 1:]
    assert within(np.linalg.norm(away[:, :2], axis=1)) < 0.3
    assert within(away[:, 2]) < 0.45


@pytest.fixture(scope="module")
def fly(shared_data: Path) -> Callable[..., ScriptedFlight]:
    def flown(name: str, **more: Any) -> ScriptedFlight:
        return ScriptedFlight(shared_data / "logs" / "real_flights" / "plans" / name / "mission.waypoints", **more)

    return functools.cache(flown)


def off(flight: ScriptedFlight) -> F64:
    """Distance in space from the line."""
    return np.hypot(*off_line(flight.track[:, 1:4], flight.line))


@pytest.mark.fact("A6")
@pytest.mark.parametrize("name", ["coro2", "coro2.h1"])
def test_it_keeps_within_a_third_of_a_metre_of_the_line_led_or_by_itself(
    fly: Callable[..., ScriptedFlight], name: str
) -> None:
    led, straight, sent_places = fly(name, feed=Feed()), fly(name, GUID_OPTIONS=64), fly(name)
    assert within(off(sent_places)) > 0.8
    for flight in (led, straight):
        assert within(off(flight)) < 0.25
        assert off(flight).max() < 0.5
    seconds = [flight.track[-1, 0] - flight.track[0, 0] for flight in (led, straight)]
    assert seconds[0] < 1.5 * seconds[1]


@pytest.mark.parametrize("changed", [{"SIM_WIND_SPD": 5.0}, {"WPNAV_ACCEL": 150.0}], ids=["wind", "slow to turn"])
def test_led_it_keeps_to_the_line_in_wind_and_with_other_settings(
    fly: Callable[..., ScriptedFlight], changed: dict[str, float]
) -> None:
    assert within(off(fly("coro2.h1", feed=Feed(), **changed))) < 0.35


def test_a_link_that_falls_silent_does_not_carry_it_off_the_line(fly: Callable[..., ScriptedFlight]) -> None:
    for from_s in (20.0, 27.0, 33.0, 46.0):
        flight = fly("coro2.h1", feed=Feed(), silent_s=(from_s, from_s + 8.0))
        assert off(flight).max() < Feed().off_line_m + 0.5


@pytest.mark.parametrize(
    ("how", "share", "aside_deg"),
    [({"feed": Feed()}, 100, 25.0), ({"GUID_OPTIONS": 64}, 90, 15.0)],
    ids=["led", "by itself"],
)
def test_on_its_legs_it_looks_where_it_goes(
    fly: Callable[..., ScriptedFlight], how: dict[str, Any], share: float, aside_deg: float
) -> None:
    """Even a vehicle whose WP_YAW_BEHAVIOR leaves its nose where it is. Led, it turns before it is fast."""
    track = fly("coro2.h1", WP_YAW_BEHAVIOR=0, **how).track
    step = np.diff(track[:, 1:3], axis=0) / SLICE_S
    fast = np.hypot(*step.T) > 1.5
    aside = np.angle(np.exp(1j * (np.arctan2(step[:, 1], step[:, 0]) - track[1:, 4])))
    assert fast.sum() > 500
    assert np.percentile(np.degrees(np.abs(aside[fast])), share) < aside_deg


def test_the_speed_that_was_ordered_holds(fly: Callable[..., ScriptedFlight]) -> None:
    """Ordered before the first place it was forgotten: the recorded vehicle flew at 7.4 m/s instead of 6."""
    for flight in (fly("coro2.h1"), fly("coro2.h1", feed=Feed())):
        speed_m_s = np.hypot(*np.diff(flight.track[:, 1:3], axis=0).T) / SLICE_S
        assert speed_m_s.max() < 6.4
