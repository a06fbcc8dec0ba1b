"""Reading the mission on board: windows of requests, lost messages, refusals, silence."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RefusedError, SilentError, TransferError
from telemetry.mavlink.actions import Failed, Send
from telemetry.mavlink.download import MissionDownload
from telemetry.mavlink.verify import as_stored, digest
from tests.telemetry.lossy import STATION, VEHICLE, Faults, Run
from tests.telemetry.mission_samples import HARSH, VEHICLES, mission, upload
from tests.telemetry.mission_vehicles import ArduCopter, Px4


def download(vehicle: Any, faults: Faults = Faults(), **options: Any) -> Run:  # noqa: B008
    firmware = "px4" if isinstance(vehicle, Px4) else "ardupilot"
    return Run(MissionDownload(firmware=firmware, target=VEHICLE), vehicle, faults, **options).until_end()


def requests(run: Run) -> list[int]:
    return [m.seq for _, way, m in run.log if way == "up" and m.get_type() == "MISSION_REQUEST_INT"]


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("seed", range(10))
def test_what_is_read_is_what_the_vehicle_holds(vehicle: type, seed: int) -> None:
    craft, items = vehicle(), mission(30)
    upload(items, craft)
    onboard = download(craft, HARSH, seed=seed).result
    assert onboard.digest == digest(as_stored(items, "ardupilot" if vehicle is ArduCopter else "px4"))
    assert len(onboard.items) == 30


def test_without_losses_each_item_is_asked_for_once_and_eight_at_a_time() -> None:
    craft = ArduCopter()
    upload(mission(40), craft)
    run = download(craft)
    assert requests(run) == list(range(41))
    assert run.now_s <= (41 / 8 + 3) * 0.04
    assert [m.get_type() for _, way, m in run.log if way == "up"][-1] == "MISSION_ACK"


def test_ardupilot_is_asked_again_only_for_what_is_missing() -> None:
    craft, lost = ArduCopter(), []
    upload(mission(40), craft)

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.get_type() == "MISSION_ITEM_INT" and message.seq in (3, 17):
            lost.append(message.seq)
            return lost.count(message.seq) == 1
        return False

    run = download(craft, lose=lose)
    assert sorted(requests(run)) == sorted([*range(41), 3, 17])


def test_px4_is_asked_one_at_a_time_after_a_loss() -> None:
    craft, lost = Px4(), []
    upload(mission(20), craft)

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.get_type() == "MISSION_ITEM_INT" and message.seq == 5:
            lost.append(number)
            return len(lost) == 1
        return False

    run = download(craft, lose=lose)
    assert len(run.result.items) == 20


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_an_empty_vehicle_holds_no_items(vehicle: type) -> None:
    onboard = download(vehicle()).result
    assert onboard.items == ()
    assert onboard.digest == digest(())


def test_a_vehicle_that_is_receiving_is_waited_for_and_then_given_up() -> None:
    craft = ArduCopter()
    craft.receiving, craft.owner = True, (254, 190)
    assert download(craft).result.items == ()

    class Busy(ArduCopter):
        receiving = True

        def on_tick(self, now_s: float) -> list[Any]:
            self.receiving = True
            return []

    assert isinstance(download(Busy()).error, RefusedError)


@pytest.mark.parametrize("at", [0, 1, 2, 5, 12])
def test_a_cut_link_ends_in_silence(at: int) -> None:
    craft = ArduCopter()
    upload(mission(10), craft)
    run = download(craft, lose=lambda direction, message, number: number >= at)
    assert isinstance(run.error, SilentError)
    assert "unknown" in run.error.advice
    assert run.now_s <= 30


def test_a_mission_that_changes_while_it_is_read_is_read_anew() -> None:
    class Changing(ArduCopter):
        asked = 0

        def _on_mission_request_int(self, message: Any, now_s: float) -> list[Any]:
            self.asked += 1
            if self.asked == 15:
                del self.stored[5:]
                return [mavlink.MAVLink_mission_count_message(*STATION, len(self.stored), 0)]
            return super()._on_mission_request_int(message, now_s)

    source, craft = ArduCopter(), Changing()
    upload(mission(20), source)
    craft.stored = source.stored
    assert len(download(craft).result.items) == 4


def test_cancelling_tells_the_vehicle() -> None:
    machine = MissionDownload(firmware="ardupilot", target=VEHICLE)
    machine.start(0.0)
    stop, end = machine.cancel(1.0)
    assert isinstance(stop, Send)
    assert stop.message.type == 15
    assert isinstance(end, Failed)
    assert isinstance(end.error, TransferError)
    assert machine.on_tick(2.0) == []


def test_a_restart_of_the_vehicle_is_named() -> None:
    class Restarting(ArduCopter):
        def on_tick(self, now_s: float) -> list[Any]:
            t_boot_ms = 90_000 if now_s < 0.1 else 100
            return [mavlink.MAVLink_attitude_message(t_boot_ms, 0, 0, 0, 0, 0, 0)]

    craft = Restarting()
    craft.receiving = True
    assert "restarted" in download(craft).error.what
