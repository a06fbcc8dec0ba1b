"""From what perception found, in metres of the map, to what travels on the bus, with latitude and longitude."""

from __future__ import annotations

import math
from collections.abc import Mapping

from mapping.geometry.frames import LocalFrame
from mapping.perceiving.alerts import AlertEvent
from mapping.perceiving.obstacles import Found
from telemetry.topics.obstacles import Count, MapOrigin, Obstacle, ObstacleAlert, Sensor


def frame_of(origin: MapOrigin) -> LocalFrame:
    return LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)


def counts(dropped: Mapping[str, int]) -> tuple[Count, ...]:
    """Most first."""
    found = sorted(((count, what) for what, count in dropped.items() if count > 0), key=lambda c: (-c[0], c[1]))
    return tuple(Count(what, count) for count, what in found)


def obstacle_of(found: Found, frame: LocalFrame | None) -> Obstacle:
    """``frame`` None: nobody knows where the map lies."""
    place = (None, None, None) if frame is None else frame.to_geodetic([found.enu_m])[0].tolist()
    lat_deg, lon_deg, alt_amsl_m = place
    return Obstacle(
        region=found.region,
        distance_m=found.distance_m,
        bearing_deg=math.degrees(found.bearing_rad) % 360.0,
        off_nose_deg=math.degrees(found.off_nose_rad),
        height_difference_m=found.height_difference_m,
        time_to_contact_s=found.time_to_contact_s,
        enu_m=found.enu_m,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        alt_amsl_m=alt_amsl_m,
        voxels=found.voxels,
        size_m=found.size_m,
    )


def alert_of(
    event: AlertEvent, sensor: Sensor, frame: LocalFrame | None, *, utc_minus_mono_s: float, done_t_mono_s: float
) -> ObstacleAlert:
    """``frame`` None: nobody knows where the map lies."""
    return ObstacleAlert(
        id=event.id,
        sensor=sensor,
        kind=event.kind,
        phase=event.phase,
        t_mono_s=event.t_mono_s,
        t_utc_s=event.t_mono_s + utc_minus_mono_s,
        done_t_mono_s=done_t_mono_s,
        text=event.text,
        obstacle=None if event.obstacle is None else obstacle_of(event.obstacle, frame),
    )
