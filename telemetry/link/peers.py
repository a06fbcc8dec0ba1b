"""Who is heard, and who of them is the one vehicle that is commanded.

An autopilot that is heard is a candidate: nothing is sent to it until it is adopted. The adopted vehicle is pinned to
where it was heard: messages with its numbers that come from elsewhere are another vehicle's and never mix in. A port
is part of where: when the vehicle falls silent and its numbers are heard from another one, the operator says whether
that is it.

A connection that the operator has named as a way to the vehicle is another place of it: the first one there with its
numbers is heard as "asked" until ``ways`` has compared its clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from telemetry.link.onboard import Started
from telemetry.mavlink.actions import Message
from telemetry.mavlink.connections import Peer
from telemetry.mavlink.reduce import autopilot_name, is_vehicle_heartbeat
from telemetry.topics.messages import LOST_S, Candidate
from telemetry.topics.obstacles import AvoidBy

FORGET_S = 10.0
"""A candidate that has been silent for this long is not offered any more."""
MOST_CANDIDATES = 32
TRY_S = 10.0
"""Who is asked for longer than this on a way makes room for the next one with the same numbers."""
REFUSED_S = 60.0
"""Who was another vehicle on a way is asked again after this: its id tells no vehicles apart."""
WARN_S = 5.0
"""How long a second vehicle with the same numbers is warned of after it was last heard."""

Verdict = Literal["adopted", "asked", "stranger", "imposter"]


@dataclass(frozen=True, slots=True)
class Source:
    """Where a message came from."""

    address: str
    peer: Peer
    system_id: int
    component_id: int

    @property
    def id(self) -> str:
        return f"{self.way}/{self.system_id}/{self.component_id}"

    @property
    def way(self) -> str:
        return f"{self.address}/{self.peer}"


@dataclass(frozen=True, slots=True)
class Expected:
    """The vehicle of the node before this one, until it is heard again: it gets its heartbeats meanwhile."""

    vehicle: Candidate
    since_s: float
    may_fly: bool
    avoid_by: AvoidBy | None
    """Avoidance was on when that node ended."""
    ways: tuple[Candidate, ...] = ()
    """Where it was heard last, one for each connection."""
    started: Started = field(default_factory=Started)
    is_given_up: bool = False
    """It was not heard for so long that it counts as gone; it is still known when it does come back."""

    def at(self, address: str) -> Candidate | None:
        return next((place for place in (*self.ways, self.vehicle) if place.address == address), None)


@dataclass(slots=True)
class _Place:
    """Where the vehicle is heard, and nobody else may be there in its name."""

    candidate: Candidate
    since_s: float
    heard_s: float
    is_known: bool
    """False: it is not proven yet that it is the vehicle."""
    is_gone: bool = False
    """The far end hung up: it can come back from another port only."""

    def is_lost(self, now_s: float) -> bool:
        return self.is_gone or now_s - self.heard_s > LOST_S

    def makes_room(self, now_s: float) -> bool:
        return self.is_lost(now_s) or (not self.is_known and now_s - self.since_s > TRY_S)


class Peers:
    def __init__(self) -> None:
        self.adopted: Candidate | None = None
        self._places: dict[str, _Place] = {}
        """Of the adopted vehicle, by connection."""
        self._heard: dict[Source, tuple[Candidate, float]] = {}
        self._imposter: tuple[Source, float] | None = None
        self._adopt_first: dict[str, Candidate | None] = {}
        self._as_way: set[str] = set()
        self._refused: dict[str, float] = {}
        """Ids of those on such connections that turned out to be another vehicle, and when they did."""

    def adopt_first_of(self, address: str, *, wanted: bool, only: Candidate | None = None) -> None:
        """The first autopilot heard on this connection becomes the vehicle, if none is by then.

        ``only``: it must have these numbers, and be heard from where this one was.
        """
        self._adopt_first.pop(address, None)
        if wanted:
            self._adopt_first[address] = only

    def adopts_first_of(self, address: str) -> bool:
        return address in self._adopt_first

    def take_as_way(self, address: str) -> None:
        """Whoever has the vehicle's numbers on this connection may be it, reached another way."""
        self._as_way.add(address)
        self._as_way.update(self._places)  # with two ways, the first one may come back from another port too

    def is_as_way(self, address: str) -> bool:
        return address in self._as_way

    @property
    def places(self) -> tuple[Candidate, ...]:
        """Of the adopted vehicle, known by now."""
        return tuple(place.candidate for place in self._places.values() if place.is_known)

    def place_at(self, address: str) -> Candidate | None:
        """Known by now, or asked."""
        place = self._places.get(address)
        return None if place is None else place.candidate

    def ways_of(self, source: Source) -> tuple[str, str]:
        """Where a signed frame counts, and beside what: nobody else on its connection repeats what the vehicle sent
        there, nor makes repetitions of the vehicle's own frames."""
        place = self.place_at(source.address)
        own = "" if place is None else f"{place.address}/{place.peer}"
        return source.way if own in (source.way, "") else source.address, own

    def candidates(self, now_s: float) -> tuple[Candidate, ...]:
        fresh = (candidate for candidate, heard_s in self._heard.values() if now_s - heard_s < FORGET_S)
        places = [place.candidate for place in self._places.values()]
        return tuple(candidate for candidate in fresh if candidate not in places)

    def find(self, candidate_id: str, now_s: float) -> Candidate | None:
        return next((candidate for candidate in self.candidates(now_s) if candidate.id == candidate_id), None)

    def adopt(self, candidate: Candidate, now_s: float) -> None:
        self.adopted, self._imposter = candidate, None
        self._places = {candidate.address: _Place(candidate, now_s, now_s, is_known=True)}
        self._refused.clear()

    def ask(self, candidate: Candidate, now_s: float) -> None:
        """It may be the adopted vehicle, reached another way."""
        if self._imposter is not None and self._imposter[0].id == candidate.id:
            self._imposter = None
        self._places[candidate.address] = _Place(candidate, now_s, now_s, is_known=False)

    def know(self, address: str, *, is_known: bool = True) -> None:
        """It is; or, after a long silence, that is asked anew."""
        self._places[address].is_known = is_known

    def part(self, address: str, now_s: float, *, refused: bool) -> None:
        """It is not, or nobody can tell any more, or the connection is closed."""
        place = self._places.pop(address, None)
        self._refused = {each: since_s for each, since_s in self._refused.items() if now_s - since_s < REFUSED_S}
        if place is not None and refused:
            self._refused[place.candidate.id] = now_s

    def release(self) -> None:
        """Also forgets the wish to adopt by itself: the operator has just said no."""
        self._adopt_first.clear()
        self.adopted, self._imposter, self._places = None, None, {}

    def gone(self, address: str, peer: Peer) -> bool:
        """The far end hung up: the vehicle can come back from another port only. True: it was one of its places."""
        place = self._places.get(address)
        if place is None or place.candidate.peer != peer:
            return False
        place.is_gone = True
        return True

    def forget(self, address: str) -> None:
        """The connection was taken away."""
        self._adopt_first.pop(address, None)
        self._as_way.discard(address)
        self._places.pop(address, None)
        if self.adopted is not None and self.adopted.address == address:
            self.adopted = next(iter(self.places), self.adopted)
        self._refused = {each: at_s for each, at_s in self._refused.items() if not each.startswith(f"{address}/")}
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

    def may_join(self, source: Source, message: Message, now_s: float) -> bool:
        """This heartbeat may be the adopted vehicle's, on a connection that is named as a way to it and has nobody yet
        who could be it. Only while the vehicle is heard elsewhere: with what else could it be compared?
        """
        adopted = self.adopted
        if adopted is None or source.address not in self._as_way or not is_vehicle_heartbeat(message):
            return False
        there = self._places.get(source.address)
        if there is not None and not there.makes_room(now_s):
            return False
        others = (place for address, place in self._places.items() if address != source.address)
        is_heard = any(place.is_known and not place.is_lost(now_s) for place in others)
        is_refused = now_s - self._refused.get(source.id, -REFUSED_S) < REFUSED_S
        return is_heard and not is_refused and _is_kind_of(adopted, source, message)

    def again(self, now_s: float) -> Candidate | None:
        """Who may be the adopted vehicle, which has fallen silent or hung up, by the numbers. Operators decide."""
        adopted = self.adopted
        if adopted is None or not all(place.is_lost(now_s) for place in self._places.values() if place.is_known):
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
        place = self._places.get(source.address)
        if place is not None and place.candidate.peer == source.peer:
            if source.component_id == adopted.component_id:
                place.heard_s, place.is_gone = now_s, False
            return "adopted" if place.is_known else "asked"
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


def _is_kind_of(vehicle: Candidate, source: Source, message: Message) -> bool:
    kind = (autopilot_name(message.autopilot), message.type)
    return _has_numbers_of(vehicle, source) and kind == (vehicle.autopilot, vehicle.vehicle_type)


def _has_numbers_of(candidate: Candidate, source: Source) -> bool:
    return (candidate.system_id, candidate.component_id) == (source.system_id, source.component_id)


def _is_where(before: Candidate, source: Source) -> bool:
    """Who has called us has another port after every call."""
    if before.address.startswith("tcpin:"):
        return _host(source.peer) == _host(before.peer)
    return source.peer == before.peer


def _host(peer: Peer) -> str:
    return peer.rpartition(":")[0]
