"""One way to the vehicle: what it loses, how long an answer takes, and whether the same vehicle is at its end.

Two vehicles may have the same numbers. The clock since boot tells them apart: all ways are asked for it at one moment,
and each answer is wrong by half its round trip at most. Positions, where both ways carry them, must not lie far apart.
"""

from __future__ import annotations

from mapping.geometry.frames import apart_m
from telemetry.link.ways.quality import ClockReading, RoundTripClock, SequenceQuality
from telemetry.mavlink.actions import Message
from telemetry.mavlink.reduce import lat_lon
from telemetry.topics.link_ways import RadioSignal, WayIdentity, WayStatus
from telemetry.topics.messages import LOST_S, STALE_S, Candidate

SILENT_S = 0.7
"""A way that carries many messages is silent after this."""
MISSED = 4.0
"""Messages in a row that a way which carries few may miss, up to ``STALE_S``."""
RESEND_S = 0.7
"""What the cost of a loss is counted with: an order that was lost goes out again so much later."""
LEAST_SHARE = 0.05
SHARE_SLACK = 0.2
"""The share of so few answers is wrong by so much."""
UNANSWERED, MOST_UNANSWERED, CHANCE = 3, 15, 0.005
"""A way that brings messages is deaf after so many questions in a row without an answer: the fewest, the most, and how
likely it may be that losses explain them, twice as many there as here."""
SLACK_S = 0.1
"""Between two clocks of one vehicle, beyond what the round trips explain."""
TELLS_S = 1.5
"""Round trips that together are longer tell nothing of the clocks."""
AGREES, DIFFERS = 2, 3
"""So many answers in a row decide."""
FAR_M, FRESH_S = 300.0, 2.0
"""No vehicle is in two places so far apart within the time that both are fresh."""
SIGNAL_S = 10.0
PROMPT_S = 2.0
"""What a spare way brings counts while its last answer is younger than this, and took no longer."""


class LinkWay:
    """``identity`` "asked": by its numbers it is the vehicle, by its clock it is not known yet to be."""

    def __init__(self, candidate: Candidate, *, identity: WayIdentity, number: int = 0) -> None:
        self.candidate = candidate
        self.identity: WayIdentity = identity
        self.heard_s = float("-inf")
        self.has_lapsed = False
        """It was silent for so long that another one may have taken its place, and has not been compared since."""
        self.quality, self.clock = SequenceQuality(), RoundTripClock(number)
        self._signal: tuple[RadioSignal, float] | None = None
        self._place: tuple[tuple[float, float], float] | None = None
        self._agreed = self._differed = 0

    @property
    def address(self) -> str:
        return self.candidate.address

    def hear(self, message: Message, now_s: float) -> ClockReading | None:
        """A message of the vehicle's autopilot that came over this way."""
        reading = self.clock.on_message(message, now_s)
        if self.is_silent(now_s):
            self.clock.forget_unanswered(now_s)
        self.heard_s = now_s
        self.quality.hear(message.get_seq(), now_s)
        if message.get_type() == "GLOBAL_POSITION_INT":
            lat_deg, lon_deg = lat_lon(message.lat, message.lon)
            if lat_deg is not None and lon_deg is not None:
                self._place = ((lat_deg, lon_deg), now_s)
        return reading

    def hear_radio(self, message: Message, now_s: float) -> None:
        """RADIO_STATUS of the radio at this end."""
        self._signal = (RadioSignal(message.rssi, message.noise, message.remrssi, message.remnoise), now_s)

    def gone(self) -> None:
        """The far end hung up: nothing is waited for."""
        self.heard_s = float("-inf")

    def is_lost(self, now_s: float) -> bool:
        return self.silent_s(now_s) > LOST_S

    def silent_s(self, now_s: float) -> float:
        return now_s - self.heard_s

    def is_silent(self, now_s: float) -> bool:
        """Sooner where much is heard: one message a second leaves gaps of its own."""
        hz = self.quality.hz(now_s)
        limit_s = STALE_S if hz == 0 else min(max(SILENT_S, MISSED / hz), STALE_S)
        return self.silent_s(now_s) > limit_s

    def is_deaf(self, now_s: float) -> bool:
        """The vehicle does not hear what goes out over it: its answers are missing, whatever else comes."""
        missing, share = self.clock.unanswered(now_s), self.quality.share(now_s)
        by_chance = 0.0 if share is None else (1 - share**3) ** missing
        return missing >= MOST_UNANSWERED or (missing >= UNANSWERED and by_chance < CHANCE)

    def is_prompt(self, now_s: float) -> bool:
        """False: it may be bringing what it held back. That would be taken for something new."""
        took_s = self.clock.round_trip_s
        return took_s is not None and took_s < PROMPT_S and now_s - self.clock.answered_s <= PROMPT_S

    def round_trip_s(self, now_s: float) -> float | None:
        """None also when answers are missing: what was measured before says nothing any more."""
        return None if self.is_deaf(now_s) else self.clock.round_trip_s

    def is_ready(self, now_s: float) -> bool:
        """It may be used."""
        return self.identity == "known" and not self.is_silent(now_s)

    def cost_s(self, now_s: float) -> float:
        """How long an order takes until it is answered, the repetitions of what is lost either way in it."""
        share, round_trip_s = self.quality.share(now_s), self.round_trip_s(now_s)
        if share is None or round_trip_s is None:
            return float("inf")
        answered = self.clock.share(now_s)
        both = share**2 if answered is None else min(share**2, answered + SHARE_SLACK)
        return round_trip_s + RESEND_S * (1 / max(both, LEAST_SHARE**2) - 1)

    def doubt(self) -> None:
        """It is asked anew, as one that was never known."""
        self.identity, self._agreed, self._differed = "asked", 0, 0

    def judge(self, witness: LinkWay, asked_ns: int, now_s: float) -> None:
        """Held against one that is known to be the vehicle's, by the question that both were asked at once."""
        same = self._is_same(witness, asked_ns, now_s)
        if same is None:
            return
        self._agreed, self._differed = (self._agreed + 1, 0) if same else (0, self._differed + 1)
        if self._differed >= DIFFERS and not witness.has_lapsed:
            self.identity = "other"
        elif self._agreed >= AGREES and self.identity != "other":
            self.identity, self.has_lapsed, witness.has_lapsed = "known", False, False

    def _is_same(self, witness: LinkWay, asked_ns: int, now_s: float) -> bool | None:
        ours, theirs = self.clock.reading(asked_ns), witness.clock.reading(asked_ns)
        if ours is None or theirs is None:
            return None
        both_s = ours.round_trip_s + theirs.round_trip_s
        if both_s > TELLS_S:
            return None
        return abs(ours.ahead_s - theirs.ahead_s) <= both_s / 2 + SLACK_S and not self._is_far(witness, now_s)

    def _is_far(self, witness: LinkWay, now_s: float) -> bool:
        ours, theirs = self._place, witness._place
        if ours is None or theirs is None or now_s - min(ours[1], theirs[1]) > FRESH_S:
            return False
        return apart_m(ours[0], theirs[0]) > FAR_M

    def status(self, now_s: float, *, in_use: bool) -> WayStatus:
        signal = self._signal
        return WayStatus(
            address=self.address,
            peer=self.candidate.peer,
            identity=self.identity,
            in_use=in_use,
            silent_s=None if self.heard_s == float("-inf") else self.silent_s(now_s),
            quality=self.quality.share(now_s),
            round_trip_s=self.round_trip_s(now_s),
            signal=signal[0] if signal is not None and now_s - signal[1] < SIGNAL_S else None,
        )
