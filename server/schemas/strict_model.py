"""What all documents and messages share: no unknown fields, numbers that are numbers, names of one line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from planning.formats.safe_text import clean_name

PROTOCOL_VERSION: Literal[1] = 1

Name = Annotated[str, StringConstraints(max_length=80, strip_whitespace=True), AfterValidator(clean_name)]
"""Without control and formatting characters: markup stays text, whoever shows it escapes it."""
Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Metres = Annotated[float, Field(allow_inf_nan=False)]


@dataclass(frozen=True, slots=True)
class Asked:
    """Which numbers the console lets an operator type, where these are fewer than the server takes: an end that is
    itself excluded has no number, and a slip of a finger is not to plan for a million metres."""

    min: float | None = None
    max: float | None = None
    initial: float | None = None
    """What a number begins with that is left out as a rule."""


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Message(Strict):
    """Of the ``/ws`` stream."""

    v: Literal[1] = PROTOCOL_VERSION
