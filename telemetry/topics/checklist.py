"""A crew's own list of what is looked at before a start: its text, and who ticked which point of it when."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from planning.errors import FormatError
from planning.formats.safe_text import clean_name

MOST_CHARACTERS, MOST_POINTS, LONGEST_LINE = 8_000, 60, 80
"""One that nobody reads to its end is ticked without being read."""
SUGGESTED = """\
# Vehicle
Propellers are whole and tight, nothing is loose
Battery is full, fastened and warm
Sensors and lenses are clean, nothing hangs before them
# Place
Nothing was built or has grown since the surface model was made
No wires, cranes or masts near the path
People and animals keep away, wind and light will do
# Crew
Pilot's transmitter is on, its switch to take over was tried
All know where the vehicle returns to, and how high
"""
_MARKS = ("- ", "* ", "[ ] ", "- [ ] ", "* [ ] ")
"""With which people and programs begin a line of a list."""


@dataclass(frozen=True, slots=True)
class ChecklistPoint:
    text: str
    heading: str = ""
    """That it stands under; empty: under none."""
    ticked_by: str = ""
    """Empty: it is open."""
    ticked_utc_s: float | None = None


@dataclass(frozen=True, slots=True)
class ChecklistRecord:
    """A vehicle's checklist as it is ticked by now."""

    t_utc_s: float
    profile: str
    """Name of the vehicle profile whose list it is."""
    vehicle: str
    """Id of the candidate that it was ticked for."""
    mission_digest: str
    points: tuple[ChecklistPoint, ...]
    started_utc_s: float | None = None
    """When the start was asked for that it was ticked for; None: none was yet."""


def points_of(text: str, *, where: str = "checklist") -> tuple[ChecklistPoint, ...]:
    """One point a line; ``# `` begins a heading, blank lines part. Raises FormatError for what is too long."""
    if len(text) > MOST_CHARACTERS:
        _refuse(f"The checklist has {len(text):,} characters, more than {MOST_CHARACTERS:,}.", where)
    points: list[ChecklistPoint] = []
    heading = ""
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if len(line) > LONGEST_LINE:
            _refuse(f"Line {number} has {len(line)} characters, more than {LONGEST_LINE}.", where)
        if line.startswith("#"):
            heading = clean_name(line.lstrip("#"))
        elif point := clean_name(_without_mark(line)):
            points.append(ChecklistPoint(point, heading))
    if len(points) > MOST_POINTS:
        _refuse(f"The checklist has {len(points)} points, more than {MOST_POINTS}.", where)
    return tuple(points)


def digest_of(points: tuple[ChecklistPoint, ...]) -> str:
    """Of the words alone, not of the ticks: what was ticked holds for these words."""
    lines = "\n".join(f"{point.heading}\t{point.text}" for point in points)
    return hashlib.sha256(lines.encode()).hexdigest()


def _without_mark(line: str) -> str:
    mark = max((mark for mark in _MARKS if f"{line} ".startswith(mark)), key=len, default="")
    return line[len(mark) :]


def _refuse(what: str, where: str) -> None:
    raise FormatError(what, where=where, advice="Shorten it: only what is really looked at before each start.")
