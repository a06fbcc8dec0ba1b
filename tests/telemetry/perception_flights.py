"""Made-up flights for tests of perception: a vehicle flies north towards a wall, past which its mission leads."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from mapping.geometry.frames import LocalFrame
from mapping.sensor_frames import CloudFrame, RadarFrame, RangeFrame, SlamPose, packed
from planning.basics.plan_model import Home, Mission, MissionItem
from planning.formats.wpl import write_wpl
from telemetry.topics.messages import PlanRecord
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import PLAN

HOME = (45.0, 10.0, 120.0)
FRAME = LocalFrame(*HOME)
WALL_NORTH_M = 40.0
SPEED_M_S = 3.0
UP_M = 10.0


def mission() -> PlanRecord:
    """Straight north over home, through the wall."""
    (lat, lon, _), (far_lat, far_lon, _) = FRAME.to_geodetic([[0.0, 5.0, 0.0], [0.0, 120.0, 0.0]])
    items = (
        MissionItem(22, 3, alt_m=UP_M),
        MissionItem(16, 3, lat_deg=lat, lon_deg=lon, alt_m=UP_M),
        MissionItem(16, 3, lat_deg=far_lat, lon_deg=far_lon, alt_m=UP_M),
    )
    return replace(PLAN, mission_wpl=write_wpl(Mission(Home(*HOME), items)))


def state_at(t_s: float, t0_mono_s: float, t0_utc_s: float, **changes: Any) -> VehicleState:
    """``t_s`` seconds after take-off at 10 m over home."""
    north_m = max(0.0, SPEED_M_S * t_s)
    (lat_deg, lon_deg, _) = FRAME.to_geodetic([[0.0, north_m, UP_M]])[0]
    t_mono_s = t0_mono_s + t_s
    state = VehicleState(
        1,
        1,
        autopilot="ardupilot",
        t_utc_s=t0_utc_s + t_s,
        heartbeat_t_mono_s=t_mono_s,
        mode="AUTO",
        armed=True,
        landed="in_air",
        position_t_mono_s=t_mono_s,
        lat_deg=float(lat_deg),
        lon_deg=float(lon_deg),
        alt_amsl_m=HOME[2] + UP_M,
        alt_rel_home_m=UP_M,
        v_north_m_s=SPEED_M_S,
        v_east_m_s=0.0,
        v_down_m_s=0.0,
        ground_speed_m_s=SPEED_M_S,
        attitude_t_mono_s=t_mono_s,
        roll_rad=0.0,
        pitch_rad=0.02 * math.sin(t_s),
        heading_rad=0.1 * math.sin(0.7 * t_s) % math.tau,
        gnss_t_mono_s=t_mono_s,
        gnss_fix="rtk_fixed",
        home_lat_deg=HOME[0],
        home_lon_deg=HOME[1],
        home_alt_amsl_m=HOME[2],
    )
    return replace(state, **changes)


def wall_body_m(t_s: float, count: int, seed: int) -> np.ndarray:
    """(N, 3) places on the wall as the sensor sees them, x right, y forward, z up."""
    rng = np.random.default_rng(seed)
    away_m = WALL_NORTH_M - SPEED_M_S * t_s
    enu = np.column_stack([rng.uniform(-6, 6, count), np.full(count, away_m), rng.uniform(-2, 4, count)])
    psi = 0.1 * math.sin(0.7 * t_s)
    c, s = math.cos(psi), math.sin(psi)
    return np.column_stack([c * enu[:, 0] - s * enu[:, 1], s * enu[:, 0] + c * enu[:, 1], enu[:, 2]])


def radar_frame(t_s: float, number: int, t0_mono_s: float, t0_utc_s: float, *, count: int = 12) -> RadarFrame:
    xyz = wall_body_m(t_s, count, number)
    xyz[:, 2] = np.abs(xyz[:, 2]) * 0.1
    speeds = -SPEED_M_S * xyz[:, 1] / np.linalg.norm(xyz, axis=1)
    return RadarFrame(
        t0_mono_s + t_s, t0_utc_s + t_s, number, "test", packed(xyz), packed(speeds), packed(np.full(count, 30.0))
    )


def cloud_frame(t_s: float, number: int, t0_mono_s: float, t0_utc_s: float, *, count: int = 4000) -> CloudFrame:
    return CloudFrame(t0_mono_s + t_s, t0_utc_s + t_s, number, "test", packed(wall_body_m(t_s, count, number)))


def range_frame(t_s: float, number: int, t0_mono_s: float, t0_utc_s: float) -> RangeFrame:
    psi = 0.1 * math.sin(0.7 * t_s)
    away_m = (WALL_NORTH_M - SPEED_M_S * t_s) / math.cos(psi)
    return RangeFrame(
        t0_mono_s + t_s, t0_utc_s + t_s, number, "test", (0.0,), (0.0,), (away_m,), (0.0,), 0.4, 0.2, 40.0
    )


def slam_pose(t_s: float, t0_mono_s: float) -> SlamPose:
    """In a frame turned by 90 degrees against north."""
    psi = 0.1 * math.sin(0.7 * t_s) + math.pi / 2
    return SlamPose(
        t0_mono_s + t_s,
        (max(0.0, SPEED_M_S * t_s), 0.0, 0.0),
        (math.cos(psi / 2), 0.0, 0.0, -math.sin(psi / 2)),
    )
