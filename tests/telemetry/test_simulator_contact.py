"""The simulated vehicle among things that it can fly into, land on and fall beside."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from telemetry.simulation.simulator.run import SimOptions, Simulator
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from tests.telemetry.scenes import FRAME, world

ROOF = {"type": "box", "name": "Shed", "at_m": [0, 0], "size_m": [6, 6, 3]}
WALL = {"type": "wall", "name": "Old wall", "from_m": [-20, 30], "to_m": [20, 30], "height_m": 12}


def airborne(scene: World, up_m: float) -> SimulatedVehicle:
    """Hovering in GUIDED over the origin."""
    vehicle = SimulatedVehicle(FRAME, ground=scene.ground, obstacles=scene, gnss="perfect", boot_s=0.5)
    vehicle.advance(1.0)
    pilot = vehicle.autopilot
    assert (pilot.set_mode("GUIDED"), pilot.arm(), pilot.take_off(up_m)) == ("accepted",) * 3
    vehicle.advance(4.0 + up_m)
    assert vehicle.truth.p_neu[2] == pytest.approx(up_m, abs=0.3)
    return vehicle


def texts(vehicle: SimulatedVehicle) -> list[str]:
    return [getattr(event, "text", "") for event in vehicle.autopilot.take_events()]


def test_a_wall_ends_the_flight_and_the_vehicle_falls_beside_it() -> None:
    vehicle = airborne(world(WALL), 6.0)
    vehicle.autopilot.go_to((60.0, 0.0, 6.0))
    vehicle.advance(15.0)
    assert vehicle.hit == "Old wall"
    assert vehicle.autopilot.crashed
    assert "Crash: Disarming: hit Old wall" in texts(vehicle)
    north, _, up = vehicle.truth.p_neu
    assert 29.0 < north < 29.85
    assert up == pytest.approx(0.0, abs=0.01)


def test_over_the_wall_nothing_happens() -> None:
    vehicle = airborne(world(WALL), 12.5)
    vehicle.autopilot.go_to((60.0, 0.0, 12.5))
    vehicle.advance(15.0)
    assert vehicle.hit is None
    assert vehicle.truth.p_neu[0] == pytest.approx(60.0, abs=1.0)


def test_a_crown_ends_the_flight_too() -> None:
    oak = {"type": "tree", "name": "Oak", "at_m": [0, 20], "height_m": 10, "crown_radius_m": 3}
    vehicle = airborne(world(oak), 7.0)
    vehicle.autopilot.go_to((40.0, 0.0, 7.0))
    vehicle.advance(12.0)
    assert vehicle.hit == "Oak"
    assert vehicle.truth.p_neu[0] < 18.0


def test_a_roof_carries_whoever_lands_on_it() -> None:
    vehicle = airborne(world({**ROOF, "at_m": [0, 20]}), 6.0)
    vehicle.autopilot.go_to((20.0, 0.0, 6.0))
    vehicle.advance(12.0)
    vehicle.autopilot.set_mode("LAND")
    vehicle.advance(25.0)
    assert vehicle.hit is None
    assert not vehicle.autopilot.armed
    assert vehicle.truth.p_neu[2] == pytest.approx(3.0, abs=0.01)


def test_the_ground_is_named_as_before() -> None:
    vehicle = airborne(world(), 6.0)
    vehicle.autopilot.crash("Motors off for a test")
    vehicle.advance(3.0)
    assert vehicle.hit is None
    assert vehicle.truth.p_neu[2] == 0.0


def test_a_simulator_reads_its_world_file(tmp_path: Path) -> None:
    path = tmp_path / "world.json"
    path.write_text(json.dumps({"format": "hedgehop-world", "version": 1, "objects": [WALL]}), encoding="utf-8")
    vehicle = Simulator(SimOptions(FRAME.lat_deg, FRAME.lon_deg, FRAME.alt_amsl_m, world=path)).vehicle
    assert isinstance(vehicle.obstacles, World)
    assert vehicle.obstacles.touching((0.0, 29.7, 1.0), 0.3) == "Old wall"
