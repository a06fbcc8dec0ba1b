"""All that a vehicle says, by texts and by events, in words and once."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from telemetry.mavlink.actions import Message
from telemetry.mavlink.texts.arming_report import DEBUG, ArmingReport
from telemetry.mavlink.texts.event_reader import EventReader, LostEvents, VehicleEvent
from telemetry.mavlink.texts.event_words import unknown_words, words_of
from telemetry.mavlink.texts.status_texts import Texts, said_key

SAME_S = 2.0
"""What is said by a text and by an event within this time is said once."""
NOTICE = 5
"""MAV_SEVERITY"""
EVENT_KINDS = frozenset({"EVENT", "CURRENT_EVENT_SEQUENCE", "RESPONSE_EVENT_ERROR"})


@dataclass(frozen=True, slots=True)
class HeardWords:
    texts: tuple[tuple[int, str], ...] = ()
    """(severity, words) of what is new."""
    reasons: tuple[str, ...] | None = None
    """All that keeps from arming; None: nothing new of it."""


class Speech:
    def __init__(self, vehicle: tuple[int, int]) -> None:
        self._texts, self._events, self._report = Texts(), EventReader(vehicle), ArmingReport()
        self._said: deque[tuple[float, bool, str]] = deque()
        """When, whether by an event, and what."""
        self._wants_report, self._has_events = False, False

    def on_message(self, message: Message, now_s: float) -> HeardWords:
        kind = message.get_type()
        if kind == "STATUSTEXT":
            return HeardWords(self._once(self._texts.on_message(message, now_s), now_s, by_event=False))
        if kind not in EVENT_KINDS:
            return HeardWords()
        if not self._has_events:
            self._has_events = self._wants_report = True
        return self._on_events(self._events.on_message(message, now_s), now_s)

    def on_tick(self, now_s: float) -> HeardWords:
        """At infinity: nothing is waited for any more."""
        heard = self._on_events(self._events.on_tick(now_s), now_s)
        return HeardWords((*self._once(self._texts.on_tick(now_s), now_s, by_event=False), *heard.texts), heard.reasons)

    def take_requests(self) -> list[Message]:
        """For events that got lost."""
        return self._events.take_requests()

    def take_wish(self) -> bool:
        """Whether a report of what keeps from arming is to be asked for: the last one is not known."""
        wish, self._wants_report = self._wants_report, False
        return wish

    def _on_events(self, events: list[VehicleEvent | LostEvents], now_s: float) -> HeardWords:
        texts: list[tuple[int, str]] = []
        reasons: tuple[str, ...] | None = None
        for event in events:
            is_of_report = self._report.hear(event)
            if isinstance(event, LostEvents):
                self._wants_report = True
                texts.append((NOTICE, _lost_words(event.count)))
            elif (report := self._report.take(event)) is not None:
                reasons = tuple(dict.fromkeys(words for _, words in report))
                texts += self._report.news(report)
            elif not is_of_report and event.severity <= DEBUG:
                texts.append((event.severity, words_of(event) or unknown_words(event)))
        return HeardWords(self._once(texts, now_s, by_event=True), reasons)

    def _once(self, texts: list[tuple[int, str]], now_s: float, *, by_event: bool) -> tuple[tuple[int, str], ...]:
        """What repeats itself is told again: only what came the other way within the time is left out."""
        while self._said and now_s - self._said[0][0] > SAME_S:
            self._said.popleft()
        before = {key for _, was_event, key in self._said if was_event != by_event}
        new = tuple(each for each in texts if said_key(each[1]) not in before)
        self._said.extend((now_s, by_event, said_key(words)) for _, words in new)
        return new


def _lost_words(count: int) -> str:
    return "1 event of the vehicle got lost." if count == 1 else f"{count} events of the vehicle got lost."
