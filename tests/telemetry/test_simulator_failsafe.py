"""When the simulated autopilot takes over."""

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.failsafe import BatteryFailsafe, GcsFailsafe


def test_a_ground_station_that_was_never_heard_is_not_missed() -> None:
    assert GcsFailsafe(1.0).check(Parameters(FS_GCS_ENABLE=1), 100.0) is None


def test_silence_takes_over_once_and_ends_with_the_next_heartbeat() -> None:
    failsafe, parameters = GcsFailsafe(1.0), Parameters(FS_GCS_ENABLE=1)
    failsafe.heard(10.0)
    assert failsafe.check(parameters, 14.9) is None
    found = failsafe.check(parameters, 15.1)
    assert found is not None
    assert (found.text, found.takeover) == ("GCS Failsafe", "RTL")
    assert failsafe.check(parameters, 16.0) is None
    failsafe.heard(20.0)
    cleared = failsafe.check(parameters, 20.1)
    assert cleared is not None
    assert (cleared.text, cleared.takeover) == ("GCS Failsafe Cleared", "none")
    assert not failsafe.active


def test_disabled_it_does_nothing() -> None:
    failsafe = GcsFailsafe(1.0)
    failsafe.heard(0.0)
    assert failsafe.check(Parameters(), 100.0) is None


def test_speeded_up_flights_still_have_a_ground_station_of_one_heartbeat_a_second() -> None:
    failsafe, parameters = GcsFailsafe(20.0), Parameters(FS_GCS_ENABLE=5)
    failsafe.heard(0.0)
    assert failsafe.check(parameters, 95.0) is None
    found = failsafe.check(parameters, 101.0)
    assert found is not None
    assert found.takeover == "LAND"


def test_a_low_battery_returns_and_a_critical_one_lands() -> None:
    failsafe = BatteryFailsafe()
    parameters = Parameters(
        BATT_CAPACITY=1000, BATT_LOW_MAH=300, BATT_CRT_MAH=100, BATT_FS_LOW_ACT=2, BATT_FS_CRT_ACT=1
    )
    assert failsafe.check(parameters, 12.0, 600.0, flying=True, now_s=0.0) is None
    low = failsafe.check(parameters, 11.0, 710.0, flying=True, now_s=1.0)
    assert low is not None
    assert (low.text, low.takeover) == ("Battery 1 is low 11.00V used 710 mAh", "RTL")
    assert failsafe.check(parameters, 11.0, 720.0, flying=True, now_s=2.0) is None
    critical = failsafe.check(parameters, 10.5, 910.0, flying=True, now_s=3.0)
    assert critical is not None
    assert critical.takeover == "LAND"


def test_a_short_dip_of_the_voltage_is_forgiven() -> None:
    failsafe, parameters = BatteryFailsafe(), Parameters(BATT_LOW_VOLT=10.5, BATT_FS_LOW_ACT=2)
    assert failsafe.check(parameters, 10.0, 0.0, flying=True, now_s=0.0) is None
    assert failsafe.check(parameters, 11.0, 0.0, flying=True, now_s=5.0) is None
    assert failsafe.check(parameters, 10.0, 0.0, flying=True, now_s=6.0) is None
    assert failsafe.check(parameters, 10.0, 0.0, flying=True, now_s=15.0) is None
    found = failsafe.check(parameters, 10.0, 0.0, flying=True, now_s=16.1)
    assert found is not None
    assert found.takeover == "RTL"
