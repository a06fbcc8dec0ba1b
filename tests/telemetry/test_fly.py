"""A whole flight against a link that plays a vehicle: what is asked in which order, and what stops it."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from typing import Any

import pytest

from planning.formats.wpl import read_wpl
from telemetry.errors import (
    ConnectionFailedError,
    NotAllowedError,
    NoVehicleError,
    RefusedError,
    SilentError,
    TransferError,
)
from telemetry.flight import fly as fly_module
from telemetry.flight.fly import FlyResult, fly
from telemetry.topics.checklist import ChecklistPoint
from telemetry.topics.messages import ConnectionStatus, ErrorInfo, FlightStatus, LinkStatus, Topic, VehicleText
from telemetry.topics.requests import Connect, ReadParameters, ReturnHome, StartAuto, StartGuided, TickPoint, Upload
from tests.server.flight_logs import PLAIN
from tests.telemetry.fly_bench import ADDRESS, OPTIONS, PLANNED, VEHICLE, Heard, Pilot, flown
from tests.telemetry.own_time import run
from tests.telemetry.small_bus import SmallBus
from tests.telemetry.test_preflight import hill, state_at


def test_the_order_of_things() -> None:
    pilot = Pilot(SmallBus())
    result, heard = flown(pilot)
    assert [type(request) for request in pilot.asked] == [Connect, Upload, ReadParameters, StartAuto]
    assert pilot.asked[0].adopt
    assert pilot.asked[-1].digest == result.upload.onboard.digest
    assert result.completed
    assert result.text == "The mission was flown and the vehicle has landed."
    assert heard.prepared is not None
    assert any("clearance: At least 12.00 m" in line for line in heard.lines)


@pytest.mark.fact("P4")
def test_the_firmware_is_told_though_it_is_known_only_after_the_vehicle_was_heard() -> None:
    class Late(Pilot):
        def _tell(self) -> None:
            self.bus.publish(Topic.VEHICLE, replace(self.state, firmware_version=None))
            self.bus.publish(Topic.LINK, LinkStatus(0.0, adopted=VEHICLE, state="live"))
            asyncio.get_running_loop().call_later(0.05, self.bus.publish, Topic.VEHICLE, self.state)

    _, heard = flown(Late(SmallBus()))
    assert "Vehicle 1: ardupilot 4.7.0" in heard.lines


def test_what_the_crew_ticked_is_written_down_before_the_start() -> None:
    pilot, points = (
        Pilot(SmallBus()),
        (ChecklistPoint("Props", "", "Anna", 1.0), ChecklistPoint("Wind", "", "Anna", 2.0)),
    )
    result, _ = flown(pilot, replace(OPTIONS, checklist=points))
    assert [type(request) for request in pilot.asked[-3:]] == [TickPoint, TickPoint, StartAuto]
    assert pilot.asked[-2] == TickPoint(OPTIONS.operator, 2, 2, "Wind", "quad", by="Anna")
    record = pilot.bus.last[Topic.CHECKLIST]
    assert (record.points, record.mission_digest, record.vehicle) == (points, result.upload.onboard.digest, VEHICLE.id)
    assert record.started_utc_s is not None


def test_with_an_open_point_nothing_is_started() -> None:
    pilot = Pilot(SmallBus())
    with pytest.raises(NotAllowedError, match='Point 1 of the checklist is open: "Props"'):
        flown(pilot, replace(OPTIONS, checklist=(ChecklistPoint("Props"),)))
    assert pilot.of(StartAuto) == []


def test_what_is_flown_is_put_on_record() -> None:
    pilot = Pilot(SmallBus())
    result, _ = flown(pilot)
    record = pilot.bus.last[Topic.PLAN]
    assert record.name == "Orchard"
    assert record.digest == result.upload.onboard.digest
    assert record.terrain_sha256 == PLAIN.sha256
    assert '"certified": true' in record.certificate_json
    assert len(read_wpl(record.mission_wpl).items) == len(PLANNED.items)


def test_guided() -> None:
    pilot = Pilot(SmallBus())
    result, _ = flown(pilot, replace(OPTIONS, way="guided"))
    start, proof = pilot.of(StartGuided)[0], result.preflight.certificate
    assert proof is not None
    assert start.spare_m == proof.kept_m - proof.required_clearance_m > 0.0
    assert [target.item for target in start.targets] == [2, 3, 4]
    assert start.takeoff_alt_rel_home_m == pytest.approx(20.0)
    assert start.end == "rtl"


def test_heights_are_moved_to_suit_the_ground_where_the_vehicle_stands() -> None:
    pilot = Pilot(SmallBus(), state_at((80.0, 150.0)))
    result, heard = flown(pilot, replace(OPTIONS, dsm=hill()))
    first, second = pilot.of(Upload)
    assert second.items[1].alt_m == pytest.approx(first.items[1].alt_m - 3.0, abs=0.011)
    assert result.preflight.ok()
    assert not result.preflight.needs_rereference
    assert pilot.of(StartAuto)[0].digest == result.upload.onboard.digest
    assert any("+3.00 m" in line for line in heard.lines)
    assert result.mission.home.alt_dsm_m == pytest.approx(103.0)


def test_a_check_that_fails_stops_before_the_start() -> None:
    low = replace(PLANNED, items=tuple(replace(i, alt_m=9.0) if i.command == 16 else i for i in PLANNED.items))
    pilot = Pilot(SmallBus())
    with pytest.raises(NotAllowedError, match="check before the start"):
        flown(pilot, flight=low)
    assert pilot.of(StartAuto) == []
    assert Topic.PLAN not in pilot.bus.last


def test_what_can_be_accepted_is_named_and_accepted() -> None:
    poor = state_at(gnss_fix="3d", horizontal_accuracy_m=2.5)
    with pytest.raises(NotAllowedError, match=r"Or accept it: gnss\."):
        flown(Pilot(SmallBus(), poor))
    result, _ = flown(Pilot(SmallBus(), poor), replace(OPTIONS, accept=frozenset({"gnss"})))
    assert result.completed


def test_without_a_surface_model_it_flies_unchecked() -> None:
    result, _ = flown(Pilot(SmallBus()), replace(OPTIONS, dsm=None))
    assert result.completed
    assert result.preflight.certificate is None


def test_a_vehicle_that_is_not_ready_is_waited_for() -> None:
    pilot = Pilot(SmallBus(), state_at(ready_to_arm=False))

    async def later() -> FlyResult:
        async def becomes_ready() -> None:
            await asyncio.sleep(0.2)
            pilot.bus.publish(Topic.VEHICLE, replace(state_at(), firmware_version="4.7.0"))

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(becomes_ready())
            return await fly(pilot, pilot.bus, PLANNED, replace(OPTIONS, ready_s=60.0), Heard())

    assert run(later).completed


def test_refused_arming_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fly_module, "ARM_AGAIN_S", 0.01)
    pilot = Pilot(SmallBus())
    pilot.refusals = [RefusedError("The vehicle refused to arm: Need Position Estimate.")] * 2
    result, heard = flown(pilot, replace(OPTIONS, ready_s=60.0))
    assert result.completed
    assert len(pilot.of(StartAuto)) == 3
    assert sum("Not yet" in line for line in heard.lines) == 2


def test_refused_for_good() -> None:
    pilot = Pilot(SmallBus())
    pilot.refusals = [RefusedError("The vehicle refused to arm.")] * 100
    heard = Heard()
    with pytest.raises(RefusedError):
        run(lambda: fly(pilot, pilot.bus, PLANNED, replace(OPTIONS, ready_s=0.0), heard))
    assert heard.refused


def test_silence_is_not_tried_again() -> None:
    pilot = Pilot(SmallBus())
    pilot.refusals = [SilentError("No answer.")]
    with pytest.raises(SilentError):
        flown(pilot)


def test_another_mission_on_board() -> None:
    pilot = Pilot(SmallBus())
    pilot.differences = ("Item 3: the command is 20, not 16 as sent.",)
    with pytest.raises(TransferError, match="Item 3"):
        flown(pilot)


def test_nobody_is_heard() -> None:
    pilot = Pilot(SmallBus())
    pilot.tells = False
    with pytest.raises(NoVehicleError, match="within 0 s"):
        flown(pilot, replace(OPTIONS, connect_s=0.1))


def test_several_ways_are_opened_to_the_same_vehicle() -> None:
    pilot = Pilot(SmallBus())
    flown(pilot, replace(OPTIONS, address=f"udpin:0.0.0.0:14550,{ADDRESS}"))
    assert [(each.address, each.adopt, each.as_way) for each in pilot.of(Connect)] == [
        ("udpin:0.0.0.0:14550", True, True),
        (ADDRESS, True, True),
    ]


def test_a_connection_that_cannot_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("telemetry.flight.preflight.prepare.FAILED_PATIENCE_S", 0.0)
    pilot = Pilot(SmallBus())
    pilot.tells = False
    error = ErrorInfo("connection", "Port 14550 is in use by another program.", ADDRESS, "End it, or use another port.")
    pilot.bus.publish(Topic.LINK, LinkStatus(0.0, connections=(ConnectionStatus(ADDRESS, "failed", error),)))
    with pytest.raises(ConnectionFailedError, match="in use by another program"):
        flown(pilot)


def test_a_flight_that_broke_off() -> None:
    pilot = Pilot(SmallBus())
    pilot.end = FlightStatus(phase="interrupted", targets=5, broke_off_at=3)
    result, _ = flown(pilot)
    assert not result.completed
    assert "broke off at item 3 of 5, where it can go on" in result.text


def test_going_on_where_a_flight_broke_off() -> None:
    pilot = Pilot(SmallBus())
    result, heard = flown(pilot, replace(OPTIONS, from_item=3))
    start = pilot.of(StartAuto)[0]
    assert (start.from_item, start.climb_to_m) == (3, 20.0)
    assert start.digest == result.upload.onboard.digest
    assert any("Going on at item 3" in line for line in heard.lines)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"from_item": 9}, "no item 9"),
        ({"from_item": 3, "dsm": None}, "surface model"),
        ({"from_item": 5}, "Nothing is left"),
        ({"from_item": 3, "way": "guided"}, "one at a time"),
    ],
)
def test_going_on_is_refused(changes, words) -> None:
    pilot = Pilot(SmallBus())
    with pytest.raises(NotAllowedError, match=words):
        flown(pilot, replace(OPTIONS, **changes))
    assert pilot.of(StartAuto) == []


def test_the_end_of_an_earlier_flight_is_not_taken_for_this_ones() -> None:
    pilot = Pilot(SmallBus())
    pilot.bus.publish(Topic.FLIGHT, FlightStatus(phase="interrupted", broke_off_at=2, since_utc_s=time.time() - 60.0))
    result, _ = flown(pilot)
    assert result.completed


def test_going_home_on_request_and_words_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fly_module, "FOLLOW_S", 0.02)
    pilot, heard = Pilot(SmallBus()), Heard()
    pilot.end = FlightStatus(phase="flying", target=3, targets=5)

    async def flight() -> FlyResult:
        go_home = asyncio.Event()

        async def on_the_way() -> None:
            while not pilot.of(StartAuto):
                await asyncio.sleep(0.01)
            pilot.bus.publish(Topic.TEXT, VehicleText(0.0, 4, "Battery low"))
            pilot.bus.publish(Topic.LINK, LinkStatus(0.0, adopted=VEHICLE, state="lost"))
            await asyncio.sleep(0.1)
            pilot.bus.publish(Topic.LINK, LinkStatus(0.0, adopted=VEHICLE, state="live"))
            await asyncio.sleep(0.1)
            go_home.set()
            while not pilot.of(ReturnHome):
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.1)
            ended = FlightStatus(phase="interrupted", broke_off_at=3, targets=5, since_utc_s=time.time() + 1)
            pilot.bus.publish(Topic.FLIGHT, ended)

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(on_the_way())
            return await fly(pilot, pilot.bus, PLANNED, OPTIONS, heard, go_home=go_home)

    result = run(flight)
    assert not result.completed
    assert len(pilot.of(ReturnHome)) == 1
    for line in ("Vehicle: Battery low", "Communication lost: the vehicle flies on by itself", "Communication is back"):
        assert line in heard.lines
    assert heard.states > 2


class Deaf(Pilot):
    """The first order to return is lost."""

    async def call(self, request: Any) -> Any:
        answer = await super().call(request)
        if isinstance(request, ReturnHome):
            if len(self.of(ReturnHome)) == 1:
                raise SilentError("No answer.")
            ended = FlightStatus(phase="interrupted", broke_off_at=3, targets=5, since_utc_s=time.time() + 1)
            self.bus.publish(Topic.FLIGHT, ended)
        return answer


def test_a_return_that_is_not_obeyed_is_commanded_again_and_the_flight_watched_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(fly_module, "FOLLOW_S", 0.02)
    pilot, heard = Deaf(SmallBus()), Heard()
    pilot.end = FlightStatus(phase="flying", target=3, targets=5)

    async def flight() -> FlyResult:
        go_home = asyncio.Event()
        go_home.set()
        return await fly(pilot, pilot.bus, PLANNED, OPTIONS, heard, go_home=go_home)

    assert not run(flight).completed
    assert len(pilot.of(ReturnHome)) == 2
    assert any("commanded again" in line for line in heard.lines)


class Surprising(Pilot):
    """Its vehicle takes off although the answer to the start is lost."""

    async def call(self, request: Any) -> Any:
        if isinstance(request, StartAuto):
            self.bus.publish(Topic.VEHICLE, state_at(armed=True, landed="in_air"))
        if isinstance(request, ReturnHome):
            self.bus.publish(Topic.VEHICLE, state_at())
        return await super().call(request)


def test_a_vehicle_that_took_off_although_the_start_went_wrong_is_watched_to_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(fly_module, "FOLLOW_S", 0.02)
    monkeypatch.setattr(fly_module, "HEARTBEAT_S", 0.1)
    pilot, heard = Surprising(SmallBus()), Heard()
    pilot.refusals = [SilentError("No answer.")]

    async def flight() -> FlyResult:
        go_home = asyncio.Event()
        go_home.set()
        return await fly(pilot, pilot.bus, PLANNED, OPTIONS, heard, go_home=go_home)

    with pytest.raises(SilentError, match="No answer"):
        run(flight)
    assert len(pilot.of(ReturnHome)) == 1
    assert any("the vehicle is armed" in line for line in heard.lines)


def test_a_vehicle_of_another_connection_is_not_taken_for_this_ones() -> None:
    pilot = Pilot(SmallBus())
    with pytest.raises(NoVehicleError):
        flown(pilot, replace(OPTIONS, address="tcp:127.0.0.1:5770", connect_s=0.1))


def test_nothing_stays_subscribed() -> None:
    pilot = Pilot(SmallBus())
    flown(pilot)
    assert pilot.bus.subscriptions == []
