"""How well the places of the navigation script are followed: as the real ArduCopter did, and in straight legs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from planning.model import F64
from telemetry.mavlink.codec import Parser
from telemetry.messages import RawFrame, Topic
from telemetry.recording.reader import open_recording
from telemetry.simulator.frame import Frame
from telemetry.simulator.parameters import Parameters
from telemetry.simulator.vehicle import SimulatedVehicle
from tests.telemetry.guided_flights import ScriptedFlight, off_line
from tests.telemetry.simulator_bench import SLICE_S, Bench

HOME = Frame(-37.1236758, 175.6886922, 803.94)
FLOWN_S = (64.5, 153.5)
"""Of the recording: from the first target to the last."""


@dataclass
class Traces:
    real: F64
    """(N, 4) time, north, east, up"""
    simulated: F64
    line: F64


@pytest.fixture(scope="module")
def traces(shared_data: Path) -> Traces:
    """The simulated vehicle is sent what the real one was sent, when it was."""
    path = shared_data / "logs" / "real_flights" / "arducopter-4.7_guided_below_certified.mcap"
    parsers, orders, real = {True: Parser(datagrams=True), False: Parser(datagrams=True)}, [], []
    with open_recording(path) as recording:
        for entry in recording.entries({Topic.RAW}):
            assert isinstance(entry.message, RawFrame)
            t_s = entry.t_utc_s - recording.start_utc_s
            for message in parsers[entry.message.sent].feed(entry.message.frame):
                kind = message.get_type()
                if entry.message.sent and kind in ("COMMAND_LONG", "SET_POSITION_TARGET_GLOBAL_INT") and t_s > 46:
                    orders.append((t_s, message))
                elif kind == "GLOBAL_POSITION_INT":
                    n, e, _ = HOME.neu_from_geodetic(message.lat / 1e7, message.lon / 1e7, 0)
                    real.append((t_s, n, e, message.relative_alt / 1000))
    places = [message for _, message in orders if message.get_type() != "COMMAND_LONG"]
    line = [(*HOME.neu_from_geodetic(m.lat_int / 1e7, m.lon_int / 1e7, 0)[:2], m.alt) for m in places]
    flown = np.array(real)
    return Traces(flown[(flown[:, 0] > FLOWN_S[0]) & (flown[:, 0] < FLOWN_S[1])], simulated(orders), np.array(line))


def simulated(orders: list[tuple[float, object]]) -> F64:
    bench = Bench(SimulatedVehicle(HOME, gnss="perfect", boot_s=0.5, parameters=Parameters(BATT_CAPACITY=33000)))
    track: list[tuple[float, ...]] = []
    for t_s, order in orders:
        while bench.now_s < min(t_s, FLOWN_S[1]) - SLICE_S / 2:
            bench.advance(SLICE_S)
            track.append((bench.now_s, *bench.vehicle.truth.p_neu))
        bench.send(order)
    flown = np.array(track)
    return flown[flown[:, 0] > FLOWN_S[0]]


def test_the_simulated_vehicle_leaves_the_straight_leg_as_the_recorded_one_did(traces: Traces) -> None:
    (_, real), (_, ours) = (off_line(flown[:, 1:], traces.line) for flown in (traces.real, traces.simulated))
    assert (real.min(), real.max()) == pytest.approx((-1.7, 1.3), abs=0.1)
    for of in (np.min, np.max, lambda off: np.percentile(np.abs(off), 95), lambda off: np.abs(off).mean()):
        assert of(ours) == pytest.approx(of(real), rel=0.2)


def test_it_is_where_the_recorded_one_was(traces: Traces) -> None:
    real, ours = traces.real, traces.simulated
    then = np.column_stack([np.interp(real[:, 0], ours[:, 0], ours[:, axis]) for axis in (1, 2, 3)])
    assert np.percentile(np.linalg.norm(then - real[:, 1:], axis=1), [50, 95]) == pytest.approx([0.0, 0.0], abs=0.8)
    assert np.percentile(np.abs(then[:, 2] - real[:, 3]), 95) < 0.2


@pytest.mark.parametrize("name", ["coro2", "coro2.h1"])
def test_in_straight_legs_it_keeps_within_a_third_of_a_metre_of_the_line(shared_data: Path, name: str) -> None:
    mission = shared_data / "logs" / "real_flights" / "plans" / name / "mission.waypoints"
    straight, shaped = (ScriptedFlight(mission, GUID_OPTIONS=options) for options in (64, 0))
    for flight, close in ((straight, True), (shaped, False)):
        beside_m, above_m = off_line(flight.track[:, 1:], flight.line)
        assert bool(np.percentile(np.abs(above_m), 95) < 0.3) is close
        assert bool(np.percentile(beside_m, 95) < 0.3) is close


def test_the_speed_that_was_ordered_holds(shared_data: Path) -> None:
    """Ordered before the first place it was forgotten: the recorded vehicle flew at 7.4 m/s instead of 6."""
    flight = ScriptedFlight(shared_data / "logs" / "real_flights" / "plans" / "coro2.h1" / "mission.waypoints")
    speed_m_s = np.hypot(*np.diff(flight.track[:, 1:3], axis=0).T) / SLICE_S
    assert speed_m_s.max() < 6.3
