"""The companion computers that are connected, and their way onto the bus."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from mapping.sensor_frames import CloudFrame, RadarFrame, UwbScan
from server.errors import BusyError
from telemetry.agent.intake import Frame, Intake
from telemetry.bus.bus import Bus
from telemetry.topics.messages import Topic, VehicleText

AGENTS_MAX = 4


class Agents:
    """Frames of all agents go the same way; the perception nodes tell their sources apart."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._connected: list[Intake] = []

    @contextmanager
    def connected(self, intake: Intake) -> Iterator[None]:
        """Raises BusyError when there are as many agents as may be."""
        if len(self._connected) >= AGENTS_MAX:
            raise BusyError(f"{AGENTS_MAX} agents are connected already.", advice="End one of them first.")
        self._connected.append(intake)
        try:
            yield
        finally:
            self._connected.remove(intake)

    def publish(self, frame: Frame | VehicleText) -> None:
        match frame:
            case VehicleText():
                self._bus.publish(Topic.TEXT, frame)
            case RadarFrame():
                self._bus.publish(Topic.RADAR_FRAME, frame)
            case CloudFrame():
                self._bus.publish(Topic.CLOUD_FRAME, frame)
            case UwbScan():
                self._bus.publish(Topic.UWB_SCAN, frame)
            case _:
                self._bus.publish(Topic.SLAM_POSE, frame)
