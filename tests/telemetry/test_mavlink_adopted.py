"""The adopted vehicle with a clock of the test's own: silence, restarts, and what is said of them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any, cast

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RefusedError, SilentError
from telemetry.link.adopted import AdoptedVehicle, Telling
from telemetry.link.line import Line
from telemetry.mavlink.address import parse_address
from telemetry.topics.messages import Candidate
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.fake_vehicle import ack
from tests.telemetry.frames import ARMED, GUIDED, attitude, heard, heartbeat
from tests.telemetry.own_time import run

CANDIDATE = Candidate("id", "tcp:127.0.0.1:5760", "127.0.0.1:5760", 1, 1, "ardupilot", 2)


class Wire:
    """Takes the place of a connection."""

    def __init__(self) -> None:
        self.address, self.text = parse_address("tcp:127.0.0.1:5760"), "tcp:127.0.0.1:5760"
        self.sent: list[Any] = []

    def send(self, message: Any, peer: str | None = None) -> bytes:
        self.sent.append(message)
        return b"frame"

    def kinds(self) -> list[str]:
        return [message.get_type() for message in self.sent]


class Bench:
    def __init__(self) -> None:
        self.now_s = 100.0
        self.wire = Wire()
        self.states: list[VehicleState] = []
        self.texts: list[str] = []
        self.unsure = 0
        telling = Telling(
            state=self.states.append,
            text=lambda _, text: self.texts.append(text),
            unsure=self._unsure,
            sent=lambda _: None,
        )
        self.vehicle = AdoptedVehicle(CANDIDATE, cast(Line, self.wire), telling, lambda: self.now_s)

    def hear(self, *messages: Any, component: int = 1) -> None:
        for message in messages:
            self.vehicle.on_message(heard(message, component=component), 1.7e9)

    def _unsure(self) -> None:
        self.unsure += 1


def with_bench(act: Callable[[Bench], Awaitable[None]]) -> None:
    async def whole() -> None:
        await act(Bench())

    run(whole)


@pytest.mark.fact("A23")
def test_silence_is_stale_after_a_second_and_a_half_and_lost_after_three_and_a_half() -> None:
    bench = Bench()
    bench.hear(heartbeat())
    seen = []
    for silent_s in (0.0, 1.4, 1.6, 3.4, 3.6):
        bench.now_s = 100.0 + silent_s
        seen.append(bench.vehicle.link_state)
    assert seen == ["live", "live", "stale", "stale", "lost"]
    bench.hear(attitude())
    assert bench.vehicle.link_state == "live"


def test_another_component_does_not_keep_the_link_alive() -> None:
    bench = Bench()
    bench.hear(heartbeat())
    bench.now_s += 4
    bench.hear(attitude(), component=154)
    assert bench.vehicle.link_state == "lost"


def test_its_words_and_states_are_told() -> None:
    bench = Bench()
    bench.hear(heartbeat(), mavlink.MAVLink_statustext_message(4, b"PreArm: no"))
    assert bench.texts == ["PreArm: no"]
    assert bench.states[-1].mode == "AUTO"


def known(bench: Bench) -> None:
    bench.vehicle.onboard.transfer_ends(OnboardMission((), None, None, None, "digest"), bench.now_s - 60)


@pytest.mark.fact("A28")
def test_after_a_restart_the_mission_is_unknown_and_streams_are_asked_for_again() -> None:
    bench = Bench()
    bench.hear(heartbeat(), attitude(100_000))
    known(bench)
    bench.vehicle.on_tick()
    bench.wire.sent.clear()
    for t_boot_ms in (300, 900, 1500):  # a moment, until nobody can be sending beside it
        assert bench.vehicle.onboard.state == "none"
        bench.now_s += 0.6
        bench.hear(attitude(t_boot_ms))
    assert bench.vehicle.onboard.state == "unknown"
    assert bench.unsure == 1
    bench.vehicle.on_tick()
    assert "COMMAND_LONG" in bench.wire.kinds()
    bench.hear(attitude(400))
    assert bench.unsure == 1


def test_after_a_long_silence_on_the_ground_the_mission_is_unknown() -> None:
    bench = Bench()
    bench.hear(heartbeat())
    known(bench)
    bench.now_s += 10
    bench.hear(heartbeat())
    assert bench.vehicle.onboard.state == "unknown"
    assert bench.unsure == 1


@pytest.mark.fact("A24")
def test_after_a_long_silence_in_flight_it_is_not() -> None:
    bench = Bench()
    bench.hear(heartbeat(base_mode=ARMED))
    known(bench)
    bench.now_s += 10
    bench.hear(heartbeat(base_mode=ARMED))
    assert bench.vehicle.onboard.state == "none"
    assert bench.unsure == 0


def test_a_refusal_carries_the_vehicles_own_words() -> None:
    async def act(bench: Bench) -> None:
        order = asyncio.create_task(bench.vehicle.obey(bench.vehicle.orders.arm()))
        await asyncio.sleep(0)
        assert bench.wire.sent[-1].command == 400
        bench.hear(ack(400, 4), mavlink.MAVLink_statustext_message(2, b"Arm: Need Position Estimate"))
        bench.now_s += 2
        bench.vehicle.on_tick()
        with pytest.raises(RefusedError, match="Need Position Estimate"):
            await order

    with_bench(act)


def test_the_next_way_is_tried_after_a_refusal() -> None:
    async def act(bench: Bench) -> None:
        orders = bench.vehicle.orders
        both = asyncio.create_task(bench.vehicle.obey_first(orders.mode("BRAKE"), orders.mode("GUIDED")))
        await asyncio.sleep(0)
        bench.hear(ack(176, 4))
        bench.now_s += 2
        bench.vehicle.on_tick()
        while bench.wire.sent[-1].get_type() != "COMMAND_LONG" or bench.wire.sent[-1].param2 != GUIDED:
            await asyncio.sleep(0)
        bench.hear(ack(176, 0))
        await both

    with_bench(act)


def test_a_change_back_to_a_way_asks_for_nothing_at_once() -> None:
    bench = Bench()
    other, second = replace(CANDIDATE, id="other", address="tcp:127.0.0.1:5761"), Wire()
    bench.vehicle.ask_way(other, cast(Line, second))
    for way in bench.vehicle.ways:
        way.identity = "known"

    def asked(seconds: float) -> list[int]:
        """Commands over each, while messages come over one alone."""
        for wire in (bench.wire, second):
            wire.sent.clear()
        for _ in range(round(seconds / 0.05)):
            bench.now_s += 0.05
            bench.vehicle.on_spare(heard(attitude()), over)
            bench.vehicle.on_tick()
        return [wire.kinds().count("COMMAND_LONG") for wire in (bench.wire, second)]

    def change_over() -> list[int]:
        before = bench.vehicle.line
        while bench.vehicle.line is before:
            asked(0.05)
        return asked(0.9)

    over = CANDIDATE.address
    assert asked(0.9)[0] > 15
    over = other.address
    assert change_over()[1] > 15
    over = CANDIDATE.address
    assert change_over() == [0, 0]
    assert asked(0.5)[0] > 0, "most of it does not come"


def test_waiting_for_what_does_not_come_ends() -> None:
    async def act(bench: Bench) -> None:
        with pytest.raises(SilentError, match="did not climb within 0 s"):
            await bench.vehicle.wait_until(lambda state: False, timeout_s=0.05, what="climb")

    with_bench(act)


def test_integers_are_read_as_the_vehicle_says() -> None:
    bench = Bench()
    assert not bench.vehicle.sends_integers_bytewise
    zeros = [0] * 8
    version = mavlink.MAVLink_autopilot_version_message(16, 0, 0, 0, 0, zeros, zeros, zeros, 0, 0, 0)
    bench.hear(version)
    assert bench.vehicle.sends_integers_bytewise


def told(name: str, value: float) -> Any:
    return mavlink.MAVLink_param_value_message(name.encode(), value, 9, 900, 65535)


def test_kinds_of_the_fence_that_may_not_act_are_forgotten_by_a_restart_and_not_by_a_silence() -> None:
    bench = Bench()
    bench.hear(heartbeat(), attitude(100_000))
    bench.hear(told("FENCE_ENABLE", 1), told("FENCE_TYPE", 4), told("FENCE_TYPE", 5))
    assert bench.vehicle.state.fence_kinds_untaken == 1
    bench.now_s += 5.0
    bench.hear(heartbeat(), attitude(105_000))
    bench.hear(told("FENCE_ENABLE", 1), told("FENCE_TYPE", 5))
    assert bench.vehicle.state.fence_kinds_untaken == 1
    for t_boot_ms in (300, 900, 1500):
        bench.now_s += 0.6
        bench.hear(attitude(t_boot_ms))
    assert bench.vehicle.state.fence_kinds_untaken == 0
