"""Logs read from a vehicle: whole over lossy links, never while it is armed, bounded whatever the vehicle says."""

from __future__ import annotations

import random
import time
from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, SilentError, TransferError
from telemetry.mavlink.actions import Failed
from telemetry.mavlink.logs.listing import LONGEST_S, LogListRead
from telemetry.mavlink.logs.on_the_ground import refuse_in_flight
from telemetry.mavlink.logs.reading import LogRead
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import BLOCK_BYTES, MOST_BYTES
from tests.telemetry.log_vehicles import LogVehicle, Px4Logs
from tests.telemetry.lossy import VEHICLE, Faults, Run

LOSSY = Faults(loss=0.3, reordering=0.1, duplicates=0.05, corruption=0.01)
STATE = VehicleState(*VEHICLE, heartbeat_t_mono_s=1.0)


def content(size: int, seed: int = 1) -> bytes:
    return random.Random(seed).randbytes(size)


def listed(vehicle: Any, faults: Faults = Faults(), **options: Any) -> Run:  # noqa: B008
    return Run(LogListRead(target=VEHICLE), vehicle, faults, **options).until_end()


def read(
    vehicle: Any,
    offset: int,
    size: int,
    faults: Faults = Faults(),  # noqa: B008
    *,
    number: int = 1,
    is_last: bool = True,
    **options: Any,
) -> Run:
    return Run(LogRead(number, offset, size, is_last=is_last, target=VEHICLE), vehicle, faults, **options).until_end()


def asked(run: Run) -> list[Any]:
    return [m for _, way, m in run.log if way == "up" and m.get_type() == "LOG_REQUEST_DATA"]


def tells_the_end(run: Run) -> bool:
    return any(way == "up" and m.get_type() == "LOG_REQUEST_END" for _, way, m in run.log)


def test_without_losses_one_question_brings_a_stretch() -> None:
    vehicle = LogVehicle([content(5000), content(200_000, 2)])
    run = read(vehicle, 0, MOST_BYTES, number=2)
    assert run.result == vehicle.logs[1][:MOST_BYTES]
    assert len(asked(run)) == 1
    assert tells_the_end(run)


def test_fifty_of_fifty_stretches_are_exact_at_thirty_percent_loss_with_reordering() -> None:
    slowest_s = 0.0
    for seed in range(50):
        vehicle = LogVehicle([content(MOST_BYTES + 4321, seed)])
        run = read(vehicle, 0, MOST_BYTES, LOSSY, seed=seed)
        assert run.result == vehicle.logs[0][:MOST_BYTES], seed
        rest = read(vehicle, MOST_BYTES, 4321, LOSSY, seed=seed)
        assert rest.result == vehicle.logs[0][MOST_BYTES:], seed
        slowest_s = max(slowest_s, run.now_s)
    assert slowest_s < 60.0


def test_fifty_of_fifty_lists_are_whole_at_thirty_percent_loss() -> None:
    for seed in range(50):
        for vehicle in (LogVehicle([content(100 + n) for n in range(60)]), Px4Logs([content(9 + n) for n in range(7)])):
            logs = listed(vehicle, LOSSY, seed=seed).result
            assert [log.size_bytes for log in logs] == [len(log) for log in reversed(vehicle.logs)]
            assert logs[-1].number == vehicle.first_number


def test_what_was_lost_is_asked_for_again_and_no_more() -> None:
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.ofs in (900, 1080, 45_000) and message.ofs not in lost:
            lost.append(message.ofs)
            return True
        return False

    run = read(LogVehicle([content(60_000)]), 0, 60_000, lose=lose)
    assert run.result == content(60_000)
    assert [(m.ofs, m.count) for m in asked(run)] == [(0, 60_000), (900, 270), (45_000, 90)]


def test_px4_is_told_only_at_the_end_that_no_more_is_read() -> None:
    """After that it answers nothing."""
    vehicle = Px4Logs([content(2 * MOST_BYTES)])
    listing = LogListRead(target=VEHICLE)
    vehicle.on_message(listing.start(0.0)[0].message, 0.0)  # type: ignore[union-attr]
    first = read(vehicle, 0, MOST_BYTES, number=0, is_last=False)
    assert not tells_the_end(first)
    second = read(vehicle, MOST_BYTES, MOST_BYTES, number=0)
    assert first.result + second.result == vehicle.logs[0]
    assert tells_the_end(second)


@pytest.mark.parametrize("size", [0, 1, 89, 90, 91, 179, 180, 1000])
def test_a_log_that_ends_early_is_read_as_far_as_it_goes(size: int) -> None:
    vehicle = LogVehicle([content(size)])
    assert read(vehicle, 0, 1800).result == vehicle.logs[0]


