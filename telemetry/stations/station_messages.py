"""What stations tell each other, as MessagePack arrays of bounded whole numbers and short cleaned words.

There is no fraction on this wire, and so nothing that is not a number: lengths are centimetres, angles hundredths of a
degree, positions 1e-7 degree, shares per mille. Whatever comes is another machine's word: it is bounded and cleaned.
"""

from __future__ import annotations

import math
from typing import Annotated, TypeVar

import msgspec

from telemetry.errors import StationsError
from telemetry.stations.station_names import MOST_STATIONS, MOST_VEHICLES
from telemetry.topics.station_vehicles import FleetVehicle, VehicleLink

VEHICLE_BYTES, BEACON_BYTES = 500, 4096
"""Longer ones are refused unread: two of a vehicle in a second, with all that TLS and TCP add, stay under 2 kB."""
NAME_BYTES, MODE_BYTES, BATTERY_BYTES, PLAN_BYTES, ALARM_BYTES = 40, 20, 48, 48, 150
IN_CHARGE_BYTES, MOST_WANTS = 40, 8
_LINKS: tuple[VehicleLink, ...] = ("none", "live", "stale", "lost")
_PHASES = "idle", "arming", "taking_off", "flying", "paused", "returning", "landed", "interrupted"
"""Of a flight; on the wire each is its place here."""
_OFF_MS = 10**8
"""A day and more: an age beyond it is told as this."""

Meta = msgspec.Meta
Count = Annotated[int, Meta(ge=0, lt=2**48)]
Run = Annotated[int, Meta(ge=0, lt=2**32)]
Permille = Annotated[int, Meta(ge=0, le=1000)] | None
Centimetres = Annotated[int, Meta(ge=-10_000_000, le=10_000_000)] | None
CmPerS = Annotated[int, Meta(ge=-50_000, le=50_000)]
Words = Annotated[str, Meta(max_length=200)]
T = TypeVar("T")


