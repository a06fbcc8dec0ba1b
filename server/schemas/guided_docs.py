"""Guided flight: one way that is asked for, judged over the surface model, and flown."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from planning.guided.guided_model import HEIGHTS_M, LAPS, RADII_M, Problem
from server.schemas.plan_docs import PlaceDoc
from server.schemas.result_docs import ReasonDoc
from server.schemas.strict_model import Asked, Strict

WayAction = Literal["take_off", "to", "height", "look", "orbit", "home", "rally", "back"]


class WayBody(Strict):
    """A way from where the vehicle is now; it is judged, not flown."""

    action: WayAction
    place: PlaceDoc | None = None
    """For "to", "look" and "orbit"."""
    height_m: Annotated[float, Field(ge=HEIGHTS_M[0], le=HEIGHTS_M[1]), Asked(initial=10.0)] = 10.0
    """Above the surface where it ends; for "take_off" and "home" above home. "look" and "back" have heights already."""
    radius_m: Annotated[float, Field(ge=RADII_M[0], le=RADII_M[1]), Asked(initial=20.0)] = 20.0
    """Of an orbit."""
    laps: Annotated[int, Field(ge=LAPS[0], le=LAPS[1]), Asked(initial=1)] = 1
    clockwise: bool = True
    """Seen from above."""
    speed_m_s: Annotated[float, Field(gt=0.0, le=50.0), Asked(min=0.5, max=20.0)] | None = None
    """Over ground; null: the profile's mean speed."""


class FlyWayBody(Strict):
    """The way that was judged last is flown."""

    id: str
    accept_return: bool = False
    """Also where only the vehicle's own return from it would not be clear."""


class WaySpeedBody(Strict):
    """On the rest of the way that is flown."""

    speed_m_s: Annotated[float, Field(gt=0.0, le=50.0), Asked(min=0.5, max=20.0)]


class WayDoc(Strict):
    """A judged way, from where the vehicle was."""

    id: str
    action: WayAction
    problem: Problem | Literal["others"] | None
    """null: certified. "return": the way itself is clear, the vehicle's own return from it would not be. "others": it
    is clear, and would lead near another vehicle of the station's in the air."""
    flies: bool = False
    """It is being flown."""
    notes: list[str]
    """Where it is not what was asked for: sentences."""
    reasons: list[ReasonDoc]
    clearance_m: float | None
    """Smallest distance to the surface; null: nothing is near."""
    required_m: float
    length_m: float
    seconds: float
    lands: bool
    """It ends with a landing; else with holding."""
    speed_m_s: float
    most_m_s: float
    """For no higher speed is it certified."""
    terrain_name: str
    """The surface model that it was judged over."""
    has_seen: bool
    """With what sensors have seen, and its shadow, in it."""


class GuidedState(Strict):
    """What guided flight has in hand."""

    way: WayDoc | None = None
    is_judging: bool = False
