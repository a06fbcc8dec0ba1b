"""Logs that lie on a vehicle, as they are listed and read."""

from __future__ import annotations

from dataclasses import dataclass

BLOCK_BYTES = 90
"""Of one LOG_DATA."""
MOST_BYTES = 728 * BLOCK_BYTES
"""That may be asked for at once: some 64 KiB, after which it is looked anew whether the vehicle is still on the
ground."""


@dataclass(frozen=True, slots=True)
class VehicleLog:
    number: int
    size_bytes: int
    """As the vehicle says; 0 of one that it could not look at."""
    begun_utc_s: float | None
    """None: the vehicle did not know the time."""
