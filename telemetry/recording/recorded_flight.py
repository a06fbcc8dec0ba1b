"""One finished flight in memory, whatever file it came from: what review looks at."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, attitude_of
from planning.basics.plan_model import Mission
from planning.terrain.dsm import Dsm
from telemetry.recording.frame_facts import SentTarget, TruePosition
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.messages import CommandRecord, PlanRecord, VehicleText
from telemetry.topics.obstacles import AvoidanceStatus, ObstacleAlert, PerceptionSettings
from telemetry.topics.vehicle import VehicleState

Stamped = tuple[float, VehicleState]


@dataclass(frozen=True, slots=True)
class RecordedTrack:
    """Positions as columns of equal length (N,). NaN where a height or a speed was not known."""

    t_utc_s: F64
    lat_deg: F64
    lon_deg: F64
    alt_amsl_m: F64
    alt_rel_home_m: F64
    v_north_m_s: F64
    v_east_m_s: F64
    v_down_m_s: F64

    def __len__(self) -> int:
        return len(self.t_utc_s)


@dataclass(frozen=True, slots=True)
class HomePosition:
    """Home as the vehicle reported it."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float | None


@dataclass(frozen=True, slots=True)
class FlightLog:
    """Everything that review needs. All times are seconds since 1970, of the log's clock."""

    kind: Literal["hedgehop", "tlog", "dataflash", "ulog"]
    name: str
    """File name without folder."""
    start_utc_s: float
    end_utc_s: float
    states: tuple[Stamped, ...]
    """One for every position that came, (t_utc_s, all that was known of the vehicle then)."""
    track: RecordedTrack
    """The positions of ``states``, row by row."""
    truth: RecordedTrack | None
    """Where a simulator said that the vehicle really was (SIM_STATE); velocities unknown."""
    texts: tuple[VehicleText, ...]
    modes: tuple[tuple[float, str], ...]
    """(t_utc_s, mode) at every change, the first known mode included."""
    armed: tuple[tuple[float, bool], ...]
    """(t_utc_s, armed) at every change, the first known value included."""
    reached: tuple[tuple[float, int], ...]
    """(t_utc_s, sequence number) as the vehicle counts; ArduPilot: 0 is home."""
    targets: tuple[SentTarget, ...]
    """Positions that a ground station sent one by one (GUIDED)."""
    commands: tuple[CommandRecord, ...]
    vehicle: VehicleState
    """The last that was known."""
    home: HomePosition | None
    """Of the flight: the last while armed."""
    mission: Mission | None
    plan: PlanRecord | None
    faults: tuple[str, ...]
    """Damage and doubts, in sentences."""
    alerts: tuple[ObstacleAlert, ...] = ()
    """Obstacles as they were alerted, in the order of time: where each begins and where it ends."""
    avoidance: tuple[tuple[float, AvoidanceStatus], ...] = ()
    """(t_utc_s, what it said of itself) whenever its state changed."""
    settings: tuple[tuple[float, PerceptionSettings], ...] = ()
    """(t_utc_s, how objects were followed and obstacles looked for) at every change, the first known included."""
    checklist: ChecklistRecord | None = None
    """The crew's list as it was ticked for this flight's start; None: nothing was demanded, or none was started."""
    ground: Dsm | None = None
    """The surface model that the recording itself carries."""

    @property
    def t_s(self) -> F64:
        """(N,) seconds since ``start_utc_s`` of every position."""
        return self.track.t_utc_s - self.start_utc_s


def track_of(states: Iterable[Stamped]) -> RecordedTrack:
    """States -> columns, row by row."""
    rows = [
        (t, s.lat_deg, s.lon_deg, s.alt_amsl_m, s.alt_rel_home_m, s.v_north_m_s, s.v_east_m_s, s.v_down_m_s)
        for t, s in states
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 8)
    return RecordedTrack(*(np.ascontiguousarray(column) for column in table.T))


