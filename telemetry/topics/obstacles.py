"""What perception makes of sensor frames, as it travels on the bus: maps, regions, alerts, avoidance.

Map frame: east, north, up in metres from an origin on the WGS84 ellipsoid's tangent plane there; up counts from the
height of the vehicle's home, as ``alt_rel_home_m`` does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import I32
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings

Sensor = Literal["radar", "vision", "ranges"]
SENSORS: tuple[Sensor, ...] = ("radar", "vision", "ranges")

MapName = Literal["radar", "vision", "ranges", "vision_flight"]
"""Each sensor's; vision_flight: all that the camera has seen on its way, beside its local map."""
MAP_NAMES: tuple[MapName, ...] = (*SENSORS, "vision_flight")


AlertSource = Literal["radar", "vision", "ranges", "traffic"]
"""traffic: other aircraft tell of themselves (``telemetry.topics.traffic``)."""


def sensor_of(name: MapName) -> Sensor:
    """Whose map it is."""
    return "vision" if name == "vision_flight" else name


@dataclass(frozen=True, slots=True)
class MapOrigin:
    """Of the map frame."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    """Of home: up = 0."""


@dataclass(frozen=True, slots=True)
class MapDelta:
    """Voxels of one map that have changed. Cut into parts where it is large."""

    sensor: MapName
    t_mono_s: float
    """Of the newest frame in it."""
    t_utc_s: float
    revision: int
    whole: bool
    """The map is this and nothing else: forget what came before (with ``part`` 0)."""
    part: int
    parts: int
    origin: MapOrigin
    resolution_m: float
    keys: bytes
    """(N, 3) little-endian int32: floor(enu / resolution)"""
    probability: bytes
    """(N,) uint8, 255 is 1: occupied above 127"""
    explained: bytes
    """(N,) uint8, 1: known ground"""
    since: int = 0
    """Revision that these changes were made to; who has another one asks for the whole map. Means nothing if whole."""
    began_mono_s: float = 0.0
    """Since when there is this map. Another one: it is another map, and what the one before held is not in it because
    nobody has looked again yet. The same one may be laid anew from its frames."""
    clear_count: int = 0
    """``PerceptionSettings.clear_count`` that its node knew of: who has ordered otherwise since passes this over."""


def pack_keys(keys: NDArray[np.integer]) -> bytes:
    return np.ascontiguousarray(keys, dtype="<i4").tobytes()


def unpack_keys(data: bytes) -> I32:
    """(N, 3)"""
    return np.frombuffer(data, dtype="<i4").reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A cluster of occupied, unexplained voxels; ``distance_m`` and so on are those of its nearest voxel."""

    region: Literal["roi", "corridor"]
    distance_m: float
    """From the vehicle, 3-D."""
    bearing_deg: float
    """Clockwise from true north."""
    off_nose_deg: float
    """Clockwise from the heading, -180 to 180."""
    height_difference_m: float
    """Top of the cluster above the vehicle."""
    time_to_contact_s: float | None
    """At the present velocity; None while it is not getting nearer."""
    enu_m: tuple[float, float, float]
    lat_deg: float | None
    """None, as the height: the map stands in the camera's own frame, and nobody knows where that is."""
    lon_deg: float | None
    alt_amsl_m: float | None
    voxels: int
    size_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Region:
    """The sector ahead that is searched (Bigazzi 2022, eq. A1), as it was for this frame."""

    enu_m: tuple[float, float, float]
    """Its tip."""
    heading_rad: float
    depth_m: float
    fov_rad: float
    height_m: float
    occupied: bool
    nearest_m: float = 0.0
    """What is nearer cannot be seen."""
    hidden_m: float | None = None
    """Distance of the nearest thing that stood in the way and cannot be seen now, so that it may still."""


