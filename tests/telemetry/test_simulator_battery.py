"""The simulated vehicle's battery."""

import pytest

from telemetry.simulation.simulator.airframe.battery import Battery, Pack


def drained(thrust_share: float | None, seconds: int) -> Battery:
    battery = Battery(Pack())
    for _ in range(seconds):
        battery.step(thrust_share, 1.0)
    return battery


def test_lasts_twenty_minutes_of_hovering() -> None:
    assert not drained(1.0, 19 * 60).empty
    assert drained(1.0, 21 * 60).empty


def test_hardly_drains_on_the_ground() -> None:
    assert drained(None, 20 * 60).share > 0.97


def test_climbing_costs_more_than_sinking() -> None:
    assert drained(1.2, 60).used_mah > drained(1.0, 60).used_mah > drained(0.8, 60).used_mah


def test_voltage_falls_all_the_way_and_steeply_at_the_end() -> None:
    volts = [drained(1.0, minutes * 60).voltage_v for minutes in range(0, 20)]
    assert volts == sorted(volts, reverse=True)
    assert volts[0] == pytest.approx(12.6, abs=0.5)
    assert volts[-2] - volts[-1] > 2 * (volts[1] - volts[2])


def test_the_share_stays_between_empty_and_full() -> None:
    assert Battery(Pack()).share == 1
    assert drained(2.0, 3600).share == 0
