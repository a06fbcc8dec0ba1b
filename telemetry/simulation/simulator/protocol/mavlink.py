"""The simulated vehicle's MAVLink side as a machine without sockets or clock: what comes in, what goes out.

What is particular to an autopilot is in its dialect. Unasked ArduCopter sends HEARTBEAT, TIMESYNC and STATUSTEXT and
no position; PX4 sends nearly everything.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.personality import Make
from telemetry.simulation.simulator.autopilot.pilot import Text
from telemetry.simulation.simulator.own_logs.keeping import OwnLogs
from telemetry.simulation.simulator.protocol.ardupilot_dialect import ARDUPILOT
from telemetry.simulation.simulator.protocol.command_protocol import RESULTS, read_order, whole
from telemetry.simulation.simulator.protocol.dialect import Dialect
from telemetry.simulation.simulator.protocol.file_protocol import FileProtocol
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.protocol.log_protocol import LogProtocol
from telemetry.simulation.simulator.protocol.parameter_protocol import parameter_error
from telemetry.simulation.simulator.protocol.passing_traffic import passing
from telemetry.simulation.simulator.protocol.px4.px4_dialect import PX4
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

DIALECTS: dict[Make, Dialect] = {"ardupilot": ARDUPILOT, "px4": PX4}
HEARTBEAT_S = 1.0
TRAFFIC_S = 1.0
NEWS_S = 0.15
"""After this the other ground stations hear that one of them has written a mission; between 0.1 s and 0.2 s, measured
on the real ArduCopter."""
FASTEST_WALL_S = 0.02
"""However fast simulated time runs, no stream sends more often than 50 times a second."""
ROUNDING_S = 1e-6
"""Sums of time steps that should reach a stream's interval miss it by less."""
GROUPS: dict[int, tuple[int, ...]] = {
    wire.MAV_DATA_STREAM_EXTENDED_STATUS: (1, 24, 42, 62, 87),
    wire.MAV_DATA_STREAM_POSITION: (33, 32),
    wire.MAV_DATA_STREAM_EXTRA1: (30, 108),
    wire.MAV_DATA_STREAM_EXTRA2: (74,),
    wire.MAV_DATA_STREAM_EXTRA3: (2, 147, 193),
}
"""REQUEST_DATA_STREAM's groups."""
MISSION_MESSAGES = {
    "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_REQUEST_LIST", "MISSION_REQUEST",
    "MISSION_REQUEST_INT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST", "MISSION_ACK",
}  # fmt: skip


@dataclass(slots=True)
class _Stream:
    interval_s: float
    """Simulated"""
    due_s: float
    sent_wall_s: float = -1e9


@dataclass(slots=True)
class _Peer:
    streams: dict[int, _Stream] = field(default_factory=dict)