@dataclass(frozen=True, slots=True)
class MissionConflict:
    """The first place of the mission ahead that the live map comes too near to."""

    ahead_m: float
    """Along the mission, from the vehicle."""
    time_s: float | None
    """Until it is reached at the present speed."""
    item: int
    """Of the mission that is flown to there, 1 is the first."""
    distance_m: float
    """Between the mission's line and the obstacle; the vehicle's radius is not taken off."""
    enu_m: tuple[float, float, float]
    """Of the obstacle."""
    lat_deg: float
    lon_deg: float
    voxels: int
    top_unseen: bool = False
    """It may end below the mission's line: nobody has seen how high it is."""


@dataclass(frozen=True, slots=True)
class Count:
    """So many frames, points or events, and of what."""

    what: str
    count: int


@dataclass(frozen=True, slots=True)
class Basis:
    """What was known when a frame was worked on: with it a recording's map comes out exactly as live."""

    taken_t_mono_s: float
    """When the work on the frame began."""
    vehicle_t_utc_s: float = 0.0
    """``VehicleState.t_utc_s`` of the newest state."""
    camera_t_mono_s: float = 0.0
    """Of the newest pose of the camera's own."""
    ground: bool = False
    """Whether known ground lay under the map."""
    run: str = ""
    """Of the node: one that was started again began with an empty map."""


@dataclass(frozen=True, slots=True)
class FlightMapStatus:
    """The camera's map of the whole flight."""

    voxels_occupied: int
    map_bytes: int
    part: int = 1
    """Another one begins, empty, where the camera's path breaks off."""
    why: str = ""
    """It began; empty for the first."""


@dataclass(frozen=True, slots=True)
class PerceptionStatus:
    """One sensor's node after each frame, and once a second when none comes."""

    sensor: Sensor
    state: Literal["waiting", "running", "blind", "frozen", "stale"]
    """waiting: no frame yet; blind: it says that it sees nothing; frozen: no position, so the map stands still;
    stale: frames have stopped."""
    text: str
    """Why, and what to do; empty while running."""
    t_mono_s: float
    """When the newest frame was measured, or when this was said."""
    t_utc_s: float
    done_t_mono_s: float
    """When its map, regions and alerts were done."""
    frames: int = 0
    dropped: tuple[Count, ...] = ()
    """Frames and points that were refused, by reason."""
    lost_frames: int = 0
    points: int = 0
    """In the newest frame, after the gates."""
    voxels_occupied: int = 0
    voxels_explained: int = 0
    map_bytes: int = 0
    map_revision: int = 0
    clear_count: int = 0
    """As ``MapDelta.clear_count``."""
    origin: MapOrigin | None = None
    region: Region | None = None
    corridor_m: float = 0.0
    """Length of the corridor along the mission ahead that is searched; 0: there is no mission."""
    corridor_occupied: bool = False
    obstacles: tuple[Obstacle, ...] = ()
    """In region and corridor, nearest first, at most 16."""
    sweep_m: tuple[float | None, ...] = ()
    """Nearest unexplained occupied voxel within 5 m of the vehicle's height in 72 sectors of 5 degrees, clockwise from
    the nose (the first is centred on it)."""
    conflict: MissionConflict | None = None
    divergence_m: float | None = None
    """Vision: between the camera's own path and the GNSS path, since they were last laid over each other."""
    latency_s: float | None = None
    """Median of the last frames, from measuring to done."""
    basis: Basis | None = None
    """None when no frame was worked on."""
    flight_map: FlightMapStatus | None = None
    """Where the map is local."""
    placed: bool = True
    """Whether anybody knows where the map lies; until then bearings and distances hold, places do not."""


@dataclass(frozen=True, slots=True)
class ObstacleAlert:
    """Something has entered a region, is still there (told again at most once a second), or has left it."""

    id: str
    """One per obstacle and sensor, from begin to end."""
    sensor: AlertSource
    kind: Literal["obstacle", "conflict", "approach", "divergence", "sensor", "avoidance", "traffic"]
    """conflict: on the mission ahead, beyond the regions; approach: a track whose closest approach will be too near;
    divergence, sensor: of the sensor itself; avoidance: it does not watch any more, by whatever cause; traffic: another
    aircraft may come too near."""
    phase: Literal["begins", "goes_on", "ends"]
    t_mono_s: float
    """When the frame was measured that showed it."""
    t_utc_s: float
    done_t_mono_s: float
    text: str
    """One line for the operator."""
    obstacle: Obstacle | None = None


