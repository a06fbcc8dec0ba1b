"""A wall 2 m thick and 16 m wide that only the radar sees, through its own perception, as a real vehicle has met it.

The feed is the one of that flight: targets from the truth, none nearer than 1 m, none beyond 60 degrees aside.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame, packed
from telemetry.flight.avoidance.backing import Trail
from telemetry.flight.guided.orders import Place
from telemetry.perception.perceiver import Perceiver
from telemetry.perception.sensor_kinds import RADAR
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.avoiding_bench import BRAKE, Craft, Wall, mission, place

PERIOD_S, LATENCY_S = 0.1, 0.1
BLIND_M, ASIDE_RAD = 1.0, math.radians(60.0)
HULL_M = 0.35
NORTH_M, THICK_M, HALF_WIDE_M = 70.0, 2.0, 8.0


class RadarCraft(Craft):
    """Its only sensor is a radar whose frames go through the radar's perception."""

    def __init__(self, wall: Wall, speed_m_s: float) -> None:
        super().__init__(mission(place(120, 9.2), place(150, 9.2)), [wall], [])
        self.perceiver = Perceiver(RADAR, run="test", utc_minus_mono_s=0.0)
        self._due_s, self._number, self.speed_m_s = 0.0, 0, speed_m_s
        self._frames: list[RadarFrame] = []

    def hear(self, message: Any) -> None:
        before = self.state
        super().hear(message)
        if self.state is not before:
            self.perceiver.on_state(self.state)

    def _sense(self) -> None:
        self.perceiver.flown.avoidance = self.avoiding.status
        if self.now_s >= self._due_s:
            self._due_s = self.now_s + PERIOD_S
            self._frames.append(self._measured())
        while self._frames and self._frames[0].t_mono_s + LATENCY_S <= self.now_s:
            outcome = self.perceiver.work(self._frames.pop(0), lambda: self.now_s)
            self.perform(self.avoiding.on_perception(outcome.status, self.now_s))

    def _measured(self) -> RadarFrame:
        xyz = self._targets()
        v_north = self.bench.vehicle.truth.v_neu[0]
        radial = -v_north * xyz[:, 1] / np.maximum(np.linalg.norm(xyz, axis=1), 1e-9)
        self._number += 1
        snr = packed(np.full(len(xyz), 30.0))
        return RadarFrame(self.now_s, self.now_s, self._number, "truth", packed(xyz), packed(radial), snr)

    def _targets(self) -> np.ndarray:
        """(N, 3) right, forward, up of the wall's face as seen from the truth."""
        north_m, east_m, up_m = self.truth
        psi = self.bench.vehicle.truth.heading_rad
        wall = self.walls[0]
        across, heights = np.arange(-HALF_WIDE_M, HALF_WIDE_M + 0.1, 0.5), np.arange(0.25, wall.top_m + 1e-9, 0.5)
        e, u = (grid.ravel() for grid in np.meshgrid(across, heights))
        n = np.full(len(e), wall.north_m if north_m < wall.north_m else wall.north_m + wall.thick_m)
        e, n, u = e - east_m, n - north_m, u - up_m
        xyz = np.column_stack([e * math.cos(psi) - n * math.sin(psi), e * math.sin(psi) + n * math.cos(psi), u])
        range_m, aside = np.linalg.norm(xyz, axis=1), np.abs(np.arctan2(xyz[:, 0], xyz[:, 1]))
        return xyz[(range_m >= BLIND_M) & (range_m <= 60.0) & (aside <= ASIDE_RAD)]

    @property
    def nearest_m(self) -> float:
        """Between the vehicle's hull and the wall, over the whole flight."""
        wall = self.walls[0]
        away = [
            math.hypot(max(wall.north_m - n, n - wall.north_m - wall.thick_m, 0.0), max(u - wall.top_m, 0.0))
            for _, n, u in self.trail
        ]
        return min(away) - HULL_M