class Endpoint:
    """One autopilot for any number of ground stations. ``peer`` names the way to one of them.

    ``wall_s`` is any monotonic clock. Answers of the mission protocol keep its time, everything else
    keeps simulated time.
    """

    def __init__(self, vehicle: SimulatedVehicle, *, traffic: bool = False, parameter_errors: bool = False) -> None:
        """``traffic``: an aircraft that flies past is told of. ``parameter_errors``: PARAM_ERROR is sent."""
        self.vehicle = vehicle
        self._traffic = _Stream(TRAFFIC_S, 0.0) if traffic else None
        self._says_parameter_errors = parameter_errors
        self._pilot = vehicle.autopilot
        self._dialect = dialect = DIALECTS[vehicle.personality.make]
        parts = dialect.parts(vehicle)
        self._missions, self._parameters = parts.missions, parts.parameters
        self._streams, self._commands = parts.streams, parts.commands
        self._events = parts.events
        self._own_logs = OwnLogs(vehicle, dialect.log_writer)
        self._logs = LogProtocol(vehicle, self._own_logs)
        made = partial(dialect.made_file, vehicle.parameters)
        self._files = FileProtocol(self._own_logs, most_sessions=dialect.file_sessions, made=made)
        self._peers: dict[Hashable, _Peer] = {}
        self._news: list[tuple[float, Reply]] = []
        """That the other ground stations have not heard yet, and when they will."""
        self._heartbeat = _Stream(HEARTBEAT_S, 0.0)
        self._timesync = _Stream(dialect.timesync_s, dialect.timesync_s)
        self._texts = 0

    @property
    def system_id(self) -> int:
        return int(self.vehicle.parameters[self.vehicle.personality.system_id])

    @property
    def component_id(self) -> int:
        return wire.MAV_COMP_ID_AUTOPILOT1

    def connect(self, peer: Hashable) -> None:
        if peer not in self._peers:
            now_s = self.vehicle.now_s
            unasked = {number: _Stream(1 / hz, now_s) for number, hz in self._dialect.unasked_hz.items()}
            self._peers[peer] = _Peer(unasked)

    def disconnect(self, peer: Hashable) -> None:
        self._peers.pop(peer, None)
        self._parameters.list.forget(peer)
        self._logs.forget(peer)
        self._files.forget(peer)

    def on_message(self, message: Any, peer: Hashable, wall_s: float) -> list[Reply]:
        """Answers, in the order in which they go out."""
        self.connect(peer)
        kind = message.get_type()
        if getattr(message, "target_system", 0) not in (0, self.system_id):
            return []
        if kind == "HEARTBEAT":
            self._on_heartbeat(message)
            return []
        if kind in MISSION_MESSAGES:
            return self._missions.on_message(message, peer, wall_s) + self._tell_first(peer, wall_s)
        if kind.startswith("PARAM_"):
            return self._on_parameter(message, peer) + self._tell()
        if kind.startswith("LOG_REQUEST_"):
            self._logs.on_message(message, peer)
            return self._tell()
        if kind == "FILE_TRANSFER_PROTOCOL":
            return self._files.on_message(message, peer)
        replies = self._answer(kind, message, peer)
        return [(peer, reply) for reply in replies] + self._tell()

    def on_slice(self, wall_s: float) -> list[Reply]:
        """What is due after a slice of simulated time, of at most 20 ms if streams are to keep their rates."""
        self._own_logs.on_slice()
        out = self._missions.on_tick(wall_s) + self._parameters.list.on_tick(wall_s) + self._logs.on_tick(wall_s)
        out += self._files.on_tick(wall_s)
        out += [reply for due_s, reply in self._news if due_s <= wall_s]
        self._news = [(due_s, reply) for due_s, reply in self._news if due_s > wall_s]
        out += self._tell()
        if self._events is not None:
            out += [reply for message in self._events.on_slice() for reply in self._to_all(message)]
        now_s = self.vehicle.now_s
        if _due(self._heartbeat, now_s, wall_s) or wall_s - self._heartbeat.sent_wall_s > HEARTBEAT_S:
            out += self._beat(wall_s)
        if _due(self._timesync, now_s, wall_s):
            self._timesync.sent_wall_s = wall_s
            out += self._to_all(wire.MAVLink_timesync_message(0, int(now_s * 1e9)))
        if self._traffic is not None and _due(self._traffic, now_s, wall_s):
            self._traffic.sent_wall_s = wall_s
            out += self._to_all(passing(self.vehicle.frame, now_s))
        for peer, state in self._peers.items():
            for message_id, stream in state.streams.items():
                if _due(stream, now_s, wall_s) and (message := self._streams.build(message_id)):
                    stream.sent_wall_s = wall_s
                    out.append((peer, message))
        return out

    def _answer(self, kind: str, message: Any, peer: Hashable) -> list[MAVLink_message]:
        if kind in ("COMMAND_LONG", "COMMAND_INT"):
            return self._on_command(message, peer)
        if kind == "SET_MODE":
            self._commands.set_mode_message(message)
        elif kind in ("SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED"):
            self._commands.position_target(message)
        elif kind == "REQUEST_DATA_STREAM":
            self._on_data_stream(message, peer)
        elif kind == "MISSION_SET_CURRENT":
            return [self._streams.mission_current()] if self._pilot.set_current(message.seq) == "accepted" else []
        elif kind == "PING" and (message.target_system, message.target_component) == (0, 0):
            sender = message.get_srcSystem(), message.get_srcComponent()
            return [wire.MAVLink_ping_message(message.time_usec, message.seq, *sender)]
        elif kind == "REQUEST_EVENT" and self._events is not None:
            return self._events.on_request(message)
        elif kind == "TIMESYNC" and message.tc1 == 0:
            return [wire.MAVLink_timesync_message(int(self.vehicle.now_s * 1e9), message.ts1)]
        return []

    def _on_parameter(self, message: Any, peer: Hashable) -> list[Reply]:
        if self._says_parameter_errors and (error := parameter_error(message, self.vehicle.parameters)) is not None:
            return [(peer, error)]
        if message.get_type() != "PARAM_SET":
            return self._parameters.on_message(message, peer)
        return [reply for value in self._parameters.on_set(message) for reply in self._to_all(value)]

    def _on_heartbeat(self, message: Any) -> None:
        if self._dialect.hears(self.vehicle.parameters, message):
            self._pilot.gcs_heard()

    def _on_command(self, message: Any, peer: Hashable) -> list[MAVLink_message]:
        order, extra = read_order(message), []
        first, second = order.params[:2]
        if order.command == wire.MAV_CMD_SET_MESSAGE_INTERVAL:
            result = self._set_interval(peer, whole(first), second)
        elif order.command == wire.MAV_CMD_GET_MESSAGE_INTERVAL:
            result, extra = self._interval(peer, whole(first))
        elif order.command in REQUESTS:
            requested = self._streams.build(REQUESTS[order.command] or whole(first))
            result, extra = (RESULTS["accepted"], [requested]) if requested else (self._dialect.unknown_message, [])
        else:
            result = self._commands.run(order)
        sender = message.get_srcSystem(), message.get_srcComponent()
        return [wire.MAVLink_command_ack_message(message.command, result, 0, 0, *sender), *extra]

    def _set_interval(self, peer: Hashable, message_id: int, interval_us: float) -> int:
        if message_id not in self._streams:
            return self._dialect.unknown_stream
        streams = self._peers[peer].streams
        if interval_us == 0 and message_id in self._dialect.unasked_hz:
            interval_us = 1e6 / self._dialect.unasked_hz[message_id]
        if interval_us > 0:
            streams[message_id] = _Stream(interval_us / 1e6, self.vehicle.now_s)
        else:
            streams.pop(message_id, None)
        return RESULTS["accepted"]

    def _interval(self, peer: Hashable, message_id: int) -> tuple[int, list[MAVLink_message]]:
        if message_id not in self._streams:
            return RESULTS["denied"], []
        stream = self._peers[peer].streams.get(message_id)
        interval_us = round(stream.interval_s * 1e6) if stream else 0
        return RESULTS["accepted"], [wire.MAVLink_message_interval_message(message_id, min(interval_us, 2**31 - 1))]

    def _on_data_stream(self, message: Any, peer: Hashable) -> None:
        wanted = GROUPS if message.req_stream_id == wire.MAV_DATA_STREAM_ALL else (message.req_stream_id,)
        interval_us = 1e6 / message.req_message_rate if message.start_stop and message.req_message_rate else -1
        for group in wanted:
            for message_id in GROUPS.get(group, ()):
                self._set_interval(peer, message_id, interval_us)

    def _beat(self, wall_s: float) -> list[Reply]:
        self._heartbeat.sent_wall_s = wall_s
        return self._to_all(self._streams.heartbeat())

    def _tell_first(self, peer: Hashable, wall_s: float) -> list[Reply]:
        """The news for this ground station; the others hear them later."""
        told = self._tell()
        self._news += [(wall_s + NEWS_S, reply) for reply in told if reply[0] != peer]
        return [reply for reply in told if reply[0] == peer]

    def _tell(self) -> list[Reply]:
        """The autopilot's news, to everybody."""
        out: list[Reply] = []
        self._own_logs.look()
        for event in self._pilot.take_events():
            self._own_logs.on_event(event)
            messages = self._streams.on_event(event)
            if isinstance(event, Text):
                self._texts += 1
                messages = self._dialect.text(event, self._texts)
                messages += self._events.on_text(event) if self._events is not None else []
            out += [reply for message in messages for reply in self._to_all(message)]
        return out

    def _to_all(self, message: Any) -> list[Reply]:
        return [(peer, message) for peer in self._peers]


REQUESTS = {
    wire.MAV_CMD_REQUEST_MESSAGE: 0,
    wire.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    wire.MAV_CMD_GET_HOME_POSITION: wire.MAVLINK_MSG_ID_HOME_POSITION,
}
"""Commands that ask for a message; 0: the one that the command names."""


def _due(stream: _Stream, now_s: float, wall_s: float) -> bool:
    """Whether the stream's time has come; then its next one is set."""
    if now_s < stream.due_s - ROUNDING_S or wall_s - stream.sent_wall_s < FASTEST_WALL_S - ROUNDING_S:
        return False
    stream.due_s = max(stream.due_s + stream.interval_s, now_s)
    return True
