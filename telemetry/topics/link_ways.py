"""The ways over which one vehicle is reached: radios and networks, each with what is known of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

WayIdentity = Literal["known", "asked", "other"]
"""known: the adopted vehicle is at its end; asked: by its numbers, and its clock is being compared; other: by its
clock it is another vehicle."""


@dataclass(frozen=True, slots=True)
class RadioSignal:
    """RADIO_STATUS in the radio's own units, 0 to 254: of SiK about 1.9 to the dB; 255: not known."""

    rssi: int
    noise: int
    remote_rssi: int
    """As the vehicle's radio receives."""
    remote_noise: int


@dataclass(frozen=True, slots=True)
class WayStatus:
    """One of the ways to the adopted vehicle."""

    address: str
    peer: str
    identity: WayIdentity
    in_use: bool
    """Orders go over it, and the vehicle's state comes from it."""
    silent_s: float | None = None
    """Age of the last packet; None: none yet, or the far end hung up."""
    quality: float | None = None
    """Share of the packets of the last seconds that arrived."""
    round_trip_s: float | None = None
    signal: RadioSignal | None = None
