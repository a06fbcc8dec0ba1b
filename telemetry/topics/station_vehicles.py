"""Vehicles of several stations as they travel on the bus: this station's own for the others, and theirs for this one.

A *station* is a Hedgehop server with its vehicles; the others are met at a Zenoh router (``telemetry/stations/``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

VehicleLink = Literal["none", "live", "stale", "lost"]


@dataclass(frozen=True, slots=True)
class FleetVehicle:
    """One vehicle as its own station tells of it; None where nothing is known."""

    number: int
    """At its own station."""
    name: str
    in_charge: str = ""
    """Who commands it at its own station; empty: nobody."""
    in_charge_silent: bool = False
    """Nothing is heard of them there."""
    mode: str = ""
    phase: str = "idle"
    """Of its flight, as ``telemetry.topics.messages.FlightPhase`` names them."""
    armed: bool = False
    in_air: bool = False
    link: VehicleLink = "none"
    link_quality: float | None = None
    """0 to 1"""
    position_t_mono_s: float | None = None
    """When its position came, on this machine's clock; of another station's vehicle the likeliest."""
    lat_deg: float | None = None
    """WGS84, as is ``lon_deg``"""
    lon_deg: float | None = None
    alt_amsl_m: float | None = None
    alt_rel_home_m: float | None = None
    alt_surface_m: float | None = None
    """Above the surface model's cell below."""
    v_enu_m_s: tuple[float, float, float] | None = None
    heading_rad: float | None = None
    """Clockwise from true north"""
    within_m: float | None = None
    """Horizontal, as its receiver claims (one sigma)."""
    battery_share: float | None = None
    """0 to 1"""
    battery: str = ""
    """In words, with the time that is left: "63 %, 12 min to the reserve"."""
    plan: str = ""
    """Name of the plan that is flown."""
    plan_share: float | None = None
    """So much of it is flown, 0 to 1."""
    alarm: str = ""
    """The worst that is wrong with it."""
    line: int = 0
    """Of the plan that it flies: what its ``FleetLine`` is known by; 0: none is told."""
    line_s: float | None = None
    """Where on that line it was at its position, by the line's own times; None: it has left it, or holds."""


@dataclass(frozen=True, slots=True)
class FleetLine:
    """The line that a vehicle flies, as ``telemetry.stations.plan_lines`` packs it."""

    station: str
    """Empty: this one."""
    number: int
    packed: bytes


@dataclass(frozen=True, slots=True)
class OwnVehicles:
    """What the server tells the *stations* node, twice a second and more often while something changes."""

    t_mono_s: float
    vehicles: tuple[FleetVehicle, ...] = ()
    lines: tuple[FleetLine, ...] = ()


@dataclass(frozen=True, slots=True)
class OtherVehicle:
    station: str
    it: FleetVehicle
    oldest_t_mono_s: float | None
    """Its position may be as old as from then, at the worse end of how the clocks compare; None: they were not yet
    compared, or it has no position."""
    heard_t_mono_s: float
    """When its newest message came."""
    unsure_s: float = 0.0
    """So much later than ``oldest_t_mono_s`` its position may be."""
    sent_t_mono_s: float | None = None
    """When its newest message was sent, at the earliest; None: the clocks were not compared yet."""
    run: int = 0
    """Of the process that told it."""


@dataclass(frozen=True, slots=True)
class OtherStation:
    name: str
    state: Literal["live", "lost"]
    heard_t_mono_s: float
    heard_utc_s: float
    vehicles: int
    """So many it says it has."""
    round_trip_s: float | None = None
    """Through the router, the best of the last ones; None: the clocks were not compared yet."""
    clock_ahead_s: float | None = None
    """Its clock of the day less ours."""
    clock_within_s: float | None = None
    """How wrong that may be."""
    hears_us: bool = False
    sent_t_mono_s: float | None = None
    """When its newest beacon was sent, at the earliest; None: the clocks were not compared yet, or there is none."""
    is_new: bool = False
    """Its process has only just taken another one's place: whether that one has ended is not known yet."""
    is_double: bool = False
    """Another process spoke under its name, too, and is not shown."""
    text: str = ""
    """What is wrong and what to do; empty: nothing."""


@dataclass(frozen=True, slots=True)
class StationsStatus:
    """Of the *stations* node: twice a second, and at once when a station is lost or found."""

    t_mono_s: float
    station: str
    """This one's name."""
    router: Literal["connected", "lost"]
    text: str = ""
    """What is wrong with the way to the router, and what to do."""
    listens_since_t_mono_s: float | None = None
    """Since when the router answers; None: it does not."""
    leaves_out: str = ""
    """Why stations that speak are not among these; empty: none that is known of."""
    stations: tuple[OtherStation, ...] = ()
    vehicles: tuple[OtherVehicle, ...] = ()
    lines: tuple[FleetLine, ...] = ()
    """Of those of them whose line has come."""
    refused: int = 0
    """Messages that were malformed, foreign, repeated, or more than are kept."""
    refused_last: str = ""
    """Why the last one of them was refused."""
