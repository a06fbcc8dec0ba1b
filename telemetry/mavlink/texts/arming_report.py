"""What keeps PX4 from arming, of its report by events: a summary, one event for each reason, another summary."""

from __future__ import annotations

from telemetry.mavlink.texts.event_reader import LostEvents, VehicleEvent
from telemetry.mavlink.texts.event_words import (
    ARMING_SUMMARY,
    HEALTH_SUMMARY,
    is_news,
    kept_from,
    unknown_words,
    words_of,
)

FLOWN_MODES = 1 << 3 | 1 << 4 | 1 << 5 | 1 << 17 | 1 << 18
"""Mission, Hold, Return, Take-off and Land: what keeps from others alone, as from flying by hand, is no reason here."""
DEBUG = 7
"""MAV_SEVERITY; the levels above are not for people."""


class ArmingReport:
    def __init__(self) -> None:
        self._reasons: list[tuple[int, str]] | None = None
        """(severity, words) of the report that is under way."""
        self._last: frozenset[str] = frozenset()

    def hear(self, event: VehicleEvent | LostEvents) -> bool:
        """Whether it belongs to a report."""
        if isinstance(event, LostEvents):
            self._reasons = None
            return False
        if event.id == ARMING_SUMMARY:
            self._reasons = []
            return True
        if self._reasons is None or event.id == HEALTH_SUMMARY:
            return event.id == HEALTH_SUMMARY
        if is_news(event):
            return False
        modes, about = kept_from(event)
        words = words_of(event)
        if modes & FLOWN_MODES and event.severity <= DEBUG:
            self._reasons.append((event.severity, words or f"{unknown_words(event)}, about: {about}"))
        return True

    def take(self, event: VehicleEvent | LostEvents) -> list[tuple[int, str]] | None:
        """The report that ends with this event."""
        if isinstance(event, LostEvents) or event.id != HEALTH_SUMMARY:
            return None
        report, self._reasons = self._reasons, None
        return report

    def news(self, report: list[tuple[int, str]]) -> list[tuple[int, str]]:
        """What was not in the report before."""
        new = [each for each in report if each[1] not in self._last]
        self._last = frozenset(words for _, words in report)
        return new
