"""What goes into perception and what comes out of it. Times are those of one monotonic clock."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from mapping.geometry.poses import Pose
from mapping.perceiving.alerts import AlertEvent
from mapping.perceiving.braking import Braking
from mapping.perceiving.obstacles import Found
from mapping.radar.targets import Variant

State = Literal["waiting", "running", "blind", "frozen", "stale"]


@dataclass(frozen=True, slots=True)
class Settings:
    """Of one sensor's perception. Defaults: Bigazzi 2022 and Miccinesi 2022, for the radar."""

    depth_m: float = 10.0
    fov_rad: float = 24 * np.pi / 180
    height_m: float = 2.0
    resolution_m: float = 1.0
    paper_bare: bool = False
    """As the papers: no known ground, no corridor, every target believed at once."""
    radar_variant: Variant = "heading_only"
    gate_azimuth_rad: float = math.radians(45)
    gate_low_rad: float = 0.0
    gate_high_rad: float = math.radians(20)
    """Where the radar's targets must be measured to be used: ``Gate``."""
    cloud_voxel_m: float = 0.0
    """Edge of the voxels of which one point each is used of a cloud; 0, as Bigazzi 2022: all points are."""
    vehicle_radius_m: float = 0.5
    position_error_m: float = 0.3
    braking: Braking = field(default_factory=Braking)
    memory_limit_bytes: int = 1_000_000_000

    def makes_another_map(self, other: Settings) -> bool:
        """Whether a map cannot go on under the other settings: it begins anew."""
        return (self.resolution_m, self.memory_limit_bytes) != (other.resolution_m, other.memory_limit_bytes)


@dataclass(frozen=True, slots=True)
class SearchedRegion:
    """The sector ahead, as it was for this frame."""

    enu_m: tuple[float, float, float]
    heading_rad: float
    depth_m: float
    fov_rad: float
    height_m: float
    occupied: bool
    nearest_m: float = 0.0
    """What is nearer cannot be seen."""
    hidden_m: float | None = None
    """Distance of the nearest thing that stood in the way and cannot be seen now, so that it may still."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameResult:
    """What one frame, or the passing of time, has come to."""

    t_mono_s: float
    state: State
    text: str
    """For the operator, empty while running."""
    accepted: bool
    """The frame is in the map."""
    pose: Pose | None = None
    points: int = 0
    """After the gates."""
    region: SearchedRegion | None = None
    corridor_m: float = 0.0
    corridor_occupied: bool = False
    obstacles: tuple[Found, ...] = ()
    """In region and corridor, nearest first, at most 16."""
    sweep_m: tuple[float | None, ...] = ()
    alerts: tuple[AlertEvent, ...] = ()
    divergence_m: float | None = None
    placed: bool = True
    """Whether anybody knows where the map lies; not while it stands in the camera's own frame alone."""

    def with_alerts(self, more: list[AlertEvent], *, divergence_m: float | None) -> FrameResult:
        """The same, with what else is to be told."""
        return replace(self, alerts=(*self.alerts, *more), divergence_m=divergence_m)
