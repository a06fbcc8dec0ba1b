"""What all documents and messages share: no unknown fields, numbers that are numbers, names of one line."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from planning.formats.safe_text import clean_name

PROTOCOL_VERSION = 1

Name = Annotated[str, StringConstraints(max_length=80, strip_whitespace=True), AfterValidator(clean_name)]
"""Without control and formatting characters: markup stays text, whoever shows it escapes it."""
Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Metres = Annotated[float, Field(allow_inf_nan=False)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