class VehicleWire(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    run: Run
    """Drawn at the start of the process that sends: its clock and its count begin anew with it."""
    count: Count
    """Of this vehicle's messages, from 1 on."""
    sent_us: Count
    """On the sender's monotonic clock, as in its beacons."""
    age_ms: Annotated[int, Meta(ge=0, le=_OFF_MS)] | None
    """Of the position, when this was sent."""
    name: Words
    mode: Words
    phase: Annotated[int, Meta(ge=0, lt=len(_PHASES))]
    flags: Annotated[int, Meta(ge=0, lt=32)]
    """1 armed, 2 in the air, 4 times the link's state, 16 nothing is heard of who is in charge"""
    link_quality: Permille
    lat_e7: Annotated[int, Meta(ge=-900_000_000, le=900_000_000)] | None
    lon_e7: Annotated[int, Meta(ge=-1_800_000_000, le=1_800_000_000)] | None
    alt_amsl_cm: Centimetres
    alt_rel_home_cm: Centimetres
    alt_surface_cm: Centimetres
    v_enu_cm_s: tuple[CmPerS, CmPerS, CmPerS] | None
    heading_cdeg: Annotated[int, Meta(ge=0, lt=36_000)] | None
    within_cm: Annotated[int, Meta(ge=0, le=10_000_000)] | None
    battery_share: Permille
    battery: Words
    plan: Words
    plan_share: Permille
    alarm: Words
    in_charge: Words
    line: Count
    """Of the plan that is flown; 0: none is told"""
    line_ms: Annotated[int, Meta(ge=0, lt=2**32)] | None
    """Where on it the position was, by the line's times; None: not on it"""


class HeardWire(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """The newest beacon of a station, sent back with the time at which it came."""

    station: Annotated[str, Meta(max_length=24)]
    run: Run
    sent_us: Count
    """On that station's clock."""
    came_us: Count
    """On the clock of who tells this."""


class WantWire(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """A line of which a vehicle's messages tell and that has not come: its station sends it again."""

    station: Annotated[str, Meta(max_length=24)]
    vehicle: Annotated[int, Meta(ge=1, le=MOST_VEHICLES)]


class BeaconWire(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """A station lives; with ``heard`` the four stamps of an exchange are complete at whoever is named in it."""

    run: Run
    count: Count
    sent_us: Count
    utc_ms: Annotated[int, Meta(ge=0, lt=2**48)]
    vehicles: Annotated[int, Meta(ge=0, le=999)]
    heard: Annotated[tuple[HeardWire, ...], Meta(max_length=MOST_STATIONS)]
    wants: Annotated[tuple[WantWire, ...], Meta(max_length=MOST_WANTS)] = ()


def vehicle_wire(of: FleetVehicle, *, run: int, count: int, now_mono_s: float) -> VehicleWire:
    """What is out of a number's bounds is told at its bound, or as unknown where that would be wrong."""
    placed = of.lat_deg is not None and of.lon_deg is not None and of.position_t_mono_s is not None
    age_s = max(0.0, now_mono_s - of.position_t_mono_s) if placed and of.position_t_mono_s is not None else None
    velocity = None if of.v_enu_m_s is None else [_scaled(v, 100, 50_000) for v in of.v_enu_m_s]
    heading = None if of.heading_rad is None else _scaled(math.degrees(of.heading_rad) % 360.0, 100, 36_000)
    return VehicleWire(
        run=run,
        count=count,
        sent_us=round(now_mono_s * 1e6),
        age_ms=None if age_s is None else min(round(age_s * 1000), _OFF_MS),
        name=cleaned(of.name, NAME_BYTES),
        mode=cleaned(of.mode, MODE_BYTES),
        phase=_PHASES.index(of.phase) if of.phase in _PHASES else 0,
        flags=of.armed + 2 * of.in_air + 4 * _LINKS.index(of.link) + 16 * of.in_charge_silent,
        link_quality=_share(of.link_quality),
        lat_e7=_scaled(of.lat_deg, 1e7, 900_000_000) if placed else None,
        lon_e7=_scaled(of.lon_deg, 1e7, 1_800_000_000) if placed else None,
        alt_amsl_cm=_scaled(of.alt_amsl_m, 100, 10_000_000),
        alt_rel_home_cm=_scaled(of.alt_rel_home_m, 100, 10_000_000),
        alt_surface_cm=_scaled(of.alt_surface_m, 100, 10_000_000),
        v_enu_cm_s=None if velocity is None or None in velocity else tuple(velocity),  # type: ignore[arg-type]
        heading_cdeg=None if heading is None else heading % 36_000,
        within_cm=None if of.within_m is None else min(_scaled(max(0.0, of.within_m), 100, 10**12) or 0, 10_000_000),
        battery_share=_share(of.battery_share),
        battery=cleaned(of.battery, BATTERY_BYTES),
        plan=cleaned(of.plan, PLAN_BYTES),
        plan_share=_share(of.plan_share),
        alarm=cleaned(of.alarm, ALARM_BYTES),
        in_charge=cleaned(of.in_charge, IN_CHARGE_BYTES),
        line=of.line,
        line_ms=None if of.line_s is None or not of.line else _scaled(max(0.0, of.line_s), 1000, 2**32 - 1),
    )


def vehicle_of(wire: VehicleWire, number: int, position_t_mono_s: float | None) -> FleetVehicle:
    placed = wire.lat_e7 is not None and wire.lon_e7 is not None and wire.age_ms is not None
    return FleetVehicle(
        number=number,
        name=cleaned(wire.name, NAME_BYTES) or f"Vehicle {number}",
        mode=cleaned(wire.mode, MODE_BYTES),
        armed=bool(wire.flags & 1),
        in_air=bool(wire.flags & 2),
        phase=_PHASES[wire.phase],
        link=_LINKS[wire.flags >> 2 & 3],
        in_charge=cleaned(wire.in_charge, IN_CHARGE_BYTES),
        in_charge_silent=bool(wire.flags & 16),
        link_quality=_of(wire.link_quality, 1000),
        position_t_mono_s=position_t_mono_s if placed else None,
        lat_deg=_of(wire.lat_e7, 1e7) if placed else None,
        lon_deg=_of(wire.lon_e7, 1e7) if placed else None,
        alt_amsl_m=_of(wire.alt_amsl_cm, 100),
        alt_rel_home_m=_of(wire.alt_rel_home_cm, 100),
        alt_surface_m=_of(wire.alt_surface_cm, 100),
        v_enu_m_s=None if wire.v_enu_cm_s is None else tuple(v / 100 for v in wire.v_enu_cm_s),  # type: ignore[arg-type]
        heading_rad=None if wire.heading_cdeg is None else math.radians(wire.heading_cdeg / 100),
        within_m=_of(wire.within_cm, 100),
        battery_share=_of(wire.battery_share, 1000),
        battery=cleaned(wire.battery, BATTERY_BYTES),
        plan=cleaned(wire.plan, PLAN_BYTES),
        plan_share=_of(wire.plan_share, 1000),
        alarm=cleaned(wire.alarm, ALARM_BYTES),
        line=wire.line,
        line_s=_of(wire.line_ms, 1000) if wire.line else None,
    )


def encode(message: VehicleWire | BeaconWire) -> bytes:
    return msgspec.msgpack.encode(message)


def decode(payload: bytes, cls: type[T], most_bytes: int) -> T:
    """Raises StationsError: too long, malformed, or out of bounds."""
    if len(payload) > most_bytes:
        raise StationsError(f"A message of {len(payload)} bytes is longer than {most_bytes}.")
    try:
        return msgspec.msgpack.decode(payload, type=cls)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, OverflowError) as error:
        raise StationsError(f"A message cannot be understood ({cleaned(str(error), 120)}).") from error


def cleaned(text: str, most_bytes: int) -> str:
    """Printable characters alone, so many bytes of UTF-8 at most: no line breaks, terminal codes, reversed writing."""
    printable = "".join(c for c in text if c.isprintable())
    if len(printable.encode(errors="ignore")) <= most_bytes:
        return printable.encode(errors="ignore").decode()
    return printable.encode(errors="ignore")[: most_bytes - 3].decode(errors="ignore") + "…"


def _scaled(value: float | None, by: float, most: int) -> int | None:
    """None for what is no number, or beyond the bound."""
    if value is None or not math.isfinite(value) or abs(scaled := value * by) > most:
        return None
    return round(scaled)


def _share(value: float | None) -> int | None:
    return None if value is None or not math.isfinite(value) else round(1000 * min(1.0, max(0.0, value)))


def _of(value: int | None, by: float) -> float | None:
    return None if value is None else value / by
