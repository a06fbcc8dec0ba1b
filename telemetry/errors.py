"""What can go wrong between Hedgehop and a vehicle, as one tree.

TelemetryError
├── AddressError           a link string that names no connection Hedgehop makes
├── ConnectionFailedError  a port in use, gone or forbidden; a host that does not answer
├── NoVehicleError         no vehicle adopted, or the link to it is lost
├── NotAllowedError        not the operator in charge, or a command that does not fit the present state
│   ├── MissionUnknownError    what is on board has not been read back and found to be the plan
│   └── OvertakenError         a fencing token lower than one that the link has seen
├── RefusedError           the vehicle said no: its result and its own words
├── SilentError            the vehicle did not answer
├── TransferError          a mission that did not get across whole
├── RecordingError         a recording that cannot be read: foreign, empty, broken from the start
│   └── RecordingFullError     no space left to record on
├── SensorLinkError        an agent or ground station that does not speak the sensor link's protocol
├── SensorError            a sensor's port that is gone, busy or silent; a configuration that the sensor refuses
├── Ros2Error              a router of ROS 2 that does not answer; topics or frames that are missing
│   └── Ros2AddressError       a router that Hedgehop would not reach
├── StationsError          another station's message, name or router that is not accepted
└── BusError               a node that is not there, or messages nobody understands
"""

from __future__ import annotations

from planning.errors import DescribedError


class TelemetryError(DescribedError):
    """Base of all errors of this floor."""

    code = "telemetry"


class AddressError(TelemetryError):
    code = "link_address"


class ConnectionFailedError(TelemetryError):
    code = "connection"


class NoVehicleError(TelemetryError):
    code = "no_vehicle"


class NotAllowedError(TelemetryError):
    code = "not_allowed"


class MissionUnknownError(NotAllowedError):
    code = "mission_unknown"


class OvertakenError(NotAllowedError):
    code = "overtaken"


class RefusedError(TelemetryError):
    code = "vehicle_refused"


class SilentError(TelemetryError):
    code = "vehicle_silent"


class TransferError(TelemetryError):
    code = "transfer"


class RecordingError(TelemetryError):
    code = "recording"


class RecordingUnreadableError(RecordingError):
    """Its disk does not give it: what it holds is not known."""


class RecordingFullError(RecordingError):
    code = "recording_full"


class SensorLinkError(TelemetryError):
    code = "sensor_link"


class SensorError(TelemetryError):
    code = "sensor"


class Ros2Error(TelemetryError):
    code = "ros2"


class Ros2AddressError(Ros2Error, AddressError):
    code = "ros2_address"


class StationsError(TelemetryError):
    code = "stations"


class BusError(TelemetryError):
    code = "bus"
