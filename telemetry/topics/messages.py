"""What travels on the bus, defined once. Frozen dataclasses, written as MessagePack by ``telemetry.bus``.

Live names stand in ``Topic``; a replay uses the same names behind ``replay/`` and nothing else does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

from mapping.sensor_frames import CloudFrame, RadarFrame, RangeFrame, SlamPose, UwbScan
from planning.errors import DescribedError
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.link_ways import WayStatus
from telemetry.topics.looks import CloudLook, RadarLook
from telemetry.topics.obstacles import (
    AvoidanceStatus,
    GroundNotice,
    MapDelta,
    ObstacleAlert,
    PerceptionSettings,
    PerceptionStatus,
)
from telemetry.topics.station_recordings import OwnRecordings, RecordingsStatus
from telemetry.topics.station_vehicles import OwnVehicles, StationsStatus
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.traffic import TrafficSettings, TrafficStatus
from telemetry.topics.vehicle import SimTruth, VehicleState

STALE_S, LOST_S = 1.5, 3.5
"""Without a message of it a vehicle's link is stale, then lost."""


class Topic(StrEnum):
    """Names on the bus and what they carry."""

    VEHICLE = "vehicle/state"  # VehicleState, latest wins
    TEXT = "vehicle/text"  # VehicleText, each arrives
    RAW = "mavlink/raw"  # RawFrame, each arrives
    LINK = "link/status"  # LinkStatus, latest wins, at 1 Hz and on change
    TRANSFER = "link/transfer"  # TransferStatus, latest wins
    FLIGHT = "flight/status"  # FlightStatus, latest wins
    COMMAND = "flight/command"  # CommandRecord, each arrives, published before the command is sent
    PLAN = "plan/active"  # PlanRecord, latest wins
    CHECKLIST = "checklist/ticked"  # ChecklistRecord, latest wins
    RECORDER = "recorder/status"  # RecorderStatus, latest wins, at 1 Hz and on change
    REPLAY = "replayer/status"  # ReplayStatus, latest wins
    RADAR_FRAME = "sensor/radar"  # RadarFrame, each arrives
    CLOUD_FRAME = "sensor/cloud"  # CloudFrame, latest wins: a node that is behind takes the newest
    SLAM_POSE = "sensor/slam"  # SlamPose, each arrives
    RANGE_FRAME = "sensor/ranges"  # RangeFrame, each arrives
    UWB_SCAN = "sensor/uwb"  # UwbScan, each arrives
    MAP_RADAR = "map/radar"  # MapDelta, each arrives
    MAP_VISION = "map/vision"
    MAP_VISION_FLIGHT = "map/vision_flight"
    MAP_RANGES = "map/ranges"
    RADAR_LOOK = "look/radar"  # RadarLook, latest wins
    CLOUD_LOOK = "look/cloud"  # CloudLook, latest wins
    PERCEPTION_RADAR = "perception/radar"  # PerceptionStatus, latest wins
    PERCEPTION_VISION = "perception/vision"
    PERCEPTION_RANGES = "perception/ranges"
    ALERT = "obstacle/alert"  # ObstacleAlert, each arrives
    GROUND = "ground/active"  # GroundNotice, latest wins
    PERCEPTION_SETTINGS = "perception/settings"  # PerceptionSettings, latest wins
    TRACKS = "tracks/status"  # TracksStatus, latest wins
    TRAFFIC = "traffic/status"  # TrafficStatus, latest wins
    TRAFFIC_SETTINGS = "traffic/settings"  # TrafficSettings, latest wins
    STATIONS_OWN = "stations/own"  # OwnVehicles, latest wins
    STATIONS = "stations/status"  # StationsStatus, latest wins
    STATIONS_OFFERED = "stations/offered"  # OwnRecordings, latest wins
    STATIONS_RECORDINGS = "stations/recordings"  # RecordingsStatus, latest wins
    AVOIDANCE = "avoidance/status"  # AvoidanceStatus, latest wins
    TRUTH = "simulator/truth"  # SimTruth, latest wins, 50 Hz
    SERVER = "server/alive"  # ServerAlive, at 1 Hz: what keeps the link node's heartbeat going


REPLAY_PREFIX = "replay/"
FlightPhase = Literal["idle", "arming", "taking_off", "flying", "paused", "returning", "landed", "interrupted"]


@dataclass(frozen=True, slots=True)
class ErrorInfo:
    """A ``DescribedError`` on its way through the bus."""

    code: str
    what: str
    where: str = ""
    advice: str = ""

    @classmethod
    def of(cls, error: DescribedError) -> ErrorInfo:
        return cls(error.code, error.what, error.where, error.advice)


@dataclass(frozen=True, slots=True)
class VehicleText:
    """A STATUSTEXT, its parts put together."""

    t_utc_s: float
    severity: int
    """MAV_SEVERITY: 0 emergency to 7 debug"""
    text: str


