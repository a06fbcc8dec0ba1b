"""The link's reading of logs: refused in flight, one at a time, and out of the way of what a flight needs."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, TransferError
from telemetry.link.exchanges import Exchanges
from telemetry.link.log_reading import LogReading
from telemetry.mavlink.logs.ftp.listing import FtpEntry
from telemetry.mavlink.logs.ftp.log_files import FOLDERS, MOST_DAYS, day_folders, file_of_each
from telemetry.topics.requests import Operator, ReadVehicleLog
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog
from tests.telemetry.file_vehicles import FileVehicle
from tests.telemetry.log_vehicles import LogVehicle
from tests.telemetry.lossy import STATION, VEHICLE, Codec

DISARMED = VehicleState(1, 1, heartbeat_t_mono_s=1.0)


def bench(state: VehicleState = DISARMED) -> tuple[LogReading, list[str]]:
    sent: list[str] = []
    exchanges = Exchanges(lambda message: sent.append(message.get_type()), lambda: 0.0)
    vehicle = SimpleNamespace(target=(1, 1), exchanges=exchanges, state=state, capabilities=0, tell=lambda *_: None)
    return LogReading(cast(Any, vehicle)), sent


def asked(size: int = 900) -> ReadVehicleLog:
    return ReadVehicleLog(Operator("anna", 1), 1, 0, size, is_last=True)


@pytest.mark.parametrize("state", [replace(DISARMED, armed=True), replace(DISARMED, heartbeat_t_mono_s=None)])
def test_nothing_is_asked_of_a_vehicle_that_may_be_armed(state: VehicleState) -> None:
    async def run() -> None:
        logs, sent = bench(state)
        for reading in (logs.list(), logs.read(asked())):
            with pytest.raises(NotAllowedError, match="armed"):
                await reading
        assert sent == []

    asyncio.run(run())


@pytest.mark.parametrize("size", [0, -1, MOST_BYTES + 1])
def test_no_more_is_read_at_once_than_can_be_ended_soon(size: int) -> None:
    async def run() -> None:
        with pytest.raises(NotAllowedError, match="at once"):
            await bench()[0].read(asked(size))

    asyncio.run(run())


def test_a_mission_that_is_transferred_goes_before() -> None:
    async def run() -> None:
        logs, sent = bench()
        reading = asyncio.create_task(logs.read(asked()))
        await asyncio.sleep(0)
        logs.give_way()
        with pytest.raises(TransferError, match="a mission is being transferred"):
            await reading
        assert sent == ["LOG_REQUEST_DATA", "LOG_REQUEST_END"]
        logs.give_way()

    asyncio.run(run())


def test_a_second_one_waits_for_the_first() -> None:
    async def run() -> None:
        logs, sent = bench()
        first = asyncio.create_task(logs.read(asked()))
        second = asyncio.create_task(logs.list())
        await asyncio.sleep(0)
        assert sent == ["LOG_REQUEST_DATA"]
        first.cancel()
        for _ in range(5):
            await asyncio.sleep(0)
        assert sent[-1] == "LOG_REQUEST_LIST"
        second.cancel()

    asyncio.run(run())


FTP = mavlink.MAV_PROTOCOL_CAPABILITY_FTP
LOGS = [bytes((number,)) * size for number, size in ((1, 700), (2, 5000), (3, 5000), (4, 900))]


class Card:
    """A vehicle with logs and the files of them, on a clock that runs while it is waited for."""

    def __init__(self, *, files: list[bytes], capabilities: int | None = FTP, autopilot: str = "ardupilot") -> None:
        self.sent: list[str] = []
        self.told: list[str] = []
        self._logs, self._files, self._now_s = LogVehicle(LOGS), FileVehicle(files), 0.0
        self._ours, self._theirs = Codec(STATION), Codec(VEHICLE)
        self._answers: list[Any] = []
        self._exchanges = Exchanges(self._hear, lambda: self._now_s)
        vehicle = SimpleNamespace(
            target=VEHICLE,
            exchanges=self._exchanges,
            state=replace(DISARMED, autopilot=cast(Any, autopilot)),
            capabilities=capabilities,
            tell=lambda _, text: self.told.append(text),
        )
        self.reading = LogReading(cast(Any, vehicle))

    def _hear(self, message: Any) -> None:
        self.sent.append(message.get_type())
        heard = self._theirs.parse(self._ours.pack(message))
        for vehicle in (self._logs, self._files):
            self._answers += vehicle.on_message(heard, self._now_s)

    async def get(self, number: int, offset: int, size: int) -> bytes:
        request = ReadVehicleLog(Operator("anna", 1), number, offset, size, is_last=False)
        return await self._while_time_passes(self.reading.read(request))

    async def list(self) -> None:
        await self._while_time_passes(self.reading.list())

    async def _while_time_passes(self, waiting: Any) -> Any:
        task = asyncio.ensure_future(waiting)
        while not task.done() and self._now_s < 100.0:
            self._now_s += 0.05
            for vehicle in (self._logs, self._files):
                self._answers += vehicle.on_tick(self._now_s)
            answers, self._answers = self._answers, []
            for answer in answers:
                self._exchanges.on_message(self._ours.parse(self._theirs.pack(answer)))
            self._exchanges.on_tick()
            await asyncio.sleep(0)
            await asyncio.sleep(0)
        return await task


def test_a_log_whose_file_is_certain_comes_as_a_file() -> None:
    async def run() -> None:
        card = Card(files=LOGS)
        await card.list()
        assert await card.get(4, 300, 900) == LOGS[3][300:]
        assert "LOG_REQUEST_DATA" not in card.sent
        assert card.told == []

    asyncio.run(run())


def test_of_two_logs_of_the_same_size_no_file_is_guessed() -> None:
    async def run() -> None:
        card = Card(files=LOGS)
        await card.list()
        assert await card.get(2, 0, 900) == LOGS[1][:900]
        assert await card.get(3, 900, 900) == LOGS[2][900:1800]
        assert card.sent.count("LOG_REQUEST_DATA") == 2
        assert card.told == ["Logs are read block by block, not as files: which file is which log is not certain."]

    asyncio.run(run())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"capabilities": 0}, "the vehicle offers none"),
        ({"capabilities": None}, "the vehicle offers none"),
        ({"autopilot": "other"}, "not known"),
        ({"files": []}, "not certain"),
    ],
)
def test_without_files_the_blocks_are_asked_for_and_the_reason_is_told(options: dict[str, Any], words: str) -> None:
    async def run() -> None:
        card = Card(**{"files": LOGS, **options})
        await card.list()
        assert await card.get(1, 0, 700) == LOGS[0]
        assert "LOG_REQUEST_DATA" in card.sent
        assert len(card.told) == 1
        assert words in card.told[0]

    asyncio.run(run())


def test_a_vehicle_that_offers_files_and_answers_nothing_is_asked_for_them_once() -> None:
    async def run() -> None:
        card = Card(files=LOGS)
        card._files.on_message = lambda message, now_s: []  # type: ignore[method-assign]
        await card.list()
        assert await card.get(1, 0, 700) == LOGS[0]
        asked = card.sent.count("FILE_TRANSFER_PROTOCOL")
        assert await card.get(4, 0, 900) == LOGS[3]
        assert card.sent.count("FILE_TRANSFER_PROTOCOL") == asked
        (told,) = card.told
        assert "the vehicle does not say which files are in /APM/LOGS" in told

    asyncio.run(run())


def test_a_mission_that_is_transferred_goes_before_a_file_too() -> None:
    async def run() -> None:
        card = Card(files=LOGS)
        await card.list()
        reading = asyncio.create_task(card.reading.read(asked()))
        await asyncio.sleep(0)
        card.reading.give_way()
        with pytest.raises(TransferError, match="cancelled"):
            await reading
        assert "LOG_REQUEST_DATA" not in card.sent

    asyncio.run(run())


def test_files_are_told_by_their_sizes_also_where_their_numbers_went_on() -> None:
    logs = [VehicleLog(1, 700, None), VehicleLog(2, 0, None), VehicleLog(3, 900, None)]
    entries = [
        FtpEntry("00000041.BIN", False, 700),
        FtpEntry("00000042.BIN", False, 0),
        FtpEntry("LASTLOG.TXT", False, 900),
        FtpEntry("00000044.BIN", True, 900),
    ]
    listed = {"/APM/LOGS": entries}
    assert file_of_each(logs, listed, FOLDERS["ardupilot"]) == {1: "/APM/LOGS/00000041.BIN"}


def test_px4_has_a_folder_for_each_day_and_the_same_size_on_two_days_is_no_certain_file() -> None:
    folder = FOLDERS["px4"]
    days = [FtpEntry("2026-05-01", True, 0), FtpEntry("2026-05-03", True, 0), FtpEntry("readme.txt", False, 9)]
    first, second = day_folders(days, folder)[::-1]
    assert (first, second) == ("/fs/microsd/log/2026-05-01", "/fs/microsd/log/2026-05-03")
    logs = [VehicleLog(0, 700, None), VehicleLog(1, 900, None), VehicleLog(2, 800, None)]
    listed = {
        first: [FtpEntry("09_10_11.ulg", False, 700), FtpEntry("10_10_11.ulg", False, 800)],
        second: [FtpEntry("09_10_11.ulg", False, 900), FtpEntry("12_00_00.ulg", False, 800)],
    }
    assert file_of_each(logs, listed, folder) == {0: f"{first}/09_10_11.ulg", 1: f"{second}/09_10_11.ulg"}
    many = [FtpEntry(f"2026-05-{day:03d}", True, 0) for day in range(MOST_DAYS + 5)]
    assert day_folders(many, folder)[-1].endswith("2026-05-005")
