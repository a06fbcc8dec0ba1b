"""Alerts, statuses and parts of maps as the sensors' nodes tell them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from server.scene.mirror import MapMirror
from telemetry.topics.obstacles import (
    MapDelta,
    MapOrigin,
    Obstacle,
    ObstacleAlert,
    PerceptionStatus,
    Region,
    Sensor,
    pack_keys,
)

ORIGIN = MapOrigin(37.7, 15.0, 1712.0)


def alert(
    alert_id: str = "radar-1", phase: Any = "begins", *, sensor: Sensor = "radar", kind: Any = "obstacle", **more: Any
) -> ObstacleAlert:
    fields: dict[str, Any] = {"t_mono_s": 10.0, "t_utc_s": 1000.0, "done_t_mono_s": 10.05, "text": "A wall", **more}
    return ObstacleAlert(alert_id, sensor, kind, phase, **fields)


def approach(**more: Any) -> ObstacleAlert:
    """Of the track t7."""
    return alert("t7", kind="approach", **more)


def obstacle(distance_m: float = 12.0) -> Obstacle:
    return Obstacle(
        region="roi",
        distance_m=distance_m,
        bearing_deg=90.0,
        off_nose_deg=0.0,
        height_difference_m=1.0,
        time_to_contact_s=4.0,
        enu_m=(distance_m, 0.0, 5.0),
        lat_deg=37.7,
        lon_deg=15.0,
        alt_amsl_m=1717.0,
        voxels=7,
        size_m=(2.0, 2.0, 2.0),
    )


def status(
    sensor: Sensor = "radar", state: Any = "running", *, occupied: bool = False, **more: Any
) -> PerceptionStatus:
    region = Region((0.0, 0.0, 5.0), 0.0, 10.0, 0.4, 2.0, occupied)
    fields: dict[str, Any] = {"origin": ORIGIN, "region": region, **more}
    return PerceptionStatus(sensor, state, "", t_mono_s=10.0, t_utc_s=1000.0, done_t_mono_s=10.05, **fields)


def delta(keys: ArrayLike, probability: ArrayLike = 200, explained: ArrayLike = 0, **more: Any) -> MapDelta:
    """``probability`` and ``explained`` may be one for all voxels."""
    k = np.asarray(keys, dtype=np.int32).reshape(-1, 3)
    fields: dict[str, Any] = {
        "sensor": "radar",
        "t_mono_s": 10.0,
        "t_utc_s": 1000.0,
        "revision": 1,
        "whole": False,
        "part": 0,
        "parts": 1,
        "origin": ORIGIN,
        "resolution_m": 1.0,
        **more,
    }
    return MapDelta(
        **fields,
        keys=pack_keys(k),
        probability=np.broadcast_to(np.asarray(probability, np.uint8), (len(k),)).tobytes(),
        explained=np.broadcast_to(np.asarray(explained, np.uint8), (len(k),)).tobytes(),
    )


def voxels_in(mirror: MapMirror) -> dict[tuple[int, ...], tuple[int, bool]]:
    v = mirror.voxels()
    rows = zip(v.keys.tolist(), v.probability.tolist(), v.explained.tolist(), strict=True)
    return {tuple(key): (p, e) for key, p, e in rows}
