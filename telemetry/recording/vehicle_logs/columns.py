"""From columns of a vehicle's own log to what was known of it at any moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64, Bools
from telemetry.recording.frame_facts import FrameFacts
from telemetry.recording.recorded_flight import Stamped
from telemetry.recording.vehicle_logs.rows import Rows
from telemetry.topics.messages import VehicleText
from telemetry.topics.vehicle import VehicleState

_OUT_OF_ORDER_S, _LONGEST_PAUSE_S = 5.0, 6 * 3600.0
_SHOWN_EVERY_S = 0.05
_MOST_STATES = 400_000
EARLIEST_UTC_S, _LATEST_UTC_S = 946_684_800.0, 4_102_444_800.0
"""The years 2000 and 2100: what a receiver tells outside of them is no time of day."""


@dataclass(frozen=True, slots=True)
class Told:
    """One kind of record as fields of the vehicle's state; NaN and None: not known."""

    t_s: F64
    """(N,) never decreasing"""
    fields: dict[str, F64 | Sequence[Any]]
    """(N,) each, by the name of a field of ``VehicleState``"""
    stamp: str | None = None
    """The field that holds when such a record came last."""
    exact: bool = False
    """Every single one counts: a position, or something that is told only when it changes."""


@dataclass(slots=True)
class OwnLog:
    """What a reader makes of either kind of log."""

    vehicle: VehicleState
    """What holds for the whole log."""
    utc_minus_boot_s: float | None
    told: list[Told] = field(default_factory=list)
    texts: list[VehicleText] = field(default_factory=list)
    facts: FrameFacts = field(default_factory=lambda: FrameFacts(0, 0))
    """Missions, reached items and a simulator's truth."""
    faults: list[str] = field(default_factory=list)

    def to_utc(self) -> None:
        """Every time, until now counted from the vehicle's start, to seconds since 1970 if the log tells that."""
        later_s, facts = self.utc_minus_boot_s, self.facts
        if later_s is None:
            return
        self.told = [replace(told, t_s=told.t_s + later_s) for told in self.told]
        self.texts = [replace(text, t_utc_s=text.t_utc_s + later_s) for text in self.texts]
        facts.reached[:] = [(t + later_s, number) for t, number in facts.reached]
        facts.truth[:] = [replace(place, t_utc_s=place.t_utc_s + later_s) for place in facts.truth]
        for transfer in facts.missions.finished:
            transfer.t_utc_s += later_s

    def states(self) -> list[Stamped]:
        """A state for every position and every change, and as many between as can be seen."""
        moments = self._moments()
        columns: dict[str, list[Any]] = {}
        for told in self.told:
            rows = np.searchsorted(told.t_s, moments, side="right") - 1
            for name, values in told.fields.items():
                columns[name] = _sampled(values, rows, getattr(self.vehicle, name))
            if told.stamp is not None:
                columns[told.stamp] = _sampled(told.t_s, rows, None)
        names = list(columns)
        table = zip(moments.tolist(), *columns.values(), strict=True)
        return [(t, replace(self.vehicle, t_utc_s=t, **dict(zip(names, row, strict=True)))) for t, *row in table]

    def _moments(self) -> F64:
        exact = np.unique(np.concatenate([np.empty(0), *(told.t_s for told in self.told if told.exact)]))
        others = np.concatenate([np.empty(0), *(told.t_s for told in self.told if not told.exact)])
        seen = np.unique(np.floor(others / _SHOWN_EVERY_S)) * _SHOWN_EVERY_S
        moments = np.union1d(exact, seen)
        if len(moments) > _MOST_STATES:
            moments = exact
        every = -(-len(moments) // _MOST_STATES)
        if every > 1:
            self.faults.append(f"The log is very long: one of every {every} positions is shown.")
        return moments[:: max(1, every)]


def _sampled(values: F64 | Sequence[Any], rows: Any, before: Any) -> list[Any]:
    """The value of each row; ``before``: where there is no row yet."""
    if isinstance(values, np.ndarray):
        if not len(values):
            return [before] * len(rows)
        found = values[np.maximum(rows, 0)]
        return [
            before if row < 0 else value if np.isfinite(value) else None
            for row, value in zip(rows.tolist(), found.tolist(), strict=True)
        ]
    return [before if row < 0 else values[row] for row in rows.tolist()]


def in_order(t_s: F64) -> Bools:
    """Which rows have a time that can be believed: records have no checksum, and a wrong one would stretch the log."""
    steps_s = np.diff(t_s, prepend=t_s[:1])
    ahead_s = np.diff(t_s, append=t_s[-1:])
    back = (steps_s < -_OUT_OF_ORDER_S) | (ahead_s < -_OUT_OF_ORDER_S)
    return np.isfinite(t_s) & (t_s >= 0) & ~back & (np.abs(steps_s) < _LONGEST_PAUSE_S)


def ordered(rows: Rows, t_s: F64) -> tuple[Rows, F64]:
    """Rows whose time can be believed, the earliest first."""
    kept = in_order(t_s) if len(t_s) else np.zeros(0, dtype=bool)
    order = np.argsort(t_s[kept], kind="stable")
    packed = rows.packed[kept][order] if len(rows) else rows.packed
    return Rows(packed, rows.scales), t_s[kept][order]


def placed(lat_deg: F64, lon_deg: F64) -> Bools:
    """Exactly 0, 0 is what autopilots write before they have a position."""
    return (np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180) & ((lat_deg != 0) | (lon_deg != 0))


def middle_utc_s(utc_s: F64, t_s: F64) -> float | None:
    """The time of day at the vehicle's start, as its receivers told it; None when they never did."""
    told = (utc_s > EARLIEST_UTC_S) & (utc_s < _LATEST_UTC_S)
    return float(np.median((utc_s - t_s)[told])) if told.any() else None


def unless(values: F64, wrong: Bools) -> F64:
    """NaN where it is ``wrong``."""
    return np.where(wrong, np.nan, values)


def moving(t_s: F64, north_m_s: F64, east_m_s: F64, down_m_s: F64) -> Told:
    fields: dict[str, Any] = {
        "v_north_m_s": north_m_s,
        "v_east_m_s": east_m_s,
        "v_down_m_s": down_m_s,
        "ground_speed_m_s": np.hypot(north_m_s, east_m_s),
        "climb_m_s": 0.0 - down_m_s,
    }
    return Told(t_s, fields)


def blowing(t_s: F64, north_m_s: F64, east_m_s: F64) -> Told:
    """The wind, by where it blows to. Exactly none is what an estimator writes that does not look for any."""
    none = (north_m_s == 0) & (east_m_s == 0)
    fields: dict[str, Any] = {
        "wind_speed_m_s": unless(np.hypot(north_m_s, east_m_s), none),
        "wind_from_rad": unless(np.arctan2(-east_m_s, -north_m_s) % (2 * np.pi), none),
    }
    return Told(t_s, fields)
