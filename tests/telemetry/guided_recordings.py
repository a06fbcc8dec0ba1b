"""Recorded GUIDED flights of the real ArduCopter, and the simulated vehicle that is sent the same at the same times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.mavlink.codec import Parser
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.messages import RawFrame, Topic
from tests.telemetry.simulator_bench import SLICE_S, Bench

Order = tuple[float, Any]
CHANGE_SPEED, TAKE_OFF = 178, 22
SETTLED_S = 60.0
LEG_M = 1.0
"""Shorter ways over ground are climbs."""


@dataclass(frozen=True)
class Stretch:
    """Of a recording: from the first place to the last order's end."""

    recording: str
    from_s: float
    to_s: float


@dataclass(frozen=True)
class Replay:
    real: F64
    """(N, 4) time by the vehicle's clock, north, east, up"""
    simulated: F64
    """At the same times."""
    line: F64
    """(K, 3) of the legs that lead over ground."""


def replayed_stretch(folder: Path, stretch: Stretch) -> Replay:
    """From hovering where the real vehicle was. Times are the vehicle's own: its simulator lost some of the wall's."""
    orders, flown = _read(folder / f"{stretch.recording}.mcap", stretch)
    start = flown[np.searchsorted(flown[:, 0], orders[0][0]) - 1]
    frame = NeuFrame(start[1], start[2], 100.0)
    real = np.array([(t_s, *frame.neu_from_geodetic(lat, lon, 0.0)[:2], up) for t_s, lat, lon, up in flown])
    ours = _simulated(frame, float(start[3]), orders, float(real[-1, 0]))
    line = _legs(frame, orders)
    over_ground_s = next(t_s for t_s, message in orders if _is_place(message) and _leads_away(frame, message))
    real = real[real[:, 0] > over_ground_s]
    then = [np.interp(real[:, 0], ours[:, 0], ours[:, axis]) for axis in (1, 2, 3)]
    return Replay(real, np.column_stack([real[:, 0], *then]), line)


def _read(path: Path, stretch: Stretch) -> tuple[list[Order], F64]:
    """Orders, and (N, 4) time, latitude, longitude and height above home; by the vehicle's clock."""
    parsers = {True: Parser(datagrams=True), False: Parser(datagrams=True)}
    orders: list[Order] = []
    flown, wall_s = [], []
    with open_recording(path) as recording:
        for entry in recording.entries({Topic.RAW}):
            assert isinstance(entry.message, RawFrame)
            t_s = entry.t_utc_s - recording.start_utc_s
            for message in parsers[entry.message.sent].feed(entry.message.frame):
                if entry.message.sent and stretch.from_s <= t_s <= stretch.to_s and _is_order(message):
                    orders.append((t_s, message))
                elif message.get_type() == "GLOBAL_POSITION_INT":
                    wall_s.append(t_s)
                    flown.append(
                        (message.time_boot_ms / 1e3, message.lat / 1e7, message.lon / 1e7, message.relative_alt / 1e3)
                    )
    rows, wall = np.array(flown), np.array(wall_s)
    own = [(float(np.interp(t_s, wall, rows[:, 0])), message) for t_s, message in orders]
    return own, rows[wall <= stretch.to_s]


def _is_place(message: Any) -> bool:
    return message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT"


def _is_order(message: Any) -> bool:
    return _is_place(message) or (message.get_type() == "COMMAND_LONG" and message.command == CHANGE_SPEED)


def _place(frame: NeuFrame, message: Any) -> tuple[float, float, float]:
    north, east, _ = frame.neu_from_geodetic(message.lat_int / 1e7, message.lon_int / 1e7, 0.0)
    return north, east, message.alt


def _leads_away(frame: NeuFrame, message: Any) -> bool:
    return float(np.hypot(*_place(frame, message)[:2])) > LEG_M


def _legs(frame: NeuFrame, orders: list[Order]) -> F64:
    places = [_place(frame, message) for _, message in orders if _is_place(message)]
    first = next(k for k, place in enumerate(places) if np.hypot(*place[:2]) > LEG_M)
    return np.array(places[max(0, first - 1) :])


def _simulated(frame: NeuFrame, up_m: float, orders: list[Order], end_s: float) -> F64:
    """(N, 4) time, north, east, up."""
    bench = Bench(SimulatedVehicle(frame, gnss="perfect", boot_s=0.5, parameters=Parameters(BATT_CAPACITY=60000)))
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    assert [bench.command(176, 1, 4), bench.command(400, 1), bench.command(TAKE_OFF, *[0.0] * 6, up_m)] == [0, 0, 0]
    bench.advance(SETTLED_S)
    behind_s = orders[0][0] - bench.now_s
    track = []
    for t_s, message in (*orders, (end_s, None)):
        while bench.now_s + behind_s < t_s - SLICE_S / 2:
            bench.advance(SLICE_S)
            track.append((bench.now_s + behind_s, *bench.vehicle.truth.p_neu))
        if message is not None:
            bench.send(message)
    return np.array(track)
