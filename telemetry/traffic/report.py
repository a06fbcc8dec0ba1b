"""What one message says of one aircraft, whatever kind of message it was."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.topics.traffic import HeightDatum, TrafficSource


@dataclass(frozen=True, slots=True)
class Identity:
    """None and empty: this message does not say."""

    name: str = ""
    kind: str = ""
    is_crewed: bool | None = None
    operator_deg: tuple[float, float] | None = None
    """Latitude and longitude of who flies it."""


@dataclass(frozen=True, slots=True)
class Position:
    """Where it was, with what was told beside it."""

    lat_deg: float
    lon_deg: float
    delay_s: float = 0.0
    """Since the receiver heard it."""
    stamp: float | None = None
    """The aircraft's own time of it, on whatever clock: an equal one says nothing new."""
    within_m: float | None = None
    """95 % of its horizontal errors are smaller; None: not told."""
    speed_m_s: float | None = None
    course_rad: float | None = None
    """Over ground, clockwise from true north."""
    climb_m_s: float | None = None
    alt_m: float | None = None
    alt_datum: HeightDatum = "unknown"
    alt_within_m: float | None = None
    """95 % of its vertical errors are smaller."""
    on_ground: bool = False
    emergency: bool = False


@dataclass(frozen=True, slots=True)
class Report:
    key: str
    """``Aircraft.key``"""
    source: TrafficSource
    identity: Identity
    position: Position | None = None
    is_own: bool = False
    """The vehicle tells of itself."""
