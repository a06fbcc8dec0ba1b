"""A crew's checklist: its text for each vehicle profile, and its points as they are ticked before a start."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from server.schemas.strict_model import Name, Strict
from telemetry.topics.checklist import MOST_POINTS, ChecklistPoint

Revision = Annotated[str, Field(max_length=64)]
_MOST_SENT = 100_000
"""What is longer than a list may be is said in its own words; what is much longer is not looked at."""


class ChecklistText(Strict):
    """A line for each point; ``#`` begins a heading."""

    profile: str
    text: str
    """Empty: a start with this profile demands nothing."""
    revision: str
    before: str | None
    """What the last change replaced; null: nothing was written before."""
    changed_by: str
    changed_utc: str
    suggested: str
    """For a low flight, in few words."""


class ChecklistDoc(Strict):
    """Of the profile that the mission on board was planned with, as it is ticked by now."""

    profile: str = ""
    revision: str = ""
    """Of the points' words."""
    points: list[ChecklistPoint] = Field(default_factory=list)
    why_again: str = ""
    """Why points that were ticked are open again."""
    fault: str = ""
    """Why nobody knows what the list demands: nothing is started then."""


# Bodies of requests


class WriteChecklist(Strict):
    profile: Name
    text: Annotated[str, Field(max_length=_MOST_SENT)]
    instead_of: Revision
    """The revision of the text that the writer has seen."""


class TickBody(Strict):
    digest: str
    """Of the mission on board that it is ticked for."""
    revision: Revision
    """Of the points as they were shown."""
    number: Annotated[int, Field(ge=1, le=MOST_POINTS)]
    """1 is the first point."""
    ticked: bool = True
