"""Recordings of several stations as they travel on the bus: what this one offers, what others do, what is fetched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ListState = Literal["asking", "listed", "silent", "off"]
"""silent: it was asked and did not answer; off: it offers none."""
FetchState = Literal["waiting", "fetching", "checking", "whole", "failed"]
"""waiting: for its station, or for those before it; whole: all there, and its SHA-256 is right."""


@dataclass(frozen=True, slots=True)
class OfferedRecording:
    """A closed recording of this station's own."""

    path: str
    name: str
    size_bytes: int
    begin_utc_s: float | None
    end_utc_s: float | None
    vehicle: str = ""
    plan: str = ""


@dataclass(frozen=True, slots=True)
class OwnRecordings:
    """What the server tells the *stations* node, every second."""

    t_mono_s: float
    is_on: bool
    """False: others are told that none are offered."""
    bytes_per_s: int
    """So much of them goes out at most, to all others together, and so much of theirs comes in."""
    recordings: tuple[OfferedRecording, ...] = ()
    """Newest first."""


@dataclass(frozen=True, slots=True)
class RecordingThere:
    """As its station tells of it: another machine's word."""

    sha256: str
    """64 hexadecimal digits"""
    name: str
    """A plain file name that leads to no other folder."""
    size_bytes: int
    begin_utc_s: float | None
    end_utc_s: float | None
    vehicle: str = ""
    plan: str = ""


@dataclass(frozen=True, slots=True)
class StationRecordings:
    station: str
    state: ListState
    as_of_t_mono_s: float | None
    """When its list was whole; None: it never was."""
    text: str = ""
    """What is wrong with it, or missing in it, and what to do."""
    recordings: tuple[RecordingThere, ...] = ()
    """Newest first."""


@dataclass(frozen=True, slots=True)
class FetchStatus:
    station: str
    it: RecordingThere
    state: FetchState
    have_bytes: int
    bytes_per_s: float
    """Of the last seconds."""
    text: str = ""
    """Why it waits or failed, and what to do."""
    path: str = ""
    """Of a whole one; its content is not looked at yet."""


@dataclass(frozen=True, slots=True)
class RecordingsStatus:
    """Of the *stations* node: every two seconds, twice a second while something changes."""

    t_mono_s: float
    stations: tuple[StationRecordings, ...] = ()
    fetches: tuple[FetchStatus, ...] = ()


# To the stations node.


@dataclass(frozen=True, slots=True)
class ListRecordings:
    """Asks another station for its list anew. -> None; StationsError"""

    station: str


@dataclass(frozen=True, slots=True)
class FetchRecording:
    """One of a list that has come. -> None; StationsError"""

    station: str
    sha256: str


@dataclass(frozen=True, slots=True)
class EndFetch:
    """Whatever it has come to; what is there of it is deleted. -> None"""

    sha256: str


RecordingsRequest = ListRecordings | FetchRecording | EndFetch
