"""Moving objects as they travel on the bus: tracks, what they forbid the vehicle to do, and what it might do instead.

Map frame as in ``telemetry.topics.obstacles``: east, north, up in metres from home; velocities are over ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.topics.obstacles import Count, MapOrigin

TracksState = Literal["waiting", "running", "frozen", "stale"]


@dataclass(frozen=True, slots=True)
class Track:
    """One object that is followed from radar frame to radar frame."""

    id: int
    """Of this run of the node, never used twice."""
    enu_m: tuple[float, float, float]
    """At the status's ``t_mono_s``; up is the vehicle's own height where the sensor knows no better."""
    velocity_enu_m_s: tuple[float, float]
    """East and north."""
    covariance_m2: tuple[float, float, float]
    """Of the place: east-east, east-north, north-north."""
    age_s: float
    """Since its birth."""
    updates: int
    """Frames that it was seen in."""
    moving: bool
    """Its speed over ground is more than its uncertainty accounts for."""
    range_m: float
    bearing_deg: float
    """Clockwise from true north."""
    closest_m: float
    """Predicted closest approach if both go on as they do; between middles, in the plane."""
    closest_in_s: float
    """0: it is not getting nearer."""
    dangerous: bool
    """The closest approach is inside the safety radius, soon enough to matter."""
    lat_deg: float
    lon_deg: float
    remembered: bool = False
    """It is where the radar cannot see it now: it stood there, or moved there as it did when it was seen last."""


@dataclass(frozen=True, slots=True)
class VelocityCone:
    """The vehicle's velocities over ground that lead into one object (velocity obstacle, Wessendorp 2021)."""

    track_id: int
    apex_enu_m_s: tuple[float, float]
    """The object's own velocity."""
    axis_deg: float
    """Direction from the vehicle to the object, clockwise from north."""
    half_angle_deg: float
    """asin(radius / range); 90 when the object is already inside the radius."""


@dataclass(frozen=True, slots=True)
class VelocityProposal:
    """The velocity nearest to the present one that leads into nothing, within the limits of speed and turn."""

    velocity_enu_m_s: tuple[float, float]
    hold_s: float
    """So long, until the last closest approach has passed."""
    closest_m: float
    """Predicted closest approach if it is flown."""
    text: str
    """For the pilot: "Turn 25 deg left, 4.2 m/s"."""


@dataclass(frozen=True, slots=True)
class TracksStatus:
    """The tracks node after each radar frame, and once a second when none comes."""

    state: TracksState
    """As ``PerceptionStatus.state``; frozen: the vehicle's own position or velocity is unknown."""
    text: str
    t_mono_s: float
    """When the newest frame that was followed was measured: one that is refused does not renew it. When this was said,
    before the first."""
    t_utc_s: float
    done_t_mono_s: float
    frames: int = 0
    dropped: tuple[Count, ...] = ()
    lost_frames: int = 0
    detections: int = 0
    """In the newest frame, after the gates."""
    tracks: tuple[Track, ...] = ()
    """Nearest first, at most 64."""
    hidden: int = 0
    """Tracks beyond those."""
    velocity_enu_m_s: tuple[float, float] | None = None
    """The vehicle's own."""
    max_speed_m_s: float = 0.0
    """The vehicle's limit that the proposal keeps to."""
    safety_radius_m: float = 0.0
    cones: tuple[VelocityCone, ...] = ()
    """Of the tracks that are dangerous or near, nearest first, at most 8."""
    proposal: VelocityProposal | None = None
    """None while the present velocity leads into nothing."""
    room_m: tuple[float, ...] = ()
    """How far the vehicle may fly level until known ground, in even directions clockwise from north, at most 40 m;
    empty: no surface model is known."""
    no_proposal: str = ""
    """Why there is none although one is needed."""
    origin: MapOrigin | None = None
    latency_s: float | None = None
