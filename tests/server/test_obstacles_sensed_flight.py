"""From the air to disarming is one flight, whatever the vehicle is heard over and whoever hears of it when."""

from __future__ import annotations

from dataclasses import replace

from server.obstacles.sensed_flight import SensedFlight
from telemetry.topics.vehicle import VehicleState

STANDS = VehicleState(1, 1, heartbeat_t_mono_s=1.0, landed="on_ground")
ARMED = replace(STANDS, armed=True)
FLIES = replace(ARMED, landed="in_air")


def test_it_begins_in_the_air_and_ends_where_the_vehicle_is_disarmed() -> None:
    flight = SensedFlight()
    assert flight.on_state(STANDS) == [False], "nothing of before is waited for"
    assert flight.on_state(ARMED) == []
    assert flight.on_state(FLIES) == [True]
    assert flight.on_state(ARMED) == [], "it touches the ground, and may take off again"
    assert flight.on_state(FLIES) == []
    assert flight.on_state(STANDS) == [False]
    assert SensedFlight().on_state(FLIES) == [True]


def test_a_vehicle_that_is_taken_up_again_flies_on_and_another_one_is_another_flight() -> None:
    flight = SensedFlight()
    flight.on_state(FLIES)
    assert flight.on_state(VehicleState(1, 1, landed="in_air")) == [], "whether it is armed is not known yet"
    assert flight.on_state(FLIES) == []
    assert flight.on_state(replace(FLIES, system_id=2)) == [False, True]
    assert flight.on_state(replace(STANDS, system_id=2, component_id=3)) == [False]
