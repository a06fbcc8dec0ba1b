"""The simulated PX4's events, heard by what hears a real one's."""

from __future__ import annotations

import random
from typing import Any, cast

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.flight.preflight.checks import ready_row
from telemetry.link.adopted import AdoptedVehicle, Telling
from telemetry.link.line import Line
from telemetry.mavlink.address import parse_address
from telemetry.mavlink.texts.event_messages import RequestEvent
from telemetry.topics.messages import Candidate
from tests.telemetry.frames import heard
from tests.telemetry.simulator_bench import Bench

CANDIDATE = Candidate("id", "tcp:127.0.0.1:5760", "127.0.0.1:5760", 1, 1, "px4", 2)
ARM, SET_MODE = 400, 176
LAND, MISSION = 6, 4


class Station:
    """The station's end of a link that loses a share of what the vehicle says."""

    def __init__(self, bench: Bench, *, loss: float = 0.0) -> None:
        self.address, self.text = parse_address("tcp:127.0.0.1:5760"), "tcp:127.0.0.1:5760"
        self.texts: list[str] = []
        self.sent: list[str] = []
        self._bench, self._loss, self._chance, self._read = bench, loss, random.Random(3), 0
        telling = Telling(
            state=lambda _: None, text=lambda _, text: self.texts.append(text), unsure=lambda: None, sent=lambda _: None
        )
        self.vehicle = AdoptedVehicle(CANDIDATE, cast(Line, self), telling, lambda: bench.now_s)

    def send(self, message: Any, peer: str | None = None) -> bytes:
        self.sent.append(message.get_type())
        self._bench.send(message)
        return b"frame"

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self._bench.advance(0.1)
            while self._read < len(self._bench.heard):
                message = self._bench.heard[self._read].message
                self._read += 1
                lost = message.get_type() in ("EVENT", "STATUSTEXT") and self._chance.random() < self._loss
                if not lost:
                    self.vehicle.on_message(heard(message), 1.7e9)
            self.vehicle.on_tick()


def mode(bench: Bench, sub: int) -> None:
    bench.send(wire.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 4, sub, 0, 0, 0, 0))


def test_what_keeps_from_arming_is_told_where_the_start_is_checked() -> None:
    bench = Bench(make="px4")
    station = Station(bench)
    bench.advance(2.0)
    mode(bench, LAND)
    station.advance(6.0)
    reasons = ("Mode not suitable for arming", "No valid mission available")
    assert station.vehicle.state.not_ready_words == reasons
    assert sorted(text for text in station.texts if text in reasons) == sorted(reasons), "told once each"
    assert all(reason in ready_row(station.vehicle.state).text for reason in reasons)


def test_a_station_that_comes_late_asks_for_the_report_and_once() -> None:
    bench = Bench(make="px4")
    mode(bench, LAND)
    bench.advance(20.0)
    bench.heard.clear()
    station = Station(bench)
    station.advance(8.0)
    assert "Mode not suitable for arming" in station.vehicle.state.not_ready_words
    assert len([each for each in bench.of("COMMAND_ACK") if each.message.command == 401]) == 1


def test_all_of_a_flight_is_told_though_a_third_gets_lost() -> None:
    bench = Bench(make="px4")
    station = Station(bench, loss=0.35)
    station.advance(4.0)
    bench.send(wire.MAVLink_command_long_message(1, 1, 22, 0, 0, 0, 0, 0, 0, 0, float("nan")))
    bench.send(wire.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0))
    station.advance(20.0)
    mode(bench, LAND)
    station.advance(40.0)
    told = [text for text in station.texts if text.startswith(("Armed by", "Takeoff", "Landing", "Disarmed by"))]
    assert list(dict.fromkeys(told)) == [
        "Armed by external command", "Takeoff detected", "Landing detected", "Disarmed by landing",
    ]  # fmt: skip
    assert not any("lost" in text for text in station.texts)


def test_what_it_has_no_more_it_says() -> None:
    bench = Bench(make="px4")
    for _ in range(20):
        bench.send(wire.MAVLink_command_long_message(1, 1, 401, 0, 0, 0, 0, 0, 0, 0, 0))
        bench.advance(0.1)
    newest = bench.last("EVENT").sequence
    answers = bench.send(RequestEvent(1, 1, 0, 1))
    assert [(each.get_type(), each.sequence) for each in answers] == [("RESPONSE_EVENT_ERROR", 0)]
    assert answers[0].sequence_oldest_available == newest - 31
    assert [each.sequence for each in bench.send(RequestEvent(1, 1, newest - 1, newest))] == [newest - 1, newest]
