"""What stations tell each other: bounded, cleaned, and back as it was within its steps."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import StationsError
from telemetry.stations.station_messages import (
    BEACON_BYTES,
    VEHICLE_BYTES,
    BeaconWire,
    HeardWire,
    VehicleWire,
    cleaned,
    decode,
    encode,
    vehicle_of,
    vehicle_wire,
)
from telemetry.stations.station_names import Key, below, checked_name, read_key, vehicle_key
from telemetry.topics.station_vehicles import FleetVehicle

BEE = FleetVehicle(
    number=3,
    name="Bee",
    in_charge="Anna",
    in_charge_silent=True,
    mode="AUTO",
    phase="paused",
    armed=True,
    in_air=True,
    link="stale",
    link_quality=0.97,
    position_t_mono_s=99.5,
    lat_deg=47.1234567,
    lon_deg=-8.7654321,
    alt_amsl_m=512.34,
    alt_rel_home_m=-3.25,
    alt_surface_m=12.5,
    v_enu_m_s=(1.25, -3.5, 0.0),
    heading_rad=math.radians(123.45),
    within_m=0.8,
    battery_share=0.631,
    battery="63 %, 12 min to the reserve",
    plan="Ridge",
    plan_share=0.25,
    alarm="Obstacle 4 m ahead.",
)
numbers = st.none() | st.floats(allow_nan=True, allow_infinity=True)
words = st.text(max_size=400)


def test_what_is_told_is_what_is_heard() -> None:
    wire = vehicle_wire(BEE, run=7, count=1, now_mono_s=100.0)
    back = decode(encode(wire), VehicleWire, VEHICLE_BYTES)
    assert back.age_ms == 500
    heard = vehicle_of(back, 3, 99.5)
    assert heard.heading_rad == pytest.approx(BEE.heading_rad)
    assert msgspec.structs.astuple(vehicle_wire(heard, run=7, count=1, now_mono_s=100.0)) == msgspec.structs.astuple(
        wire
    )
    told = "number name in_charge in_charge_silent mode phase armed in_air link lat_deg lon_deg v_enu_m_s battery"
    for name in told.split():
        assert getattr(heard, name) == pytest.approx(getattr(BEE, name)), name


@given(numbers, numbers, numbers, numbers, words, words, words)
def test_nothing_that_a_vehicle_tells_breaks_its_message(
    lat: float | None, alt: float | None, v: float | None, share: float | None, name: str, mode: str, alarm: str
) -> None:
    odd = FleetVehicle(
        number=1,
        name=name,
        in_charge=alarm,
        in_charge_silent=True,
        mode=mode,
        phase=mode,
        link="lost",
        link_quality=share,
        position_t_mono_s=1.0,
        lat_deg=lat,
        lon_deg=lat,
        alt_amsl_m=alt,
        alt_rel_home_m=alt,
        alt_surface_m=alt,
        v_enu_m_s=None if v is None else (v, v, v),
        heading_rad=v if v is not None and math.isfinite(v) else None,
        within_m=None if v is None or math.isnan(v) else abs(v),
        battery=name,
        plan=name,
        alarm=alarm,
    )
    payload = encode(vehicle_wire(odd, run=2**32 - 1, count=2**40, now_mono_s=1e8))
    assert len(payload) <= VEHICLE_BYTES
    heard = vehicle_of(decode(payload, VehicleWire, VEHICLE_BYTES), 1, 1.0)
    assert heard.name
    assert all(c.isprintable() for c in heard.name + heard.mode + heard.alarm + heard.in_charge)
    assert heard.lat_deg is None or -90.0 <= heard.lat_deg <= 90.0


@given(st.binary(max_size=700))
def test_noise_is_refused_and_nothing_else_happens(payload: bytes) -> None:
    for cls, most in ((VehicleWire, VEHICLE_BYTES), (BeaconWire, BEACON_BYTES)):
        with contextlib.suppress(StationsError):
            assert isinstance(decode(payload, cls, most), cls)


@pytest.mark.parametrize(
    ("at", "value"),
    [
        ("lat_e7", 900_000_001),
        ("lat_e7", 1.5),
        ("flags", 32),
        ("phase", 8),
        ("in_charge", "x" * 201),
        ("age_ms", -1),
        ("count", -1),
        ("run", 2**32),
        ("v_enu_cm_s", (0, 0)),
        ("name", 5),
        ("heading_cdeg", 36_000),
        ("battery_share", 1001),
        ("alarm", "x" * 201),
    ],
)
def test_what_is_out_of_bounds_is_refused(at: str, value: Any) -> None:
    fields = msgspec.structs.asdict(vehicle_wire(BEE, run=7, count=1, now_mono_s=100.0)) | {at: value}
    with pytest.raises(StationsError):
        decode(msgspec.msgpack.encode(list(fields.values())), VehicleWire, VEHICLE_BYTES)


def test_a_longer_message_is_refused_unread() -> None:
    with pytest.raises(StationsError, match="longer than"):
        decode(b"\xc0" * (VEHICLE_BYTES + 1), VehicleWire, VEHICLE_BYTES)
    many = encode(BeaconWire(1, 1, 1, 1, 1, tuple(HeardWire("Alpha", 1, 1, 1) for _ in range(33))))
    with pytest.raises(StationsError, match="understood"):
        decode(many, BeaconWire, BEACON_BYTES)


def test_words_lose_what_could_forge_a_line() -> None:
    assert cleaned("a\n\x1b[2Jb\u202ec\ud800", 40) == "a[2Jbc"
    assert cleaned("ä" * 50, 40) == "ä" * 18 + "…"


@pytest.mark.parametrize(
    "text",
    [
        "hedgehop/stations/1/Alpha",
        "hedgehop/stations/1/Alpha/vehicle/0",
        "hedgehop/stations/1/Alpha/vehicle/33",
        "hedgehop/stations/1/Alpha/vehicle/01",
        "hedgehop/stations/1/Alpha/vehicle/²",
        "hedgehop/stations/1/Alpha/vehicle/1/more",
        "hedgehop/stations/2/Alpha/beacon",
        "hedgehop/stations/1/Al pha/beacon",
        "hedgehop/stations/1/-Alpha/beacon",
        "",
    ],
)
def test_other_keys_are_nobodys(text: str) -> None:
    assert read_key(text) is None


def test_names_and_keys() -> None:
    assert read_key(vehicle_key("Alpha-2", 12)) == Key("Alpha-2", 12)
    assert below("Alpha-2") == "hedgehop/stations/1/Alpha-2/**"
    for name in ("", "*", "a/b", "ä", "x" * 25, "Alpha\n"):
        with pytest.raises(StationsError, match="station's name"):
            checked_name(name)
