"""From the air to disarming is one flight, whatever the vehicle is heard over and whoever hears of it when."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

from server.heard.node_states import Nodes
from server.obstacles.obstacles import SensedFlight
from telemetry.bus.node_lock import NodeLock
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told

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


def test_a_server_finds_the_sensors_whose_nodes_ran_before_it(tmp_path: Path) -> None:
    nobody: Any = None
    nodes = Nodes(nobody, tmp_path, tmp_path, Told())
    assert asyncio.run(nodes.running_sensors()) == set()
    with NodeLock(tmp_path, "radar", []), NodeLock(tmp_path, "link", []):
        assert asyncio.run(nodes.running_sensors()) == {"radar"}
    assert asyncio.run(nodes.running_sensors()) == set()
