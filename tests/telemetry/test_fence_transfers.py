"""Fences and rally points on their way to vehicles and back: the machines of missions, over links that lose."""

from __future__ import annotations

import math
from typing import Any

import pytest

from telemetry.errors import RefusedError
from telemetry.mavlink.conversation import FENCE, RALLY, ItemList
from telemetry.mavlink.download import MissionDownload
from telemetry.mavlink.upload import MissionUpload
from telemetry.simulation.simulator.protocol.mavlink import Endpoint
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.onboard_lists import Item
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.mission_vehicles import Px4
from tests.telemetry.simulator_bench import HOME

NOWHERE = (math.nan, math.nan, math.nan)
LAT, LON = -37.1244507, 175.6892878


def fence_items(corners: int = 12) -> tuple[Item, ...]:
    ring = [
        place(5002, corners, math.sin(2 * math.pi * k / corners), math.cos(2 * math.pi * k / corners))
        for k in range(corners)
    ]
    return (*ring, place(5003, 250.0, 0.0, 0.0), place(5004, 12.5, 0.3, 0.3))


def rally_items() -> tuple[Item, ...]:
    return tuple(place(5100, 0.0, 0.1 * k, 0.2, frame=3, alt_m=30.0 + k) for k in range(5))


def place(command: int, first: float, north: float, east: float, *, frame: int = 0, alt_m: float = 0.0) -> Item:
    return Item(command, frame, (first, 0.0, 0.0, 0.0), LAT + north * 1e-3, LON + east * 1e-3, alt_m)


class Simulated:
    """The simulated vehicle's end, on the clock of the run."""

    def __init__(self) -> None:
        self.endpoint = Endpoint(SimulatedVehicle(HOME, boot_s=0.5, gnss="perfect"))
        self.endpoint.connect("gcs")

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        return [reply for _, reply in self.endpoint.on_message(message, "gcs", now_s)]

    def on_tick(self, now_s: float) -> list[Any]:
        return [reply for _, reply in self.endpoint.on_slice(now_s)]


class Px4WithLists:
    """PX4 runs one protocol for its three lists, each with its own store."""

    def __init__(self) -> None:
        self.lists = {kind: Px4() for kind in (0, 1, 2)}

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        kind = getattr(message, "mission_type", 0)
        return [_of(answer, kind) for answer in self.lists[kind].on_message(message, now_s)]

    def on_tick(self, now_s: float) -> list[Any]:
        return [_of(answer, kind) for kind, each in self.lists.items() for answer in each.on_tick(now_s)]


def _of(answer: Any, kind: int) -> Any:
    answer.mission_type = kind
    return answer


def firmware_of(vehicle: Any) -> Any:
    return "px4" if isinstance(vehicle, Px4WithLists) else "ardupilot"


def send(items: tuple[Item, ...], vehicle: Any, about: ItemList, faults: Faults = Faults(), seed: int = 0) -> Run:  # noqa: B008
    machine = MissionUpload(items, NOWHERE, firmware=firmware_of(vehicle), target=VEHICLE, about=about)
    return Run(machine, vehicle, faults, seed).until_end()


def read(vehicle: Any, about: ItemList) -> tuple[Item, ...]:
    machine = MissionDownload(firmware=firmware_of(vehicle), target=VEHICLE, about=about)
    return Run(machine, vehicle).until_end().result.items


LISTS = [(FENCE, fence_items()), (RALLY, rally_items())]


@pytest.mark.parametrize("vehicle", [Simulated, Px4WithLists])
@pytest.mark.parametrize(("about", "items"), LISTS)
@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_fifty_of_fifty_are_verified_over_links_that_lose_and_reorder(
    vehicle: type, about: ItemList, items: tuple[Item, ...], loss: float
) -> None:
    faults = Faults(loss=loss, reordering=0.1, duplicates=0.02, corruption=0.01)
    unverified = []
    for seed in range(50):
        craft = vehicle()
        run = send(items, craft, about, faults, seed)
        held = read(craft, about)
        if not run.result.verified or [_exact(i) for i in held] != [_exact(i) for i in items]:
            unverified.append(seed)
    assert unverified == []


def _exact(item: Item) -> tuple[int, int, float | None, int, int, float]:
    return item.command, item.frame, item.params[0], round(item.lat_deg * 1e7), round(item.lon_deg * 1e7), item.alt_m


@pytest.mark.parametrize("vehicle", [Simulated, Px4WithLists])
def test_the_lists_do_not_touch_each_other_and_each_is_cleared_alone(vehicle: type) -> None:
    craft = vehicle()
    for about, items in LISTS:
        assert send(items, craft, about).result.verified
    assert len(read(craft, FENCE)) == len(fence_items())
    report = send((), craft, FENCE).result
    assert report.verified
    assert report.onboard.items == ()
    assert read(craft, FENCE) == ()
    assert len(read(craft, RALLY)) == 5


def test_clearing_arrives_over_a_link_that_loses_a_third() -> None:
    faults = Faults(loss=0.3, reordering=0.1)
    for seed in range(20):
        craft = Simulated()
        send(fence_items(), craft, FENCE)
        assert send((), craft, FENCE, faults, seed).result.verified
        assert read(craft, FENCE) == ()


def test_every_message_of_a_fence_says_that_it_is_of_the_fence() -> None:
    run = send(fence_items(), Simulated(), FENCE)
    kinds = {message.mission_type for _, way, message in run.log if way == "up"}
    assert kinds == {1}


def test_a_fence_that_the_vehicle_refuses_as_a_whole_is_not_verified_and_the_old_one_holds() -> None:
    craft = Simulated()
    assert send(fence_items(), craft, FENCE).result.verified
    torn = (place(5001, 4, 0, 0), place(5001, 4, 0, 1), place(5001, 4, 1, 1))
    report = send(torn, craft, FENCE).result
    assert not report.verified
    assert "3 items were sent, 14 are on board" in report.differences[0]


def test_an_item_that_the_vehicle_refuses_is_named_and_of_the_fence() -> None:
    error = send((*fence_items(), place(16, 0, 0, 0)), Simulated(), FENCE).error
    assert isinstance(error, RefusedError)
    assert error.where == "item 15"
    assert "fence on board" in error.advice


def test_rally_heights_that_are_no_whole_metres_are_found_out() -> None:
    report = send((place(5100, 0.0, 0.0, 0.0, frame=3, alt_m=30.7),), Simulated(), RALLY).result
    assert not report.verified
    assert "altitude is 30" in report.differences[0]


def test_a_vehicle_without_such_a_list_says_so() -> None:
    class Bare(Simulated):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            if message.get_type() == "MISSION_COUNT":
                message.mission_type = 7
            return [_of(reply, 1) for reply in super().on_message(message, now_s)]

    error = send(fence_items(), Bare(), FENCE).error
    assert isinstance(error, RefusedError)
    assert "keeps no fence" in error.advice


def test_a_broken_off_fence_upload_leaves_the_old_fence() -> None:
    craft = Simulated()
    send(fence_items(), craft, FENCE)
    machine = MissionUpload(fence_items(30), NOWHERE, firmware="ardupilot", target=VEHICLE, about=FENCE)
    lost = Run(machine, craft, lose=lambda direction, message, number: number > 30).until_end()
    assert "The fence on board is now unknown" in lost.error.advice
    assert len(read(craft, FENCE)) == len(fence_items())
