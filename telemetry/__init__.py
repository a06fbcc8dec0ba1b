"""The telemetry floor: bus, MAVLink, sensors, recorder, replay and simulator. Imports `planning` and `mapping`."""
