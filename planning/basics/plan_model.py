"""The nouns of a plan, shared by every step: points, parameters, profile, path, mission, flown line.

Heights named ``alt_dsm_m`` are in the surface model's own vertical datum, ``alt_rel_home_m`` are
above the surface model at home, ``alt_amsl_m`` above mean sea level. ``xy_m`` are metres east and
north in the surface model's projected CRS. ``s_m`` is horizontal distance flown since the path's start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from mapping.geometry.arrays import F64, I64
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint
from planning.margins.following_error import Firmware, Way
from planning.terrain import SMALL_HOLE_M2

if TYPE_CHECKING:
    from planning.terrain.dsm import Dsm


@dataclass(frozen=True, slots=True)
class Poi:
    """A point of interest (POI), WGS84."""

    lat_deg: float
    lon_deg: float
    name: str = ""
    loiter_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera as eq. 1 of Melita 2020 needs it."""

    image_width_px: int
    image_height_px: int
    focal_mm: float
    sensor_width_mm: float
    sensor_height_mm: float


@dataclass(frozen=True, slots=True)
class VehicleProfile:
    """What a vehicle can do and how well it knows where it is."""

    name: str
    firmware: Firmware = "ardupilot"
    radius_m: float = 0.35
    """Half the largest extent, rotors included."""
    mean_speed_m_s: float = 3.0
    max_speed_m_s: float = 5.0
    max_climb_m_s: float = 2.5
    max_descent_m_s: float = 1.5
    max_accel_m_s2: float = 2.5
    max_jerk_m_s3: float = 1.0
    """The autopilot's corner and start smoothness (ArduCopter WPNAV_JERK)."""
    brake_decel_m_s2: float = 7.5
    """Of a stop at once (ArduCopter's BRAKE_MODE_DECEL_RATE)."""
    brake_jerk_m_s3: float = 5.0
    """And how fast that comes and goes (ArduCopter's PSC_JERK_XY)."""
    endurance_s: float = 1200.0
    reserve_share: float = 0.25
    """Part of the endurance that must be left on landing."""
    max_items: int = 650
    position_error_m: float = 2.5
    rtl_height_m: float = 30.0
    """Return-to-launch height above home set in the autopilot (RTL_ALT, RTL_RETURN_ALT)."""
    following_m: float | None = None
    """Farthest that the autopilot departs from the line; None: as measured (``planning.margins.following_error``)."""
    dsm_rms_m: float = 0.023
    """RMS error of the surface model's check points (Melita 2020, section 6.1)."""
    mass_kg: float = 2.0
    """At take-off."""
    rotors: int = 4
    rotor_diameter_m: float = 0.254
    downwash_m: float | None = None
    """Kept below the rotors; None: by momentum theory (``planning.margins.downwash``)."""
    camera: Camera | None = None

    @property
    def usable_endurance_s(self) -> float:
        """Flying time that leaves the reserve in the battery."""
        return self.endurance_s * (1 - self.reserve_share)


ANY_VEHICLE = VehicleProfile("any")
"""What is taken of a vehicle that nobody has described."""


@dataclass(frozen=True, slots=True)
class SurfaceParams:
    """Melita 2020, section 5: non-flat ball (R, H), then a Gaussian."""

    radius_m: float = 20.0
    height_m: float = 5.0
    smooth_sigma_m: float | None = None
    """None: R / 10."""
    floor: bool = True
    """Keep the smoothed surface above the DSM dilated with (R, 0.8 H); False is the paper's pipeline."""
    fill_hole_area_m2: float = SMALL_HOLE_M2
    method: Literal["auto", "exact", "fast"] = "auto"


@dataclass(frozen=True, slots=True)
class PathParams:
    """Melita 2020, section 6: sampling and LSPB timing, with the vehicle's vertical limits."""

    mean_speed_m_s: float = ANY_VEHICLE.mean_speed_m_s
    max_speed_m_s: float = ANY_VEHICLE.max_speed_m_s
    max_climb_m_s: float = ANY_VEHICLE.max_climb_m_s
    max_descent_m_s: float = ANY_VEHICLE.max_descent_m_s
    max_accel_m_s2: float = ANY_VEHICLE.max_accel_m_s2
    step_m: float = 0.1
    on_steep: Literal["raise", "slow"] = "raise"
    """Where the surface is steeper than the limits: raise the path, or fly slower on it."""


@dataclass(frozen=True, slots=True)
class MissionParams:
    """How a path becomes mission items."""

    max_items: int = ANY_VEHICLE.max_items
    excess_height_m: float = 1.0
    """The flown lines may run at most this far above the sampled profile; 0 asks for the closest fit."""
    end: Literal["rtl", "land"] = "rtl"
    altitude_reference: Literal["home", "amsl"] = "home"
    heading: Literal["path", "fixed", "point"] = "path"
    heading_deg: float = 0.0
    """For heading "fixed": clockwise from north."""
    look_at: tuple[float, float] | None = None
    """For heading "point": (lat_deg, lon_deg)."""
    gimbal_pitch_deg: float | None = None
    """-90 looks straight down; None leaves the gimbal alone."""
    camera_trigger_m: float | None = None
    """Distance between photos; None takes none."""
    land_transit_height_m: float | None = None
    """Height above home of the flight back before a landing at home; None: the height the certificate needs."""


