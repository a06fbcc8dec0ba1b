"""A vehicle's pose in a map as the state that it would have told there."""

from __future__ import annotations

import math

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from telemetry.topics.vehicle import VehicleState


def state_at(t_s: float, p_enu_m: F64, v_enu_m_s: F64 | None, R_enu_body: F64, home: LocalFrame) -> VehicleState:
    """Armed, with position and attitude of that very moment; metres and heights count from ``home``."""
    east, north, up = p_enu_m.tolist()
    # Coordinates are read at the height of home again.
    lat_deg, lon_deg, _ = home.to_geodetic([[east, north, 0.0]])[0].tolist()
    heading_rad, pitch_rad, roll_rad = attitude_of(R_enu_body)
    v = (None, None, None) if v_enu_m_s is None else v_enu_m_s.tolist()
    return VehicleState(
        1, 1, t_utc_s=t_s, heartbeat_t_mono_s=t_s, armed=True, position_t_mono_s=t_s, lat_deg=lat_deg, lon_deg=lon_deg,
        alt_amsl_m=home.alt_m + up, alt_rel_home_m=up, v_east_m_s=v[0], v_north_m_s=v[1],
        v_down_m_s=None if v[2] is None else -v[2], attitude_t_mono_s=t_s, roll_rad=roll_rad, pitch_rad=pitch_rad,
        heading_rad=heading_rad, home_lat_deg=home.lat_deg, home_lon_deg=home.lon_deg, home_alt_amsl_m=home.alt_m,
    )  # fmt: skip


def attitude_of(R_enu_body: F64) -> tuple[float, float, float]:
    """Heading, pitch and roll: the inverse of ``frames.attitude_rotation``."""
    R = R_enu_body
    pitch_rad = math.asin(min(1.0, max(-1.0, float(R[2, 1]))))
    if math.hypot(R[2, 0], R[2, 2]) < 1e-9:  # straight up or down: only heading and roll together are known
        return math.atan2(-R[1, 0], R[0, 0]) % (2 * math.pi), pitch_rad, 0.0
    return quaternions.heading(R), pitch_rad, math.atan2(-R[2, 0], R[2, 2])
