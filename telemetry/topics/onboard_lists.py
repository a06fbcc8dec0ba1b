"""The lists that a vehicle keeps, as they were read back from it, and what an upload of one came to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Item:
    """A mission item as the wire knows it, home left out."""

    command: int
    frame: int
    params: tuple[float | None, float | None, float | None, float | None]
    """None: NaN, "not given"."""
    lat_deg: float
    lon_deg: float
    alt_m: float
    autocontinue: bool = True


@dataclass(frozen=True, slots=True)
class OnboardMission:
    """What was read back from the vehicle."""

    items: tuple[Item, ...]
    """Without the home row of ArduPilot."""
    home_lat_deg: float | None
    home_lon_deg: float | None
    home_alt_amsl_m: float | None
    digest: str


PlaceList = Literal["fence", "rally"]
"""The lists that a vehicle keeps beside its mission."""


@dataclass(frozen=True, slots=True)
class PlacesOnboard:
    """Those lists as they were read."""

    fence: tuple[Item, ...] = ()
    rally: tuple[Item, ...] = ()
    unread: str = ""
    """Why they were not; empty when they were."""


@dataclass(frozen=True, slots=True)
class Rounded:
    """What the vehicle changed in an item."""

    item: int
    """1 is the first item of the mission; home does not count."""
    field: str
    sent: float | None
    kept: float | None


@dataclass(frozen=True, slots=True)
class UploadReport:
    verified: bool
    """The vehicle holds what was sent, but for what it rounded."""
    onboard: OnboardMission
    rounded: tuple[Rounded, ...]
    differences: tuple[str, ...]
    """Why it is not verified: sentences with item, field, sent and found value."""
    seconds: float
