"""Home that is set by order, and what the vehicle's own return is worth since home was moved in flight."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from server.schemas.plan_docs import PlaceDoc
from server.schemas.result_docs import ReasonDoc
from server.schemas.strict_model import Strict


class HomeBody(Strict):
    """Where home shall be; it is judged, not set."""

    place: PlaceDoc | None = None
    """null: where the vehicle is."""


class SetHomeBody(Strict):
    """The home that was judged last is set."""

    id: str


class ReturnDoc(Strict):
    """The vehicle's own return, from where it was when this was judged."""

    state: Literal["certified", "not_certified", "unknown"]
    """unknown: it could not be judged; the reason says why."""
    reasons: list[ReasonDoc]
    clearance_m: float | None = None
    """Smallest distance to the surface; null: nothing is near, or not judged."""
    instead: bool = False
    """A guided way home is certified where the return is not."""
    notes: list[str] = Field(default_factory=list)
    """Sentences: what of the surroundings did not count."""
    judged_mono_s: float
    """By the server's clock."""


class HomeAskedDoc(Strict):
    """A home that may be set, and what that changes."""

    id: str
    is_here: bool
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    """By the vehicle's own heights above the sea."""
    moves_m: float
    """From home as it is."""
    rises_m: float
    changes: list[str]
    """Sentences."""
    ret: ReturnDoc | None
    """From there; null: the vehicle stands on the ground."""


class HomeState(Strict):
    """What is in hand of home."""

    asked: HomeAskedDoc | None = None
    is_judging: bool = False
    ret: ReturnDoc | None = None
    """Since home was moved in flight; null: it was not."""
    is_judging_return: bool = False
