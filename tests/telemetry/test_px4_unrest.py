"""How the simulated PX4's estimate slips, against the two recorded flights that it was taken from."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from mapping.geometry.arrays import F64
from telemetry.simulation.simulator.autopilot.px4.unrest import PULL_PER_S, SLIP_M_S, Unrest
from telemetry.simulation.simulator.protocol.common_streams import CommonStreams
from tests.telemetry.px4_craft import Px4Craft
from tests.telemetry.replayed_link import received
from tests.telemetry.simulator_bench import HOME

STEP_S, GRID_S = 0.01, 0.02
SMOOTH_S = 0.6
IN_AIR_S = {
    "px4-1.17_auto_rtk.mcap": ((83.0, 145.0), (165.0, 198.0)),
    "px4-1.17_guided_rtk.mcap": ((95.0, 195.0), (213.0, 248.0)),
}
"""On the legs, and on the way down."""
LAGS_S = (1.0, 2.0, 3.0)


def unrest(heading_rad: float, seconds: float, seed: int = 3) -> tuple[F64, F64]:
    """(N, 3) slips and accelerations, north east up."""
    made = Unrest(np.random.default_rng(seed))
    slips, accels = [], []
    for _ in range(round(seconds / STEP_S)):
        accels.append(made.step(heading_rad, STEP_S))
        slips.append(made.slip_neu)
    return np.array(slips), np.array(accels)


def after(series: F64, step_s: float) -> list[float]:
    """Autocorrelation at LAGS_S."""
    moved = series - series.mean()
    return [
        float((moved[: -round(lag_s / step_s)] * moved[round(lag_s / step_s) :]).mean() / moved.var())
        for lag_s in LAGS_S
    ]


def recorded_slips(path: Path, from_s: float, to_s: float) -> F64:
    """(N, 3) forward, right, up: what the estimator told of velocity, less the rate of the position that it told."""
    told, turned = [], []
    boot_s = 0.0
    for _, message in received(path):
        boot_s = getattr(message, "time_boot_ms", 1000 * boot_s) / 1000
        if message.get_type() == "LOCAL_POSITION_NED":
            told.append((boot_s, message.x, message.y, -message.z, message.vx, message.vy, -message.vz))
        elif message.get_type() == "ATTITUDE":
            turned.append((boot_s, message.yaw))
    t_s = np.arange(from_s, to_s, GRID_S)
    told_at, yaw = np.array(told), np.array(turned)
    p, v = (np.array([np.interp(t_s, told_at[:, 0], told_at[:, k]) for k in of]) for of in ((1, 2, 3), (4, 5, 6)))
    window = np.hanning(round(SMOOTH_S / GRID_S) + 2)[1:-1]
    slip = np.array([np.convolve(row, window / window.sum(), "same") for row in v - np.gradient(p, GRID_S, axis=1)])
    heading = np.interp(t_s, yaw[:, 0], np.unwrap(yaw[:, 1]))
    c, s = np.cos(heading), np.sin(heading)
    return np.array([slip[0] * c + slip[1] * s, slip[1] * c - slip[0] * s, slip[2]]).T[60:-60]


@pytest.fixture(scope="module")
def recorded(shared_data: Path) -> list[F64]:
    folder = shared_data / "logs" / "real_flights"
    return [recorded_slips(folder / name, *span) for name, spans in IN_AIR_S.items() for span in spans]


@pytest.mark.fact("P40")
def test_it_slips_as_far_as_the_recorded_ones_and_twice_as_far_aside_as_forward(recorded: list[F64]) -> None:
    rms = np.sqrt((np.concatenate(recorded) ** 2).mean(axis=0))
    assert rms == pytest.approx(SLIP_M_S, rel=0.12)
    assert rms[1] / rms[0] > 1.4
    slips, _ = unrest(0.0, 4000.0)
    assert np.sqrt((slips**2).mean(axis=0)) == pytest.approx(SLIP_M_S, rel=0.1)


@pytest.mark.fact("P40")
def test_a_slip_lasts_as_long_as_the_recorded_ones(recorded: list[F64]) -> None:
    legs = recorded[::2]
    aside = np.mean([after(flight[:, 1], GRID_S) for flight in legs], axis=0)
    slips, _ = unrest(0.0, 4000.0)
    assert after(slips[:, 1], STEP_S) == pytest.approx(aside, abs=0.12)
    up = np.mean([after(flight[:, 2], GRID_S) for flight in legs], axis=0)
    assert after(slips[:, 2], STEP_S) == pytest.approx(up, abs=0.12)


def test_it_turns_with_the_vehicle() -> None:
    slips, _ = unrest(math.pi / 2, 4000.0)
    north, east, _ = np.sqrt((slips**2).mean(axis=0))
    assert (east, north) == pytest.approx(SLIP_M_S[:2], rel=0.1)


def test_what_leans_the_estimate_moves_the_vehicle_the_other_way() -> None:
    slips, accels = unrest(0.0, 4000.0)
    pulled = [float(a @ s / (s @ s)) for a, s in zip(accels.T, slips.T, strict=True)]
    assert pulled == pytest.approx([-pull for pull in PULL_PER_S], abs=0.05)


def test_on_the_ground_nothing_slips() -> None:
    made = Unrest(np.random.default_rng(1))
    for _ in range(500):
        made.step(0.0, STEP_S)
    assert made.slip_neu != (0.0, 0.0, 0.0)
    made.rest()
    assert made.slip_neu == (0.0, 0.0, 0.0)


def test_the_receiver_tells_the_true_speed_though_the_estimate_slips() -> None:
    it = Px4Craft((), [], [])
    bench, pilot = it.bench, it.bench.vehicle.autopilot
    bench.until(lambda: pilot.position_ok)
    assert bench.command(400, 1) == 0
    assert bench.command(22, math.nan, 0, 0, math.nan, math.nan, math.nan, HOME.alt_amsl_m + 20) == 0
    bench.until(lambda: pilot.mode.name == "HOLD")
    apart_m_s = []
    for _ in range(50):
        bench.advance(0.2)
        message: Any = CommonStreams(bench.vehicle).build(wire.MAVLINK_MSG_ID_GPS_RAW_INT)
        told_m_s, true_m_s = message.vel / 100, math.hypot(*bench.vehicle.truth.v_neu[:2])
        assert told_m_s == pytest.approx(true_m_s, abs=0.006)
        apart_m_s.append(abs(math.hypot(*pilot.v_neu[:2]) - true_m_s))
    assert max(apart_m_s) > 0.05, "the estimate slips"
