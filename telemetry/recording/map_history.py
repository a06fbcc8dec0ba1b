"""What a map was like at any time of a recording: its changes, added up."""

from __future__ import annotations

from bisect import bisect_right, insort
from dataclasses import replace
from operator import itemgetter

import numpy as np

from telemetry.recording.mcap_files.reader import Entry, Recording
from telemetry.topics.deltas import NOTHING, FoldedMap
from telemetry.topics.obstacles import MapDelta

_KEPT_EVERY_S = 30.0
_MOST_KEPT = 12
_Kept = tuple[float, FoldedMap]


class MapHistory:
    """Of one topic. Maps that were added up once are kept, some of them, so that the next search is short."""

    def __init__(self, recording: Recording, topic: str) -> None:
        self._recording, self._topic = recording, topic
        self._kept: list[_Kept] = []

    def at(self, t_utc_s: float) -> list[Entry]:
        """The whole map as messages; an empty one before its first change, nothing if the recording holds none."""
        base_s, base = self._kept_before(t_utc_s)
        folded = base.folded(self._since(base_s, t_utc_s))
        self._keep(t_utc_s, folded)
        parts = folded.whole() if folded.last is not None else self._blank()
        return [Entry(t_utc_s, self._topic, part) for part in parts]

    def _since(self, from_utc_s: float, until_utc_s: float) -> list[MapDelta]:
        """The changes after ``from_utc_s``, or from the last one on that needs none before it."""
        found: list[MapDelta] = []
        for entries in self._recording.backwards(self._topic, until_utc_s):
            deltas = [e.message for e in entries if isinstance(e.message, MapDelta) and e.t_utc_s > from_utc_s]
            begins = [number for number, delta in enumerate(deltas) if delta.whole and delta.part == 0]
            found = deltas[begins[-1] if begins else 0 :] + found
            if begins or len(deltas) < len(entries):
                break
        return found

    def _kept_before(self, t_utc_s: float) -> _Kept:
        number = bisect_right(self._kept, t_utc_s, key=itemgetter(0))
        return self._kept[number - 1] if number else (-np.inf, FoldedMap())

    def _keep(self, t_utc_s: float, folded: FoldedMap) -> None:
        if folded.last is not None and t_utc_s - self._kept_before(t_utc_s)[0] > _KEPT_EVERY_S:
            insort(self._kept, (t_utc_s, folded), key=itemgetter(0))
            if len(self._kept) > _MOST_KEPT:
                del self._kept[1::2]

    def _blank(self) -> list[MapDelta]:
        for entry in self._recording.entries((self._topic,)):
            if isinstance(entry.message, MapDelta):
                return FoldedMap(replace(entry.message, revision=0), NOTHING).whole()
        return []
