"""Radar frames of something that moves, for the vehicle of ``perception_flights``, which flies north at 3 m/s."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapping.sensor_frames import RadarFrame, packed
from telemetry.perception.status import Outcome
from telemetry.topics.messages import Published
from telemetry.topics.tracks import TracksStatus
from telemetry.tracking.object_tracking import ObjectTracking
from tests.telemetry import perception_flights as flights

T0_MONO_S, T0_UTC_S = 1000.0, 1_700_000_000.0

Place = Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class Thing:
    """East and north at a time; its velocity is found by looking twice."""

    at: Place
    snr_db: float = 45.0

    def velocity(self, t_s: float) -> np.ndarray:
        return (np.array(self.at(t_s + 0.01)) - np.array(self.at(t_s - 0.01))) / 0.02


def straight(start: tuple[float, float], velocity: tuple[float, float], **of: Any) -> Thing:
    return Thing(lambda t_s: (start[0] + velocity[0] * t_s, start[1] + velocity[1] * t_s), **of)


def heading_rad(t_s: float) -> float:
    return 0.1 * math.sin(0.7 * t_s)


def frame(
    t_s: float,
    number: int,
    things: Sequence[Thing],
    *,
    t0_mono_s: float = T0_MONO_S,
    t0_utc_s: float = T0_UTC_S,
    seed: int = 0,
) -> RadarFrame:
    """As the radar would measure them: 0.15 m, one degree, cells of 0.31 m/s."""
    random = np.random.default_rng([seed, number])
    own = np.array([0.0, flights.SPEED_M_S * max(0.0, t_s)])
    rows, speeds = [], []
    for thing in things:
        offset = np.array(thing.at(t_s)) - own
        range_m = math.hypot(*offset)
        rate = float(offset / range_m @ (thing.velocity(t_s) - np.array([0.0, flights.SPEED_M_S])))
        azimuth = math.atan2(*offset) - heading_rad(t_s) + math.radians(random.standard_normal())
        range_m += 0.15 * random.standard_normal()
        rows.append([range_m * math.sin(azimuth), range_m * math.cos(azimuth), 0.3])
        speeds.append(round(rate / 0.31) * 0.31)
    columns = (np.array(rows).reshape(-1, 3), np.array(speeds), np.array([thing.snr_db for thing in things]))
    return RadarFrame(t0_mono_s + t_s, t0_utc_s + t_s, number, "test", *(packed(column) for column in columns))


def shows_nothing(status: TracksStatus) -> bool:
    return (status.tracks, status.hidden, status.cones, status.proposal, status.no_proposal) == ((), 0, (), None, "")


class Flight:
    """Feeds a follower as its node would."""

    def __init__(self) -> None:
        self.following = ObjectTracking(run="test", utc_minus_mono_s=T0_UTC_S - T0_MONO_S)
        self.number = 0
        self.told: list[Outcome[TracksStatus]] = []

    def fly(self, from_s: float, to_s: float, *things: Thing, **changes: Any) -> Outcome[TracksStatus]:
        for k in range(round(from_s * 20), round(to_s * 20)):
            t_s = k / 20
            self.following.perceiver.on_state(flights.state_at(t_s, T0_MONO_S, T0_UTC_S, **changes))
            if k % 2 == 0:
                self.frame(t_s, *things)
        return self.told[-1]

    def frame(self, t_s: float, *things: Thing, made: Any = None) -> Outcome[TracksStatus]:
        self.number += 1
        made = made or frame(t_s, self.number, things)
        self.told.append(self.following.work(made, lambda: T0_MONO_S + t_s + 0.02))
        return self.told[-1]

    @property
    def alerts(self) -> list[Published]:
        return [alert for told in self.told for alert in told.alerts]

    @property
    def phases(self) -> list[str]:
        return [alert.phase for told in self.told for alert in told.alerts]

    @property
    def texts(self) -> list[str]:
        return [alert.text for told in self.told for alert in told.alerts]
