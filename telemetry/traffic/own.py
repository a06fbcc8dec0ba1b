"""The vehicle itself, as other aircraft are held against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapping.geometry.frames import offset_m
from telemetry.topics.traffic import GONE_S
from telemetry.topics.vehicle import VehicleState
from telemetry.traffic.report import Position

ASSUMED_M_S = 20.0
"""Of a vehicle that does not tell its speed."""
_ECHO_M, _ECHO_S, _ECHO_M_S = 15.0, 2.0, 3.0
"""The echo of its own transponder is so near: receivers' errors and what it flies until it is heard; and so much faster
or slower."""
_HERE_M, _HERE_S = 100.0, 10.0
"""What bears the vehicle's own number may lag so far behind it; farther off it is somebody else under that number."""


@dataclass(frozen=True, slots=True)
class Own:
    """``None`` where it is not told."""

    lat_deg: float
    lon_deg: float
    age_s: float
    v_east_m_s: float | None
    v_north_m_s: float | None
    climb_m_s: float | None
    heading_rad: float | None
    alt_amsl_m: float | None
    geoid_m: float | None
    """The sea's level above the ellipsoid, as the vehicle's receiver counts it."""
    within_m: float
    alt_within_m: float

    @staticmethod
    def of(state: VehicleState, now_s: float) -> Own | None:
        """None while it is unknown, or has not been heard for long."""
        if state.lat_deg is None or state.lon_deg is None or state.position_t_mono_s is None:
            return None
        age_s = max(0.0, now_s - state.position_t_mono_s)
        if age_s > GONE_S:
            return None
        amsl_m, ellipsoid_m = state.gnss_alt_amsl_m, state.gnss_alt_ellipsoid_m
        return Own(
            lat_deg=state.lat_deg,
            lon_deg=state.lon_deg,
            age_s=age_s,
            v_east_m_s=state.v_east_m_s,
            v_north_m_s=state.v_north_m_s,
            climb_m_s=state.climb_m_s,
            heading_rad=state.heading_rad,
            alt_amsl_m=state.alt_amsl_m,
            geoid_m=None if amsl_m is None or ellipsoid_m is None else ellipsoid_m - amsl_m,
            within_m=max(3.0, 2.0 * (state.horizontal_accuracy_m or 0.0)),
            alt_within_m=max(10.0, 2.0 * (state.vertical_accuracy_m or 0.0)),
        )

    @property
    def speed_m_s(self) -> float:
        if self.v_east_m_s is None or self.v_north_m_s is None:
            return ASSUMED_M_S
        return math.hypot(self.v_east_m_s, self.v_north_m_s)

    @property
    def nose_rad(self) -> float | None:
        """Where it looks, else where it goes."""
        if self.heading_rad is not None:
            return self.heading_rad
        if self.v_east_m_s is None or self.v_north_m_s is None or self.speed_m_s < 1.0:
            return None
        return math.atan2(self.v_east_m_s, self.v_north_m_s) % math.tau

    def distance_m(self, position: Position) -> float:
        return math.hypot(*offset_m((self.lat_deg, self.lon_deg), position.lat_deg, position.lon_deg))

    def may_be_echo(self, position: Position) -> bool:
        """It was where the vehicle is, and as fast: without a speed on both sides nobody can say."""
        if position.speed_m_s is None or self.v_east_m_s is None or self.v_north_m_s is None:
            return False
        if self.distance_m(position) > _ECHO_M + (_ECHO_S + self.age_s + position.delay_s) * self.speed_m_s:
            return False
        if position.course_rad is None:
            return abs(position.speed_m_s - self.speed_m_s) <= _ECHO_M_S
        east = position.speed_m_s * math.sin(position.course_rad)
        north = position.speed_m_s * math.cos(position.course_rad)
        return math.hypot(east - self.v_east_m_s, north - self.v_north_m_s) <= _ECHO_M_S

    def is_here(self, position: Position, age_s: float) -> bool:
        return self.distance_m(position) <= _HERE_M + (_HERE_S + self.age_s + age_s) * self.speed_m_s
