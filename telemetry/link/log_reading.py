"""The logs on the adopted vehicle: their list, and one stretch of one log at a time, on the ground only."""

from __future__ import annotations

import asyncio
import contextlib

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, RefusedError, SilentError, TelemetryError, TransferError
from telemetry.link.adopted import AdoptedVehicle
from telemetry.mavlink.logs.ftp.listing import FtpEntry, FtpList
from telemetry.mavlink.logs.ftp.log_files import FOLDERS, LogFolder, day_folders, file_of_each
from telemetry.mavlink.logs.ftp.questions import Numbers
from telemetry.mavlink.logs.ftp.reading import FtpRead
from telemetry.mavlink.logs.ftp.whole import FtpReadWhole
from telemetry.mavlink.logs.listing import LogListRead
from telemetry.mavlink.logs.on_the_ground import refuse_in_flight
from telemetry.mavlink.logs.reading import LogRead
from telemetry.topics.requests import ReadVehicleLog
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog

INFO = 6
SAYS_S = 1.5
"""It is asked what it can as soon as it is adopted."""


class LogReading:
    """One at a time: a vehicle sends one log, to one station. A mission that is transferred goes before.

    By MAVLink FTP where the vehicle has it and the log's file is certain, else by LOG_REQUEST_DATA.
    """

    def __init__(self, vehicle: AdoptedVehicle) -> None:
        self._vehicle = vehicle
        self._machine: LogListRead | LogRead | FtpList | FtpRead | None = None
        self._gave_way = False
        self._reading = asyncio.Lock()
        self._numbers = Numbers()
        self._logs: tuple[VehicleLog, ...] = ()
        self._paths: dict[int, str] | None = None
        """Files of the logs by their numbers; None: not looked for since the list."""
        self._has_told = False

    async def list(self) -> tuple[VehicleLog, ...]:
        async with self._reading:
            found = await self._run(LogListRead(target=self._vehicle.target))
            assert isinstance(found, tuple)
            self._logs, self._paths, self._has_told = found, None, False
            return found

    async def read(self, request: ReadVehicleLog) -> bytes:
        if not 0 < request.size <= MOST_BYTES:
            what = f"{request.size} bytes of a log were asked for at once."
            raise NotAllowedError(what, advice=f"Ask for 1 to {MOST_BYTES}.")
        async with self._reading:
            content = await self._read_file(request)
            if content is None:
                content = await self._run(
                    LogRead(
                        request.number,
                        request.offset,
                        request.size,
                        is_last=request.is_last,
                        target=self._vehicle.target,
                    )
                )
            assert isinstance(content, bytes)
            return content

    async def whole_file(self, path: str, *, most_bytes: int) -> bytes | None:
        """Another file than a log, to its end. None: not while a log is read or the vehicle is armed, or it has no
        MAVLink FTP. Raises RefusedError, SilentError, TransferError, NotAllowedError."""
        with contextlib.suppress(SilentError):
            says = lambda _: self._vehicle.capabilities is not None  # noqa: E731
            await self._vehicle.wait_until(says, timeout_s=SAYS_S, what="say what it can")
        has_ftp = (self._vehicle.capabilities or 0) & mavlink.MAV_PROTOCOL_CAPABILITY_FTP
        if not has_ftp or self._reading.locked() or self._vehicle.state.armed:
            return None
        async with self._reading:
            target = self._vehicle.target
            content = await self._run(FtpReadWhole(path, most_bytes=most_bytes, target=target, numbers=self._numbers))
        assert isinstance(content, bytes)
        return content

    @property
    def gave_way(self) -> bool:
        """Whether the newest reading ended for that alone."""
        return self._gave_way

    def give_way(self) -> None:
        """Something that a flight needs is about to be transferred."""
        if self._machine is not None:
            self._gave_way = True
            self._vehicle.exchanges.perform(self._machine, self._machine.cancel())

    async def _read_file(self, request: ReadVehicleLog) -> bytes | None:
        """None: it cannot be read as a file, which has been told."""
        if not (self._vehicle.capabilities or 0) & mavlink.MAV_PROTOCOL_CAPABILITY_FTP:
            return self._tell_instead("the vehicle offers none")
        folder = FOLDERS.get(self._vehicle.state.autopilot)
        if folder is None:
            return self._tell_instead("where this autopilot keeps them is not known")
        try:
            if self._paths is None:
                self._paths = await self._find_files(folder)
            path = self._paths.get(request.number)
            if path is None:
                return self._tell_instead("which file is which log is not certain")
            target = self._vehicle.target
            content = await self._run(FtpRead(path, request.offset, request.size, target=target, numbers=self._numbers))
        except (RefusedError, SilentError, TransferError) as error:
            if self._gave_way:
                raise
            self._paths = {}
            return self._tell_instead(_within_a_sentence(error))
        assert isinstance(content, bytes)
        return content

    async def _find_files(self, folder: LogFolder) -> dict[int, str]:
        found = await self._list_folder(folder.path)
        if not folder.has_days:
            return file_of_each(self._logs, {folder.path: found}, folder)
        listed = {day: await self._list_folder(day) for day in day_folders(found, folder)}
        return file_of_each(self._logs, listed, folder)

    async def _list_folder(self, path: str) -> tuple[FtpEntry, ...]:
        entries = await self._run(FtpList(path, target=self._vehicle.target, numbers=self._numbers))
        assert isinstance(entries, tuple)
        return entries

    def _tell_instead(self, why: str) -> None:
        """Once for each list."""
        if not self._has_told:
            self._has_told = True
            self._vehicle.tell(INFO, f"Logs are read block by block, not as files: {why}.")

    async def _run(self, machine: LogListRead | LogRead | FtpList | FtpRead) -> object:
        self._gave_way = False
        refuse_in_flight(self._vehicle.state)
        self._machine = machine
        try:
            return await self._vehicle.exchanges.run(machine)
        finally:
            self._machine = None


def _within_a_sentence(error: TelemetryError) -> str:
    words = error.what.rstrip(".")
    return words[0].lower() + words[1:]
