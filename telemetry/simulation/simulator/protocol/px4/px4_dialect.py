"""PX4's MAVLink, of the link to a ground station."""

from __future__ import annotations

from functools import partial
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.pilot import Text
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.own_logs.ulog_writing import UlogWriter
from telemetry.simulation.simulator.protocol.dialect import Dialect, Parts
from telemetry.simulation.simulator.protocol.px4.px4_commands import Px4Commands
from telemetry.simulation.simulator.protocol.px4.px4_events import Px4Events
from telemetry.simulation.simulator.protocol.px4.px4_metadata import px4_file
from telemetry.simulation.simulator.protocol.px4.px4_missions import Px4Missions
from telemetry.simulation.simulator.protocol.px4.px4_parameters_on_wire import Px4ParametersOnWire
from telemetry.simulation.simulator.protocol.px4.px4_streams import FIRMWARE_VERSION, UNASKED_HZ, Px4Streams
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

TEXT_BYTES = 50
FAILED, DENIED = 4, 2


def _parts(vehicle: SimulatedVehicle) -> Parts:
    pilot = vehicle.autopilot
    assert isinstance(pilot, Px4Pilot)
    streams = Px4Streams(vehicle, pilot)
    parameters, commands = Px4ParametersOnWire(vehicle.parameters), Px4Commands(pilot)
    return Parts(Px4Missions(pilot), parameters, streams, commands, Px4Events(pilot))


def _text(text: Text, number: int) -> list[MAVLink_message]:
    """It ends in a tab: the same is said by an event, too. What is longer than one message comes in parts."""
    data = f"{text.text}\t".encode()
    parts = [data[at : at + TEXT_BYTES] for at in range(0, len(data), TEXT_BYTES)]
    return [wire.MAVLink_statustext_message(text.severity, part, number % 65536, seq) for seq, part in enumerate(parts)]


def _hears(_: Parameters, heartbeat: Any) -> bool:
    return heartbeat.type == wire.MAV_TYPE_GCS


PX4 = Dialect(
    _parts,
    partial(UlogWriter, version=FIRMWARE_VERSION),
    _text,
    _hears,
    UNASKED_HZ,
    timesync_s=2.0,
    unknown_stream=FAILED,
    unknown_message=DENIED,
    file_sessions=1,
    made_file=px4_file,
)
