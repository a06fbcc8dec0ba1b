"""The circle around home at which a vehicle acts by its own parameters, which no list of a fence holds.

ArduPilot acts at FENCE_RADIUS where FENCE_TYPE says so and the fence is on, PX4 at GF_MAX_HOR_DIST; both count from
their own home. A flight is held against it as against an inclusion circle of a plan.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import LARGEST_M, NO_FENCE, Fence, FenceCircle, LatLon, place
from telemetry.flight.fence_actions import CIRCLE_BIT, is_switched_on

NAMES: dict[Firmware, str] = {"ardupilot": "FENCE_RADIUS", "px4": "GF_MAX_HOR_DIST"}
LEAST_M = 0.1
"""A circle of no size lets nothing fly: it is judged as one that is hardly larger."""


def radius_aboard_m(parameters: Mapping[str, float | None], firmware: Firmware) -> float | None:
    """At which the vehicle acts, horizontally from home; None: at none, or that was not read."""
    radius_m = parameters.get(NAMES[firmware])
    if not is_switched_on(parameters, firmware) or radius_m is None or not math.isfinite(radius_m):
        return None
    if firmware == "px4":
        return radius_m if radius_m > 0 else None
    return max(LEAST_M, radius_m) if int(parameters.get("FENCE_TYPE") or 0) & CIRCLE_BIT else None


def may_have_radius(parameters: Mapping[str, float | None], firmware: Firmware) -> bool:
    """It may act at one, and what was read does not tell at which."""
    if not is_switched_on(parameters, firmware):
        return False
    kinds = parameters.get("FENCE_TYPE") if firmware == "ardupilot" else CIRCLE_BIT
    radius_m = parameters.get(NAMES[firmware])
    is_told = radius_m is not None and math.isfinite(radius_m)
    return kinds is None or (bool(int(kinds) & CIRCLE_BIT) and not is_told)


def circle_aboard(parameters: Mapping[str, float | None], firmware: Firmware, home: LatLon | None) -> Fence:
    """``home``: the vehicle's, from which it counts."""
    radius_m = radius_aboard_m(parameters, firmware)
    if radius_m is None or home is None or radius_m > LARGEST_M:
        return NO_FENCE
    return Fence(circles=(FenceCircle(inclusion=True, centre_lat_lon_deg=place(*home), radius_m=radius_m),))
