"""Stepping aside over real sockets: only with consent, past what stands on the line, and not a moment longer."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, replace

import pytest

from telemetry.errors import NotAllowedError
from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.requests import Resume, SetAvoidance, StartAuto
from telemetry.topics.tracks import Track, TracksStatus
from tests.telemetry.link_bench import ME, Console, again_and_again, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_avoidance import HURRIED, avoidance, landed, taken_off
from tests.telemetry.test_mavlink_flights import LAT_DEG, LON_DEG, simulated, start, upload

POLE_NORTH_M, POLE_EAST_M = 22.0, 0.3
"""Between two waypoints."""
NORTH_PER_DEG = 111_195.0
STANDS_M = 2.0
FRAME_S, NEARLY_REAL, STRAIGHT = 0.04, 1.5, 3.0
"""Frames come in real time: a vehicle that steps aside is little faster than they are."""


@dataclass
class Watched:
    """What the tracks node says of a pole on the mission's line, and how near the vehicle truly came on its mission."""

    simulator: Simulator
    nearest_m: float = math.inf
    asides_m: list[float] = field(default_factory=list)

    def go(self, speedup: float) -> None:
        self.simulator.options = replace(self.simulator.options, speedup=speedup)

    def look(self) -> TracksStatus:
        north_m, east_m, up_m = self.simulator.vehicle.truth.p_neu
        range_m = math.hypot(POLE_NORTH_M - north_m, POLE_EAST_M - east_m)
        # On the way home nothing is stepped around: what sensors see there is climbed over.
        if up_m > 5.0 and self.simulator.vehicle.autopilot.mode.name != "RTL":
            self.nearest_m = min(self.nearest_m, range_m)
            self.asides_m.append(abs(east_m))
        now_s = time.monotonic()
        pole = Track(
            id=1,
            enu_m=(POLE_EAST_M, POLE_NORTH_M, up_m),
            velocity_enu_m_s=(0.0, 0.0),
            covariance_m2=(0.01, 0.0, 0.01),
            age_s=3.0,
            updates=30,
            moving=False,
            range_m=range_m,
            bearing_deg=0.0,
            closest_m=0.3,
            closest_in_s=3.0,
            dangerous=True,
            lat_deg=LAT_DEG + POLE_NORTH_M / NORTH_PER_DEG,
            lon_deg=LON_DEG + POLE_EAST_M / NORTH_PER_DEG / math.cos(math.radians(LAT_DEG)),
        )
        tracks = (pole,) if up_m > 5.0 else ()
        return TracksStatus("running", "", now_s, now_s, now_s, tracks=tracks, max_speed_m_s=5.0, room_m=(40.0,) * 120)


@contextlib.asynccontextmanager
async def before_a_pole() -> AsyncIterator[tuple[Console, Watched]]:
    """A real vehicle as far as it tells, with a pole on its line."""
    async with simulated(speedup=HURRIED) as (bench, simulator):
        vehicle, watched = bench.vehicle, Watched(simulator)
        assert vehicle is not None
        await until(lambda: vehicle.capabilities is not None)
        vehicle.is_simulation = False
        async with again_and_again(lambda: bench.link.on_tracks(watched.look()), FRAME_S):
            yield bench, watched


async def fly(bench: Console, watched: Watched, speedup: float = NEARLY_REAL) -> None:
    report = await upload(bench)
    await start(bench, StartAuto(ME, report.onboard.digest))
    await taken_off(bench, watched.simulator)
    watched.go(speedup)


def modes_in_the_air(bench: Console) -> set[str]:
    return {state.mode for state in bench.of(type(bench.state)) if state.landed == "in_air"}


def test_without_consent_nothing_moves_it_from_its_line() -> None:
    async def whole() -> None:
        async with before_a_pole() as (bench, watched):
            with pytest.raises(NotAllowedError, match="consent"):
                await bench.handle(SetAvoidance(ME, enabled=True, by="sidestep"))
            await fly(bench, watched, STRAIGHT)
            await landed(bench, watched.simulator)
            assert watched.nearest_m < 1.0
            assert max(watched.asides_m) < 1.0
            assert "GUIDED" not in modes_in_the_air(bench)
            assert avoidance(bench).state == "off"
            assert not [words for words in bench.commands if "avoidance" in words]

    run(whole)


def test_with_consent_it_steps_aside_and_the_mission_goes_on() -> None:
    async def whole() -> None:
        async with before_a_pole() as (bench, watched):
            await bench.handle(SetAvoidance(ME, enabled=True, consent=True, by="sidestep"))
            await fly(bench, watched)
            await landed(bench, watched.simulator)
            assert watched.nearest_m > 0.6 * STANDS_M  # its frames are half as far apart again
            assert max(watched.asides_m) > 1.0
            assert "GUIDED" in modes_in_the_air(bench)
            assert "avoidance on by sidestep, with consent" in bench.commands
            assert bench.flight.broke_off_at is None

    run(whole)


@pytest.mark.parametrize("instead", [SetAvoidance(ME, False), SetAvoidance(ME, True, True, "climb")])
def test_consent_withdrawn_on_the_way_aside_ends_it_there(instead: SetAvoidance) -> None:
    async def whole() -> None:
        async with before_a_pole() as (bench, watched):
            await bench.handle(SetAvoidance(ME, enabled=True, consent=True, by="sidestep"))
            await fly(bench, watched)
            await until(lambda: watched.asides_m and watched.asides_m[-1] > 0.7)
            await bench.handle(instead)
            await until(lambda: "switched off" in bench.flight.hint)
            await until(lambda: bench.state.mode == "BRAKE" and (bench.state.ground_speed_m_s or 0.0) < 0.2)
            stood_m = watched.simulator.vehicle.truth.p_neu[0]
            await asyncio.sleep(1.0)
            assert watched.simulator.vehicle.truth.p_neu[0] == pytest.approx(stood_m, abs=0.5)
            watched.go(HURRIED)
            await bench.handle(Resume(ME))
            await landed(bench, watched.simulator)

    run(whole)
