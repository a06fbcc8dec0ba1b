"""Who is heard, and who of them is the one vehicle that is commanded.

An autopilot that is heard is a candidate: nothing is sent to it until it is adopted. The adopted vehicle is pinned to
where it was heard: messages with its numbers that come from elsewhere are another vehicle's and never mix in. A port
is part of where: when the vehicle falls silent and its numbers are heard from another one, the operator says whether
that is it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.mavlink.actions import Message
from telemetry.mavlink.connections import Peer
from telemetry.mavlink.reduce import autopilot_name, is_vehicle_heartbeat
from telemetry.topics.messages import LOST_S, Candidate

FORGET_S = 10.0
"""A candidate that has been silent for this long is not offered any more."""
MOST_CANDIDATES = 32
WARN_S = 5.0
"""How long a second vehicle with the same numbers is warned of after it was last heard."""

Verdict = Literal["adopted", "stranger", "imposter"]


@dataclass(frozen=True, slots=True)
class Source:
    """Where a message came from."""

    address: str
    peer: Peer
    system_id: int
    component_id: int

    @property
    def id(self) -> str:
        return f"{self.address}/{self.peer}/{self.system_id}/{self.component_id}"


class Peers:
    def __init__(self) -> None:
        self.adopted: Candidate | None = None
        self._heard: dict[Source, tuple[Candidate, float]] = {}
        self._vehicle_s = 0.0
        self._imposter: tuple[Source, float] | None = None
        self._adopt_first: dict[str, Candidate | None] = {}
        self._has_gone = False

    def adopt_first_of(self, address: str, *, wanted: bool, only: Candidate | None = None) -> None:
        """The first autopilot heard on this connection becomes the vehicle, if none is by then.

        ``only``: it must have these numbers, and be heard from where this one was.
        """
        self._adopt_first.pop(address, None)
        if wanted:
            self._adopt_first[address] = only

    def adopts_first_of(self, address: str) -> bool:
        return address in self._adopt_first

    def candidates(self, now_s: float) -> tuple[Candidate, ...]:
        fresh = (candidate for candidate, heard_s in self._heard.values() if now_s - heard_s < FORGET_S)
        return tuple(candidate for candidate in fresh if candidate != self.adopted)

    def find(self, candidate_id: str, now_s: float) -> Candidate | None:
        return next((candidate for candidate in self.candidates(now_s) if candidate.id == candidate_id), None)

    def adopt(self, candidate: Candidate, now_s: float) -> None:
        self.adopted, self._vehicle_s, self._imposter = candidate, now_s, None
        self._has_gone = False

    def release(self) -> None:
        """Also forgets the wish to adopt by itself: the operator has just said no."""
        if self.adopted is not None:
            self._adopt_first.pop(self.adopted.address, None)
        self.adopted, self._imposter = None, None

    def gone(self, address: str, peer: Peer) -> None:
        """The far end hung up: the vehicle can come back from another port only."""
        if self.adopted is not None and (self.adopted.address, self.adopted.peer) == (address, peer):
            self._has_gone = True

    def forget(self, address: str) -> None:
        """The connection was taken away."""
        self._adopt_first.pop(address, None)
        self._heard = {source: seen for source, seen in self._heard.items() if source.address != address}

    def hear(self, source: Source, message: Message, now_s: float) -> Verdict:
        """Whose message this is."""
        if self.adopted is not None and source.system_id == self.adopted.system_id:
            verdict = self._hear_adopted(self.adopted, source, message, now_s)
            if verdict != "stranger":
                return verdict
        if is_vehicle_heartbeat(message):
            self._hear_candidate(source, message, now_s)
        return "stranger"

    def wants(self, source: Source, message: Message) -> bool:
        """This heartbeat is the first of a connection whose first autopilot is to be adopted."""
        if self.adopted is not None or source.address not in self._adopt_first or not is_vehicle_heartbeat(message):
            return False
        only = self._adopt_first[source.address]
        return only is None or (_has_numbers_of(only, source) and _is_where(only, source))

    def again(self, now_s: float) -> Candidate | None:
        """Who may be the adopted vehicle, which has fallen silent or hung up, by the numbers. Operators decide."""
        adopted = self.adopted
        if adopted is None or not (self._has_gone or now_s - self._vehicle_s > LOST_S):
            return None
        return next((found for found in self.candidates(now_s) if is_same_vehicle(found, adopted)), None)

    def warnings(self, now_s: float) -> tuple[str, ...]:
        if self.again(now_s) is not None or self._imposter is None or now_s - self._imposter[1] > WARN_S:
            return ()
        source, _ = self._imposter
        return (
            f"A second vehicle with system id {source.system_id} is heard from {source.peer} on {source.address}. "
            "Its messages are ignored; give the vehicles different ids.",
        )

    def _hear_adopted(self, adopted: Candidate, source: Source, message: Message, now_s: float) -> Verdict:
        if (source.address, source.peer) == (adopted.address, adopted.peer):
            if source.component_id == adopted.component_id:
                self._vehicle_s = now_s
            return "adopted"
        if not is_vehicle_heartbeat(message):
            return "imposter"
        self._imposter = (source, now_s)
        return "stranger"

    def _hear_candidate(self, source: Source, message: Message, now_s: float) -> None:
        self._heard.pop(source, None)
        self._heard[source] = (_candidate(source, message), now_s)
        if len(self._heard) > MOST_CANDIDATES:
            del self._heard[next(iter(self._heard))]


def _candidate(source: Source, message: Message) -> Candidate:
    return Candidate(
        id=source.id,
        address=source.address,
        peer=source.peer,
        system_id=source.system_id,
        component_id=source.component_id,
        autopilot=autopilot_name(message.autopilot),
        vehicle_type=message.type,
    )


def is_same_vehicle(before: Candidate, now: Candidate) -> bool:
    """By its numbers, wherever it is heard."""
    return (before.system_id, before.component_id) == (now.system_id, now.component_id)


def _has_numbers_of(candidate: Candidate, source: Source) -> bool:
    return (candidate.system_id, candidate.component_id) == (source.system_id, source.component_id)


def _is_where(before: Candidate, source: Source) -> bool:
    """Who has called us has another port after every call."""
    if before.address.startswith("tcpin:"):
        return _host(source.peer) == _host(before.peer)
    return source.peer == before.peer


def _host(peer: Peer) -> str:
    return peer.rpartition(":")[0]
