"""What pages hear of a vehicle: positions at once, nothing too often, ages that go on, a path per flight."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace

import pytest

from server.heard.channel import Channel
from server.heard.present import Present
from server.schemas import FlightMessage, HealthMessage, TextMessage, TrackMessage, VehicleMessage
from telemetry.topics.messages import FlightStatus, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told

STATE = VehicleState(1, 1, lat_deg=37.0, lon_deg=15.0, alt_rel_home_m=10.0, position_t_mono_s=0.0)


class Bench:
    """A channel on a clock of its own."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.told = Told()
        self.present = Present(self.told)
        self.channel = Channel("live", self.present, now_mono_s=lambda: self.now_s)

    def vehicles(self) -> list[VehicleMessage]:
        return [message for message in self.told if isinstance(message, VehicleMessage)]


def run(scenario: Callable[[Bench], None]) -> None:
    async def whole() -> None:
        bench = Bench()
        try:
            scenario(bench)
        finally:
            bench.channel.close()

    asyncio.run(whole())


@pytest.mark.fact("A18")
def test_a_position_is_told_at_once() -> None:
    def scenario(bench: Bench) -> None:
        for step in range(15):
            bench.now_s += 0.05
            bench.channel.on_state(replace(STATE, position_t_mono_s=bench.now_s, t_utc_s=float(step)))
            assert bench.vehicles()[-1].state == bench.channel.state
            assert bench.vehicles()[-1].now_mono_s == bench.now_s

    run(scenario)


def test_a_fast_replay_does_not_flood_the_pages() -> None:
    def scenario(bench: Bench) -> None:
        for _ in range(2000):
            bench.now_s += 0.001
            bench.channel.on_state(replace(STATE, position_t_mono_s=bench.now_s))
        assert len(bench.vehicles()) <= 2 * 20 + 20

    run(scenario)


def test_health_is_told_once_a_second_when_it_changes_and_ends_with_the_vehicle() -> None:
    def scenario(bench: Bench) -> None:
        def heard() -> list[HealthMessage]:
            return [message for message in bench.told if isinstance(message, HealthMessage)]

        for share in (0.9, 0.8, 0.8):
            for _ in range(10):
                bench.now_s += 0.1
                changes = {"position_t_mono_s": bench.now_s, "battery_t_mono_s": bench.now_s, "battery_share": share}
                bench.channel.on_state(replace(STATE, **changes))
        batteries = [next(row.value for row in message.rows if row.code == "battery") for message in heard()]
        assert batteries == ["90 %", "80 %"]
        bench.now_s += 30.0
        bench.channel.tick()
        assert any("Not heard for 30 s" in row.value for row in heard()[-1].rows)
        opened = [message for message in bench.present.messages() if isinstance(message, HealthMessage)]
        assert opened == [heard()[-1]]
        bench.channel.forget()
        assert heard()[-1].rows == []

    run(scenario)


def test_what_is_no_position_waits_a_little() -> None:
    async def whole() -> None:
        bench = Bench()
        bench.channel.on_state(STATE)
        bench.channel.on_state(replace(STATE, battery_v=11.1))
        assert len(bench.vehicles()) == 1
        async with asyncio.timeout(30):
            while len(bench.vehicles()) < 2:
                await asyncio.sleep(0.01)
        assert bench.vehicles()[-1].state == replace(STATE, battery_v=11.1)
        bench.channel.close()

    asyncio.run(whole())


def test_ages_run_when_nothing_is_heard() -> None:
    def scenario(bench: Bench) -> None:
        bench.channel.tick()
        assert bench.told == []
        bench.channel.on_state(STATE)
        bench.now_s += 0.5
        bench.channel.tick()
        assert len(bench.vehicles()) == 1
        bench.now_s += 0.6
        bench.channel.tick()
        assert bench.vehicles()[-1].now_mono_s == bench.now_s

    run(scenario)


def test_each_flight_has_a_path_of_its_own() -> None:
    def scenario(bench: Bench) -> None:
        def fly(armed: bool, seconds: int) -> None:
            for _ in range(seconds):
                bench.now_s += 1.0
                state = replace(STATE, armed=armed, position_t_mono_s=bench.now_s, t_utc_s=bench.now_s)
                bench.channel.on_state(state)

        fly(False, 3)
        assert bench.channel.track.doc("live").t_s == []
        fly(True, 5)
        fly(False, 2)
        assert len(bench.channel.track.doc("live").t_s) == 5
        fly(True, 2)
        assert len(bench.channel.track.doc("live").t_s) == 2
        tracks = [message for message in bench.told if isinstance(message, TrackMessage)]
        assert [len(message.track.t_s) for message in tracks] == [0, 0]

    run(scenario)


def test_a_flight_that_began_before_the_server_did_gets_its_beginning() -> None:
    def scenario(bench: Bench) -> None:
        bench.channel.on_state(replace(STATE, armed=True, t_utc_s=50.0, position_t_mono_s=1.0))
        bench.channel.prepend([replace(STATE, armed=True, t_utc_s=float(t)) for t in range(40, 50)])
        assert bench.channel.track.t_utc_s == [float(t) for t in range(40, 51)]

    run(scenario)


def test_a_page_that_opens_later_is_told_the_present_and_the_last_words() -> None:
    def scenario(bench: Bench) -> None:
        bench.channel.on_state(STATE)
        bench.channel.on_flight(FlightStatus(phase="flying"))
        bench.channel.on_flight(FlightStatus(phase="landed"))
        for number in range(70):
            bench.channel.on_text(VehicleText(float(number), 6, f"Words {number}"))
        told = bench.present.messages()
        assert [m.flight.phase for m in told if isinstance(m, FlightMessage)] == ["landed"]
        assert [m.text.text for m in told if isinstance(m, TextMessage)] == [f"Words {n}" for n in range(20, 70)]
        assert [m.state for m in told if isinstance(m, VehicleMessage)] == [STATE]

    run(scenario)


def test_a_closed_replay_is_forgotten_and_the_live_vehicle_is_not() -> None:
    def scenario(bench: Bench) -> None:
        replayed = Channel("replay", bench.present, now_mono_s=lambda: bench.now_s)
        for channel in (bench.channel, replayed):
            channel.on_state(STATE)
            channel.on_text(VehicleText(0.0, 6, "Hello"))
        bench.present.forget_replay()
        sources = {getattr(message, "source", "live") for message in bench.present.messages()}
        assert sources == {"live"}
        replayed.close()

    run(scenario)
