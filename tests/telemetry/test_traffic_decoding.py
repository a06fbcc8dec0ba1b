"""Traffic messages, packed by pymavlink, against what the MAVLink and ASTM definitions say of each field."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.codec import Parser
from telemetry.traffic.decoding import reports
from telemetry.traffic.report import Position, Report
from tests.telemetry.traffic_messages import (
    ALL_VALID,
    HERE,
    MAC,
    adsb,
    basic_id,
    location,
    message_pack,
    over_the_air,
    packed_basic_id,
    packed_location,
    packed_system,
    padded,
    system,
    utm,
)


def one(message: Any) -> Report:
    (report,) = reports(message)
    return report


def placed(message: Any) -> Position:
    position = one(message).position
    assert position is not None
    return position


def test_an_adsb_vehicle_with_all_it_knows() -> None:
    report = one(adsb(tslc=2, squawk=7700))
    assert (report.key, report.source, report.identity.name) == ("adsb 4b1805", "adsb", "HBABC")
    assert (report.identity.kind, report.identity.is_crewed, report.is_own) == ("light", True, False)
    position = report.position
    assert position is not None
    assert position.lat_deg == pytest.approx(HERE[0])
    assert (position.delay_s, position.speed_m_s, position.climb_m_s) == (2.0, 40.0, 1.0)
    assert position.course_rad == pytest.approx(math.radians(270))
    assert (position.alt_m, position.alt_datum) == (650.0, "gnss")
    assert position.emergency
    assert not position.on_ground


@pytest.mark.parametrize(
    ("flag", "lost"),
    [(2, "alt_m"), (4, "course_rad"), (8, "speed_m_s"), (128, "climb_m_s")],
)
def test_what_an_adsb_flag_does_not_declare_valid_is_unknown(flag: int, lost: str) -> None:
    position = placed(adsb(flags=ALL_VALID & ~flag))
    assert getattr(position, lost) is None
    assert [name for name in ("alt_m", "course_rad", "speed_m_s", "climb_m_s") if getattr(position, name) is None] == [
        lost
    ]


def test_adsb_coordinates_callsign_and_squawk_have_flags_too() -> None:
    assert one(adsb(flags=ALL_VALID & ~1)).position is None
    assert one(adsb(flags=ALL_VALID & ~16)).identity.name == ""
    assert not placed(adsb(squawk=7700, flags=ALL_VALID & ~32)).emergency
    assert one(adsb(at=(0.0, 0.0))).position is None


@pytest.mark.parametrize(
    ("flags", "datum"), [(ALL_VALID, "pressure"), (ALL_VALID & ~2, "pressure"), (ALL_VALID & ~(2 | 256), "unknown")]
)
def test_a_pressure_altitude_is_called_one(flags: int, datum: str) -> None:
    assert placed(adsb(altitude_type=0, flags=flags)).alt_datum == datum


def test_no_aircraft_is_in_space_or_twice_as_fast_as_sound() -> None:
    assert placed(adsb(altitude=40_000_000)).alt_m is None
    assert placed(adsb(ver_velocity=-32_000)).climb_m_s is None
    assert placed(adsb(heading=36_500)).course_rad is None


def test_remote_id_in_single_messages() -> None:
    key = f"rid {MAC.hex()}"
    named = one(basic_id())
    assert (named.key, named.identity.name, named.identity.kind) == (key, "1581F5FKD", "multirotor drone")
    assert one(basic_id(b"\x01\xff\x10", id_type=4)).identity.name == "01ff10"
    assert one(basic_id(id_type=0)).identity.name == ""
    position = placed(location())
    assert one(location()).key == key
    assert (position.speed_m_s, position.climb_m_s, position.stamp) == (10.0, -1.5, 1234.5)
    assert position.course_rad == pytest.approx(math.pi)
    assert (position.alt_m, position.alt_datum, position.alt_within_m) == (560.0, "ellipsoid", 10.0)
    assert position.within_m == 10.0
    assert one(system()).identity.operator_deg == (46.9, 7.9)
    assert one(system((0.0, 0.0))).identity.operator_deg is None


@pytest.mark.parametrize(
    ("unknown", "lost"),
    [
        ({"direction": 36_100}, "course_rad"),
        ({"speed_horizontal": 25_500}, "speed_m_s"),
        ({"speed_vertical": 6_300}, "climb_m_s"),
        ({"altitude_geodetic": -1000.0, "altitude_barometric": -1000.0}, "alt_m"),
        ({"altitude_geodetic": math.nan, "altitude_barometric": math.inf}, "alt_m"),
        ({"horizontal_accuracy": 0}, "within_m"),
        ({"horizontal_accuracy": 15}, "within_m"),
        ({"vertical_accuracy": 0}, "alt_within_m"),
        ({"timestamp": float(0xFFFF)}, "stamp"),
        ({"timestamp": math.nan}, "stamp"),
    ],
)
def test_what_remote_id_calls_unknown_is_unknown(unknown: dict[str, Any], lost: str) -> None:
    assert getattr(placed(location()), lost) is not None
    assert getattr(placed(location(**unknown)), lost) is None


def test_without_a_geodetic_height_the_pressure_altitude_counts_and_is_called_one() -> None:
    position = placed(location(altitude_geodetic=-1000.0))
    assert (position.alt_m, position.alt_datum, position.alt_within_m) == (480.0, "pressure", 25.0)


def test_remote_id_without_a_place_or_on_the_ground() -> None:
    assert one(location(at=(0.0, 0.0))).position is None
    assert placed(location(status=1)).on_ground
    assert placed(location(status=3)).emergency


def test_messages_without_a_senders_address_are_the_vehicles_own() -> None:
    assert one(location(mac=b"")).is_own
    assert not one(location()).is_own


def test_a_message_pack_says_the_same_as_single_messages() -> None:
    first, second, third = reports(message_pack(packed_location(), packed_basic_id(), packed_system()))
    assert first.identity.name == "1581F5FKD"
    assert second.identity.operator_deg == (46.9, 7.9)
    position = third.position
    assert position is not None
    assert (position.lat_deg, position.lon_deg) == pytest.approx(HERE)
    assert position.course_rad == pytest.approx(math.radians(270))
    assert (position.speed_m_s, position.climb_m_s, position.stamp) == (10.0, -1.5, 1234.5)
    assert (position.alt_m, position.alt_datum, position.within_m, position.alt_within_m) == (560, "ellipsoid", 10, 10)


@pytest.mark.parametrize(
    ("raw", "name", "value"),
    [
        ({"speed": 100, "fast": True}, "speed_m_s", 138.75),
        ({"speed": 255, "fast": True}, "speed_m_s", None),
        ({"course": 181, "east_of": True}, "course_rad", None),
        ({"course": 0, "east_of": False}, "course_rad", 0.0),
        ({"climb": 126}, "climb_m_s", None),
        ({"geo": 0}, "alt_datum", "pressure"),
        ({"geo": 0, "baro": 0}, "alt_m", None),
        ({"tenths": 0xFFFF}, "stamp", None),
    ],
)
def test_the_edges_of_a_packed_place(raw: dict[str, Any], name: str, value: Any) -> None:
    assert getattr(placed(message_pack(packed_location(**raw))), name) == value


@pytest.mark.parametrize(("size", "count"), [(24, 1), (25, 0), (25, 10)])
def test_a_pack_of_another_shape_says_nothing(size: int, count: int) -> None:
    assert reports(message_pack(packed_location(), size=size, count=count)) == ()


def test_a_utm_position() -> None:
    report = one(utm())
    assert (report.key, report.identity.name) == (f"utm {b'UTM-7'.hex()}", "UTM-7")
    position = report.position
    assert position is not None
    assert (position.speed_m_s, position.climb_m_s, position.alt_m, position.alt_datum) == (5.0, -0.5, 590.0, "gnss")
    assert position.course_rad == pytest.approx(math.atan2(-4, 3) % math.tau)
    assert position.within_m == pytest.approx(4.9)
    assert position.stamp == 1_700_000_000.0
    bare = placed(utm(flags=4, h_acc=65535))
    assert (bare.speed_m_s, bare.course_rad, bare.climb_m_s, bare.alt_m, bare.stamp, bare.within_m) == (None,) * 6
    assert one(utm(flags=4)).key == "utm system 9"
    assert one(utm(flags=2)).position is None


def test_names_hold_nothing_that_moves_text() -> None:
    assert one(adsb(callsign=b"A\x1b[2J\x07B")).identity.name == "A[2JB"
    assert one(basic_id(b"<b>\xe2\x80\xae\n")).identity.name == "<b>"


def test_any_other_message_says_nothing() -> None:
    assert reports(over_the_air(mavlink.MAVLink_heartbeat_message(1, 1, 0, 0, 0, 3))) == ()


IDS = (246, 12900, 12901, 12904, 12915, 340)


@given(st.sampled_from(IDS), st.binary(min_size=255, max_size=255))
def test_whatever_a_forged_frame_holds_is_read_without_an_error(number: int, noise: bytes) -> None:
    kind = mavlink.mavlink_map[number]
    payload = noise[: kind.unpacker.size]
    message = mavlink.MAVLink(None).decode(bytearray(_frame(number, payload, kind.crc_extra)))
    for report in reports(message):
        position = report.position
        assert report.identity.name.isprintable()
        assert position is None or all(
            value is None or math.isfinite(value)
            for value in (position.lat_deg, position.lon_deg, position.speed_m_s, position.course_rad, position.alt_m)
        )


def _frame(number: int, payload: bytes, crc_extra: int) -> bytes:
    header = bytes([len(payload), 0, 0, 0, 1, 156]) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header + payload)
    crc.accumulate(bytes([crc_extra]))
    return b"\xfd" + header + payload + crc.crc.to_bytes(2, "little")


def test_the_links_own_parser_knows_the_messages() -> None:
    frames = b"".join(bytes(message.get_msgbuf()) for message in (adsb(), location(), message_pack(), utm()))
    assert len(Parser(datagrams=False).feed(frames)) == 4
    assert padded(b"") == [0] * 20
