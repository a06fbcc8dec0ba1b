"""ArduCopter's MAVLink."""

from __future__ import annotations

from functools import partial
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.pilot import Text
from telemetry.simulation.simulator.own_logs.dataflash_writing import DataflashWriter
from telemetry.simulation.simulator.protocol.command_protocol import MODE_NUMBERS, Commands
from telemetry.simulation.simulator.protocol.dialect import Dialect, Parts
from telemetry.simulation.simulator.protocol.made_files import ardupilot_file
from telemetry.simulation.simulator.protocol.message_streams import FIRMWARE, ArduStreams
from telemetry.simulation.simulator.protocol.mission_protocol import MissionProtocol
from telemetry.simulation.simulator.protocol.parameter_protocol import ParameterProtocol
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle


def _parts(vehicle: SimulatedVehicle) -> Parts:
    pilot = vehicle.autopilot
    assert isinstance(pilot, Autopilot)
    missions = MissionProtocol(pilot)
    return Parts(
        missions, ParameterProtocol(vehicle.parameters), ArduStreams(vehicle, pilot, missions), Commands(pilot)
    )


def _text(text: Text, _: int) -> list[MAVLink_message]:
    return [wire.MAVLink_statustext_message(text.severity, text.text.encode()[:50])]


def _hears(parameters: Parameters, heartbeat: Any) -> bool:
    return heartbeat.get_srcSystem() == parameters["MAV_GCS_SYSID"]


ARDUPILOT = Dialect(
    _parts,
    partial(DataflashWriter, mode_numbers=MODE_NUMBERS, version=FIRMWARE),
    _text,
    _hears,
    made_file=ardupilot_file,
)
