"""The simulated vehicle as a whole: the same seed and commands make the same flight."""

import numpy as np
import pytest

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.simulated_vehicle import STEP_S, SimulatedVehicle
from tests.telemetry.simulator_bench import HOME


def flown(seed: int, slices: int) -> np.ndarray:
    """Truth at the end of 30 s, hovering in wind, advanced in slices of any size."""
    parameters = Parameters(SIM_WIND_SPD=5)
    vehicle = SimulatedVehicle(HOME, seed=seed, gnss="standalone", parameters=parameters, boot_s=0.5)
    vehicle.advance(1.0)
    pilot = vehicle.autopilot
    assert [pilot.set_mode("GUIDED"), pilot.arm(), pilot.take_off(10.0)] == ["accepted"] * 3
    for _ in range(slices):
        vehicle.advance(30.0 / slices)
    return np.array([*vehicle.truth.p_neu, *vehicle.truth.v_neu, vehicle.battery.used_mah, *vehicle.gnss.error_neu])


def test_the_same_seed_makes_the_same_flight_however_time_is_cut() -> None:
    assert np.array_equal(flown(1, 1), flown(1, 1))
    assert np.array_equal(flown(1, 1), flown(1, 750))


def test_another_seed_makes_another_flight() -> None:
    assert not np.array_equal(flown(1, 1), flown(2, 1))


def test_time_goes_on_in_whole_steps() -> None:
    vehicle = SimulatedVehicle(HOME)
    for _ in range(50):
        vehicle.advance(0.02)
    assert vehicle.now_s == pytest.approx(1.0, abs=STEP_S / 2)


def test_it_stands_still_until_it_is_told_to_fly() -> None:
    vehicle = SimulatedVehicle(HOME, parameters=Parameters(SIM_WIND_SPD=10), boot_s=0.5)
    vehicle.advance(5.0)
    assert vehicle.truth.p_neu == (0.0, 0.0, 0.0)
    assert vehicle.truth.v_neu == (0.0, 0.0, 0.0)
