"""The simulated vehicle and the ground station's end of its link, in virtual time and without sockets.

Frames are packed and parsed as on a real link, states come from the live reducer, orders arrive late.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import TelemetryError
from telemetry.link.streams import StreamRequests
from telemetry.mavlink.actions import Action, Message, Send
from telemetry.mavlink.conversation import GROUND_STATION
from telemetry.mavlink.reduce import reduce
from telemetry.simulation.simulator.protocol.mavlink import Endpoint
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.messages import RawFrame, VehicleText
from telemetry.topics.vehicle import SimTruth, VehicleState

SLICE_S = 0.02
T0_MONO_S = 1000.0
T0_UTC_S = 1_700_000_000.0
"""A recording of a scenario is the same file whenever it is made."""
VEHICLE = (1, 1)
PEER = "scenario"
LINK = "scenario:virtual"
HEARTBEAT_EVERY = 50
NOT_READY_S = 60.0


class Wire:
    """``step`` goes on by one slice of simulated time; ``state`` is what the ground station knows then."""

    def __init__(self, vehicle: SimulatedVehicle, *, order_latency_s: float = 0.0) -> None:
        self.vehicle = vehicle
        self.state: VehicleState | None = None
        self.texts: list[VehicleText] = []
        """Of the newest slice, as ``raw`` is."""
        self.raw: list[RawFrame] = []
        self._endpoint = Endpoint(vehicle)
        self._endpoint.connect(PEER)
        self._latency_s = order_latency_s
        self._craft = mavlink.MAVLink(None, srcSystem=VEHICLE[0], srcComponent=VEHICLE[1])
        self._station = mavlink.MAVLink(None, srcSystem=GROUND_STATION[0], srcComponent=GROUND_STATION[1])
        self._orders: deque[tuple[float, Message]] = deque()
        self._streams = StreamRequests(VEHICLE, "ardupilot", slow=False, now_s=self.now_s)
        self._slices = 0

    @property
    def now_s(self) -> float:
        """Virtual monotonic time."""
        return T0_MONO_S + self.vehicle.now_s

    @property
    def now_utc_s(self) -> float:
        return T0_UTC_S + self.vehicle.now_s

    def until_ready(self) -> VehicleState:
        """Steps until the vehicle has told its home and would arm. Raises TelemetryError when it never does."""
        while self.vehicle.now_s < NOT_READY_S:
            self.step()
            state = self.state
            if state is not None and state.estimator_ok and state.home_lat_deg is not None and state.landed is not None:
                return state
        raise TelemetryError("The simulated vehicle did not become ready.")

    def step(self) -> list[Message]:
        """One slice of simulated time; what the vehicle said in it."""
        self.vehicle.advance(SLICE_S)
        self.texts, self.raw = [], []
        if self._slices % HEARTBEAT_EVERY == 0:
            self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self._slices += 1
        for message in self._streams.on_tick(self.now_s):
            self.send(message)
        replies = self._deliver()
        replies += [message for _, message in self._endpoint.on_slice(self.now_s)]
        heard = [self._carried(message) for message in replies]
        for message in heard:
            self._hear(message)
        return heard

    def send(self, message: Message) -> None:
        """On its way to the vehicle, where it is obeyed ``order_latency_s`` later."""
        self._orders.append((self.now_s + self._latency_s, message))

    def perform(self, actions: Iterable[Action]) -> list[Action]:
        """Sends what a machine wants sent; the rest of its actions come back."""
        rest: list[Action] = []
        for action in actions:
            if isinstance(action, Send):
                self.send(action.message)
            else:
                rest.append(action)
        return rest

    def truth(self) -> SimTruth:
        return self.vehicle.sim_truth(self.now_s, self.now_utc_s)

    def _deliver(self) -> list[Message]:
        replies: list[Message] = []
        while self._orders and self._orders[0][0] <= self.now_s + 1e-9:
            frame = self._pack(self._station, self._orders.popleft()[1])
            self.raw.append(RawFrame(self.now_utc_s, True, LINK, frame))
            message = self._station.decode(bytearray(frame))
            replies += [reply for _, reply in self._endpoint.on_message(message, PEER, self.now_s)]
        return replies

    def _carried(self, message: Message) -> Message:
        """As it comes out at the other end of the link."""
        frame = self._pack(self._craft, message)
        self.raw.append(RawFrame(self.now_utc_s, False, LINK, frame))
        return self._craft.decode(bytearray(frame))

    def _hear(self, message: Message) -> None:
        self._streams.on_message(message, self.now_s)
        self.state = reduce(self.state, message, t_mono_s=self.now_s, t_utc_s=self.now_utc_s)
        if message.get_type() == "STATUSTEXT":
            self.texts.append(VehicleText(self.now_utc_s, message.severity, message.text))

    def _pack(self, codec: Any, message: Message) -> bytes:
        frame = bytes(message.pack(codec))
        codec.seq = (codec.seq + 1) % 256
        return frame
