"""Other aircraft: which are shown, and of which the pilot is warned.

What the bus carries (``telemetry.topics.traffic``) goes to the pages as it is; it is not written down twice.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints
from pydantic_core import PydanticCustomError

from server.schemas.strict_model import Name, Strict


def _icao(text: str) -> str:
    if text and (len(text) != 6 or not set(text.lower()) <= set("0123456789abcdef")):
        what = "An ICAO address has six hexadecimal digits, such as 4b1805; leave it empty if there is none"
        raise PydanticCustomError("icao", what)
    return text


class TrafficSettingsBody(Strict):
    """What an operator may change; what is left out stays."""

    warn_distance_m: Annotated[float, Field(ge=50, le=50_000)] | None = None
    warn_height_m: Annotated[float, Field(ge=10, le=5_000)] | None = None
    look_ahead_s: Annotated[float, Field(ge=5, le=300)] | None = None
    show_distance_m: Annotated[float, Field(ge=100, le=500_000)] | None = None
    show_height_m: Annotated[float, Field(ge=50, le=30_000)] | None = None
    own_icao: Annotated[str, StringConstraints(max_length=20, strip_whitespace=True), AfterValidator(_icao)] | None = (
        None
    )
    """Six hexadecimal digits, or none."""
    own_id: Name | None = None
