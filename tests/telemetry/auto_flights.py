"""AUTO flights of one plan: recorded from the real ArduCopter, and flown by the simulated one; both told alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as wire

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Mission
from planning.formats.wpl import read_wpl
from telemetry.mavlink.items import home_message, item_message, items_from_mission
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from tests.telemetry.guided_flights import off_line
from tests.telemetry.replayed_link import received
from tests.telemetry.simulator_bench import Bench

WAYPOINT = 16
RATE_HZ = {33: 20, 42: 5}
"""GLOBAL_POSITION_INT and MISSION_CURRENT, as the link asks for them."""
Heard = list[tuple[float, Any]]


@dataclass(frozen=True)
class Flown:
    beside_m: F64
    above_m: F64
    """Of the line, from the first waypoint to the last."""
    legs_s: float
    home_m_s: float
    """The fastest over ground after the last waypoint."""
    heard: Heard


def read_plan(folder: Path, name: str) -> Mission:
    return read_wpl((folder / "plans" / name / "mission.waypoints").read_bytes())


def recorded(path: Path, mission: Mission) -> Flown:
    return _judged(list(received(path)), mission)


def simulated(mission: Mission, **parameters: float) -> Flown:
    bench = Bench(
        SimulatedVehicle(
            frame_of(mission), gnss="perfect", boot_s=0.5, parameters=Parameters(BATT_CAPACITY=60000, **parameters)
        )
    )
    for message_id, rate_hz in RATE_HZ.items():
        bench.stream(message_id, rate_hz)
    _upload(bench, mission)
    bench.fly_mission()
    bench.until(lambda: not bench.vehicle.autopilot.armed)
    bench.advance(1.1)
    return _judged([(one.t_s, one.message) for one in bench.heard], mission)


def frame_of(mission: Mission) -> NeuFrame:
    return NeuFrame(mission.home.lat_deg, mission.home.lon_deg, mission.home.alt_dsm_m)


def _upload(bench: Bench, mission: Mission) -> None:
    target = (1, 1)
    items = enumerate(items_from_mission(mission), start=1)
    rows = [item_message(item, seq, target=target, number=seq, firmware="ardupilot") for seq, item in items]
    rows.insert(0, home_message(mission.home.lat_deg, mission.home.lon_deg, mission.home.alt_dsm_m, target=target))
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    answers = bench.send(wire.MAVLink_mission_count_message(*target, len(rows)))
    while answers[0].get_type() == "MISSION_REQUEST":
        answers = bench.send(rows[answers[0].seq])
    assert answers[0].type == 0


def _judged(heard: Heard, mission: Mission) -> Flown:
    reached = {message.seq: t_s for t_s, message in heard if message.get_type() == "MISSION_ITEM_REACHED"}
    items = items_from_mission(mission)
    places = [seq for seq, item in enumerate(items, start=1) if item.command == WAYPOINT]
    track, speed_m_s = _track(heard, frame_of(mission))
    first_s, last_s = reached[places[0]], reached[places[-1]]
    legs = track[(track[:, 0] >= first_s) & (track[:, 0] <= last_s)]
    beside_m, above_m = off_line(legs[:, 1:], _line(mission))
    return Flown(beside_m, above_m, last_s - first_s, float(speed_m_s[track[:, 0] > last_s].max()), heard)


def _track(heard: Heard, frame: NeuFrame) -> tuple[F64, F64]:
    """(N, 4): time, north, east, height above home; (N,): speed over ground."""
    rows, speeds = [], []
    for t_s, message in heard:
        if message.get_type() == "GLOBAL_POSITION_INT" and message.lat:
            north, east, _ = frame.neu_from_geodetic(message.lat / 1e7, message.lon / 1e7, 0)
            rows.append((t_s, north, east, message.relative_alt / 1000))
            speeds.append(math.hypot(message.vx, message.vy) / 100)
    return np.array(rows), np.array(speeds)


def _line(mission: Mission) -> F64:
    frame = frame_of(mission)
    return np.array([
        (*frame.neu_from_geodetic(item.lat_deg, item.lon_deg, 0)[:2], item.alt_m)
        for item in items_from_mission(mission) if item.command == WAYPOINT
    ])  # fmt: skip
