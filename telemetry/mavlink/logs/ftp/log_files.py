"""Which file on a vehicle's card is which of the logs that it lists: told by their sizes, which must be of one alone.

ArduPilot counts its list anew when old logs have gone, and goes on with the numbers of its files.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from telemetry.mavlink.logs.ftp.listing import FtpEntry
from telemetry.topics.vehicle import Autopilot
from telemetry.topics.vehicle_logs import VehicleLog

FOLDERS: dict[Autopilot, str] = {"ardupilot": "/APM/LOGS"}
"""Where an autopilot keeps all its logs in one folder. PX4 has one for each day."""
_ENDING = ".BIN"


def file_of_each(logs: Iterable[VehicleLog], entries: Iterable[FtpEntry], folder: str) -> dict[int, str]:
    """Paths by the logs' numbers; without the logs whose file is not certain."""
    files = [entry for entry in entries if not entry.is_folder and entry.name.upper().endswith(_ENDING)]
    logs = tuple(logs)
    alike = Counter(log.size_bytes for log in logs)
    named = Counter(file.size_bytes for file in files)
    names = {file.size_bytes: file.name for file in files}
    return {
        log.number: f"{folder}/{names[log.size_bytes]}"
        for log in logs
        if log.size_bytes and alike[log.size_bytes] == named[log.size_bytes] == 1
    }