@dataclass(frozen=True, slots=True)
class SampledPath:
    """The path as sampled every ``step_m``; vertices (home's entry point and POIs) are samples."""

    xy_m: F64
    """(N, 2)"""
    s_m: F64
    """(N,) horizontal distance from the first sample, strictly increasing inside a segment."""
    surface_alt_dsm_m: F64
    """(N,) the safe surface under each sample."""
    ground_alt_dsm_m: F64
    """(N,) the DSM under each sample; NaN where unknown."""
    alt_dsm_m: F64
    """(N,) the path: never below the surface."""
    vertex: I64
    """(V,) sample index of each vertex, first is 0 and last is N - 1."""
    vertex_poi: tuple[int | None, ...]
    """(V,) index of the vertex's POI; None for a home that is no POI."""


@dataclass(frozen=True, slots=True)
class Timing:
    """When the paper's law reaches each sample (Melita 2020, LSPB per segment)."""

    t_s: F64
    """(N,) seconds since the first sample, loiter included once it is over."""
    speed_m_s: F64
    """(N,) horizontal ground speed when passing the sample."""
    loiter_s: F64
    """(N,) seconds waited at the sample, 0 except at vertices."""


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One MAVLink mission item. Params may be NaN ("not given")."""

    command: int
    """MAV_CMD: `planning.basics.mav_cmd`"""
    frame: int
    """MAV_FRAME: 0 AMSL, 2 none, 3 relative to home, 10 above terrain."""
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lat_deg: float = 0.0
    lon_deg: float = 0.0
    alt_m: float = 0.0
    autocontinue: bool = True


@dataclass(frozen=True, slots=True)
class Home:
    """Where the vehicle takes off. ``alt_dsm_m`` is the surface model's height there."""

    lat_deg: float
    lon_deg: float
    alt_dsm_m: float
    """NaN when a file gives none."""
    vertical_datum: str | None = None
    """Datum of ``alt_dsm_m``; None: unknown."""


@dataclass(frozen=True, slots=True)
class PlannedFor:
    """With which vehicle and which demands a mission was planned: whoever flies it counts on the same."""

    profile: VehicleProfile
    way: Way = "auto"
    required_clearance_m: float | None = None
    """Set by hand; None: the sum of the terms."""
    max_height_above_ground_m: float | None = None


@dataclass(frozen=True, slots=True)
class Mission:
    """Items as uploaded, WITHOUT the home row that ArduPilot keeps at sequence 0."""

    home: Home
    items: tuple[MissionItem, ...]
    firmware: Firmware = "ardupilot"
    pois: tuple[Poi, ...] = ()
    cruise_speed_m_s: float | None = None
    warnings: tuple[str, ...] = ()
    """What a reader noticed: swapped coordinates, items it had to drop, guessed values."""
    planned_for: PlannedFor | None = None
    """None: the file does not say."""
    surface_sha256: str = ""
    """Of the surface model's file that it was planned over; empty: the file does not say."""
    surface_name: str = ""
    """Of that file, as far as the mission's says; a name proves nothing, two may share one."""
    fence: Fence = NO_FENCE
    rally: tuple[RallyPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class Unjudged:
    """Why a part of a mission cannot be judged, and what would mend it."""

    why: str
    """A sentence without its subject where items are named ("flies a spline."), a whole one otherwise."""
    mend: str
    item: int | None = None
    """Index into ``Mission.items``; None: the mission as a whole."""
    command: int | None = None
    """MAV_CMD of the item."""


@dataclass(frozen=True, slots=True)
class FlownLine:
    """The polyline that a vehicle flies through a mission, and its columns over home."""

    points_m: F64
    """(K, 3) x, y, alt_dsm of the line from the top of the take-off column to the last waypoint."""
    leg_item: I64
    """(K - 1,) index into ``Mission.items`` of the item each leg flies to."""
    home_xy_m: tuple[float, float]
    home_alt_dsm_m: float
    takeoff_alt_dsm_m: float
    ends_with_rtl: bool
    unjudged: tuple[Unjudged, ...] = ()
    """Why some items cannot be judged (terrain frame, spline, jump ...): such a mission is not certified."""
    landing_xy_m: tuple[float, float] | None = None
    """Where a landing item ends the flight, its column is judged as home's is; None without one."""
    notes: tuple[str, ...] = ()
    """What had to be assumed about home; does not stand in the way of a certificate."""
    fence: Fence = NO_FENCE
    """That the flight is held against."""
    rally: tuple[RallyPoint, ...] = ()
    """To which the vehicle may fly instead of home."""
    returns_above_rally: bool = True
    """PX4 counts the return height from the rally point; ArduPilot returns at the higher one of both heights."""


@dataclass(frozen=True, slots=True)
class Surfaces:
    """The safe surface and what was done to get it."""

    safe: Dsm
    """Dilated and smoothed; may cover only the part asked for, and be coarser than the DSM."""
    method: Literal["exact", "fast"]
    floor: Dsm | None = None
    """The DSM dilated with (R, 0.8 H) on the same grid as ``safe``, never above it; None in the paper's pipeline."""


def finite_or_none(value: float) -> float | None:
    """JSON knows no NaN and no infinity."""
    return value if math.isfinite(value) else None
