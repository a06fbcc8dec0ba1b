"""What a proposed velocity must keep to: the limits of the vehicle whose plan is on board."""

from __future__ import annotations

from planning.errors import DescribedError
from planning.vehicle_profile import parse_profile
from planning.velocity_obstacles import Limits
from telemetry.messages import PlanRecord
from telemetry.track_settings import USUAL_MAX_SPEED_M_S

USUAL = Limits(max_speed_m_s=USUAL_MAX_SPEED_M_S)


def limits_of(plan: PlanRecord) -> Limits:
    """Of its profile; the usual ones where it holds none that can be read."""
    try:
        profile = parse_profile(plan.profile_toml.encode(), where="plan on board")
    except DescribedError:
        return USUAL
    return Limits(max_speed_m_s=profile.max_speed_m_s)
