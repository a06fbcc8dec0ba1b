"""Another station's list of recordings: asked for page by page, put together only of one edition, bounded."""

from __future__ import annotations

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import (
    MOST_OFFERED,
    OFFERS_AT_ONCE,
    ListAsk,
    ListGive,
    recording_there,
)
from telemetry.topics.station_recordings import ListState, RecordingThere, StationRecordings

AGAIN_S, TRIES = 3.0, 5
UNREAD_AGAIN_S, MOST_ROUNDS = 5.0, 60
"""While another station computes SHA-256 its list grows; it is not asked for ever."""
NOT_ANSWERED = (
    "{station} does not answer about recordings. Its Hedgehop may be older, or the router's file: make that anew with "
    "hedgehop stations, and restart the router with it."
)


class Listing:
    """Sans-IO: of one station. What is there stays on show while it is asked for anew."""

    def __init__(self, station: str) -> None:
        self._station = station
        self._state: ListState = "asking"
        self._text = ""
        self._as_of_s: float | None = None
        self._whole: tuple[RecordingThere, ...] = ()
        self._edition: int | None = None
        self._unread = 0
        self._pages: dict[int, ListGive] = {}
        self._next, self._again_s, self._tries, self._rounds = 0, 0.0, 0, 0

    def ask(self) -> None:
        self._rounds = 0
        if self._state != "asking":
            self._begin()

    def due(self, now_s: float, *, is_live: bool) -> ListAsk | None:
        if not is_live or now_s < self._again_s:
            return None
        if self._state == "listed" and self._unread and self._rounds < MOST_ROUNDS:
            self._rounds += 1
            self._begin()
        if self._state != "asking":
            return None
        if self._tries >= TRIES:
            self._state, self._text = "silent", NOT_ANSWERED.format(station=self._station)
            return None
        self._tries += 1
        self._again_s = now_s + AGAIN_S
        return ListAsk(self._next)

    def on_list(self, given: ListGive, now_s: float) -> None:
        """Raises StationsError: more than may be offered."""
        if self._state not in ("asking", "silent"):
            return
        if not given.is_on:
            self._state, self._as_of_s, self._whole = "off", now_s, ()
            self._text = f"{self._station} offers no recordings: that is switched off there."
            return
        if given.total > MOST_OFFERED:
            self._state, self._text = "silent", f"{self._station} lists more recordings than may be listed."
            raise StationsError(self._text)
        if self._edition not in (None, given.edition):
            self._rounds += 1
            self._begin_pages()
            if self._rounds >= MOST_ROUNDS:
                self._state, self._text = "silent", f"The list of {self._station} changes all the time: ask again."
            return
        if given.first != self._next:
            return
        self._state, self._edition, self._tries, self._again_s = "asking", given.edition, 0, now_s
        self._pages[given.first] = given
        self._next = given.first + OFFERS_AT_ONCE
        if self._next >= given.total:
            self._finish(given, now_s)

    def _begin(self) -> None:
        self._state, self._tries, self._again_s = "asking", 0, 0.0
        self._begin_pages()

    def _begin_pages(self) -> None:
        self._edition, self._next = None, 0
        self._pages.clear()

    def _finish(self, last: ListGive, now_s: float) -> None:
        found, wrong = dict[str, RecordingThere](), list[str]()
        for _, page in sorted(self._pages.items()):
            for each in page.offers:
                try:
                    there = recording_there(each)
                except StationsError as error:
                    wrong.append(f"{error.what} {error.advice}")
                else:
                    found.setdefault(there.sha256, there)
        self._whole, self._as_of_s, self._state = tuple(found.values())[:MOST_OFFERED], now_s, "listed"
        self._unread = last.unread
        unread = f"{last.unread} more are still being read there." if last.unread else ""
        more = f" {len(wrong) - 1} others are like that." if len(wrong) > 1 else ""
        self._text = " ".join(filter(None, (unread, wrong[0] + more if wrong else "")))
        self._again_s = now_s + UNREAD_AGAIN_S
        self._begin_pages()

    def recording(self, sha256: str) -> RecordingThere | None:
        return next((each for each in self._whole if each.sha256 == sha256), None)

    def status(self) -> StationRecordings:
        return StationRecordings(self._station, self._state, self._as_of_s, self._text, self._whole)
