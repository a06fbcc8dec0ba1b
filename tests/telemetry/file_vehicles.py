"""Vehicles that serve files by MAVLink FTP on the test's clock: the simulated vehicle's own end of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from telemetry.simulation.simulator.own_logs.keeping import OwnLogs
from telemetry.simulation.simulator.protocol.file_protocol import FileProtocol

FOLDER = "/APM/LOGS"


class FileVehicle:
    def __init__(self, logs: list[bytes]) -> None:
        files = {path(number): bytearray(log) for number, log in enumerate(logs, start=1)}
        own = SimpleNamespace(files=files, writer=SimpleNamespace(folder=FOLDER))
        self.files = FileProtocol(cast(OwnLogs, own), most_sessions=4)

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        if message.get_type() != "FILE_TRANSFER_PROTOCOL":  # a frame can be spoilt into another one
            return []
        return [reply for _, reply in self.files.on_message(message, "station")]

    def on_tick(self, now_s: float) -> list[Any]:
        return [reply for _, reply in self.files.on_tick(now_s)]


def path(number: int) -> str:
    return f"{FOLDER}/{number:08d}.BIN"
