"""How an autopilot of one make speaks MAVLink: the parts of which the simulated vehicle's end of a link is made."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.pilot import Event, Text
from telemetry.simulation.simulator.own_logs.keeping import MakeWriter
from telemetry.simulation.simulator.protocol.command_protocol import ReceivedOrder
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.protocol.made_files import MadeFile
from telemetry.simulation.simulator.protocol.parameter_protocol import ParameterList
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle


class Missions(Protocol):
    """Mission, fence and rally points on board."""

    def on_message(self, message: Any, peer: Hashable, now_s: float) -> list[Reply]: ...
    def on_tick(self, now_s: float) -> list[Reply]: ...


class ParametersOnWire(Protocol):
    def on_message(self, message: Any, peer: Hashable) -> list[Reply]: ...
    def on_set(self, message: Any) -> list[Any]: ...
    @property
    def list(self) -> ParameterList: ...


class StreamsOnWire(Protocol):
    """Messages by their ids."""

    def __contains__(self, message_id: int) -> bool: ...
    def build(self, message_id: int) -> MAVLink_message | None: ...
    def heartbeat(self) -> MAVLink_message: ...
    def mission_current(self) -> MAVLink_message: ...
    def on_event(self, event: Event) -> list[MAVLink_message]:
        """What everybody is told at once; texts come from the dialect."""
        ...


class CommandsOnWire(Protocol):
    def run(self, order: ReceivedOrder) -> int: ...
    def set_mode_message(self, message: Any) -> None: ...
    def position_target(self, message: Any) -> None: ...


class EventsOnWire(Protocol):
    def on_text(self, text: Text) -> list[MAVLink_message]: ...
    def on_request(self, message: Any) -> list[MAVLink_message]: ...
    def on_slice(self) -> list[MAVLink_message]: ...


@dataclass(frozen=True, slots=True)
class Parts:
    missions: Missions
    parameters: ParametersOnWire
    streams: StreamsOnWire
    commands: CommandsOnWire
    events: EventsOnWire | None = None


@dataclass(frozen=True, slots=True)
class Dialect:
    parts: Callable[[SimulatedVehicle], Parts]
    log_writer: MakeWriter
    text: Callable[[Text, int], list[MAVLink_message]]
    """The STATUSTEXTs of a text; the number is that of the text."""
    hears: Callable[[Parameters, Any], bool]
    """Whether a heartbeat is that of the ground station which may be missed."""
    unasked_hz: Mapping[int, float] = field(default_factory=dict[int, float])
    timesync_s: float = 10.0
    unknown_stream: int = 2
    """MAV_RESULT for the rate of a message that it does not have."""
    unknown_message: int = 4
    file_sessions: int = 4
    """That MAVLink FTP may have open at once."""
    made_file: Callable[[Parameters, str], MadeFile | None] = lambda *_: None
    """By its path; None: there is none."""
