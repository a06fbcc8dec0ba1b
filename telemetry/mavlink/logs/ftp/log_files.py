"""Which file on a vehicle's card is which of the logs that it lists: told by their sizes, which must be of one alone.

ArduPilot counts its list anew when old logs have gone, and goes on with the numbers of its files. PX4 names its files
by the time of day, in a folder for each day.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from telemetry.mavlink.logs.ftp.listing import FtpEntry
from telemetry.topics.vehicle import Autopilot
from telemetry.topics.vehicle_logs import VehicleLog

MOST_DAYS = 60
"""The newest; each is a folder that has to be listed."""


@dataclass(frozen=True, slots=True)
class LogFolder:
    """Where an autopilot keeps its logs."""

    path: str
    ending: str
    has_days: bool = False
    """A folder in it for each day, whose names sort as the days do."""


FOLDERS: dict[Autopilot, LogFolder] = {
    "ardupilot": LogFolder("/APM/LOGS", ".BIN"),
    "px4": LogFolder("/fs/microsd/log", ".ULG", has_days=True),
}


def day_folders(entries: Iterable[FtpEntry], folder: LogFolder) -> tuple[str, ...]:
    """Paths of the newest days in a folder that has been listed."""
    days = sorted((entry.name for entry in entries if entry.is_folder), reverse=True)
    return tuple(f"{folder.path}/{day}" for day in days[:MOST_DAYS])


def file_of_each(
    logs: Iterable[VehicleLog], listed: Mapping[str, Iterable[FtpEntry]], folder: LogFolder
) -> dict[int, str]:
    """Paths by the logs' numbers; without the logs whose file is not certain. ``listed``: by the folder's path."""
    files = [
        (f"{path}/{entry.name}", entry.size_bytes)
        for path, entries in listed.items()
        for entry in entries
        if not entry.is_folder and entry.name.upper().endswith(folder.ending)
    ]
    logs = tuple(logs)
    alike = Counter(log.size_bytes for log in logs)
    of_size = Counter(size for _, size in files)
    paths = {size: path for path, size in files}
    return {
        log.number: paths[log.size_bytes]
        for log in logs
        if log.size_bytes and alike[log.size_bytes] == of_size[log.size_bytes] == 1
    }
