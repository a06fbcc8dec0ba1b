"""What is flown instead of the mission: its kinds, its phases, and what leads from one phase to the next.

Bigazzi 2022, figs 9-10: velocity V1 until something is inside the region, then V2 (climb) until it is clear, then V1
again at the new altitude. Before the climb the vehicle is brought to a stand: it does not drift into what it saw.
Where it stands too near to see what is in the way, it first goes back on the way that it came.

    idle       step aside -> aside
    stopping   stands -> taking, unheard -> stopping
    taking     not guided -> taking, ordered on -> going, too near -> backing, guided -> climbing
    backing    still unseen -> holding, backed -> climbing
    climbing   unsure -> holding, clear -> levelling, highest -> ceiling, occupied -> climbing
    levelling  unsure -> holding, seen again -> climbing, level -> going
    going      way flown -> going, flown for good -> holding, flown -> ending, under way -> going,
               silent -> holding, blocked -> holding, beyond fence -> holding, step aside -> aside,
               lower line -> going
    holding    unheard -> holding, sure again -> taking, resumed -> stopping
    ceiling    clear at last -> levelling
    ending     returns -> idle
    aside      on its line -> going, no way past -> going, switched off -> holding
    any        obstacle -> stopping, way ordered -> stopping, sidestep ordered -> taking, paused -> holding

An event that a phase does not name changes nothing in it. Those that a look may find are looked for in this order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import Sensor

Phase = Literal[
    "idle", "stopping", "taking", "backing", "climbing", "levelling", "going", "holding", "ceiling", "ending", "aside"
]
Event = Literal[
    "stands",
    "unheard",
    "not guided",
    "ordered on",
    "too near",
    "guided",
    "still unseen",
    "backed",
    "unsure",
    "clear",
    "highest",
    "occupied",
    "seen again",
    "level",
    "way flown",
    "flown for good",
    "flown",
    "under way",
    "sure again",
    "returns",
    "on its line",
    "obstacle",
    "way ordered",
    "sidestep ordered",
    "step aside",
    "no way past",
    "switched off",
    "lower line",
    "blocked",
    "beyond fence",
    "silent",
    "paused",
    "resumed",
    "clear at last",
]

ANY: dict[Event, Phase] = {
    "obstacle": "stopping",
    "way ordered": "stopping",
    "sidestep ordered": "taking",
    "paused": "holding",
}
TABLE: dict[Phase, dict[Event, Phase]] = {
    "idle": {"step aside": "aside"},
    "stopping": {"stands": "taking", "unheard": "stopping"},
    "taking": {"not guided": "taking", "ordered on": "going", "too near": "backing", "guided": "climbing"},
    "backing": {"still unseen": "holding", "backed": "climbing"},
    "climbing": {"unsure": "holding", "clear": "levelling", "highest": "ceiling", "occupied": "climbing"},
    "levelling": {"unsure": "holding", "seen again": "climbing", "level": "going"},
    "going": {
        "way flown": "going",
        "flown for good": "holding",
        "flown": "ending",
        "under way": "going",
        "silent": "holding",
        "blocked": "holding",
        "beyond fence": "holding",
        "step aside": "aside",
        "lower line": "going",
    },
    "holding": {"unheard": "holding", "sure again": "taking", "resumed": "stopping"},
    "ceiling": {"clear at last": "levelling"},
    "ending": {"returns": "idle"},
    "aside": {"on its line": "going", "no way past": "going", "switched off": "holding"},
}


def next_phase(phase: Phase, event: Event) -> Phase | None:
    """None: the event changes nothing in this phase."""
    own = TABLE[phase]
    return own[event] if event in own else ANY.get(event)


@dataclass(frozen=True, slots=True)
class Avoid:
    """Up until it is clear, then on with the mission, that much higher."""

    least_m: float = 0.0
    """Above home: to this height it climbs at least."""
    is_manoeuvre: ClassVar[bool] = False
    climbs_over: ClassVar[bool] = True
    """What is in the way is climbed over, and must be seen to be clear before it goes on."""


@dataclass(frozen=True, slots=True)
class Along:
    """On with the mission, by stepping aside or after a way past something: nothing is climbed over."""

    least_m: float = 0.0
    is_manoeuvre: ClassVar[bool] = False
    climbs_over: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class Way:
    """A prepared way, then the rest of the mission ``offset_m`` higher than planned."""

    places: tuple[GuidedTarget, ...]
    """Still to be flown, at their planned heights."""
    offset_m: float
    lookouts: frozenset[Sensor] = frozenset()
    """Who is counted on along it: those who saw what it leads past, else all that work."""
    from_m: float = 0.0
    least_m: float = 0.0
    is_manoeuvre: ClassVar[bool] = True
    climbs_over: ClassVar[bool] = False

    @property
    def flown(self) -> Avoid | Along:
        """What follows once its places are flown."""
        return Avoid(self.least_m) if self.climbs_over else Along(self.least_m)


@dataclass(frozen=True, slots=True)
class Over(Way):
    """Over something, whose top may not have been seen yet: it climbs on while it is not clear."""

    climbs_over: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Past(Way):
    """Beside something, of which it has seen only what was in sight: what is in its way there stops it."""


@dataclass(frozen=True, slots=True)
class Sidestep(Way):
    """Past what moves, at once: who brakes there stays where it is expected, and its own echoes would stop it."""


Variant = Avoid | Along | Over | Past | Sidestep


def raised(targets: tuple[GuidedTarget, ...], by_m: float) -> tuple[GuidedTarget, ...]:
    return tuple(replace(t, alt_rel_home_m=t.alt_rel_home_m + by_m) for t in targets)
