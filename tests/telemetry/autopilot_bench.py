"""A simulated vehicle that is ready, hovers, or is given a mission; and what commands and modes are called."""

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from tests.telemetry.simulator_bench import Bench

ARM, SET_MODE, TAKEOFF, START, PAUSE, YAW, SPEED, SET_CURRENT = 400, 176, 22, 300, 193, 115, 178, 224
STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND, POSHOLD, BRAKE = 0, 3, 4, 5, 6, 9, 16, 17
ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
LAT, LON = -371244507, 1756892878
SHORT_LANDING = {"LAND_SPEED": 150.0, "LAND_ALT_LOW": 200.0, "RTL_LOIT_TIME": 0.0}


def ready(**parameters: float) -> Bench:
    bench = Bench(parameters=Parameters(**SHORT_LANDING, **parameters))
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    return bench


def hovering(up_m: float = 10.0, **parameters: float) -> Bench:
    """In GUIDED, over home."""
    bench = ready(**parameters)
    assert bench.command(SET_MODE, 1, GUIDED) == ACCEPTED
    assert bench.command(ARM, 1) == ACCEPTED
    assert bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, up_m) == ACCEPTED
    bench.until(lambda: bench.vehicle.autopilot.stage == "flight")
    return bench


def go_to(bench: Bench, lat: int, lon: int, up_m: float) -> None:
    mask = 0b110111111000
    bench.send(wire.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, mask, lat, lon, up_m, *[0] * 8))


def mission(*rows: tuple[int, float, int, int, float]) -> list[tuple[int, int, float, int, int, float]]:
    """Home, take-off to 10 m and (command, first parameter, lat e7, lon e7, z) rows."""
    rows = ((TAKEOFF, 0.0, LAT, LON, 10.0), *rows)
    return [(0, 16, 0.0, LAT, LON, 0.0), *((3, command, first, x, y, z) for command, first, x, y, z in rows)]


def landed(bench: Bench) -> bool:
    return not bench.vehicle.autopilot.armed
