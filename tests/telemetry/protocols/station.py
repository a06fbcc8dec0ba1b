"""A plain ground station before the simulated vehicle of either make: every message as the standard has it, resent
after its time, over a link that may lose a share of them. Nothing of Hedgehop's own machines is in it."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from tests.telemetry.simulator_bench import Bench

MAKES = ("ardupilot", "px4")
LAT, LON = -371244507, 1756892878
ACCEPTED, ERROR, UNSUPPORTED, NO_SPACE, INVALID_SEQUENCE, CANCELLED = 0, 1, 3, 4, 13, 15
REQUESTS = ("MISSION_REQUEST", "MISSION_REQUEST_INT")
MISSION, FENCE, ALL = 0, 1, 255
AGAIN_S, ITEM_AGAIN_S, TRIES = 1.5, 0.25, 40
"""After so long without an answer the standard has the last message sent again; an item sooner."""


def place(seq: int, *, kind: int = MISSION, **changes: Any) -> Any:
    """A place 1.1 m further north and 1 m higher for each number."""
    fields: dict[str, Any] = {"frame": 3, "command": 16, "x": LAT + 100 * seq, "y": LON, "z": 10.0 + seq, **changes}
    return wire.MAVLink_mission_item_int_message(
        1, 1, seq, fields["frame"], fields["command"], 0, 1, 0, 0, 0, 0, fields["x"], fields["y"], fields["z"], kind
    )


def places(count: int) -> list[Any]:
    return [place(seq) for seq in range(count)]


class Station:
    """``loss`` is the share of messages that is lost in each direction."""

    def __init__(self, make: str, *, loss: float = 0.0, seed: int = 0) -> None:
        self.make = make
        self.bench = Bench(make=make)
        self.bench.until(lambda: self.bench.vehicle.autopilot.position_ok)
        self.bench.advance(1.2)
        self._loss, self._random = loss, random.Random(seed)
        self._read = len(self.bench.heard)
        self._waiting: list[Any] = []
        self.sent = 0

    @property
    def first_seq(self) -> int:
        """Of the items that are kept as they came: ArduPilot's first is home."""
        return 1 if self.make == "ardupilot" else 0

    def say(self, message: Any, **sender: Any) -> None:
        """Sent, and perhaps lost."""
        self.sent += 1
        if self._random.random() >= self._loss:
            self.bench.send(message, **sender)

    def hear(self, *kinds: str, limit_s: float = AGAIN_S) -> Any | None:
        """The next message of these kinds; None: none came in time."""
        end_s = self.bench.now_s + limit_s
        while True:
            self._take_in()
            for at, message in enumerate(self._waiting):
                if message.get_type() in kinds:
                    del self._waiting[: at + 1]
                    return message
            self._waiting.clear()
            if self.bench.now_s >= end_s:
                return None
            self.bench.advance(0.02)

    def expect(self, *kinds: str, limit_s: float = AGAIN_S) -> Any:
        """The next message of these kinds, which must come."""
        message = self.hear(*kinds, limit_s=limit_s)
        assert message is not None, f"none of {kinds} within {limit_s} s"
        return message

    def ask(
        self, message: Any, *kinds: str, tell: Callable[[Any], bool] = lambda answer: True, again_s: float = AGAIN_S
    ) -> Any:
        """The answer that ``tell`` accepts, however often it must be asked for."""
        for _ in range(TRIES):
            self.say(message)
            while (answer := self.hear(*kinds, limit_s=again_s)) is not None:
                if tell(answer):
                    return answer
        raise AssertionError(f"no answer to {message.get_type()} after {TRIES} tries")

    def answers(self, message: Any, *, for_s: float = 0.5, **sender: int) -> list[Any]:
        """What comes of it at once and in a while, without streams and heartbeats."""
        self.forget()
        self.say(message, **sender)
        self.bench.advance(for_s)
        self._take_in()
        came, self._waiting = self._waiting, []
        kinds = ("MISSION_", "PARAM_", "COMMAND_ACK", "PING", "AUTOPILOT_VERSION")
        streamed = ("MISSION_CURRENT", "MISSION_ITEM_REACHED")
        return [one for one in came if one.get_type().startswith(kinds) and one.get_type() not in streamed]

    def forget(self) -> None:
        self._take_in()
        self._waiting.clear()

    def upload(self, items: list[Any], kind: int = MISSION) -> int:
        """MAV_MISSION_RESULT. The last message is sent again when nothing comes. An item that ArduCopter calls out of
        its order came once more: it asks for the right one in a while.
        """
        self.forget()
        last: Any = wire.MAVLink_mission_count_message(1, 1, len(items), kind)
        for _ in range(TRIES * (len(items) + 1)):
            self.say(last)
            answer = self.hear(*REQUESTS, "MISSION_ACK", limit_s=ITEM_AGAIN_S)
            if answer is not None and answer.get_type() == "MISSION_ACK":
                if answer.type != INVALID_SEQUENCE:
                    return answer.type
                answer = self.hear(*REQUESTS)
            last = items[answer.seq] if answer is not None else last
        raise AssertionError("the upload never ended")

    def download(self, kind: int = MISSION) -> list[Any]:
        self.forget()
        asked = wire.MAVLink_mission_request_list_message(1, 1, kind)
        count = self.ask(asked, "MISSION_COUNT", tell=lambda answer: answer.mission_type == kind).count
        found = [
            self.ask(
                wire.MAVLink_mission_request_int_message(1, 1, seq, kind),
                "MISSION_ITEM_INT",
                tell=lambda answer, seq=seq: answer.seq == seq,
                again_s=ITEM_AGAIN_S,
            )
            for seq in range(count)
        ]
        self.say(wire.MAVLink_mission_ack_message(1, 1, ACCEPTED, kind))
        return found

    def clear(self, kind: int = MISSION) -> int:
        self.forget()
        return self.ask(wire.MAVLink_mission_clear_all_message(1, 1, kind), "MISSION_ACK").type

    def _take_in(self) -> None:
        new = [one.message for one in self.bench.heard[self._read :]]
        self._read = len(self.bench.heard)
        self._waiting += [message for message in new if self._random.random() >= self._loss]


def same_places(station: Station, found: list[Any], sent: list[Any]) -> bool:
    """Whether what is on board is what was sent: numbers, commands, places and heights."""
    if len(found) != len(sent):
        return False
    pairs = list(zip(found, sent, strict=True))[station.first_seq :]
    return all(
        (one.seq, one.command, one.x, one.y) == (other.seq, other.command, other.x, other.y)
        and abs(one.z - other.z) < 0.01
        for one, other in pairs
    )