def test_the_end_of_a_log_may_come_before_the_blocks_that_were_lost() -> None:
    first: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.ofs == 0 and not first:
            first.append(0)
            return True
        return False

    assert read(LogVehicle([content(1000)]), 0, 5000, lose=lose).result == content(1000)


def test_no_logs_is_an_answer() -> None:
    assert listed(LogVehicle([])).result == ()


def test_an_unknown_time_is_said_to_be_unknown() -> None:
    (log,) = listed(LogVehicle([b"abc"], begun_utc_s=0)).result
    assert log.begun_utc_s is None
    (log,) = listed(LogVehicle([b"abc"])).result
    assert log.begun_utc_s == 1_700_000_000


def test_a_vehicle_that_says_nothing_is_given_up() -> None:
    class Silent(LogVehicle):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            return []

    assert isinstance(listed(Silent([b"abc"])).error, SilentError)
    run = read(Silent([b"abc"]), 0, 3)
    assert isinstance(run.error, SilentError)
    assert run.now_s < 20.0


def test_a_vehicle_that_sends_the_same_block_for_ever_is_given_up() -> None:
    class Stuck(LogVehicle):
        def on_tick(self, now_s: float) -> list[Any]:
            return [mavlink.MAVLink_log_data_message(1, 0, 90, [7] * 90)]

    run = read(Stuck([content(5000)]), 0, 5000)
    assert isinstance(run.error, TransferError)
    assert run.now_s < 20.0


def test_a_list_that_changes_for_ever_is_given_up() -> None:
    class Changing(LogVehicle):
        def on_tick(self, now_s: float) -> list[Any]:
            return [mavlink.MAVLink_log_entry_message(7, 60_000, int(now_s), 0, 1)]

    run = listed(Changing([b"abc"]))
    assert isinstance(run.error, TransferError)
    assert run.now_s < LONGEST_S + 1


def test_a_vehicle_that_says_it_has_as_many_logs_as_can_be_holds_nothing_up() -> None:
    """The machine runs where the heartbeat is sent: what took minutes here would end the link."""

    class Boasting(LogVehicle):
        def on_tick(self, now_s: float) -> list[Any]:
            return [mavlink.MAVLink_log_entry_message(65_000, 65_535, 65_535, 0, 1)] if now_s < 1.0 else []

    begun_s = time.process_time()
    run = listed(Boasting([b"abc"]))
    assert isinstance(run.error, TransferError)
    assert "65534 of 65535 entries" in run.error.what
    questions = [(m.start, m.end) for _, way, m in run.log if way == "up" and m.get_type() == "LOG_REQUEST_LIST"]
    assert questions[1:] == [(1, 64_999)] * (len(questions) - 1)
    assert time.process_time() - begun_s < 20.0


def test_data_of_another_log_or_from_between_blocks_is_not_taken() -> None:
    machine = LogRead(3, 0, 180, is_last=True, target=VEHICLE)
    machine.start(0.0)
    codec = mavlink.MAVLink(None, srcSystem=VEHICLE[0], srcComponent=VEHICLE[1])
    for number, offset in ((2, 0), (3, 45), (3, 2**31), (3, 180)):
        frame = mavlink.MAVLink_log_data_message(number, offset, 90, [1] * 90).pack(codec)
        assert machine.on_message(mavlink.MAVLink(None).decode(bytearray(frame)), 0.1) == []


def test_it_ends_when_the_vehicle_is_armed() -> None:
    for machine in (LogListRead(target=VEHICLE), LogRead(1, 0, 900, is_last=True, target=VEHICLE)):
        machine.start(0.0)
        assert machine.on_state(STATE, 0.1) == []
        told, end = machine.on_state(replace(STATE, armed=True), 0.2)
        assert told.message.get_type() == "LOG_REQUEST_END"  # type: ignore[union-attr]
        assert isinstance(end, Failed)
        assert isinstance(end.error, NotAllowedError)
        assert machine.on_tick(99.0) == []


@pytest.mark.parametrize(
    ("state", "words"),
    [(replace(STATE, armed=True), "is armed"), (replace(STATE, heartbeat_t_mono_s=None), "not known")],
)
def test_it_is_refused_unless_the_vehicle_says_that_it_is_disarmed(state: VehicleState, words: str) -> None:
    refuse_in_flight(STATE)
    with pytest.raises(NotAllowedError, match=words):
        refuse_in_flight(state)


def test_a_stretch_is_whole_blocks() -> None:
    assert MOST_BYTES % BLOCK_BYTES == 0
