"""All ways to the adopted vehicle, and the one in use: orders go over it alone, and the vehicle's state comes from it.

Another one takes over at once when the one in use falls silent, or when the vehicle answers over the other one and no
more over the one in use; while neither is so, only one that has been clearly better without a break for ``SETTLE_S``.
A way is used when its vehicle is known to be the adopted one. No clock of its own: ``now_s`` is monotonic.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from telemetry.link.ways.copies import ANSWERS, Copies
from telemetry.link.ways.way import UNANSWERED, LinkWay
from telemetry.mavlink.actions import Message
from telemetry.topics.link_ways import WayStatus
from telemetry.topics.messages import Candidate

ASK_EVERY_S = 1.0
SETTLE_S = 5.0
"""How long another one must have been better."""
BETTER, BETTER_S = 0.6, 0.03
"""Better: its cost is below this share of the other's, and by as much less."""


@dataclass(frozen=True, slots=True)
class ChangeOver:
    before: Candidate
    now: Candidate
    why: str
    """Words that follow a colon."""
    is_loss: bool
    """The way before is silent, deaf or gone; False: it is only worse."""


class Ways:
    def __init__(self, candidate: Candidate, now_s: float) -> None:
        """``candidate``: the vehicle, where it was adopted."""
        self._numbers = count(1)
        self.chosen = LinkWay(candidate, identity="known")
        self.chosen.heard_s = now_s
        self._ways = {candidate.address: self.chosen}
        self._copies = Copies()
        self._asked_s = -ASK_EVERY_S
        self._better: tuple[LinkWay, float] | None = None
        """Which way has been better than the one in use, and since when."""

    def __iter__(self) -> Iterator[LinkWay]:
        return iter(self._ways.values())

    def get(self, address: str) -> LinkWay | None:
        return self._ways.get(address)

    @property
    def has_several(self) -> bool:
        return len(self._ways) > 1

    def is_known(self, address: str) -> bool:
        way = self._ways.get(address)
        return way is not None and way.identity == "known"

    def is_prompt(self, address: str, now_s: float) -> bool:
        """What comes over it is of now: it is in use, or a known one that holds nothing back."""
        way = self._ways.get(address)
        return way is self.chosen or (way is not None and way.identity == "known" and way.is_prompt(now_s))

    def add(self, candidate: Candidate) -> None:
        """Who has the vehicle's numbers there; until its clock has been compared nothing of it is used."""
        if candidate.address != self.chosen.address:
            self._ways[candidate.address] = LinkWay(candidate, identity="asked", number=next(self._numbers))

    def remove(self, address: str, now_s: float) -> ChangeOver | None:
        """Not the last one that is known."""
        before = self._ways.pop(address)
        if before is not self.chosen:
            return None
        known = [way for way in self if way.identity == "known"]
        return self._change(min(known, key=lambda way: way.silent_s(now_s)), "it was taken away", is_loss=True)

    def has_other_live(self, address: str, now_s: float) -> bool:
        """A known one, beside the one at this address."""
        others = (way for way in self if way.address != address and way.identity == "known")
        return any(not way.is_lost(now_s) for way in others)

    def has_other_known(self, address: str) -> bool:
        return any(way.identity == "known" for way in self if way.address != address)

    def was_reached_beside(self, address: str) -> bool:
        """Another way was known once, and may come back."""
        return any(way.identity == "known" or way.has_lapsed for way in self if way.address != address)

    def takes(self, address: str, message: Message, now_s: float) -> bool:
        """Whether anything is to be made of this message. To be asked once for each."""
        if not self.is_prompt(address, now_s):
            return False
        if self.has_several and message.get_type() in ANSWERS:
            return self._copies.is_new(address, message, now_s)
        return address == self.chosen.address

    def hear(self, address: str, message: Message, now_s: float) -> None:
        """Of the vehicle's autopilot, whether it is used or not."""
        way = self._ways.get(address)
        reading = None if way is None else way.hear(message, now_s)
        if way is None or reading is None:
            return
        for other in self:
            judged, witness = (other, way) if way is self.chosen else (way, other)
            if way is not other and witness.identity == "known":
                judged.judge(witness, reading.asked_ns, now_s)

    def on_tick(self, now_s: float) -> list[tuple[LinkWay, Message]]:
        """Questions, each to be sent over its way: all at once, so that the answers can be compared."""
        if now_s - self._asked_s < ASK_EVERY_S:
            return []
        self._asked_s = now_s
        return [(way, way.clock.ask(now_s)) for way in self]

    def lapse(self, now_s: float) -> None:
        """Who comes back after a long silence, or calls anew, is compared with the vehicle again while it is heard."""
        for way in self:
            if way is not self.chosen and way.is_lost(now_s):
                way.has_lapsed = True
                if way.identity == "known" and not self.chosen.is_lost(now_s):
                    way.doubt()

    def part(self, now_s: float) -> list[LinkWay]:
        """Ways that turned out to be another vehicle's, or that nothing can be compared with any more: taken out."""
        lost = all(way.is_lost(now_s) for way in self if way.identity == "known")
        out = [way for way in self if way.identity == "other" or (way.identity == "asked" and lost)]
        out = [way for way in out if way is not self.chosen]
        for way in out:
            del self._ways[way.address]
        return out

    def choose(self, now_s: float) -> ChangeOver | None:
        """Looked at on every tick."""
        is_silent = self.chosen.is_silent(now_s)
        ready = [way for way in self if way is not self.chosen and way.is_ready(now_s)]
        if is_silent:
            # Heard later than the one in use: when all fall silent nothing goes back and forth.
            ready = [way for way in ready if way.heard_s > self.chosen.heard_s]
        best = min(ready, key=lambda way: way.cost_s(now_s), default=None)
        if best is None:
            self._better = None
            return None
        if is_silent:
            return self._change(best, _silence(self.chosen.silent_s(now_s)), is_loss=True)
        # A vehicle that answers over no way is one that does not know the question.
        if self.chosen.is_deaf(now_s) and best.clock.answered_beyond(self.chosen.clock) >= UNANSWERED:
            return self._change(best, f"{self.chosen.clock.unanswered(now_s)} questions went unanswered", is_loss=True)
        return self._settle(best, now_s)

    def _settle(self, best: LinkWay, now_s: float) -> ChangeOver | None:
        before_s, now_cost_s = self.chosen.cost_s(now_s), best.cost_s(now_s)
        if now_cost_s >= BETTER * before_s - BETTER_S or now_cost_s == float("inf"):
            self._better = None
            return None
        if self._better is None or self._better[0] is not best:
            self._better = (best, now_s)
        if now_s - self._better[1] < SETTLE_S:
            return None
        return self._change(best, _worse(self.chosen, best, now_s), is_loss=False)

    def _change(self, way: LinkWay, why: str, *, is_loss: bool) -> ChangeOver:
        before, self.chosen = self.chosen, way
        # What the way before brought may be said again: once too often is better than a real repetition unheard.
        self._better, self._copies = None, Copies()
        return ChangeOver(before.candidate, way.candidate, why, is_loss)

    def status(self, now_s: float) -> tuple[WayStatus, ...]:
        return tuple(way.status(now_s, in_use=way is self.chosen) for way in self)


def _silence(silent_s: float) -> str:
    return "the far end hung up" if silent_s == float("inf") else f"it has been silent for {silent_s:.1f} s"


def _worse(before: LinkWay, now: LinkWay, now_s: float) -> str:
    return f"this one is better, {_figures(now, now_s)} instead of {_figures(before, now_s)}"


def _figures(way: LinkWay, now_s: float) -> str:
    share, round_trip_s = way.quality.share(now_s), way.round_trip_s(now_s)
    loss = "nothing heard" if share is None else f"{100 * (1 - share):.0f} % lost"
    return loss if round_trip_s is None else f"{loss} and {1000 * round_trip_s:.0f} ms"
