"""What the ways past an obstacle are sought for, and what is found: the nouns that all of them share."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mapping.geometry.arrays import F64
from planning.missions.vehicle_profile import parse_profile
from server.scene.mirror import Voxels
from server.schemas import ManoeuvreDoc
from telemetry.topics.messages import FlightStatus, GuidedTarget, PlanRecord
from telemetry.topics.obstacles import MapOrigin, ObstacleAlert
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import HomePlace, VehicleState

if TYPE_CHECKING:
    from planning.evading.way_past import Kind
    from telemetry.perception.mission_line import FlightLine

PAST: tuple[Kind, ...] = ("over", "around")
"""Ways past what stands."""
_HANDLE = re.compile(r"[^A-Za-z0-9_.-]")


@dataclass(frozen=True, slots=True)
class Situation:
    """Where everything is at one moment."""

    alert: ObstacleAlert | None
    """Of what stands in the way."""
    state: VehicleState
    flight: FlightStatus
    height_offset_m: float
    """So much higher than planned the mission is flown already."""
    record: PlanRecord
    terrain: Path
    origin: MapOrigin
    maps: tuple[Voxels, ...]
    """Each with an origin of its own: home may move a little between the starts of two sensors' nodes."""
    radius_m: float = 0.5
    """Of the vehicle."""
    ceiling_m: float = 30.0
    """Above the plan: no way leads higher."""
    radar_high_deg: float = 20.0
    """Upper edge of the radar's gate: what it has seen may be as high."""
    approach: ObstacleAlert | None = None
    """Of a moving object."""
    tracks: TracksStatus | None = None
    """None unless they are of now."""
    safety_radius_m: float = 3.0
    """Kept from moving objects."""
    took_off: HomePlace | None = None
    """The home that the flight began with; None: not known."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A manoeuvre that is on show, and what flying it takes."""

    doc: ManoeuvreDoc
    targets: tuple[GuidedTarget, ...] = ()
    rejoin_item: int | None = None
    height_offset_m: float = 0.0
    points_enu_m: tuple[tuple[float, float, float], ...] = ()
    """From the vehicle on, in the maps' frame; empty when there is no way."""
    begins_lat_lon_deg: tuple[float, float] | None = None
    """Where the vehicle was when it was prepared."""


@dataclass(frozen=True, slots=True)
class MissionAhead:
    """What is left of the mission."""

    line: FlightLine
    points_enu_m: F64
    """From beside the vehicle on."""
    leg: int
    """Of the mission's line, on which they begin; the one before where the vehicle has yet to come to the line."""

    def item(self, leg: int) -> int:
        """That is flown to at the end of a leg of ``points_enu_m``."""
        items = self.line.leg_item
        return items[max(0, min(self.leg + leg, len(items) - 1))]


def handle_of(kind: str, alert: ObstacleAlert) -> str:
    return f"{kind}-{_HANDLE.sub('-', alert.id)}"[:80]


def impossible(kind: Kind, why: str, alert: ObstacleAlert) -> Prepared:
    """``why``: for the pilot."""
    return Prepared(ManoeuvreDoc(id=handle_of(kind, alert), kind=kind, for_alert=alert.id, possible=False, text=why))


def none_possible(why: str, standing: ObstacleAlert | None, moving: ObstacleAlert | None) -> tuple[Prepared, ...]:
    """Each way that would be looked for, with the same reason: none goes without a word."""
    past = () if standing is None else tuple(impossible(kind, why, standing) for kind in PAST)
    return past if moving is None else (*past, impossible("sidestep", why, moving))


def cruise_m_s(record: PlanRecord) -> float:
    return parse_profile(record.profile_toml.encode(), where="the plan's profile").mean_speed_m_s
