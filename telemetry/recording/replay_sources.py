"""What a replay is fed from: Hedgehop's own recordings message by message, other logs through the state reducer."""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Protocol

import numpy as np

from telemetry.recording.file_types import foreign, is_mcap, opened
from telemetry.recording.frame_facts import FrameFacts
from telemetry.recording.mcap_files.reader import Entry, Recording
from telemetry.recording.recorded_topics import LATEST, MAPS, NOT_REPLAYED, RECORDED
from telemetry.recording.tlog import Data
from telemetry.recording.tlog_flight import looks_like_tlog, states_of, survey
from telemetry.recording.vehicle_logs.own_flight import OwnKind, kind_of_own_log, read_own_states
from telemetry.topics.deltas import NOTHING, FoldedMap
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapDelta
from telemetry.topics.vehicle import VehicleState

_KEPT_EVERY_S = 30.0
_MOST_KEPT = 12
_Kept = tuple[float, FoldedMap]
_REPLAYED = RECORDED - NOT_REPLAYED
_SPACING_S = 0.05


class MapHistory:
    """What the map of one topic was like at any time of a recording: its changes, added up.

    Maps that were added up once are kept, some of them, so that the next search is short.
    """

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


class ReplaySource(Protocol):
    """All that can be replayed of one file."""

    name: str

    @property
    def start_utc_s(self) -> float: ...

    @property
    def end_utc_s(self) -> float: ...

    @property
    def mono_minus_utc_s(self) -> float: ...

    def latest(self, until_utc_s: float) -> list[Entry]:
        """The last message of each topic that shows a state, up to a time."""
        ...

    def maps(self, until_utc_s: float) -> list[Entry]:
        """Every map as it was at that time, whole."""
        ...

    def entries(self, from_utc_s: float) -> Iterator[Entry]: ...

    def close(self) -> None: ...


def open_source(path: Path, *, raw: bool = False) -> ReplaySource:
    """``raw``: MAVLink frames too. Blocks while a log of another program is read; raises RecordingError."""
    stack = ExitStack()
    with stack:
        data = stack.enter_context(opened(path))
        if is_mcap(data):
            recording = Recording(path.name, data)
            return RecordingSource(recording, stack.pop_all(), raw=raw)
        if (kind := kind_of_own_log(data)) is not None:
            return _own_source(path, data, kind)
        if looks_like_tlog(data):
            return _tlog_source(path.name, data)
        raise foreign(path, data)


def _tlog_source(name: str, data: Data) -> TlogSource:
    """Every position, and of all else not more than can be seen."""
    seen = survey(data)
    vehicle = seen.chosen(name)
    facts, entries = FrameFacts(*vehicle), list[Entry]()
    last: VehicleState | None = None
    for state, t_utc_s in states_of(data, vehicle, facts):
        moved = last is None or state.position_t_mono_s != last.position_t_mono_s or state.armed != last.armed
        if last is None or moved or t_utc_s - last.t_utc_s >= _SPACING_S:
            entries.append(Entry(t_utc_s, Topic.VEHICLE, state))
            last = state
    entries += [Entry(text.t_utc_s, Topic.TEXT, text) for text in facts.texts()]
    entries.sort(key=itemgetter(0))
    return TlogSource(name, entries, seen.start_utc_s, seen.end_utc_s)


def _own_source(path: Path, data: Data, kind: OwnKind) -> TlogSource:
    log, states = read_own_states(path, data, kind)
    entries = [Entry(t_utc_s, Topic.VEHICLE, state) for t_utc_s, state in states]
    entries += [Entry(text.t_utc_s, Topic.TEXT, text) for text in log.texts]
    entries.sort(key=itemgetter(0))
    return TlogSource(path.name, entries, states[0][0], states[-1][0])


class RecordingSource:
    """Reads chunk after chunk from the open file: its size does not matter."""

    def __init__(self, recording: Recording, stack: ExitStack, *, raw: bool) -> None:
        self.name = recording.name
        self._recording, self._stack = recording, stack
        self._topics = _REPLAYED | ({Topic.RAW} if raw else frozenset())
        self._maps = [MapHistory(recording, topic) for topic in sorted(MAPS & recording.topics())]

    @property
    def start_utc_s(self) -> float:
        return self._recording.start_utc_s

    @property
    def end_utc_s(self) -> float:
        return self._recording.end_utc_s

    @property
    def mono_minus_utc_s(self) -> float:
        return self._recording.mono_minus_utc_s

    def latest(self, until_utc_s: float) -> list[Entry]:
        found = (self._recording.latest(topic, until_utc_s) for topic in sorted(LATEST & self._topics))
        return [entry for entry in found if entry is not None]

    def maps(self, until_utc_s: float) -> list[Entry]:
        return [entry for history in self._maps for entry in history.at(until_utc_s)]

    def entries(self, from_utc_s: float) -> Iterator[Entry]:
        return self._recording.entries(self._topics, from_utc_s)

    def close(self) -> None:
        self._stack.close()


class TlogSource:
    """All states in memory: logs of other programs have no index."""

    mono_minus_utc_s = 0.0

    def __init__(self, name: str, entries: list[Entry], start_utc_s: float, end_utc_s: float) -> None:
        self.name, self._entries = name, entries
        self.start_utc_s, self.end_utc_s = start_utc_s, end_utc_s

    def latest(self, until_utc_s: float) -> list[Entry]:
        for number in range(bisect_right(self._entries, until_utc_s, key=itemgetter(0)) - 1, -1, -1):
            if self._entries[number].topic == Topic.VEHICLE:
                return [self._entries[number]]
        return []

    def maps(self, until_utc_s: float) -> list[Entry]:
        return []

    def entries(self, from_utc_s: float) -> Iterator[Entry]:
        start = bisect_left(self._entries, from_utc_s, key=itemgetter(0))
        return (self._entries[number] for number in range(start, len(self._entries)))

    def close(self) -> None:
        self._entries = []
