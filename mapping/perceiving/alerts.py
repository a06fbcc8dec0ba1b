"""Alerts: one per obstacle, from when it enters a region until it has been out of all of them for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64
from mapping.perceiving.obstacles import Found

Kind = Literal["obstacle", "divergence", "sensor"]
Phase = Literal["begins", "goes_on", "ends"]


@dataclass(frozen=True, slots=True)
class AlertParams:
    """How alerts stay together and end."""

    same_within_m: float = 3.0
    """Clusters whose boxes are nearer to each other than this are one obstacle: a building is seen in pieces."""
    out_for_s: float = 1.5
    """An obstacle must have been out of all regions for so long before its alert is over."""
    tell_again_s: float = 1.0


@dataclass(frozen=True, slots=True)
class AlertEvent:
    """What is to be told about one alert."""

    id: str
    kind: Kind
    phase: Phase
    t_mono_s: float
    text: str
    obstacle: Found | None = None


@dataclass(slots=True)
class _Open:
    id: str
    kind: Kind
    seen_s: float
    told_s: float
    text: str
    obstacle: Found | None = None
    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)


class AlertBook:
    """The alerts of one sensor that are not over. ``prefix`` begins every id; give each run of a node its own."""

    def __init__(self, name: str, *, prefix: str = "", params: AlertParams | None = None) -> None:
        self._name = name
        self._prefix = prefix or name
        self._params = params or AlertParams()
        self._open: list[_Open] = []
        self._count = 0

    def observe(self, found: list[Found], t_mono_s: float) -> list[AlertEvent]:
        """All obstacles that are in a region at ``t_mono_s``, the nearest first -> what is to be told."""
        events: list[AlertEvent] = []
        told: set[str] = set()
        for obstacle in found:
            entry = self._same(obstacle)
            if entry is None:
                events.append(self._begin("obstacle", _words(self._name, obstacle), t_mono_s, obstacle))
                told.add(events[-1].id)
                continue
            first = entry.id not in told
            told.add(entry.id)
            _take(entry, obstacle, t_mono_s, replace=first)
            if first:
                entry.obstacle, entry.text = obstacle, _words(self._name, obstacle)
                events += self._again(entry, t_mono_s)
        return events + self._over(t_mono_s)

    def pass_time(self, t_mono_s: float) -> list[AlertEvent]:
        """Nothing has been looked at: what has been out for long enough is over, though nobody knows it to be gone."""
        return self._over(t_mono_s, "not seen any more, for nothing is seen")

    def say(self, kind: Kind, on: bool, text: str, t_mono_s: float) -> list[AlertEvent]:
        """Something about the sensor itself is (still) so, or not any more."""
        entry = next((e for e in self._open if e.kind == kind), None)
        if entry is None:
            return [self._begin(kind, text, t_mono_s, None)] if on else []
        if on:
            entry.seen_s, entry.text = t_mono_s, text
            return self._again(entry, t_mono_s)
        self._open.remove(entry)
        return [AlertEvent(entry.id, kind, "ends", t_mono_s, text)]

    def move(self, R_new_old: F64, shift_m: F64) -> None:
        """The map's frame is laid elsewhere, (3, 3) a turn about z and (3,) a shift: open alerts go with it."""
        for entry in self._open:
            if entry.low:
                corners = [
                    (x, y, z)
                    for x in (entry.low[0], entry.high[0])
                    for y in (entry.low[1], entry.high[1])
                    for z in (entry.low[2], entry.high[2])
                ]
                moved = np.array(corners) @ R_new_old.T + shift_m
                entry.low, entry.high = moved.min(axis=0).tolist(), moved.max(axis=0).tolist()

    def end_all(self, t_mono_s: float) -> list[AlertEvent]:
        """The map was emptied, or the flight is over."""
        events = [AlertEvent(e.id, e.kind, "ends", t_mono_s, e.text, e.obstacle) for e in self._open]
        self._open.clear()
        return events

    def _begin(self, kind: Kind, text: str, t_s: float, obstacle: Found | None) -> AlertEvent:
        self._count += 1
        entry = _Open(f"{self._prefix}-{self._count}", kind, t_s, t_s, text, obstacle)
        if obstacle is not None:
            _take(entry, obstacle, t_s, replace=True)
        self._open.append(entry)
        return AlertEvent(entry.id, kind, "begins", t_s, text, obstacle)

    def _again(self, entry: _Open, t_s: float) -> list[AlertEvent]:
        if t_s - entry.told_s < self._params.tell_again_s:
            return []
        entry.told_s = t_s
        return [AlertEvent(entry.id, entry.kind, "goes_on", t_s, entry.text, entry.obstacle)]

    def _over(self, t_s: float, why: str = "clear again") -> list[AlertEvent]:
        over = [e for e in self._open if e.kind == "obstacle" and t_s - e.seen_s >= self._params.out_for_s]
        self._open = [e for e in self._open if e not in over]
        return [AlertEvent(e.id, e.kind, "ends", t_s, f"{self._name}: {why}", e.obstacle) for e in over]

    def _same(self, obstacle: Found) -> _Open | None:
        near = [(_box_gap_m(e, obstacle), e) for e in self._open if e.kind == "obstacle"]
        gap, entry = min(near, key=lambda pair: pair[0], default=(math.inf, None))
        return entry if gap <= self._params.same_within_m else None


def _take(entry: _Open, obstacle: Found, t_s: float, *, replace: bool) -> None:
    entry.seen_s = t_s
    if replace:
        entry.low, entry.high = list(obstacle.low_enu_m), list(obstacle.high_enu_m)
        return
    entry.low = [min(pair) for pair in zip(entry.low, obstacle.low_enu_m, strict=True)]
    entry.high = [max(pair) for pair in zip(entry.high, obstacle.high_enu_m, strict=True)]


def _box_gap_m(entry: _Open, obstacle: Found) -> float:
    """Distance of two boxes; heights do not count: a column is seen at whatever height the vehicle has."""
    gaps = [max(entry.low[k] - obstacle.high_enu_m[k], obstacle.low_enu_m[k] - entry.high[k], 0.0) for k in (0, 1)]
    return math.hypot(*gaps)


def _words(name: str, found: Found) -> str:
    """One line for the operator."""
    clock = round(found.off_nose_rad / (math.pi / 6)) % 12 or 12
    where = "ahead" if clock == 12 else f"at {clock} o'clock"
    above = round(found.height_difference_m)
    height = f"{above} m above" if above > 0 else f"{-above} m below" if above < 0 else "level with"
    contact = "" if found.time_to_contact_s is None else f", contact in {found.time_to_contact_s:.1f} s"
    return f"{name}: obstacle {found.distance_m:.0f} m {where}, its top {height} the vehicle{contact}"
