"""What waits to be written: large messages hold up no others, and have a bound of their own."""

from __future__ import annotations

import pytest

from mapping.sensor_frames import CloudFrame
from telemetry.recording.trigger import Stamped
from telemetry.recording.waiting import BYTES_PER_S, CloudBudget, LocalMapBudget, Waiting
from telemetry.topics.messages import Published, Topic, VehicleText
from telemetry.topics.obstacles import MapDelta, MapOrigin


def cloud(number: int, size: int = 1_200_000) -> Stamped:
    return Stamped(0.0, Topic.CLOUD_FRAME, CloudFrame(0.0, 0.0, number, "test", bytes(size)))


def text(number: int) -> Stamped:
    return Stamped(0.0, Topic.TEXT, VehicleText(0.0, 6, str(number)))


def delta(size: int) -> Stamped:
    origin = MapOrigin(0.0, 0.0, 0.0)
    message = MapDelta("radar", 0.0, 0.0, 1, False, 0, 1, origin, 1.0, bytes(size), b"", b"")
    return Stamped(0.0, Topic.MAP_RADAR, message)


def words(items: list[Stamped | str]) -> list[str]:
    return [item if isinstance(item, str) else _word(item.message) for item in items]


def _word(message: Published) -> str:
    return message.text if isinstance(message, VehicleText) else type(message).__name__


def test_small_messages_go_first_and_large_ones_a_few_at_a_time() -> None:
    waiting: Waiting[str] = Waiting()
    for number in range(4):
        waiting.put(cloud(number))
        waiting.put(text(number))
    assert words(list(waiting.take())) == ["0", "1", "2", "3", "CloudFrame", "CloudFrame"]
    assert words(list(waiting.take())) == ["CloudFrame", "CloudFrame"]
    assert list(waiting.take()) == []


def test_marks_keep_what_was_before_them_before_them() -> None:
    waiting: Waiting[str] = Waiting()
    waiting.mark("open")
    for number in range(4):
        waiting.put(cloud(number))
    waiting.put(text(1))
    waiting.mark("close")
    waiting.mark("open again")
    waiting.put(cloud(9))
    found = words(list(waiting.take()))
    assert found == ["open", "1", *["CloudFrame"] * 4, "close", "open again", "CloudFrame"]


def test_clouds_give_way_before_maps_and_nothing_else_does() -> None:
    waiting: Waiting[str] = Waiting()
    for number in range(30):
        waiting.put(cloud(number))
    assert waiting.dropped == 30 - 13
    for _ in range(70):
        waiting.put(delta(1_000_000))
    assert waiting.dropped == 17
    for number in range(1000):
        waiting.put(text(number))
    assert waiting.dropped == 17
    for _ in range(20):
        waiting.put(delta(1_000_000))
    assert waiting.dropped > 17


def test_clouds_are_recorded_as_fast_as_a_disk_takes_them_for_hours() -> None:
    budget = CloudBudget()
    size, taken = 1_200_000, 0
    for number in range(5 * 600):
        taken += budget.takes(size, number / 5)
    assert taken * size <= 600 * BYTES_PER_S + 6_000_000
    assert taken * size > 0.95 * 600 * BYTES_PER_S
    thin = CloudBudget()
    assert all(thin.takes(95_000, number / 5) for number in range(3000))


def test_of_local_maps_two_a_second_are_recorded_and_always_the_empty_one() -> None:
    budget, origin, taken = LocalMapBudget(), MapOrigin(0.0, 0.0, 0.0), []
    for number in range(50):
        for part in range(3):
            whole = MapDelta("vision", 0.0, 0.0, number, True, part, 3, origin, 1.0, b"k", b"", b"")
            if budget.takes(whole, number / 5):
                taken.append((number, part))
    assert len(taken) == pytest.approx(3 * 17, abs=6)
    assert all((number, part) in taken for number, _ in taken for part in range(3))
    assert budget.takes(MapDelta("vision", 0.0, 0.0, 99, True, 0, 1, origin, 1.0, b"", b"", b""), 9.81)
    radar = [MapDelta("radar", 0.0, 0.0, k, k == 0, 0, 1, origin, 1.0, b"k", b"", b"") for k in range(9)]
    assert all(budget.takes(delta, 9.82) for delta in radar)
