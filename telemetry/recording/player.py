"""Plays a recording again: which message is due when. Knows neither bus nor real time; ``nodes/replay.py`` does."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.reader import Entry
from telemetry.recording.recorded_topics import EVENTS
from telemetry.recording.replay_sources import ReplaySource
from telemetry.topics.messages import FlightStatus, Published, ReplayStatus, Topic

SLOWEST, FASTEST = 0.1, 50.0
STATUS_EVERY_S = 0.125
_AGES_EVERY_S = 0.5
_THINNED_ABOVE = 4.0
_LONGEST_STEP_S = 0.5
_BLANK: dict[str, Published] = {Topic.FLIGHT: FlightStatus()}
"""Shown where a replay is moved to a time before the first message of a topic."""

Due = tuple[str, Published]
"""Topic as it was recorded, and message."""


class Player:
    """One opened recording, playing or not. Every method takes the present monotonic time and returns what is due.

    Times of the vehicle's machine (``t_mono_s`` fields) are moved to now, so that what was 2 s old is 2 s old again.
    """

    def __init__(self, source: ReplaySource, now_s: float) -> None:
        self._source = source
        self.speed, self.playing = 1.0, False
        self._at_s = source.start_utc_s
        self._seen_s = now_s
        self._ages_s = now_s
        self._waiting: Entry | None = None
        self._rest: Iterator[Entry] = iter(())

    def open(self, now_s: float) -> list[Due]:
        """What the recording begins with."""
        return self._move_to(self._source.start_utc_s, now_s)

    def play(self, now_s: float, *, playing: bool, at_utc_s: float | None, speed: float | None) -> list[Due]:
        """Raises RecordingError for a speed or time that is none; times outside the recording become its ends."""
        if not all(v is None or math.isfinite(v) for v in (at_utc_s, speed)):
            raise RecordingError("Time and speed of a replay must be numbers.", where=self._source.name)
        if speed is not None and not SLOWEST <= speed <= FASTEST:
            what = f"A replay cannot run at {speed:g} times the recorded speed."
            raise RecordingError(what, where=self._source.name, advice=f"Choose {SLOWEST:g} to {FASTEST:g}.")
        due = self.on_tick(now_s)
        self.speed = self.speed if speed is None else speed
        if at_utc_s is not None:
            due += self._move_to(min(max(at_utc_s, self._source.start_utc_s), self._source.end_utc_s), now_s)
        elif playing and self._at_s >= self._source.end_utc_s:
            due += self._move_to(self._source.start_utc_s, now_s)
        self.playing = playing
        return due

    def on_tick(self, now_s: float) -> list[Due]:
        """What has become due since the last call; the replay stops by itself at the end."""
        elapsed_s, self._seen_s = now_s - self._seen_s, now_s
        if not self.playing:
            return self._ages(now_s)
        # After a long pause of this process the replay goes on from where it was, it does not rush.
        until = self._at_s + min(elapsed_s, _LONGEST_STEP_S) * self.speed
        self._at_s = min(until, self._source.end_utc_s)
        due = [self._moved(entry, now_s) for entry in self._thinned(self._until(self._at_s))]
        self.playing = self._at_s < self._source.end_utc_s
        return due

    def wait_s(self) -> float:
        """How long until the next message is due, at most until the next status."""
        if not self.playing or self._waiting is None:
            return STATUS_EVERY_S
        return min(max((self._waiting.t_utc_s - self._at_s) / self.speed, 0.0), STATUS_EVERY_S)

    def status(self, now_s: float) -> ReplayStatus:
        return ReplayStatus(
            t_mono_s=now_s,
            recording=self._source.name,
            start_utc_s=self._source.start_utc_s,
            end_utc_s=self._source.end_utc_s,
            at_utc_s=self._at_s,
            playing=self.playing,
            speed=self.speed,
        )

    def close(self) -> None:
        self._rest = iter(())
        self._source.close()

    def _move_to(self, at_utc_s: float, now_s: float) -> list[Due]:
        """The state of things at that time, and from there on message by message."""
        self._at_s, self._seen_s = at_utc_s, now_s
        self._rest = self._source.entries(math.nextafter(at_utc_s, math.inf))
        self._waiting = next(self._rest, None)
        return self._state(now_s) + [self._moved(entry, now_s) for entry in self._source.maps(at_utc_s)]

    def _state(self, now_s: float) -> list[Due]:
        self._ages_s = now_s
        found = {entry.topic: entry for entry in self._source.latest(self._at_s)}
        blanks = [(topic, blank) for topic, blank in _BLANK.items() if topic not in found]
        return blanks + [self._moved(entry, now_s) for entry in found.values()]

    def _ages(self, now_s: float) -> list[Due]:
        """While a replay is paused its values must not grow old: they are given again with the same age."""
        if now_s - self._ages_s < _AGES_EVERY_S:
            return []
        return self._state(now_s)

    def _until(self, t_utc_s: float) -> Iterator[Entry]:
        while self._waiting is not None and self._waiting.t_utc_s <= t_utc_s:
            yield self._waiting
            self._waiting = next(self._rest, None)

    def _thinned(self, entries: Iterator[Entry]) -> list[Entry]:
        """All at ordinary speeds; of what comes at once when it is fast, the latest state and every event."""
        if self.speed <= _THINNED_ABOVE:
            return list(entries)
        kept: dict[object, Entry] = {}
        for number, entry in enumerate(entries):
            kept.pop(entry.topic, None)
            kept[number if entry.topic in EVENTS else entry.topic] = entry
        return list(kept.values())

    def _moved(self, entry: Entry, now_s: float) -> Due:
        """The message with its monotonic times moved by as much as the replay's moment lies in the past."""
        names = _mono_fields(type(entry.message))
        shift_s = now_s - (self._at_s + self._source.mono_minus_utc_s)
        values = {name: getattr(entry.message, name) for name in names}
        moved = {name: value + shift_s for name, value in values.items() if value is not None}
        message: Any = entry.message
        return entry.topic, dataclasses.replace(message, **moved) if moved else message


@cache
def _mono_fields(kind: type[Any]) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind) if field.name.endswith("t_mono_s"))
