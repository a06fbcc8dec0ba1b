"""Ways of a test's own to one vehicle, in simulated time: what they lose, hold back and answer."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.ways.choosing import ChangeOver, Ways
from telemetry.topics.messages import Candidate
from tests.telemetry.frames import attitude, heard

TICK_S = 0.05
RADIO, WIFI, LTE = "/dev/ttyUSB0:57600", "udpin:0.0.0.0:14550", "tcp:10.0.0.7:5760"


def candidate(address: str) -> Candidate:
    return Candidate(f"{address}/x/1/1", address, "x", 1, 1, "ardupilot", 2)


@dataclass
class Carrier:
    """What a test's way does to packets."""

    hz: float = 20.0
    loss: float = 0.0
    delay_s: float = 0.05
    boot_s: float = -90.0
    """The clock at its far end is so much ahead of ours."""
    cut: bool = False
    deaf: bool = False
    """Nothing that goes out over it arrives."""
    sequence: int = 0
    due_s: float = 0.0
    underway: list[tuple[float, Any]] = field(default_factory=list)


class Field:
    """Ways over carriers in simulated time; ``changes`` with the time of each."""

    def __init__(self, seed: int = 0, *, routed: bool = False, answers: bool = True, **carriers: Carrier) -> None:
        """``routed``: each answer comes over all of them."""
        self._routed, self._answers = routed, answers
        self.now_s, self._random = 100.0, random.Random(seed)
        addresses = {"radio": RADIO, "wifi": WIFI, "lte": LTE}
        self.carriers = {addresses[name]: carrier for name, carrier in carriers.items()}
        first, *others = self.carriers
        self.ways = Ways(candidate(first), self.now_s)
        for address in others:
            self.ways.add(candidate(address))
        self.changes: list[tuple[float, ChangeOver]] = []

    def run(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self._tick()

    def _tick(self) -> None:
        self.now_s += TICK_S
        for address, carrier in self.carriers.items():
            if self.now_s >= carrier.due_s:
                carrier.due_s = self.now_s + 1 / carrier.hz
                self._send(carrier, attitude(), carrier.delay_s)
            arrived = [message for at_s, message in carrier.underway if at_s <= self.now_s]
            carrier.underway = [(at_s, message) for at_s, message in carrier.underway if at_s > self.now_s]
            for message in arrived:
                self.ways.hear(address, message, self.now_s)
        for way, question in self.ways.on_tick(self.now_s):
            carrier = self.carriers[way.address]
            if self._answers and self._random.random() >= carrier.loss and not (carrier.cut or carrier.deaf):
                tc1 = int((self.now_s + carrier.delay_s + carrier.boot_s) * 1e9)
                answer = mavlink.MAVLink_timesync_message(tc1, question.ts1)
                for back in self.carriers.values() if self._routed else [carrier]:
                    self._send(back, answer, carrier.delay_s + back.delay_s)
        self.ways.lapse(self.now_s)
        if (change := self.ways.choose(self.now_s)) is not None:
            self.changes.append((self.now_s, change))

    def _send(self, carrier: Carrier, message: Any, delay_s: float) -> None:
        carrier.sequence = (carrier.sequence + 1) % 256
        if self._random.random() >= carrier.loss and not carrier.cut:
            carrier.underway.append((self.now_s + delay_s, heard(message, sequence=carrier.sequence)))

    @property
    def used(self) -> str:
        return self.ways.chosen.address
