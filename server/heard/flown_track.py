"""The flown path so far, thinned for drawing; no line leads over a time in which nobody knew where the vehicle was."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

from server.schemas import FollowDoc, ReviewSeries, Source, TrackDoc
from telemetry.topics.messages import LOST_S
from telemetry.topics.vehicle import VehicleState

POINTS_MAX = 3000
"""Then every other one goes: a long flight keeps its shape, and a page that opens late gets it in one message."""
EVERY_S = 0.25


@dataclass(slots=True)
class Track:
    """Columns of equal length, but for ``states``."""

    t_utc_s: list[float] = field(default_factory=list)
    states: list[VehicleState] = field(default_factory=list)
    """What the 3D view draws; empty for points that were loaded."""
    s_m: list[float | None] = field(default_factory=list)
    alt_rel_home_m: list[float | None] = field(default_factory=list)
    cross_track_m: list[float | None] = field(default_factory=list)
    is_anew: list[bool] = field(default_factory=list)
    """Before this one no position came for so long that the vehicle was lost: no line leads to it."""
    every_s: float = EVERY_S
    _placed_s: float | None = None
    """When the newest position came, kept or not."""
    _is_next_anew: bool = False

    def see(self, state: VehicleState) -> None:
        """Called with every state, also with those that are not kept."""
        placed_s = state.position_t_mono_s
        if placed_s is None:
            return
        if self._placed_s is not None and placed_s - self._placed_s > LOST_S:
            self._is_next_anew = True
        self._placed_s = placed_s

    def add(self, state: VehicleState, follow: FollowDoc | None) -> bool:
        """Whether it was far enough from the last one to be kept."""
        self.see(state)
        if state.lat_deg is None or (self.t_utc_s and state.t_utc_s < self.t_utc_s[-1] + self.every_s):
            return False
        self.is_anew.append(self._is_next_anew and bool(self.t_utc_s))
        self._is_next_anew = False
        self.t_utc_s.append(state.t_utc_s)
        self.states.append(state)
        self.s_m.append(None if follow is None else follow.s_m)
        placed_m = None if follow is None else follow.alt_rel_home_m
        self.alt_rel_home_m.append(state.alt_rel_home_m if placed_m is None else placed_m)
        self.cross_track_m.append(None if follow is None else follow.cross_track_m)
        if len(self.t_utc_s) > POINTS_MAX:
            self._thin()
        return True

    def clear(self) -> None:
        for column in self._columns():
            column.clear()
        self.every_s = EVERY_S
        self._placed_s, self._is_next_anew = None, False

    def load(self, series: ReviewSeries, start_utc_s: float, *, until_utc_s: float) -> None:
        """What was flown until then, as a review knows it."""
        self.clear()
        count = bisect_right(series.t_s, until_utc_s - start_utc_s)
        every = max(1, count // POINTS_MAX + 1)
        self.t_utc_s = [start_utc_s + t_s for t_s in series.t_s[:count:every]]
        self.s_m, self.cross_track_m = series.s_m[:count:every], series.cross_track_m[:count:every]
        self.alt_rel_home_m = series.alt_rel_home_m[:count:every]
        self.is_anew = [False] * len(self.t_utc_s)

    def doc(self, source: Source) -> TrackDoc:
        start_s = self.t_utc_s[0] if self.t_utc_s else 0.0
        doc = TrackDoc(source=source, s_m=[], alt_rel_home_m=[], cross_track_m=[], t_s=[])
        for k, t_utc_s in enumerate(self.t_utc_s):
            t_s = t_utc_s - start_s
            if self.is_anew[k]:
                _append(doc, (doc.t_s[-1] + t_s) / 2, None, None, None)
            _append(doc, t_s, self.s_m[k], self.alt_rel_home_m[k], self.cross_track_m[k])
        return doc

    def _thin(self) -> None:
        # What goes hands its gap on to the one that stays after it.
        for k in range(2, len(self.is_anew), 2):
            self.is_anew[k] = self.is_anew[k] or self.is_anew[k - 1]
        for column in self._columns():
            del column[1::2]
        self.every_s *= 2

    def _columns(self) -> tuple[list, ...]:
        return self.t_utc_s, self.states, self.s_m, self.alt_rel_home_m, self.cross_track_m, self.is_anew


def _append(
    doc: TrackDoc, t_s: float, s_m: float | None, alt_rel_home_m: float | None, cross_track_m: float | None
) -> None:
    doc.t_s.append(t_s)
    doc.s_m.append(s_m)
    doc.alt_rel_home_m.append(alt_rel_home_m)
    doc.cross_track_m.append(cross_track_m)
