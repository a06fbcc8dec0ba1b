"""Avoidance on the simulated PX4 over real sockets: a wall that only the sensors know of, in MISSION and afterwards."""

from __future__ import annotations

import contextlib
import math
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, replace

import pytest

from telemetry.errors import NotAllowedError
from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import PerceptionSettings, PerceptionStatus
from telemetry.topics.requests import FlyManoeuvre, MayFlyManoeuvre, Pause, Resume, StartAuto
from tests.telemetry.avoiding_bench import Wall
from tests.telemetry.link_bench import ME, Console, again_and_again, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_avoidance import (
    CLIMBED,
    FRAME_S,
    HURRIED,
    avoidance,
    climbing_states,
    seen,
    states,
    switch_on,
)
from tests.telemetry.test_mavlink_flights import LAT_DEG, LON_DEG, STEP_DEG, phase, simulated, start, upload
from tests.telemetry.test_px4_flights import QUICK

SPEEDUP = 2.0
"""Frames come in real time."""
WALL = Wall(20.0, 17.0, thick_m=3.0)
SETTINGS = PerceptionSettings()
KEPT_M = SETTINGS.vehicle_radius_m + SETTINGS.position_error_m


@dataclass
class Watched:
    """How near the vehicle truly came to the wall, over which it flies, too."""

    simulator: Simulator
    wall: Wall | None
    least_m: float = math.inf
    heights_m: list[float] = field(default_factory=list)

    def look(self) -> PerceptionStatus:
        north_m, _, up_m = self.simulator.vehicle.truth.p_neu
        if self.wall is not None:
            wall = self.wall
            beside_m = max(wall.north_m - north_m, north_m - wall.north_m - wall.thick_m, 0.0)
            self.least_m = min(self.least_m, math.hypot(beside_m, max(up_m - wall.top_m, 0.0)))
        self.heights_m.append(up_m)
        return seen(self.simulator, self.wall)

    def go(self, speedup: float) -> None:
        self.simulator.options = replace(self.simulator.options, speedup=speedup)


@contextlib.asynccontextmanager
async def before_a_wall(wall: Wall | None = WALL) -> AsyncIterator[tuple[Console, Watched]]:
    parameters = (*QUICK, ("MPC_XY_CRUISE", 3.0))
    async with simulated(autopilot="px4", parameters=parameters, speedup=HURRIED) as (bench, simulator):
        watched = Watched(simulator, wall)
        async with again_and_again(lambda: bench.link.on_perception(watched.look()), FRAME_S):
            yield bench, watched


async def in_its_mission(bench: Console, watched: Watched) -> None:
    report = await upload(bench)
    await start(bench, StartAuto(ME, report.onboard.digest))
    await phase(bench, "flying")
    watched.go(SPEEDUP)


async def home(bench: Console, watched: Watched) -> None:
    await phase(bench, "returning")
    watched.wall = None  # on the way home, higher, it is the mission's own affair
    watched.go(HURRIED)
    await phase(bench, "landed")


def modes_in_the_air(bench: Console) -> list[str]:
    modes = [s.mode for s in bench.of(type(bench.state)) if s.landed == "in_air"]
    return [mode for k, mode in enumerate(modes) if k == 0 or modes[k - 1] != mode]


def test_in_its_mission_it_holds_climbs_over_a_wall_and_flies_the_rest_higher() -> None:
    async def whole() -> None:
        async with before_a_wall() as (bench, watched):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await switch_on(bench)
            await in_its_mission(bench, watched)
            await until(lambda: avoidance(bench).state == "offset")
            assert avoidance(bench).height_offset_m > 3.0
            await phase(bench, "returning")
            assert watched.least_m >= KEPT_M
            await home(bench, watched)
            assert bench.flight.broke_off_at is None
            assert bench.flight.way == "auto"
            assert modes_in_the_air(bench)[:3] == ["MISSION", "HOLD", "RTL"]
            assert climbing_states(bench)[:4] == CLIMBED
            assert "avoidance: climbing" in bench.commands
            assert not watched.simulator.vehicle.autopilot.crashed

    run(whole)


def test_a_prepared_way_around_is_flown_paused_resumed_and_the_mission_goes_on() -> None:
    async def whole() -> None:
        async with before_a_wall(None) as (bench, watched):
            await in_its_mission(bench, watched)
            await until(lambda: (bench.flight.target or 0) >= 2 and bench.state.landed == "in_air")
            aside = tuple(
                GuidedTarget(k, LAT_DEG + north * STEP_DEG, LON_DEG + 1.6e-4, 14.0, 3.0)
                for k, north in enumerate((1.0, 2.0), start=1)
            )
            await bench.handle(FlyManoeuvre(ME, "around", aside, 4))
            await until(lambda: avoidance(bench).state == "manoeuvre")
            await until(lambda: watched.simulator.vehicle.truth.p_neu[1] > 4)
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            await until(lambda: (bench.state.ground_speed_m_s or 0.0) < 0.4)
            await bench.handle(Resume(ME))
            await until(lambda: watched.simulator.vehicle.truth.p_neu[1] > 10)
            await home(bench, watched)
            assert bench.flight.broke_off_at is None
            assert "fly around an obstacle, 2 places" in bench.commands
            assert states(bench)[-1] == "off"

    run(whole)


def test_what_is_refused_is_told_before_it_is_ordered_in_the_same_words() -> None:
    async def whole() -> None:
        async with before_a_wall(None) as (bench, watched):
            await in_its_mission(bench, watched)
            aside = (GuidedTarget(1, LAT_DEG + STEP_DEG, LON_DEG, 14.0, 3.0),)
            await until(lambda: bench.state.landed == "in_air")
            for places, item, offset_m in ((aside, None, 90.0), ((), None, 0.0), (aside, 99, 0.0)):
                why = await bench.handle(MayFlyManoeuvre("over", places, item, offset_m))
                with pytest.raises(NotAllowedError) as refused:
                    await bench.handle(FlyManoeuvre(ME, "over", places, item, offset_m))
                assert why == str(refused.value)
            assert await bench.handle(MayFlyManoeuvre("over", aside, 4)) == ""
            assert avoidance(bench).state == "off"
            assert not [words for words in bench.commands if words.startswith("fly over")]

    run(whole)
