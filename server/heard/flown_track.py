"""The flown path so far, thinned for drawing."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

from server.schemas import FollowDoc, ReviewSeries, Source, TrackDoc
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
    every_s: float = EVERY_S

    def add(self, state: VehicleState, follow: FollowDoc | None) -> bool:
        """Whether it was far enough from the last one to be kept."""
        if state.lat_deg is None or (self.t_utc_s and state.t_utc_s < self.t_utc_s[-1] + self.every_s):
            return False
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

    def load(self, series: ReviewSeries, start_utc_s: float, *, until_utc_s: float) -> None:
        """What was flown until then, as a review knows it."""
        self.clear()
        count = bisect_right(series.t_s, until_utc_s - start_utc_s)
        every = max(1, count // POINTS_MAX + 1)
        self.t_utc_s = [start_utc_s + t_s for t_s in series.t_s[:count:every]]
        self.s_m, self.cross_track_m = series.s_m[:count:every], series.cross_track_m[:count:every]
        self.alt_rel_home_m = series.alt_rel_home_m[:count:every]

    def doc(self, source: Source) -> TrackDoc:
        start_s = self.t_utc_s[0] if self.t_utc_s else 0.0
        return TrackDoc(
            source=source,
            s_m=list(self.s_m),
            alt_rel_home_m=list(self.alt_rel_home_m),
            cross_track_m=list(self.cross_track_m),
            t_s=[t_s - start_s for t_s in self.t_utc_s],
        )

    def _thin(self) -> None:
        for column in self._columns():
            del column[1::2]
        self.every_s *= 2

    def _columns(self) -> tuple[list, ...]:
        return self.t_utc_s, self.states, self.s_m, self.alt_rel_home_m, self.cross_track_m
