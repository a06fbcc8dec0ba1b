"""Files read from a vehicle by MAVLink FTP: whole over lossy links, bounded whatever the vehicle answers."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import pytest

from telemetry.errors import NotAllowedError, RefusedError, SilentError, TransferError
from telemetry.mavlink.actions import Failed
from telemetry.mavlink.logs.ftp.listing import MOST_ENTRIES, FtpList
from telemetry.mavlink.logs.ftp.payload import FtpPayload, Nak, Opcode, read_payload
from telemetry.mavlink.logs.ftp.questions import Numbers
from telemetry.mavlink.logs.ftp.reading import LONGEST_S, FtpRead
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import MOST_BYTES
from tests.telemetry.file_vehicles import FOLDER, FileVehicle, path
from tests.telemetry.lossy import STATION, VEHICLE, Codec, Faults, Run

LOSSY = Faults(loss=0.3, reordering=0.1, duplicates=0.05, corruption=0.01)
STATE = VehicleState(*VEHICLE, heartbeat_t_mono_s=1.0)


def content(size: int, seed: int = 1) -> bytes:
    return random.Random(seed).randbytes(size)


def reader(number: int = 1, offset: int = 0, size: int = MOST_BYTES, numbers: Numbers | None = None) -> FtpRead:
    return FtpRead(path(number), offset, size, target=VEHICLE, numbers=numbers or Numbers())


def lister(folder: str = FOLDER) -> FtpList:
    return FtpList(folder, target=VEHICLE, numbers=Numbers())


def asked(run: Run, opcode: Opcode) -> list[FtpPayload]:
    said = [read_payload(message) for _, way, message in run.log if way == "up"]
    return [payload for payload in said if payload is not None and payload.opcode == opcode]


class Odd(FileVehicle):
    """Answers some questions in a way of its own."""

    def __init__(self, opcode: Opcode, data: bytes, *, says: Opcode = Opcode.ACK, offset: int | None = None) -> None:
        super().__init__([content(5000)])
        self._opcode, self._data, self._says, self._offset = opcode, data, says, offset

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        payload = read_payload(message)
        assert payload is not None
        if payload.opcode != self._opcode:
            return super().on_message(message, now_s)
        return [self.odd(payload).message(STATION)]

    def odd(self, payload: FtpPayload) -> FtpPayload:
        offset = payload.offset if self._offset is None else self._offset
        return FtpPayload(
            payload.seq + 1, self._says, payload.session, offset, len(self._data), self._data, payload.opcode
        )


def test_without_losses_a_stretch_is_bursts_and_nothing_twice() -> None:
    vehicle = FileVehicle([content(5000), content(200_000, 2)])
    run = Run(reader(2, 1000), vehicle).until_end()
    assert run.result == content(200_000, 2)[1000 : 1000 + MOST_BYTES]
    assert len(asked(run, Opcode.BURST_READ_FILE)) == 3
    assert asked(run, Opcode.READ_FILE) == []
    assert len(asked(run, Opcode.TERMINATE_SESSION)) == 1


def test_fifty_of_fifty_files_are_exact_at_thirty_percent_loss_with_reordering() -> None:
    slowest_s = 0.0
    for seed in range(50):
        vehicle, numbers = FileVehicle([content(19_000, seed)]), Numbers()
        run = Run(reader(1, 0, 15_000, numbers), vehicle, LOSSY, seed).until_end()
        rest = Run(reader(1, 15_000, 15_000, numbers), vehicle, LOSSY, seed, now_s=run.now_s).until_end()
        assert run.result + rest.result == content(19_000, seed), seed
        slowest_s = max(slowest_s, run.now_s)
    assert slowest_s < 60.0


def test_fifty_of_fifty_folders_are_whole_at_thirty_percent_loss() -> None:
    for seed in range(50):
        found = Run(lister(), FileVehicle([content(100 + n) for n in range(60)]), LOSSY, seed).until_end().result
        assert [(entry.name, entry.size_bytes) for entry in found] == [
            (f"{n + 1:08d}.BIN", 100 + n) for n in range(60)
        ], seed


@pytest.mark.parametrize("size", [0, 1, 238, 239, 240, 478, 1000])
def test_a_file_that_is_shorter_is_read_as_far_as_it_goes(size: int) -> None:
    assert Run(reader(), FileVehicle([content(size)])).until_end().result == content(size)
    assert Run(reader(1, 2000), FileVehicle([content(size)])).until_end().result == b""


def test_folders_above_are_listed_and_those_that_are_not_there_refused() -> None:
    (entry,) = Run(lister("/"), FileVehicle([])).until_end().result
    assert (entry.name, entry.is_folder) == ("APM", True)
    assert Run(lister(), FileVehicle([])).until_end().result == ()
    error = Run(lister("/fs"), FileVehicle([])).until_end().error
    assert isinstance(error, RefusedError)
    assert "no such file" in error.what


def test_a_session_that_nobody_closed_is_closed() -> None:
    vehicle = FileVehicle([content(900)])
    for _ in range(4):
        abandoned = reader()
        for action in abandoned.start(0.0):
            vehicle.on_message(_decoded(action.message), 0.0)  # type: ignore[union-attr]
        vehicle.files._last.clear()
    run = Run(reader(), vehicle).until_end()
    assert run.result == content(900)
    assert len(asked(run, Opcode.RESET_SESSIONS)) == 1


def test_what_is_late_of_an_earlier_file_is_not_taken_for_this_one() -> None:
    numbers, vehicle = Numbers(), FileVehicle([b"a" * 900, b"b" * 900])
    first = Run(reader(1, numbers=numbers), vehicle).until_end()
    late = [message for _, way, message in first.log if way == "down"]

    class Late(FileVehicle):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            return [*late, *vehicle.on_message(message, now_s), *late]

        def on_tick(self, now_s: float) -> list[Any]:
            return vehicle.on_tick(now_s)

    assert Run(reader(2, numbers=numbers), Late([])).until_end().result == b"b" * 900


def test_a_vehicle_without_bursts_is_read_piece_by_piece() -> None:
    vehicle = Odd(Opcode.BURST_READ_FILE, bytes((Nak.UNKNOWN_COMMAND,)), says=Opcode.NAK)
    run = Run(reader(), vehicle).until_end()
    assert run.result == content(5000)
    assert len(asked(run, Opcode.READ_FILE)) == 21


def test_a_size_of_four_gigabytes_costs_no_memory_and_is_refused_at_the_end() -> None:
    run = Run(reader(), Odd(Opcode.OPEN_TO_READ, b"\xff" * 4)).until_end()
    assert isinstance(run.error, RefusedError)
    assert "not open" in run.error.what
    machine = reader(1, 2**31, 900)
    run = Run(machine, Odd(Opcode.OPEN_TO_READ, b"\xff" * 4)).until_end()
    assert len(machine._content) == 900


@pytest.mark.parametrize("offset", [2**32 - 1, 5000, 0])
def test_data_from_elsewhere_for_ever_is_given_up(offset: int) -> None:
    class Endless(Odd):
        def on_tick(self, now_s: float) -> list[Any]:
            data = b"x" * 239
            payload = FtpPayload(9, Opcode.ACK, 0, offset, 239, data, Opcode.BURST_READ_FILE)
            return [payload.message(STATION)] * 20

    run = Run(reader(), Endless(Opcode.BURST_READ_FILE, b"", offset=0)).until_end()
    assert isinstance(run.error, SilentError)
    assert "bytes of /APM/LOGS/00000001.BIN did not come" in run.error.what
    assert run.now_s < 20.0


def test_a_vehicle_that_sends_a_byte_at_a_time_is_given_up() -> None:
    class Slow(Odd):
        def odd(self, payload: FtpPayload) -> FtpPayload:
            return FtpPayload(payload.seq + 1, Opcode.ACK, payload.session, payload.offset, 1, b"x", payload.opcode)

    run = Run(reader(), Slow(Opcode.BURST_READ_FILE, b"")).until_end()
    assert isinstance(run.error, SilentError)
    assert run.now_s < LONGEST_S + 1


def test_a_vehicle_that_says_nothing_is_given_up() -> None:
    class Silent(FileVehicle):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            return []

    for machine in (lister(), reader()):
        run = Run(machine, Silent([])).until_end()
        assert isinstance(run.error, SilentError)
        assert run.now_s < 10.0


@pytest.mark.parametrize(
    "data",
    [b"F../../etc/passwd\t5\0", b"Fa\\b\t5\0", b"Fa\x1b[2J\t5\0", b"F\xff\xfe\t5\0", b"Fa\tmany\0", b"Fa\0", b"Xa\0"],
)
def test_names_that_make_no_sense_are_refused(data: bytes) -> None:
    error = Run(lister(), Odd(Opcode.LIST_DIRECTORY, data)).until_end().error
    assert isinstance(error, TransferError)
    assert "makes no sense" in error.what


def test_a_folder_that_never_ends_is_given_up() -> None:
    error = Run(lister(), Odd(Opcode.LIST_DIRECTORY, b"Fa\t5\0" * 40)).until_end().error
    assert isinstance(error, TransferError)
    assert f"more than {MOST_ENTRIES} files" in error.what


@pytest.mark.parametrize("wrong", ["", "/APM/../etc/passwd", "..", "a\0b", "a" * 239])
def test_no_vehicle_is_asked_for_a_path_that_leads_elsewhere(wrong: str) -> None:
    with pytest.raises(NotAllowedError, match="no path"):
        lister(wrong)


def test_a_payload_that_says_more_than_it_carries_is_not_read() -> None:
    said = FtpPayload(1, Opcode.ACK, 2, 3, 4, b"data", Opcode.READ_FILE, is_burst_over=True)
    assert read_payload(said.message(STATION)) == said
    assert read_payload(replace(said, size=240).message(STATION)) is None


def test_it_ends_when_the_vehicle_is_armed() -> None:
    for machine in (lister(), reader()):
        machine.start(0.0)
        assert machine.on_state(STATE, 0.1) == []
        *_, end = machine.on_state(replace(STATE, armed=True), 0.2)
        assert isinstance(end, Failed)
        assert isinstance(end.error, NotAllowedError)
        assert machine.on_tick(99.0) == []


def _decoded(message: Any) -> Any:
    return Codec(VEHICLE).parse(Codec(STATION).pack(message))