def truth_of(places: list[TruePosition], home: HomePosition | None) -> RecordedTrack | None:
    """True positions -> columns; heights above home only if home's own height is known."""
    if not places:
        return None
    home_alt_m = math.nan if home is None or home.alt_amsl_m is None else home.alt_amsl_m
    table = np.array([(p.t_utc_s, p.lat_deg, p.lon_deg, p.alt_amsl_m) for p in places], dtype=np.float64)
    t_utc_s, lat_deg, lon_deg, alt_m = (np.ascontiguousarray(column) for column in table.T)
    unknown = np.full_like(t_utc_s, np.nan)
    return RecordedTrack(t_utc_s, lat_deg, lon_deg, alt_m, alt_m - home_alt_m, unknown, unknown, unknown)


class StateHistory:
    """Takes every state in order and keeps what a flight log needs of them."""

    def __init__(self) -> None:
        self.positions: list[Stamped] = []
        self.modes: list[tuple[float, str]] = []
        self.armed: list[tuple[float, bool]] = []
        self.reached: list[tuple[float, int]] = []
        self.last: VehicleState | None = None
        self.last_armed: VehicleState | None = None

    def on_state(self, state: VehicleState, t_utc_s: float) -> None:
        last, self.last = self.last, state
        if state.heartbeat_t_mono_s is not None:
            if not self.modes or self.modes[-1][1] != state.mode:
                self.modes.append((t_utc_s, state.mode))
            if not self.armed or self.armed[-1][1] != state.armed:
                self.armed.append((t_utc_s, state.armed))
        if state.armed:
            self.last_armed = state
        if state.mission_reached is not None and (last is None or last.mission_reached != state.mission_reached):
            self.reached.append((t_utc_s, state.mission_reached))
        moved = last is None or last.position_t_mono_s != state.position_t_mono_s
        if moved and state.lat_deg is not None and state.lon_deg is not None:
            self.positions.append((t_utc_s, state))

    def home(self) -> HomePosition | None:
        """Of the flight: while armed; a vehicle moves its home when it arms."""
        for state in (self.last_armed, self.last):
            if state is not None and state.home_lat_deg is not None and state.home_lon_deg is not None:
                return HomePosition(state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m)
        return None

    def mission_flown_until_utc_s(self) -> float:
        """When the last armed stretch in a mission mode ended; before all else when there was none."""
        until = -math.inf
        if not self.modes or not self.armed:
            return until
        ends = [t for t, _ in self.modes[1:]] + [math.inf]
        armed_ends = [t for t, _ in self.armed[1:]] + [math.inf]
        for (start, mode), end in zip(self.modes, ends, strict=True):
            for (armed_start, armed), armed_end in zip(self.armed, armed_ends, strict=True):
                if mode in ("AUTO", "MISSION") and armed and max(start, armed_start) < min(end, armed_end):
                    until = max(until, min(end, armed_end))
        return until


def state_at(t_s: float, p_enu_m: F64, v_enu_m_s: F64 | None, R_enu_body: F64, home: LocalFrame) -> VehicleState:
    """Armed, with position and attitude of that very moment; metres and heights count from ``home``."""
    east, north, up = p_enu_m.tolist()
    # Coordinates are read at the height of home again.
    lat_deg, lon_deg, _ = home.to_geodetic([[east, north, 0.0]])[0].tolist()
    heading_rad, pitch_rad, roll_rad = attitude_of(R_enu_body)
    v = (None, None, None) if v_enu_m_s is None else v_enu_m_s.tolist()
    return VehicleState(
        1, 1, t_utc_s=t_s, heartbeat_t_mono_s=t_s, armed=True, position_t_mono_s=t_s, lat_deg=lat_deg, lon_deg=lon_deg,
        alt_amsl_m=home.alt_m + up, alt_rel_home_m=up, v_east_m_s=v[0], v_north_m_s=v[1],
        v_down_m_s=None if v[2] is None else -v[2], attitude_t_mono_s=t_s, roll_rad=roll_rad, pitch_rad=pitch_rad,
        heading_rad=heading_rad, home_lat_deg=home.lat_deg, home_lon_deg=home.lon_deg, home_alt_amsl_m=home.alt_m,
    )  # fmt: skip
