"""What is known of one vehicle, and where a simulated one really is.

Missing values are None, never NaN. Clocks: ``t_mono_s`` is this machine's monotonic clock, the same in all its
processes; ``t_utc_s`` counts seconds since 1970. Angles are radians but for latitude and longitude.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Autopilot = Literal["ardupilot", "px4", "other"]
Landed = Literal["on_ground", "taking_off", "in_air", "landing"]
IN_THE_AIR: frozenset[Landed] = frozenset({"taking_off", "in_air", "landing"})
GnssFix = Literal["none", "no_fix", "2d", "3d", "dgps", "rtk_float", "rtk_fixed"]
FenceBreach = Literal["none", "floor", "ceiling", "boundary"]
EstimatorPart = Literal["velocity", "place", "height", "compass", "airspeed", "terrain"]
RadarKind = Literal["model", "iq"]
"""Of a simulated radar. model: targets, with errors drawn to the table of the real one's; iq: samples of its
converters, and the whole chain of processing."""


@dataclass(frozen=True, slots=True)
class HomePlace:
    """By the vehicle's own heights above the sea."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


@dataclass(frozen=True, slots=True)
class VehicleState:
    """The latest of everything, each group with the time at which its last message came."""

    system_id: int
    component_id: int
    autopilot: Autopilot = "other"
    vehicle_type: int = 0
    """MAV_TYPE"""
    firmware_version: str | None = None
    t_utc_s: float = 0.0
    """When the newest message came."""

    heartbeat_t_mono_s: float | None = None
    mode: str = ""
    """The autopilot's own name of its mode: AUTO, GUIDED, RTL (ArduPilot), MISSION, HOLD (PX4) ..."""
    armed: bool = False
    critical: bool = False
    """MAV_STATE critical or emergency: a failsafe is active."""
    landed: Landed | None = None
    ready_to_arm: bool | None = None
    """The pre-arm bit of SYS_STATUS; the vehicle's own words count more."""
    not_ready_words: tuple[str, ...] = ()
    """What is in the way of arming, as the vehicle said last; nothing once it is ready."""
    not_ready_t_mono_s: float | None = None

    position_t_mono_s: float | None = None
    lat_deg: float | None = None
    lon_deg: float | None = None
    alt_amsl_m: float | None = None
    alt_rel_home_m: float | None = None
    v_north_m_s: float | None = None
    v_east_m_s: float | None = None
    v_down_m_s: float | None = None
    ground_speed_m_s: float | None = None
    climb_m_s: float | None = None

    attitude_t_mono_s: float | None = None
    roll_rad: float | None = None
    pitch_rad: float | None = None
    heading_rad: float | None = None
    """Clockwise from true north, 0 to 2 pi."""

    battery_t_mono_s: float | None = None
    battery_v: float | None = None
    battery_v_t_mono_s: float | None = None
    """When it was told: of two messages about the battery one may not know it. None in vehicles' own logs."""
    battery_a: float | None = None
    battery_share: float | None = None
    """0 to 1"""
    battery_used_mah: float | None = None

    gnss_t_mono_s: float | None = None
    gnss_fix: GnssFix = "none"
    satellites: int | None = None
    hdop: float | None = None
    horizontal_accuracy_m: float | None = None
    """As the receiver claims (one sigma)."""
    vertical_accuracy_m: float | None = None
    gnss_alt_amsl_m: float | None = None
    """Of the antenna, as the receiver itself says: above its own geoid."""
    gnss_alt_ellipsoid_m: float | None = None

    home_lat_deg: float | None = None
    home_lon_deg: float | None = None
    home_alt_amsl_m: float | None = None

    mission_item: int | None = None
    """Sequence number that the vehicle flies to, as the vehicle counts (ArduPilot: 0 is home)."""
    mission_items: int | None = None
    mission_reached: int | None = None
    """Last in this flight and of this mission, if it does not lie ahead again."""
    """Last sequence number that the vehicle said it reached."""
    mission_id: int | None = None
    """MISSION_CURRENT.mission_id; None when unsupported or 0."""

    rc_rssi: float | None = None
    """0 to 1"""
    wind_t_mono_s: float | None = None
    """None in recordings of before it was kept, and in vehicles' own logs."""
    wind_speed_m_s: float | None = None
    wind_from_rad: float | None = None
    """Direction that the wind comes from, clockwise from north."""
    estimator_t_mono_s: float | None = None
    estimator_ok: bool | None = None
    """The autopilot's position estimate is usable."""
    fence_ok: bool | None = None
    """The fence bit of SYS_STATUS; None: no fence is switched on, or it is not told."""
    fence_breach: FenceBreach | None = None
    """What of its fence the vehicle is beyond, of FENCE_STATUS; None: not told."""
    fence_kinds_untaken: int = 0
    """Bits of ArduPilot's FENCE_TYPE that were added while its fence was on: it may not act on them yet."""
    estimator_ratio: float | None = None
    """How far its measurements disagree, the worst kind; 1 is where they are refused (PX4: test ratio; ArduPilot: the
    innovation over what its filter allows)."""
    estimator_ratio_of: EstimatorPart | None = None

    vibration_t_mono_s: float | None = None
    vibration_m_s2: float | None = None
    """Of the accelerometers, the worst axis that the autopilot tells."""
    clipped: int | None = None
    """Samples at the end of an accelerometer's range, all of them since the start."""


@dataclass(frozen=True, slots=True)
class SimTruth:
    """Where the simulated vehicle really is: for simulated sensors and for tests, for nobody else."""

    t_mono_s: float
    t_utc_s: float
    t_sim_s: float
    home_lat_deg: float
    home_lon_deg: float
    home_alt_amsl_m: float
    position_enu_m: tuple[float, float, float]
    """From the simulation's origin, z = 0 on the ground there."""
    velocity_enu_m_s: tuple[float, float, float]
    roll_rad: float
    pitch_rad: float
    heading_rad: float
    armed: bool
