"""How high autopilots really return when they are close to home already.

Near home they climb less than to the set return height: ArduCopter to at most RTL_CONE_SLOPE (3) times the
distance from home; PX4, within RTL_MIN_DIST (10 m), to where its cone RTL_CONE_ANG (45 degrees) is. Both keep
their own height where that is larger. The lower of the two counts, so that a certificate holds for either.
"""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64

SLOPE = 3.0
NEAR_SLOPE, NEAR_M = 1.0, 10.0


def return_altitudes(places_m: F64, home_xy_m: F64, home_alt_m: float, *, rtl_height_m: float, step_m: float) -> F64:
    """(N,) altitude at which a return from each of the (N, 3) places flies home.

    It is the lowest for all places within half of ``step_m``, the spacing of the places.
    """
    away_m = np.maximum(0.0, np.hypot(*(places_m[:, :2] - home_xy_m).T) - step_m / 2)
    cone_m = np.where(away_m <= NEAR_M, NEAR_SLOPE, SLOPE) * away_m
    return np.maximum(places_m[:, 2], home_alt_m + np.minimum(rtl_height_m, cone_m))
