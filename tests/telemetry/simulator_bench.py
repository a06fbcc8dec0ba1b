"""A ground station without sockets for the simulated vehicle: frames in, frames out, as fast as it computes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.protocol.mavlink import Endpoint
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from tests.telemetry.tlogs import tlog_messages

HOME = NeuFrame(-37.1244507, 175.6892878, 803.24)
SLICE_S = 0.02
BOOTED_S = 0.104
"""The recorded vehicle was this old when its log begins."""


@dataclass(frozen=True, slots=True)
class Heard:
    t_s: float
    """Simulated time since switching on."""
    message: Any


class Bench:
    """Keeps its own heartbeat unless told otherwise; ``heard`` holds everything that the vehicle sent to it."""

    def __init__(
        self,
        vehicle: SimulatedVehicle | None = None,
        *,
        heartbeat: bool = True,
        parameter_errors: bool = False,
        **options: Any,
    ) -> None:
        options.setdefault("boot_s", 0.5)
        options.setdefault("gnss", "perfect")
        self.vehicle = vehicle or SimulatedVehicle(HOME, **options)
        self.endpoint = Endpoint(self.vehicle, parameter_errors=parameter_errors)
        self.endpoint.connect("gcs")
        self.heard: list[Heard] = []
        self.heartbeat = heartbeat
        self._ours, self._theirs = wire.MAVLink(None, 255, 190), wire.MAVLink(None, 1, 1)
        self._reader = wire.MAVLink(None)
        self._next_beat_s = 0.0

    @property
    def now_s(self) -> float:
        return self.vehicle.now_s

    def send(self, message: Any, *, system: int = 255, component: int = 190, peer: str = "gcs") -> list[Any]:
        """The direct answers."""
        self._ours.srcSystem, self._ours.srcComponent = system, component
        frame = self._reader.decode(bytearray(message.pack(self._ours)))
        return self._keep(self.endpoint.on_message(frame, peer, self.now_s))

    def advance(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s - SLICE_S / 2:
            if self.heartbeat and self.now_s >= self._next_beat_s:
                self._next_beat_s = self.now_s + 1
                self.send(wire.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            self.vehicle.advance(SLICE_S)
            self._keep(self.endpoint.on_slice(self.now_s))

    def until(self, there: Callable[[], bool], limit_s: float = 600.0) -> None:
        end_s = self.now_s + limit_s
        while not there():
            assert self.now_s < end_s, f"not there after {limit_s} simulated seconds"
            self.advance(SLICE_S)

    def command(self, number: int, *params: float) -> int:
        """MAV_RESULT of a COMMAND_LONG."""
        padded = [*params, *[0.0] * (7 - len(params))]
        answers = self.send(wire.MAVLink_command_long_message(1, 1, number, 0, *padded))
        return next(answer.result for answer in answers if answer.get_type() == "COMMAND_ACK")

    def stream(self, message_id: int, rate_hz: float) -> None:
        assert self.command(511, message_id, 1e6 / rate_hz) == 0

    def set_parameters(self, **values: float) -> None:
        for name, value in values.items():
            self.send(wire.MAVLink_param_set_message(1, 1, name.encode(), value, 9))

    def upload(self, items: list[tuple[int, int, float, int, int, float]]) -> int:
        """MAV_MISSION_RESULT for (frame, command, first parameter, lat e7, lon e7, z), home row included."""
        answers = self.send(wire.MAVLink_mission_count_message(1, 1, len(items)))
        while answers[0].get_type() == "MISSION_REQUEST":
            seq = answers[0].seq
            frame, command, first, x, y, z = items[seq]
            item = wire.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, first, 0, 0, 0, x, y, z)
            answers = self.send(item)
        return answers[0].type

    def fly_mission(self) -> None:
        """From the ground to AUTO."""
        self.until(lambda: self.vehicle.autopilot.position_ok)
        assert [self.command(176, 1, 4), self.command(400, 1), self.command(176, 1, 3), self.command(300)] == [0] * 4

    def of(self, *kinds: str) -> list[Heard]:
        return [heard for heard in self.heard if heard.message.get_type() in kinds]

    def texts(self) -> list[str]:
        return [heard.message.text for heard in self.of("STATUSTEXT")]

    def last(self, kind: str) -> Any:
        return self.of(kind)[-1].message

    def _keep(self, replies: list[tuple[Any, Any]]) -> list[Any]:
        frames = [bytearray(message.pack(self._theirs)) for peer, message in replies if peer == "gcs"]
        mine = [self._reader.decode(frame) for frame in frames]
        self.heard += [Heard(self.now_s, message) for message in mine]
        return mine


def recorded_vehicle() -> SimulatedVehicle:
    """The one of the recordings: no wind, a perfect estimate, slow to boot, a small battery."""
    return SimulatedVehicle(HOME, gnss="perfect", parameters=Parameters(BATT_CAPACITY=3300))


def replayed(path: Path) -> tuple[Bench, list[Heard]]:
    """A simulated vehicle that was sent what the recorded one was sent, when it was; and what the latter answered."""
    bench = Bench(recorded_vehicle(), heartbeat=False)
    recorded = []
    start_s = None
    for t_utc_s, message in tlog_messages(path):
        start_s = t_utc_s if start_s is None else start_s
        t_s = t_utc_s - start_s + BOOTED_S
        if message.get_srcSystem() == 1:
            recorded.append(Heard(t_s, message))
            continue
        bench.advance(t_s - bench.now_s)
        bench.send(message)
    return bench, recorded
