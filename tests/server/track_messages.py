"""Statuses of moving objects as the tracks node tells them."""

from __future__ import annotations

from typing import Any

from telemetry.topics.tracks import Track, TracksStatus, VelocityCone, VelocityProposal
from tests.server.obstacle_messages import ORIGIN


def track(track_id: int = 7, **more: Any) -> Track:
    """Thirty metres ahead (north), coming head-on at 3 m/s."""
    fields: dict[str, Any] = {
        "enu_m": (0.0, 30.0, 10.0),
        "velocity_enu_m_s": (0.0, -3.0),
        "covariance_m2": (0.25, 0.0, 1.0),
        "age_s": 2.0,
        "updates": 20,
        "moving": True,
        "range_m": 30.0,
        "bearing_deg": 0.0,
        "closest_m": 0.4,
        "closest_in_s": 5.0,
        "dangerous": True,
        "lat_deg": 37.70027,
        "lon_deg": 15.0,
        **more,
    }
    return Track(id=track_id, **fields)


def tracks_status(state: Any = "running", **more: Any) -> TracksStatus:
    fields: dict[str, Any] = {
        "t_mono_s": 10.0,
        "t_utc_s": 1000.0,
        "done_t_mono_s": 10.02,
        "tracks": (track(),),
        "velocity_enu_m_s": (0.0, 3.0),
        "max_speed_m_s": 5.0,
        "safety_radius_m": 3.0,
        "cones": (VelocityCone(7, (0.0, -3.0), 0.0, 5.7),),
        "proposal": VelocityProposal((1.5, 3.0), 5.0, 3.4, "Turn 27 deg right, 3.4 m/s"),
        "origin": ORIGIN,
        **more,
    }
    return TracksStatus(state, "", **fields)
