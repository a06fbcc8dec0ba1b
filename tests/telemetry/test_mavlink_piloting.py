"""What takes the place of what: pauses, returns and starts that overlap, on a wire of the test's own."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable
from types import SimpleNamespace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import MissionUnknownError, NotAllowedError, SilentError
from telemetry.link.onboard import OnBoard
from telemetry.link.piloting import procedures
from telemetry.link.piloting.missions import check_same_mission, speeds_before
from telemetry.link.piloting.pilot import Pilot
from telemetry.mavlink.flight_keeper import FlightKeeper
from telemetry.topics.messages import FlightStatus
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.requests import StartAuto
from tests.telemetry.fake_vehicle import ack
from tests.telemetry.frames import ARMED, AUTO, GUIDED, RTL, heartbeat
from tests.telemetry.link_bench import until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_adopted import Bench

BRAKE = 17
SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
NONE = (0.0, 0.0, 0.0, 0.0)
MISSION = (Item(22, 3, NONE, -37.0, 175.0, 10.0), Item(16, 3, NONE, -37.001, 175.0, 10.0), Item(20, 0, NONE, 0, 0, 0))
POSITION = mavlink.MAVLink_global_position_int_message(
    time_boot_ms=0, lat=-370000000, lon=1750000000, alt=810000, relative_alt=10000, vx=0, vy=0, vz=0, hdg=0
)


def in_air() -> Any:
    return mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_IN_AIR)


class Desk:
    """A pilot at an adopted vehicle that hears what the test says."""

    def __init__(self) -> None:
        self.bench = Bench()
        self.flight = FlightKeeper()
        self.tasks: set[asyncio.Task[None]] = set()
        self.on_board: OnboardMission | None = None
        """What a read-back finds; None: what was found before."""

        async def no_parameters(names: tuple[str, ...]) -> dict[str, float | None]:
            return dict.fromkeys(names)

        async def read_mission() -> OnboardMission:
            onboard = self.bench.vehicle.onboard
            mission = self.on_board or onboard.mission
            assert mission is not None
            onboard.transfer_ends(mission, self.bench.now_s)
            return mission

        self.alarms: list[str] = []
        self.pilot = Pilot(
            self.bench.vehicle,
            self.flight,
            spawn=self._spawn,
            read_parameters=no_parameters,
            read_mission=read_mission,
            alarm=self.alarms.append,
        )

    def _spawn(self, coroutine: Any) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(coroutine)
        self.tasks.add(task)
        return task

    def modes(self) -> list[int]:
        """That were commanded, in order."""
        return [int(m.param2) for m in self.bench.wire.sent if getattr(m, "command", None) == SET_MODE]

    async def within(self, seconds: float, doing: Awaitable[None]) -> None:
        """Raises TimeoutError."""
        async with asyncio.timeout(seconds):
            await doing

    async def later(self, seconds: float) -> None:
        self.bench.now_s += seconds
        self.bench.vehicle.on_tick()
        await asyncio.sleep(0)

    async def close(self) -> None:
        self.pilot.close()
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


@contextlib.asynccontextmanager
async def desk(*heard: Any):
    made = Desk()
    made.bench.hear(*heard)
    try:
        yield made
    finally:
        await made.close()


def test_a_return_ends_the_pause_before_it_for_good() -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=AUTO, base_mode=ARMED), in_air()) as it:
            pausing = asyncio.create_task(it.pilot.pause())
            await until(lambda: it.modes() == [BRAKE])
            returning = asyncio.create_task(it.pilot.return_home())
            await until(lambda: it.modes() == [BRAKE, RTL])
            with pytest.raises(NotAllowedError, match="Another command"):
                await pausing
            for _ in range(5):
                await it.later(1.0)
            assert set(it.modes()[1:]) == {RTL}
            it.bench.hear(ack(SET_MODE, 0))
            await returning

    run(whole)


def test_a_mode_that_was_acknowledged_but_does_not_show_is_commanded_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(procedures, "SHOWS_S", 0.05)

    async def whole() -> None:
        async with desk(heartbeat(custom_mode=AUTO, base_mode=ARMED), in_air()) as it:
            returning = asyncio.create_task(it.pilot.return_home())
            await until(lambda: it.modes() == [RTL])
            it.bench.hear(ack(SET_MODE, 0))
            await returning
            await until(lambda: it.modes() == [RTL, RTL])
            it.bench.hear(ack(SET_MODE, 0))
            it.bench.now_s += 0.1
            it.bench.hear(heartbeat(custom_mode=RTL, base_mode=ARMED))
            await until(lambda: all(task.done() for task in it.tasks))
            assert it.modes() == [RTL, RTL]
            assert it.flight.status.hint == ""

    run(whole)


def test_a_mode_that_never_shows_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(procedures, "SHOWS_S", 0.0)

    async def whole() -> None:
        async with desk(heartbeat(custom_mode=AUTO, base_mode=ARMED)) as it:
            changing = asyncio.create_task(procedures.change_mode(it.bench.vehicle, ("RTL",), lambda: None))
            for count in range(1, 4):
                await until(lambda count=count: len(it.modes()) == count)
                it.bench.hear(ack(SET_MODE, 0))
            with pytest.raises(SilentError, match="still in AUTO"):
                await changing

    run(whole)


def test_in_guided_a_vehicle_without_brake_is_sent_to_where_it_is() -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=GUIDED, base_mode=ARMED), in_air(), POSITION) as it:
            pausing = asyncio.create_task(it.pilot.pause())
            await until(lambda: it.modes() == [BRAKE])
            it.bench.hear(ack(SET_MODE, 3))
            await it.later(0.6)
            await until(lambda: "COMMAND_INT" in it.bench.wire.kinds())
            place = next(m for m in it.bench.wire.sent if m.get_type() == "COMMAND_INT")
            assert (place.command, place.x, place.y, place.z) == (192, -370000000, 1750000000, 10.0)
            it.bench.hear(ack(192, 0))
            await pausing
            assert it.modes() == [BRAKE]

    run(whole)


def test_a_pause_stops_a_start_whose_arming_does_not_show_yet() -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=GUIDED), POSITION) as it:
            it.bench.vehicle.onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "digest"), 0.0)
            starting = asyncio.create_task(it.pilot.start_auto(StartAuto(None, "digest")))  # type: ignore[arg-type]
            await until(lambda: it.flight.status.phase == "arming")
            pausing = asyncio.create_task(it.pilot.pause())
            await until(lambda: it.modes() == [BRAKE])
            with pytest.raises(NotAllowedError, match="Another command"):
                await starting
            it.bench.hear(ack(SET_MODE, 0))
            await pausing
            assert it.flight.status.phase == "idle"
            assert not it.pilot.flies_mission

    run(whole)


def test_a_start_whose_arming_never_shows_does_not_block_what_follows(monkeypatch: pytest.MonkeyPatch) -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=GUIDED), POSITION) as it:
            vehicle = it.bench.vehicle
            vehicle.onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "digest"), 0.0)

            async def obeys(*_: Any) -> None:
                return None

            async def never(*_: Any, **__: Any) -> None:
                raise SilentError("The vehicle did not arm within 10 s.")

            monkeypatch.setattr(vehicle, "obey", obeys)
            monkeypatch.setattr(vehicle, "wait_until", never)
            with pytest.raises(SilentError):
                await it.pilot.start_auto(StartAuto(None, "digest"))  # type: ignore[arg-type]
            assert it.flight.status.phase == "idle"
            assert not it.pilot.flies_mission

    run(whole)


def test_a_vehicle_that_does_not_say_whether_it_flies_is_judged_by_its_height() -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=GUIDED, base_mode=ARMED), POSITION) as it:
            it.bench.vehicle.onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "digest"), 0.0)
            with pytest.raises(NotAllowedError, match="already flying"):
                await it.pilot.start_auto(StartAuto(None, "digest"))  # type: ignore[arg-type]
            with pytest.raises(NotAllowedError, match="in the air"):
                await it.pilot.disarm()

    run(whole)


@pytest.mark.fact("A30")
@pytest.mark.parametrize(("found", "words"), [(None, "not known"), ("other", "Another mission")])
def test_a_mission_that_somebody_replaced_is_not_gone_on_with(found: str | None, words: str) -> None:
    onboard = OnBoard()
    if found is not None:
        onboard.transfer_ends(OnboardMission(MISSION, None, None, None, found), 0.0)
    with pytest.raises(MissionUnknownError, match=words):
        check_same_mission(onboard, "digest")


@pytest.mark.parametrize("leads", [True, False])
def test_a_mission_is_replaced_while_avoidance_is_paused_and_ends_it(leads: bool) -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=BRAKE, base_mode=ARMED), in_air(), POSITION) as it:
            it.flight.take_up(FlightStatus(way="auto", phase="paused", target=2, targets=3))
            stopped: list[str] = []
            avoidance: Any = SimpleNamespace(is_engaged=True, leads=leads, stop=lambda: stopped.append("stopped"))
            it.pilot.avoidance = avoidance
            if leads:
                with pytest.raises(NotAllowedError, match="being led past something"):
                    it.pilot.check_holds()
                return
            it.pilot.check_holds()
            it.pilot.replaces()
            assert stopped == ["stopped"]

    run(whole)


@pytest.mark.parametrize(
    ("phase", "is_over", "words"),
    [
        ("paused", False, ""),
        ("flying", False, "being led along a way"),
        ("interrupted", True, "being given a command"),
    ],
)
def test_a_way_that_is_flown_holds_and_one_that_is_flown_now_does_not(phase: str, is_over: bool, words: str) -> None:
    """What led the vehicle there is under way until something else is ordered."""

    async def whole() -> None:
        async with desk(heartbeat(custom_mode=GUIDED, base_mode=ARMED), in_air(), POSITION) as it:
            script: Any = SimpleNamespace(phase=phase, is_over=is_over, stop=lambda _: None)
            it.pilot._scripting._script = script  # pyright: ignore[reportPrivateUsage]
            waiting = asyncio.create_task(it.pilot._procedures.take_over(lambda _: asyncio.sleep(60.0)))  # pyright: ignore[reportPrivateUsage]
            await until(lambda: it.pilot._procedures.is_under_way)  # pyright: ignore[reportPrivateUsage]
            if words:
                with pytest.raises(NotAllowedError, match=words):
                    it.pilot.check_holds()
            else:
                it.pilot.check_holds()
            it.pilot._procedures.end()  # pyright: ignore[reportPrivateUsage]
            with pytest.raises(NotAllowedError, match="Another command"):
                await waiting

    run(whole)


def test_the_last_speed_of_each_kind_counts() -> None:
    def speed(kind: float | None, m_s: float | None) -> Item:
        return Item(178, 2, (kind, m_s, -1.0, 0.0), 0.0, 0.0, 0.0)

    items = (speed(0, 5.0), MISSION[1], speed(1, 2.0), speed(2, 1.0), speed(1, -1.0), speed(None, 3.0), MISSION[1])
    mission = OnboardMission((*items, speed(1, 9.0)), None, None, None, "")
    assert speeds_before(mission, 8) == {1: 2.0, 2: 1.0}
    assert speeds_before(mission, 2) == {1: 5.0}
    assert speeds_before(mission, 1) == {}
    assert speeds_before(None, 5) == {}
