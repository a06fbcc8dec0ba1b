"""Missions out of mission frames."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Home
from telemetry.recording.mission_frames import MissionFrames, mission_of

VEHICLE, GCS = (1, 1), (255, 190)


def sent(source: tuple[int, int], message: Any) -> Any:
    link = mavlink.MAVLink(None, *source)
    message.pack(link)
    message._header.srcSystem, message._header.srcComponent = source
    return message


def count(source: tuple[int, int], number: int, kind: int = 0) -> Any:
    return sent(source, mavlink.MAVLink_mission_count_message(1, 1, number, kind))


def item(
    source: tuple[int, int], seq: int, alt_m: float, *, frame: int = 6, command: int = 16, current: int = 0
) -> Any:
    place = (450_000_000 + seq, 100_000_000)
    message = mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, current, 1, 0, 0, 0, 0, *place, alt_m)
    return sent(source, message)


def ack(source: tuple[int, int], result: int) -> Any:
    return sent(source, mavlink.MAVLink_mission_ack_message(1, 1, result))


def transfer(frames: MissionFrames, source: tuple[int, int], alts_m: list[float], t_s: float) -> None:
    frames.on_message(count(source, len(alts_m)), t_s)
    for seq, alt_m in enumerate(alts_m):
        frames.on_message(item(source, seq, alt_m), t_s)


def alts(frames: MissionFrames, before_s: float = math.inf) -> list[float] | None:
    found = frames.newest(before_s)
    return None if found is None else [found.items[seq].alt_m for seq in range(found.count)]


def test_the_newest_whole_mission_counts() -> None:
    frames = MissionFrames(VEHICLE)
    transfer(frames, GCS, [0, 10, 20], 1.0)
    transfer(frames, VEHICLE, [0, 10, 19.99], 2.0)
    frames.on_message(count(GCS, 3), 3.0)
    frames.on_message(item(GCS, 0, 99.0), 3.0)
    assert alts(frames) == [0, 10, 19.99]


def test_a_mission_for_the_next_flight_is_not_the_one_flown() -> None:
    frames = MissionFrames(VEHICLE)
    transfer(frames, GCS, [0, 10], 1.0)
    transfer(frames, GCS, [0, 50], 9.0)
    assert alts(frames, 5.0) == [0, 10]
    assert alts(frames) == [0, 50]


def test_without_an_earlier_one_the_first_counts() -> None:
    frames = MissionFrames(VEHICLE)
    transfer(frames, VEHICLE, [0, 10], 8.0)
    assert alts(frames, 5.0) == [0, 10]


def test_what_the_vehicle_refuses_does_not_count() -> None:
    frames = MissionFrames(VEHICLE)
    transfer(frames, GCS, [0, 10], 1.0)
    frames.on_message(ack(VEHICLE, 0), 1.1)
    transfer(frames, GCS, [0, 50], 20.0)
    frames.on_message(ack(VEHICLE, 12), 20.1)
    assert alts(frames) == [0, 10]


def test_fences_guided_targets_and_other_vehicles_are_no_mission() -> None:
    frames = MissionFrames(VEHICLE)
    frames.on_message(count(GCS, 1, kind=1), 1.0)
    frames.on_message(item(GCS, 0, 5.0, current=2), 1.0)
    frames.on_message(count((7, 1), 1), 1.0)
    other = item(GCS, 0, 5.0)
    other.target_system = 7
    frames.on_message(other, 1.0)
    assert alts(frames) is None


def test_items_in_any_order_and_twice() -> None:
    frames = MissionFrames(VEHICLE)
    frames.on_message(count(GCS, 3), 1.0)
    for seq in (2, 0, 0, 1, 2, 3):
        frames.on_message(item(GCS, seq, float(seq)), 1.0)
    assert alts(frames) == [0, 1, 2]
    assert len(frames.finished) == 1


def test_row_zero_is_home_for_ardupilot_only() -> None:
    frames = MissionFrames(VEHICLE)
    transfer(frames, GCS, [803.15, 10, 20], 1.0)
    found = frames.newest()
    assert found is not None
    ardupilot = mission_of(found, "ardupilot", None)
    assert (ardupilot.home.alt_dsm_m, len(ardupilot.items)) == (pytest.approx(803.15), 2)
    px4 = mission_of(found, "px4", Home(45.0, 10.0, 500.0))
    assert (px4.home.alt_dsm_m, len(px4.items)) == (500.0, 3)
    assert mission_of(found, "px4", None).warnings


def test_obsolete_frames_and_places_are_read() -> None:
    frames = MissionFrames(VEHICLE)
    frames.on_message(count(GCS, 4), 1.0)
    for seq, frame in enumerate((0, 5, 6, 11)):
        frames.on_message(item(GCS, seq, 1.0, frame=frame), 1.0)
    old = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 45.5, 10.5, 7.0)
    frames.on_message(count(VEHICLE, 1), 2.0)
    frames.on_message(sent(VEHICLE, old), 2.0)
    by_gcs, by_vehicle = frames.finished
    assert [by_gcs.items[seq].frame for seq in range(4)] == [0, 0, 3, 10]
    assert by_gcs.items[1].lat_deg == pytest.approx(45.0000001, abs=1e-9)
    assert (by_vehicle.items[0].lat_deg, by_vehicle.items[0].alt_m) == (45.5, 7.0)
