"""Uploads over a link that loses, delays, repeats and corrupts, cut links, lost acknowledgements, other stations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RefusedError, SilentError, TransferError
from telemetry.mavlink.actions import Failed, Progress, Send
from telemetry.mavlink.upload import MissionUpload
from telemetry.mavlink.verify import as_stored, digest
from telemetry.topics.onboard_lists import Item
from tests.telemetry.lossy import STATION, VEHICLE, Faults, Run
from tests.telemetry.mission_samples import HARSH, VEHICLES, mission, upload, waypoint
from tests.telemetry.mission_vehicles import HOME, ArduCopter, Px4, ack, text

STRANGER = (254, 190)


def kinds(run: Run, direction: str = "up") -> list[str]:
    return [message.get_type() for _, way, message in run.log if way == direction]


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_a_mission_arrives_and_is_verified(vehicle: type) -> None:
    items = mission(20)
    craft = vehicle()
    report = upload(items, craft).result
    assert report.verified
    assert report.differences == ()
    firmware = "ardupilot" if vehicle is ArduCopter else "px4"
    assert report.onboard.digest == digest(as_stored(items, firmware))
    assert len(report.onboard.items) == 20
    assert craft.completed == 1


def test_ardupilot_gets_a_home_row_and_its_own_home_comes_back() -> None:
    craft = ArduCopter()
    machine = MissionUpload(mission(5), (1.0, 2.0, 3.0), firmware="ardupilot", target=VEHICLE)
    run = Run(machine, craft).until_end()
    rows = [message for _, way, message in run.log if way == "up" and message.get_type() == "MISSION_ITEM_INT"]
    assert [row.seq for row in rows] == [0, 1, 2, 3, 4, 5]
    assert (rows[0].x, rows[0].y, rows[0].z) == (10_000_000, 20_000_000, 3.0)
    onboard = run.result.onboard
    assert onboard.home_lat_deg == pytest.approx(HOME[0], abs=1e-7)
    assert onboard.home_alt_amsl_m == pytest.approx(HOME[2], abs=0.01)
    assert [item.command for item in onboard.items] == [22, 16, 16, 16, 20]


@pytest.mark.fact("P29")
def test_px4_gets_no_home_row() -> None:
    run = upload(mission(5), Px4())
    assert [row.seq for _, way, row in run.log if way == "up" and row.get_type() == "MISSION_ITEM_INT"] == [
        0,
        1,
        2,
        3,
        4,
    ]
    assert run.result.onboard.home_lat_deg is None


def test_an_unknown_home_does_not_stop_the_upload() -> None:
    nan = float("nan")
    machine = MissionUpload(mission(4), (nan, nan, nan), firmware="ardupilot", target=VEHICLE)
    assert Run(machine, ArduCopter()).until_end().result.verified


def test_a_lost_count_is_sent_again() -> None:
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if message.get_type() == "MISSION_COUNT" and direction == "up" and len(lost) < 3:
            lost.append(number)
            return True
        return False

    run = upload(mission(5), ArduCopter(), lose=lose)
    assert run.result.verified
    assert kinds(run).count("MISSION_COUNT") == 4


def test_an_item_that_the_vehicle_does_not_go_on_from_is_sent_again_soon() -> None:
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "up" and message.get_type() == "MISSION_ITEM_INT" and message.seq == 3 and not lost:
            lost.append(number)
            return True
        return False

    run = upload(mission(5), ArduCopter(), lose=lose)
    sent_s = [t for t, way, m in run.log if way == "up" and m.get_type() == "MISSION_ITEM_INT" and m.seq == 3]
    assert len(sent_s) == 2
    assert sent_s[1] - sent_s[0] <= 0.3


@pytest.mark.parametrize("words", [None, "Only 7 items are supported", "Only 0 items are supported"])
def test_a_mission_too_long_is_refused_in_the_vehicles_words(words: str | None) -> None:
    class Small(ArduCopter):
        def _on_mission_count(self, message: Any, now_s: float) -> list[Any]:
            return [ack(STATION, 4), *([text(words)] if words else [])]

    error = upload(mission(12), Small()).error
    assert isinstance(error, RefusedError)
    if words is None:
        assert "12 items" in error.what
    elif "7" in words:
        assert "12 items, the vehicle holds at most 7 items" in error.what
    else:
        assert "still starting" in error.advice
    assert words is None or words in error.what


NAN = float("nan")
REFUSED = [
    (replace(waypoint(0), alt_m=NAN), "the altitude is nan m"),
    (replace(waypoint(0), alt_m=float("inf")), "the altitude is inf m"),
    (replace(waypoint(0), frame=1), "it cannot use altitude frame 1"),
    (replace(waypoint(0), frame=99), "it cannot use altitude frame 99"),
    (replace(waypoint(0), lat_deg=95.0), "the latitude is 95"),
    (replace(waypoint(0), lon_deg=200.0), "the longitude is 200"),
    (replace(waypoint(0), command=9999), "it does not know command 9999"),
    (replace(waypoint(0), params=(NAN, 0.0, 0.0, 0.0)), "parameter 1 of command 16 is nan"),
]


@pytest.mark.parametrize(("bad", "said"), REFUSED)
@pytest.mark.parametrize("faults", [Faults(), HARSH])
def test_a_refused_item_is_named_with_its_field_and_value(bad: Item, said: str, faults: Faults) -> None:
    items = (*mission(8)[:3], bad, *mission(8)[3:])
    error = upload(items, ArduCopter(), faults, seed=3).error
    assert isinstance(error, RefusedError)
    assert error.where == "item 4"
    assert said in error.what
    assert "upload again" in error.advice


def test_each_refused_item_is_named_rightly_under_loss() -> None:
    """Two items are sent at once when one was lost: the refusal must not be laid on the wrong one."""
    wrong = []
    for seed in range(60):
        number = seed % 9 + 2
        items = list(mission(12))
        items[number - 1] = replace(items[number - 1], frame=99, command=16)
        error = upload(tuple(items), ArduCopter(), HARSH, seed=seed).error
        if error.where != f"item {number}":
            wrong.append((seed, number, str(error)))
    assert wrong == []


def test_a_place_that_no_message_can_hold_is_refused_before_anything_is_sent() -> None:
    items = (*mission(4)[:2], replace(waypoint(0), lat_deg=NAN))
    with pytest.raises(TransferError, match="latitude of item 3"):
        MissionUpload(items, HOME, firmware="ardupilot", target=VEHICLE)
    with pytest.raises(TransferError, match="no items"):
        MissionUpload((), HOME, firmware="ardupilot", target=VEHICLE)


class Mute:
    """Never answers; sends heartbeats or not."""

    def __init__(self, *, heartbeats: bool) -> None:
        self.heartbeats = heartbeats

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        return []

    def on_tick(self, now_s: float) -> list[Any]:
        return [mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)] if self.heartbeats else []


@pytest.mark.parametrize(("heartbeats", "said"), [(True, "is heard but does not answer"), (False, "has fallen silent")])
def test_a_vehicle_that_does_not_answer_is_reported_in_time(heartbeats: bool, said: str) -> None:
    run = upload(mission(5), Mute(heartbeats=heartbeats))
    assert isinstance(run.error, SilentError)
    assert said in run.error.what
    assert "unknown" in run.error.advice
    assert 8 <= run.now_s <= 25


def test_a_vehicle_that_falls_silent_on_the_way_is_reported_with_the_item() -> None:
    def lose(direction: str, message: Any, number: int) -> bool:
        return number > 20

    run = upload(mission(30), ArduCopter(), lose=lose)
    assert isinstance(run.error, SilentError)
    assert "of 30" in run.error.what
    assert run.now_s <= 30


class Restarting(ArduCopter):
    """Its clock begins anew in the middle, and it has forgotten the transfer."""

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        if now_s > 0.3 and self.receiving:
            self.__init__()
        return super().on_message(message, now_s)

    def on_tick(self, now_s: float) -> list[Any]:
        t_boot_ms = 90_000 + round(now_s * 1000) if now_s < 0.35 else round(now_s * 1000)
        return [mavlink.MAVLink_attitude_message(t_boot_ms, 0, 0, 0, 0, 0, 0), *super().on_tick(now_s)]


def test_a_restart_of_the_vehicle_is_named() -> None:
    error = upload(mission(30), Restarting()).error
    assert isinstance(error, TransferError)
    assert "restarted" in error.what


def test_a_transfer_that_the_vehicle_forgot_is_begun_again() -> None:
    class Forgetful(ArduCopter):
        forgot = False

        def on_message(self, message: Any, now_s: float) -> list[Any]:
            if message.get_type() == "MISSION_ITEM_INT" and message.seq == 5 and not self.forgot:
                self.forgot, self.receiving = True, False
            return super().on_message(message, now_s)

    run = upload(mission(10), Forgetful())
    assert run.result.verified
    assert kinds(run).count("MISSION_COUNT") == 2


def test_a_vehicle_that_always_breaks_off_is_given_up() -> None:
    class Hopeless(ArduCopter):
        def check(self, item: Any) -> int:
            return 1 if item.seq == 5 else 0

    error = upload(mission(10), Hopeless()).error
    assert isinstance(error, TransferError)
    assert error.where == "item 5"


def test_cancelling_tells_the_vehicle_and_ends_the_upload() -> None:
    machine = MissionUpload(mission(5), HOME, firmware="ardupilot", target=VEHICLE)
    machine.start(0.0)
    actions = machine.cancel(1.0)
    assert isinstance(actions[0], Send)
    assert actions[0].message.get_type() == "MISSION_ACK"
    assert actions[0].message.type == 15
    assert isinstance(actions[1], Failed)
    assert "unknown" in actions[1].error.advice
    assert machine.on_tick(100.0) == machine.cancel(100.0) == []


class Busy(ArduCopter):
    """Between our messages it talks with another ground station, about another mission and with refusals."""

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        others = [
            mavlink.MAVLink_mission_request_message(*STRANGER, 1, 0),
            mavlink.MAVLink_mission_request_int_message(*STRANGER, 3, 0),
            ack(STRANGER, 0),
            ack(STRANGER, 12),
            ack(STRANGER, 4),
            mavlink.MAVLink_mission_count_message(*STRANGER, 2, 0),
            mavlink.MAVLink_mission_item_int_message(*STRANGER, 2, 3, 16, 0, 1, 0, 0, 0, 0, 1, 2, 3.0),
        ]
        return [*others, *super().on_message(message, now_s), *others]


def test_another_stations_transfer_does_not_confuse_ours() -> None:
    run = upload(mission(20), Busy())
    assert run.result.verified
    assert kinds(run).count("MISSION_ITEM_INT") == 21


def test_other_vehicles_and_other_mission_types_are_not_heard() -> None:
    machine = MissionUpload(mission(5), HOME, firmware="ardupilot", target=VEHICLE)
    machine.start(0.0)
    fence = mavlink.MAVLink_mission_ack_message(*STATION, 4, 1)
    fence._header.srcSystem, fence._header.srcComponent = VEHICLE
    other = mavlink.MAVLink_mission_ack_message(*STATION, 4, 0)
    other._header.srcSystem, other._header.srcComponent = (2, 1)
    assert machine.on_message(fence, 0.1) == machine.on_message(other, 0.1) == []
    assert not [a for a in machine.on_tick(1.0) if isinstance(a, Failed)]


def test_an_upload_that_another_station_abandoned_is_waited_for() -> None:
    craft = ArduCopter()
    craft.receiving, craft.owner, craft.last = True, STRANGER, 9
    run = upload(mission(5), craft)
    assert run.result.verified
    assert run.now_s > 8


def test_an_upload_that_another_station_goes_on_with_is_reported() -> None:
    class Taken(ArduCopter):
        def on_tick(self, now_s: float) -> list[Any]:
            self.received_s = now_s
            return []

    craft = Taken()
    craft.receiving, craft.owner = True, STRANGER
    error = upload(mission(5), craft).error
    assert isinstance(error, RefusedError)
    assert "ground station" in error.advice


def test_an_item_that_the_vehicle_changes_is_a_difference() -> None:
    class Stubborn(ArduCopter):
        def keep(self, item: Any) -> Any:
            kept = super().keep(item)
            if item.seq == 3:
                kept.z = 99.0
            return kept

    report = upload(mission(6), Stubborn()).result
    assert not report.verified
    assert len(report.differences) == 1
    assert "Item 3: altitude is 99" in report.differences[0]


def test_what_the_vehicle_rounds_is_said() -> None:
    items = (*mission(4)[:2], waypoint(5, alt_m=32.94, hold_s=0.6), *mission(4)[2:])
    report = upload(items, ArduCopter()).result
    assert report.verified
    told = {(rounded.field, rounded.sent): rounded.kept for rounded in report.rounded if rounded.item == 3}
    assert told["parameter 1", 0.6] == 0.0
    assert told["altitude", 32.94] == pytest.approx(32.93, abs=1e-5)


def test_progress_counts_the_items_of_the_plan_and_never_exceeds_them() -> None:
    run = upload(mission(12), ArduCopter())
    progress = [action for action in run.actions if isinstance(action, Progress)]
    assert {action.phase for action in progress} == {"sending", "reading_back"}
    assert {action.total for action in progress} == {12}
    assert all(0 <= action.done <= 12 for action in progress)
    assert progress[0] == Progress("sending", 0, 12)
    assert progress[-1] == Progress("reading_back", 12, 12)


def test_a_vehicle_that_stores_an_item_twice_is_found_out_and_sent_the_mission_again() -> None:
    """As MAVSDK's vehicles do when an item comes twice."""

    class Doubling(Px4):
        def _on_mission_item_int(self, message: Any, now_s: float) -> list[Any]:
            if self.state == "receiving" and self.arriving and message.seq == self.arriving[-1].seq:
                self.arriving.append(message)
                return []
            return super()._on_mission_item_int(message, now_s)

    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.get_type() == "MISSION_REQUEST_INT" and message.seq == 4 and len(lost) < 1:
            lost.append(number)
            return True
        return False

    run = upload(mission(10), Doubling(), lose=lose)
    assert run.result.verified
    assert len(run.result.onboard.items) == 10
