"""How well the places of the navigation script are followed: as the real ArduCopter did, and in straight legs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from planning.model import F64
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


@pytest.mark.parametrize("name", ["coro2", "coro2.h1"])
def test_in_straight_legs_it_keeps_within_a_third_of_a_metre_of_the_line(shared_data: Path, name: str) -> None:
    mission = shared_data / "logs" / "real_flights" / "plans" / name / "mission.waypoints"
    straight, shaped = (ScriptedFlight(mission, GUID_OPTIONS=options) for options in (64, 0))
    for flight, close in ((straight, True), (shaped, False)):
        beside_m, above_m = off_line(flight.track[:, 1:], flight.line)
        assert (within(np.hypot(beside_m, above_m)) < 0.3) is close


def test_the_speed_that_was_ordered_holds(shared_data: Path) -> None:
    """Ordered before the first place it was forgotten: the recorded vehicle flew at 7.4 m/s instead of 6."""
    flight = ScriptedFlight(shared_data / "logs" / "real_flights" / "plans" / "coro2.h1" / "mission.waypoints")
    speed_m_s = np.hypot(*np.diff(flight.track[:, 1:3], axis=0).T) / SLICE_S
    assert speed_m_s.max() < 6.3
