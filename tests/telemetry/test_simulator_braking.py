"""BRAKE of the simulated vehicle against the real ArduCopter's: how far it goes on, and how fast it is meanwhile."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.telemetry.replayed_link import received
from tests.telemetry.simulator_bench import Bench

GUIDED, BRAKE = 4, 17
HEIGHT_M = 20.0
STANDS_M_S = 0.1


def flying_north(speed_m_s: float) -> Bench:
    """In GUIDED, at this speed over ground."""
    bench = Bench(parameters=None)
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    pilot = bench.vehicle.autopilot
    assert pilot.set_mode("GUIDED") == "accepted"
    assert pilot.arm() == "accepted"
    assert pilot.take_off(HEIGHT_M) == "accepted"
    bench.until(lambda: pilot.p_neu[2] > HEIGHT_M - 0.1)
    pilot.go_to((1000.0, 0.0, HEIGHT_M))
    pilot.change_speed(1, speed_m_s)  # after the first place: GUIDED forgets what was ordered before it
    bench.advance(20.0)
    assert pilot.v_neu[0] == pytest.approx(speed_m_s, abs=0.05)
    return bench


@pytest.mark.fact("A39")
@pytest.mark.parametrize(("speed_m_s", "measured_m"), [(3.0, 4.8), (4.0, 6.7), (5.0, 8.8), (6.2, 11.3), (8.0, 15.4)])
def test_it_stops_where_the_real_one_stopped(speed_m_s: float, measured_m: float) -> None:
    bench = flying_north(speed_m_s)
    from_m = bench.vehicle.truth.p_neu[0]
    assert bench.vehicle.autopilot.set_mode("BRAKE") == "accepted"
    bench.until(lambda: math.hypot(*bench.vehicle.truth.v_neu) < STANDS_M_S)
    assert bench.vehicle.truth.p_neu[0] - from_m == pytest.approx(measured_m, rel=0.05)


@pytest.mark.fact("A40")
@pytest.mark.parametrize("name", ["arducopter-4.7_console_a", "arducopter-4.7_console_b"])
def test_it_slows_down_as_the_recorded_vehicle_did(shared_data: Path, name: str) -> None:
    braked_s, speeds = None, []
    for t_s, message in received(shared_data / "logs" / "real_flights" / f"{name}.mcap"):
        if message.get_type() == "HEARTBEAT" and message.custom_mode == BRAKE and braked_s is None:
            braked_s = t_s
        elif message.get_type() == "GLOBAL_POSITION_INT" and braked_s is not None and t_s - braked_s < 3.5:
            speeds.append((t_s - braked_s, math.hypot(message.vx, message.vy) / 100))
    bench = flying_north(speeds[0][1])
    bench.vehicle.autopilot.set_mode("BRAKE")
    simulated = []
    while len(simulated) < 3.5 / 0.02:
        simulated.append((0.02 * len(simulated), math.hypot(*bench.vehicle.truth.v_neu[:2])))
        bench.advance(0.02)
    real_t_s, real_m_s = np.array(speeds).T
    at_same_time = np.interp(real_t_s, *np.array(simulated).T)
    assert np.abs(at_same_time - real_m_s).max() < 0.4