@dataclass(frozen=True, slots=True)
class GroundNotice:
    """The surface model that counts as known ground."""

    terrain_id: str
    name: str
    elevation_npy: str
    """Path of a (rows, columns) float32 array, row 0 northernmost, NaN unknown."""
    crs_wkt: str
    west_m: float
    north_m: float
    resolution_m: float
    sha256: str


@dataclass(frozen=True, slots=True)
class PerceptionSettings:
    """How the maps are made and what is searched. Defaults: Bigazzi 2022 and Miccinesi 2022."""

    radar_depth_m: float = 10.0
    vision_depth_m: float = 7.0
    ranges_depth_m: float = 7.0
    fov_deg: float = 24.0
    height_m: float = 2.0
    """Of the region; the vehicle is at its middle."""
    paper_bare: bool = False
    """As the papers: no known ground, no corridor."""
    radar_variant: Literal["heading_only", "full_attitude", "full_attitude_flat"] = "heading_only"
    radar_azimuth_deg: float = 45.0
    """Of the radar's gate, to both sides; targets outside of it are not used."""
    radar_low_deg: float = 0.0
    radar_high_deg: float = 20.0
    """Its elevations."""
    cloud_voxel_m: float = 0.0
    """Edge of the voxels of which one point each is used of the camera's clouds; 0: all points are."""
    climb_m_s: float = 1.5
    """By itself, over what stands in the way (V2)."""
    comes_down: bool = True
    """After a climb the rest is planned again with what was seen, and flown at its proper height once certified."""
    climb_ceiling_m: float = 30.0
    """The most that it climbs, or a prepared way leads, above the plan."""
    vehicle_radius_m: float = 0.5
    position_error_m: float = 0.3
    brake_decel_m_s2: float = 7.5
    brake_jerk_m_s3: float = 5.0
    """Both of the vehicle's profile: ``mapping.perceiving.braking.Braking``."""
    clear_count: int = 0
    """Raised by one to have all maps emptied."""
    radar_resolution_m: float = 1.0
    vision_resolution_m: float = 0.5
    """Of the range finder's map, too."""
    memory_limit_bytes: int = 1_000_000_000
    """Per map; beyond it the map takes little or nothing new, and says so."""
    safety_radius_m: float = 3.0
    """Kept from moving objects, between middles."""
    approach_s: float = 8.0
    """A closest approach later than this is not alerted yet."""
    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    velocities: VelocitySettings = field(default_factory=VelocitySettings)


AvoidBy = Literal["climb", "sidestep"]
"""sidestep: past objects that are followed, level; it climbs over what it cannot step aside of."""


@dataclass(frozen=True, slots=True)
class Eye:
    """A sensor that works."""

    sensor: Sensor
    since_t_mono_s: float
    """Without a break."""
    depth_m: float
    """So far ahead it is relied on."""
    largest_speed_m_s: float
    """From which that is enough to stop in."""
    is_late: bool = False
    """What it sees in the way counts; that nothing is in the way does not."""


@dataclass(frozen=True, slots=True)
class AvoidanceStatus:
    """The link node's: what is done about obstacles by itself."""

    enabled: bool = False
    state: Literal[
        "off", "blind", "lost", "watching", "holding", "climbing", "offset", "manoeuvre", "released", "ceiling"
    ] = "off"
    """blind: it is on, but no sensor sees ahead; lost: the server's word while the link node does not answer, and a
    restarted one's own until it hears its vehicle; holding: braked, because frames or poses are too old; ceiling: it
    may not climb any further and holds; offset: goes on in GUIDED, higher than planned; released: the pilot has taken
    over, it stays off for this flight."""
    text: str = ""
    height_offset_m: float = 0.0
    largest_speed_m_s: float | None = None
    """At which a region of the present depth still suffices to stop."""
    sensors: tuple[Sensor, ...] = ()
    """Whose word counts at present."""
    eyes: tuple[Eye, ...] = ()
    """The same, with what each sees."""
    by: AvoidBy = "climb"