@dataclass(frozen=True, slots=True)
class RawFrame:
    t_utc_s: float
    sent: bool
    """True: from Hedgehop to the vehicle."""
    link: str
    frame: bytes
    spare: bool = False
    """Of another way than the one in use, and nothing was made of it: all others together are what was heard, once."""


@dataclass(frozen=True, slots=True)
class ConnectionStatus:
    """One way to vehicles, as configured."""

    address: str
    state: Literal["open", "waiting", "failed"]
    """waiting: open, but nothing has been heard; failed: being tried again."""
    error: ErrorInfo | None = None
    received_messages: int = 0
    bad_bytes: int = 0
    as_way: bool = False
    """Named as a way to the adopted vehicle."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An autopilot that was heard and to which nothing is sent until the operator adopts it."""

    id: str
    """``address/peer/system/component``"""
    address: str
    peer: str
    """Host and port, or the serial device."""
    system_id: int
    component_id: int
    autopilot: str
    vehicle_type: int


SigningMode = Literal["off", "asked", "on", "let"]
"""asked: a key was sent, and nothing has come that is signed with it; let: switched off, unsigned messages pass."""


@dataclass(frozen=True, slots=True)
class SigningStatus:
    """MAVLink 2 signing of the adopted vehicle, and what was refused since the link started."""

    mode: SigningMode = "off"
    unsigned: int = 0
    wrong: int = 0
    """Not by the vehicle's key."""
    replayed: int = 0
    ahead: int = 0
    """By a timestamp that is years ahead."""


