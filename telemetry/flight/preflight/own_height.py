"""How high the ground under the vehicle is by its own account, where it is surveyed well enough to say so.

The surface model around the vehicle says between which heights it stands; a receiver with fixed RTK corrections
says it to centimetres, if its datum is the model's. What it tells is the antenna's height, in a geoid that need not
be the model's, so the account is an interval, too. It counts only where it is narrower than the model's and both
can be true.
"""

from __future__ import annotations

import math

from planning.certificate.home_ground import HomeGround
from planning.terrain.vertical_datum import is_amsl
from telemetry.topics.vehicle import VehicleState

ANTENNA_M = 0.5
"""The antenna sits at most so high above the ground that the vehicle stands on."""
GEOIDS_M = 0.5
"""By how much the receiver's geoid (EGM96) and the model's levelling network differ, at most, where both are good."""
SIGMAS = 3.0
"""Receivers claim one sigma."""


def own_ground(state: VehicleState, vertical_datum: str | None) -> tuple[float, float] | None:
    """(lowest, highest) ground under the vehicle in the model's datum; None without RTK, accuracy or common datum."""
    if state.gnss_fix != "rtk_fixed" or state.vertical_accuracy_m is None or vertical_datum is None:
        return None
    error_m = SIGMAS * state.vertical_accuracy_m
    if is_amsl(vertical_datum):
        alt_m, error_m = state.gnss_alt_amsl_m, error_m + GEOIDS_M
    elif "ellipsoid" in vertical_datum.lower():
        alt_m = state.gnss_alt_ellipsoid_m
    else:
        return None
    return None if alt_m is None else (alt_m - ANTENNA_M - error_m, alt_m + error_m)


def narrowed(own_m: tuple[float, float] | None, around: HomeGround) -> tuple[float, float] | None:
    """What both accounts allow; None where they contradict each other or the vehicle's adds nothing."""
    if own_m is None or not math.isfinite(around.low_dsm_m):
        return None
    low_m, high_m = max(own_m[0], around.low_dsm_m), min(own_m[1], around.high_dsm_m)
    is_narrower = high_m - low_m < around.high_dsm_m - around.low_dsm_m
    return (low_m, high_m) if low_m <= high_m and is_narrower else None