def flown(speed_m_s: float, top_m: float) -> RadarCraft:
    it = RadarCraft(Wall(NORTH_M, top_m, THICK_M, HALF_WIDE_M), speed_m_s)
    it.start()
    it.until(lambda: it.avoiding.is_engaged, 120)
    it.until(lambda: it.avoiding.status.state in ("offset", "ceiling", "holding"), 120)
    return it


@pytest.mark.fact("A36", "A37")
@pytest.mark.parametrize("speed_m_s", [4.9, 6.0])
@pytest.mark.parametrize("top_m", [22.0, 30.0])
def test_it_stops_clear_of_the_wall_and_flies_over_it(speed_m_s: float, top_m: float) -> None:
    it = flown(speed_m_s, top_m)
    before_m = NORTH_M - max(n for _, n, _ in it.trail) - HULL_M
    assert before_m > 1.0
    assert it.avoiding.status.state == "offset"
    assert it.truth[2] > top_m
    it.until(lambda: it.truth[0] > NORTH_M + THICK_M + 5.0, 60)
    assert it.nearest_m > 0.5


@lru_cache
def stopping_m(speed_m_s: float) -> float:
    """What the simulated vehicle needs from the order on."""
    it = RadarCraft(Wall(1e6, 1.0, THICK_M, HALF_WIDE_M), speed_m_s)
    it.start()
    it.perform(it.avoiding.disable(it.now_s))
    it.until(lambda: it.truth[0] > 40)
    from_m = it.truth[0]
    it.bench.command(176, 1, BRAKE)
    it.until(lambda: (it.state.ground_speed_m_s or 0.0) < 0.05 and it.state.mode == "BRAKE", 30)
    return it.truth[0] - from_m


class NoTrail(Trail):
    def back(self, state: VehicleState, distance_m: float) -> list[Place]:
        return []


def too_late(speed_m_s: float, top_m: float, *, gap_m: float = 0.3, trail: Trail | None = None) -> RadarCraft:
    """Avoidance is switched on so late that it stops with the hull ``gap_m`` before the wall: nearer than is seen."""
    it = RadarCraft(Wall(NORTH_M, top_m, THICK_M, HALF_WIDE_M), speed_m_s)
    it.start()
    it.perform(it.avoiding.disable(it.now_s))
    begin_m = NORTH_M - HULL_M - gap_m - stopping_m(speed_m_s) - 0.1
    it.until(lambda: it.truth[0] >= begin_m, 120)
    it.avoiding.enable(it.now_s)
    it.avoiding.detour.trail = trail or it.avoiding.detour.trail
    it.until(lambda: it.avoiding.detour.phase not in ("idle", "stopping"), 30)
    assert 0.0 < NORTH_M - HULL_M - it.truth[0] < 0.8, "not where the real vehicle stood"
    return it


@pytest.mark.fact("A38")
def test_too_near_to_see_it_goes_back_until_it_sees_and_climbs_there() -> None:
    """At 0.3 m the radar is blind: the wall's upper half was taken for clear, and flown through."""
    it = too_late(3.0, 30.0)
    it.until(lambda: it.avoiding.status.state == "offset", 120)
    assert "Goes back: it is too near to see what is in the way." in it.texts
    assert it.truth[2] > 30.0
    assert all(n < NORTH_M - HULL_M for _, n, u in it.trail if u < 30.0)
    assert NORTH_M - it.truth[0] > BLIND_M + 1.0
    it.until(lambda: it.truth[0] > NORTH_M + THICK_M + 5.0, 60)
    assert min(u for _, n, u in it.trail if NORTH_M <= n <= NORTH_M + THICK_M) > 30.5


def test_where_it_cannot_go_back_it_holds_and_says_why() -> None:
    it = too_late(3.0, 30.0, trail=NoTrail())
    it.until(lambda: it.avoiding.status.state == "holding", 60)
    it.advance(10.0)
    assert it.avoiding.status.state == "holding"
    assert "cannot be seen from here" in it.avoiding.status.text
    assert it.truth[2] < 12.0