@dataclass(frozen=True, slots=True)
class LinkStatus:
    t_mono_s: float
    connections: tuple[ConnectionStatus, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    adopted: Candidate | None = None
    state: Literal["none", "live", "stale", "lost"] = "none"
    """none: no vehicle adopted; stale and lost: ``STALE_S`` and ``LOST_S``."""
    silent_s: float | None = None
    quality: float | None = None
    """Share of the vehicle's packets of the last seconds that arrived, from sequence numbers."""
    round_trip_s: float | None = None
    """From TIMESYNC or a command's answer."""
    heartbeat_hz: float = 0.0
    """Of Hedgehop's own heartbeat, as really sent."""
    mission_state: Literal["unknown", "none", "verified"] = "unknown"
    mission_digest: str | None = None
    """Of the mission that a read-back found on board."""
    warnings: tuple[str, ...] = ()
    """Such as a second vehicle with the same id."""
    again: Candidate | None = None
    """Has the numbers of the adopted vehicle, which has fallen silent, and is heard from elsewhere: perhaps it."""
    signing: SigningStatus = field(default_factory=SigningStatus)
    audit_head: str = ""
    """Hash of the audit log's last line: each recording holds it, so that lines removed from the end are missed."""
    audit_log: str = ""
    """Which log that is (``telemetry.link.audit_chain.log_id``); empty of recordings from before it was told."""
    ways: tuple[WayStatus, ...] = ()
    """To the adopted vehicle; ``quality`` and ``round_trip_s`` are those of the one in use."""


@dataclass(frozen=True, slots=True)
class TransferStatus:
    """A mission on its way to or from the vehicle."""

    direction: Literal["upload", "download"]
    phase: Literal["sending", "reading_back", "done", "failed"]
    done: int
    total: int
    error: ErrorInfo | None = None


@dataclass(frozen=True, slots=True)
class GuidedTarget:
    """One waypoint of the paper's navigation script (Melita 2020, section 7)."""

    item: int
    """Number of the mission's item, 1 is the first; 0: it is none of a mission's."""
    lat_deg: float
    lon_deg: float
    alt_rel_home_m: float
    speed_m_s: float
    loiter_s: float = 0.0
    heading_rad: float | None = None
    """None: the autopilot's own choice."""
    t_s: float | None = None
    """When the plan reaches it, since the first target."""


@dataclass(frozen=True, slots=True)
class FlightStatus:
    """What Hedgehop itself is doing with the vehicle."""

    way: Literal["none", "auto", "guided"] = "none"
    phase: FlightPhase = "idle"
    target: int | None = None
    """Item of the mission that is flown to, 1 is the first."""
    targets: int | None = None
    since_utc_s: float | None = None
    """When the mission was started."""
    broke_off_at: int | None = None
    """Item that was flown to when the flight ended before the mission's end: where a resumed one goes on."""
    hint: str = ""
    is_flown: bool = False
    """All places were reached, and the vehicle holds at the last: nothing is left to be resumed."""
    not_resumed: str = ""
    """While it is paused: why Resume would be refused now, and what to do; empty: nothing stands against it."""


@dataclass(frozen=True, slots=True)
class CommandRecord:
    """Written down before it is sent, chained by hash (telemetry.link.audit)."""

    t_utc_s: float
    operator: str
    words: str
    """What was asked: "arm", "upload 88 items" ..."""
    result: str = ""
    """What came of it, in a line of its own; never on the bus."""


@dataclass(frozen=True, slots=True)
class PlanRecord:
    """What is being flown, complete enough to judge the flight later without the plan's files."""

    t_utc_s: float
    name: str
    mission_wpl: str
    """The mission as QGC WPL 110 text with home (``planning.formats.wpl``)."""
    digest: str
    firmware: Literal["ardupilot", "px4"]
    terrain_id: str
    terrain_name: str
    terrain_sha256: str
    home_alt_dsm_m: float | None
    vertical_datum: str | None
    profile_toml: str
    certificate_json: str
    """``planning.certificate.clearance.certificate_json`` of what was read back; empty when there is none."""
    plan_json: str = ""
    """The plan document of the console, if it came from there."""
    path_csv: str = ""
    """``trajectory.csv`` with the paper's timing, if there is one."""
    taken_up: bool = False
    """In flight: the mission has no take-off, and begins at its first item's place, in the air."""
    way_items: int = 0
    """So many at its beginning lead into the plan; all others are the plan's own."""
    passed_wpl: str = ""
    """The plan's items before those, as ``mission_wpl``; empty where there are none."""
    passed_flown: int = 0
    """So many of them were flown when it was taken up; the others are left out."""
    heights_moved_m: float = 0.0
    """The home that ``mission_wpl`` counts from lies so much above the plan's: the sum of all moves since."""


@dataclass(frozen=True, slots=True)
class RecorderStatus:
    t_mono_s: float
    recording: bool
    name: str | None = None
    """File name without folder."""
    started_utc_s: float | None = None
    bytes: int = 0
    messages: int = 0
    free_bytes: int | None = None
    error: ErrorInfo | None = None
    """A full disk, for one: telemetry goes on."""


@dataclass(frozen=True, slots=True)
class ReplayStatus:
    t_mono_s: float
    recording: str | None = None
    """File name; None: nothing is open."""
    start_utc_s: float = 0.0
    end_utc_s: float = 0.0
    at_utc_s: float = 0.0
    playing: bool = False
    speed: float = 1.0
    error: ErrorInfo | None = None


@dataclass(frozen=True, slots=True)
class ServerAlive:
    t_mono_s: float
    pid: int


Published = (
    VehicleState
    | VehicleText
    | RawFrame
    | LinkStatus
    | TransferStatus
    | FlightStatus
    | CommandRecord
    | PlanRecord
    | ChecklistRecord
    | RecorderStatus
    | ReplayStatus
    | ServerAlive
    | RadarFrame
    | CloudFrame
    | SlamPose
    | RangeFrame
    | UwbScan
    | MapDelta
    | RadarLook
    | CloudLook
    | PerceptionStatus
    | ObstacleAlert
    | GroundNotice
    | PerceptionSettings
    | TracksStatus
    | TrafficStatus
    | TrafficSettings
    | OwnVehicles
    | StationsStatus
    | OwnRecordings
    | RecordingsStatus
    | AvoidanceStatus
    | SimTruth
)
"""Everything that may be published."""

MESSAGE_TYPES: dict[str, type[Published]] = {
    Topic.VEHICLE: VehicleState,
    Topic.TEXT: VehicleText,
    Topic.RAW: RawFrame,
    Topic.LINK: LinkStatus,
    Topic.TRANSFER: TransferStatus,
    Topic.FLIGHT: FlightStatus,
    Topic.COMMAND: CommandRecord,
    Topic.PLAN: PlanRecord,
    Topic.CHECKLIST: ChecklistRecord,
    Topic.RECORDER: RecorderStatus,
    Topic.REPLAY: ReplayStatus,
    Topic.SERVER: ServerAlive,
    Topic.RADAR_FRAME: RadarFrame,
    Topic.CLOUD_FRAME: CloudFrame,
    Topic.SLAM_POSE: SlamPose,
    Topic.RANGE_FRAME: RangeFrame,
    Topic.UWB_SCAN: UwbScan,
    Topic.MAP_RADAR: MapDelta,
    Topic.MAP_VISION: MapDelta,
    Topic.MAP_VISION_FLIGHT: MapDelta,
    Topic.MAP_RANGES: MapDelta,
    Topic.RADAR_LOOK: RadarLook,
    Topic.CLOUD_LOOK: CloudLook,
    Topic.PERCEPTION_RADAR: PerceptionStatus,
    Topic.PERCEPTION_VISION: PerceptionStatus,
    Topic.PERCEPTION_RANGES: PerceptionStatus,
    Topic.ALERT: ObstacleAlert,
    Topic.GROUND: GroundNotice,
    Topic.PERCEPTION_SETTINGS: PerceptionSettings,
    Topic.TRACKS: TracksStatus,
    Topic.TRAFFIC: TrafficStatus,
    Topic.TRAFFIC_SETTINGS: TrafficSettings,
    Topic.STATIONS_OWN: OwnVehicles,
    Topic.STATIONS: StationsStatus,
    Topic.STATIONS_OFFERED: OwnRecordings,
    Topic.STATIONS_RECORDINGS: RecordingsStatus,
    Topic.AVOIDANCE: AvoidanceStatus,
    Topic.TRUTH: SimTruth,
}
