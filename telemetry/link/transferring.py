"""Mission transfers and parameters of the adopted vehicle: one transfer at a time, its progress told."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from typing import Literal

from planning.errors import FormatError
from telemetry.errors import NotAllowedError, RefusedError, SilentError, TelemetryError, TransferError
from telemetry.flight.avoidance.fence_aboard import PARAMETERS as FENCE_PARAMETERS
from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.log_reading import INFO, LogReading
from telemetry.mavlink.actions import Progress
from telemetry.mavlink.conversation import PLACE_LISTS
from telemetry.mavlink.download import MissionDownload
from telemetry.mavlink.parameters import packed
from telemetry.mavlink.parameters.listing import ParameterListRead
from telemetry.mavlink.parameters.metadata import MetadataAsk
from telemetry.mavlink.parameters.reading import ParameterRead
from telemetry.mavlink.parameters.writing import ParameterWrite
from telemetry.mavlink.upload import MissionUpload
from telemetry.parameters.vehicle_metadata import MOST_FILE_BYTES, check_crc, parameter_file, path_of
from telemetry.topics.messages import ErrorInfo, TransferStatus
from telemetry.topics.onboard_lists import Item, OnboardMission, PlaceList, UploadReport
from telemetry.topics.parameters import ParameterChange, ParameterList, ParameterWritten, VehicleMetadata
from telemetry.topics.requests import Upload, UploadPlaces

TELL_EVERY_S = 0.05
Phase = Literal["sending", "reading_back", "done", "failed"]


class Transfers:
    def __init__(self, vehicle: AdoptedVehicle, tell: Callable[[TransferStatus], None], files: LogReading) -> None:
        """``files`` gives way before each transfer of a mission, fence or rally points."""
        self._vehicle, self._tell, self._files = vehicle, tell, files
        self._has_packed = True
        """As far as known."""
        self._machine: MissionUpload | MissionDownload | None = None
        self._own_idea: MissionDownload | None = None
        """The newest download that nobody asked for."""
        self._told_s = 0.0
        self._writing = asyncio.Lock()

    @property
    def is_busy(self) -> bool:
        return self._machine is not None

    @property
    def knows_mission(self) -> bool:
        return self._vehicle.onboard.mission is not None

    async def upload(self, request: Upload) -> UploadReport:
        """Raises TelemetryError; then nobody knows what is on board."""
        self._make_way()
        home = (request.home_lat_deg, request.home_lon_deg, request.home_alt_amsl_m)
        vehicle = self._vehicle
        machine = MissionUpload(
            request.items, home, firmware=vehicle.firmware, target=vehicle.target, now_s=time.monotonic()
        )
        vehicle.onboard.transfer_begins(replaces=True)
        known: OnboardMission | None = None
        try:
            report = await self._run(machine, "upload", len(request.items))
            assert isinstance(report, UploadReport)
            known = report.onboard
            return report
        finally:
            self._ends(known)

    async def download(self, *, own_idea: bool = False) -> OnboardMission:
        """``own_idea``: nobody asked, so nobody is told of its progress and an upload may push it aside."""
        self._make_way()
        vehicle = self._vehicle
        machine = MissionDownload(firmware=vehicle.firmware, target=vehicle.target, now_s=time.monotonic())
        if own_idea:
            self._own_idea = machine
        vehicle.onboard.transfer_begins(replaces=False)
        known: OnboardMission | None = None
        try:
            onboard = await self._run(machine, "download", 0)
            assert isinstance(onboard, OnboardMission)
            known = onboard
            return onboard
        finally:
            self._ends(known)

    async def upload_places(self, request: UploadPlaces) -> UploadReport:
        """Raises TelemetryError; then nobody knows which fence or rally points are on board."""
        self._make_way()
        vehicle, about = self._vehicle, PLACE_LISTS[request.kind]
        no_home = (math.nan, math.nan, math.nan)
        machine = MissionUpload(
            request.items,
            no_home,
            firmware=vehicle.firmware,
            target=vehicle.target,
            now_s=time.monotonic(),
            about=about,
        )
        if request.kind == "fence":
            vehicle.onboard.fence.forget("has not been read back since it was sent")
        report = await self._run(machine, "upload", len(request.items))
        assert isinstance(report, UploadReport)
        if request.kind == "fence":
            vehicle.onboard.fence.read_back(report.onboard.items)
        return report

    async def download_places(self, kind: PlaceList) -> tuple[Item, ...]:
        self._make_way()
        vehicle, about = self._vehicle, PLACE_LISTS[kind]
        machine = MissionDownload(firmware=vehicle.firmware, target=vehicle.target, now_s=time.monotonic(), about=about)
        onboard = await self._run(machine, "download", 0)
        assert isinstance(onboard, OnboardMission)
        if kind == "fence":
            vehicle.onboard.fence.read_back(onboard.items)
        return onboard.items

    async def read_back(self) -> OnboardMission:
        """A download that nobody asked for."""
        return await self.download(own_idea=True)

    async def read_parameters(self, names: tuple[str, ...]) -> dict[str, float | None]:
        vehicle = self._vehicle
        machine = ParameterRead(names, target=vehicle.target, bytewise=vehicle.sends_integers_bytewise)
        values = await vehicle.exchanges.run(machine)
        assert isinstance(values, dict)
        vehicle.onboard.fence.take(values)
        return values

    async def list_parameters(self) -> ParameterList:
        """From its file of all of them where an ArduPilot has one, else one by one."""
        vehicle = self._vehicle
        found = await self._packed_list() if vehicle.state.autopilot == "ardupilot" else None
        if found is None:
            machine = ParameterListRead(target=vehicle.target, bytewise=vehicle.sends_integers_bytewise)
            found = await vehicle.exchanges.run(machine)
        assert isinstance(found, ParameterList)
        vehicle.onboard.fence.take(
            dict.fromkeys(FENCE_PARAMETERS) | {each.name: each.value for each in found.parameters}
        )
        return found

    async def _packed_list(self) -> ParameterList | None:
        """None: it has no such file, which is told once. Raises TransferError where it gave way to a mission."""
        if not self._has_packed:
            return None
        try:
            content = await self._files.whole_file(packed.PATH, most_bytes=packed.MOST_BYTES)
            if content is None:
                return None
            return ParameterList(await asyncio.to_thread(packed.read_packed, content))
        except (RefusedError, SilentError, TransferError, NotAllowedError) as error:
            if self._files.gave_way:
                raise
            self._has_packed = isinstance(error, NotAllowedError)
            self._vehicle.tell(INFO, f"Parameters are read one by one, not as a file. {error.what}")
            return None

    async def read_metadata(self, known_crcs: tuple[int, ...]) -> VehicleMetadata:
        """Without content where its CRC is known. Raises TelemetryError."""
        announced = await self._vehicle.exchanges.run(MetadataAsk(target=self._vehicle.target))
        assert isinstance(announced, tuple)
        uri, crc = announced
        if crc in known_crcs:
            return VehicleMetadata(crc, b"")
        try:
            general = await self._file(uri, crc)
            uri, its_crc = await asyncio.to_thread(parameter_file, general)
            return VehicleMetadata(crc, await self._file(uri, its_crc))
        except FormatError as error:
            raise TransferError(error.what, where=error.where, advice=error.advice) from None

    async def _file(self, uri: str, crc: int | None) -> bytes:
        path = path_of(uri)
        content = await self._files.whole_file(path, most_bytes=MOST_FILE_BYTES)
        if content is None:
            raise RefusedError(f"The vehicle does not give {path} now.", advice="Read it while it is on the ground.")
        await asyncio.to_thread(check_crc, path, content, crc)
        return content

    async def write_parameters(
        self, changes: tuple[ParameterChange, ...], *, even_armed: bool
    ) -> tuple[ParameterWritten, ...]:
        """One writing at a time: another's read-back must not pass for ours."""
        vehicle = self._vehicle
        machine = ParameterWrite(
            changes, target=vehicle.target, bytewise=vehicle.sends_integers_bytewise, even_armed=even_armed
        )
        async with self._writing:
            written = await vehicle.exchanges.run(machine)
        assert isinstance(written, tuple)
        vehicle.onboard.fence.take({each.name: each.after for each in written if each.outcome != "not sent"})
        return written

    def _ends(self, known: OnboardMission | None) -> None:
        """Not of one that was pushed aside: what it made way for is on its way."""
        if self._machine is None:
            self._vehicle.onboard.transfer_ends(known, time.monotonic())

    def _make_way(self) -> None:
        if self._machine is None:
            return
        if self._machine is not self._own_idea:
            advice = "Wait until it is over."
            raise NotAllowedError("A mission is being transferred already.", advice=advice)
        self._vehicle.exchanges.perform(self._machine, self._machine.cancel(time.monotonic()))
        self._machine = None

    async def _run(
        self, machine: MissionUpload | MissionDownload, direction: Literal["upload", "download"], total: int
    ) -> object:
        self._files.give_way()
        self._machine, last = machine, Progress("sending" if direction == "upload" else "reading_back", 0, total)

        def progress(news: Progress) -> None:
            nonlocal last
            last = news
            self._progress(machine, direction, news)

        try:
            result = await self._vehicle.exchanges.run(machine, progress=progress)
        except TelemetryError as error:
            self._publish(machine, TransferStatus(direction, "failed", last.done, last.total, ErrorInfo.of(error)))
            raise
        else:
            self._publish(machine, TransferStatus(direction, "done", last.total, last.total))
        finally:
            if self._machine is machine:
                self._machine = None
        return result

    def _progress(self, machine: object, direction: Literal["upload", "download"], news: Progress) -> None:
        now_s = time.monotonic()
        if now_s - self._told_s >= TELL_EVERY_S or news.done in (0, news.total):
            self._told_s = now_s
            phase: Phase = "sending" if news.phase == "sending" else "reading_back"
            self._publish(machine, TransferStatus(direction, phase, news.done, news.total))

    def _publish(self, machine: object, status: TransferStatus) -> None:
        if machine is not self._own_idea:
            self._tell(status)
