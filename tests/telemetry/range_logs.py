"""Logs of a vehicle that flies towards a wall, with its distance sensors in them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, attitude_rotation
from tests.telemetry.own_logs import DataFlashWriter, ulog_head, ulog_record

HOME = LocalFrame(47.0, 8.0, 500.0)
WALL_NORTH_M, UP_M, SPEED_M_S = 40.0, 10.0, 4.0
SECONDS, START_S = 6.0, 50.0
NEAREST_M, FARTHEST_M = 0.5, 30.0
POSITIONS_HZ, ATTITUDES_HZ, RANGES_HZ = 5.0, 10.0, 7.0


class Flight(NamedTuple):
    """At constant attitude (rad) due north."""

    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    looks: tuple[float, float, float] = (0.0, 1.0, 0.0)
    """Of the sensor: right, forward, up."""

    def place(self, t_s: float) -> F64:
        return np.array([0.0, SPEED_M_S * t_s, UP_M])

    def hit(self, t_s: float) -> tuple[float, F64]:
        """How far the wall is along the sensor's axis, and where the axis meets it."""
        axis = attitude_rotation(self.heading, self.pitch, self.roll) @ np.array(self.looks)
        place = self.place(t_s)
        range_m = (WALL_NORTH_M - place[1]) / axis[1]
        return float(range_m), place + range_m * axis

    def hits(self) -> F64:
        """(N, 3) of those that are within the sensor's limits."""
        found = [self.hit(t) for t in times(RANGES_HZ)]
        return np.array([p for range_m, p in found if NEAREST_M <= range_m <= FARTHEST_M])


def times(rate_hz: float, until_s: float = SECONDS) -> Iterator[float]:
    yield from (number / rate_hz for number in range(round(until_s * rate_hz) + 1))


def geodetic(p_enu: F64) -> list[float]:
    return HOME.to_geodetic(p_enu)[0].tolist()


class ULogWriter:
    def __init__(self) -> None:
        self._parts: list[tuple[float, bytes]] = []
        self._head: list[bytes] = []
        self._numbers: dict[tuple[str, int], int] = {}

    def describe(self, name: str, fields: str, *, instances: int = 1) -> None:
        self._head.append(ulog_record("F", f"{name}:uint64_t timestamp;{fields}".encode()))
        for instance in range(instances):
            number = self._numbers[name, instance] = len(self._numbers)
            self._head.append(ulog_record("A", struct.pack("<BH", instance, number) + name.encode()))

    def write(self, name: str, t_s: float, packing: str, *values: Any, instance: int = 0) -> None:
        head = struct.pack("<HQ", self._numbers[name, instance], round((START_S + t_s) * 1e6))
        self._parts.append((t_s, ulog_record("D", head + struct.pack("<" + packing, *values))))

    @property
    def data(self) -> bytes:
        records = [record for _, record in sorted(self._parts, key=lambda part: part[0])]
        return b"".join([ulog_head(), *self._head, *records])


def quaternion(flight: Flight) -> F64:
    """(w, x, y, z) of the body (forward, right, down) in north, east, down."""
    h, p, r = flight.heading / 2, flight.pitch / 2, flight.roll / 2
    turns = [(np.cos(h), 0, 0, np.sin(h)), (np.cos(p), 0, np.sin(p), 0), (np.cos(r), np.sin(r), 0, 0)]
    (w1, x1, y1, z1), *rest = turns
    for w2, x2, y2, z2 in rest:
        w1, x1, y1, z1 = (
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        )
    return np.array([w1, x1, y1, z1])


def ulog_of(flight: Flight, *, placed: str = "global", turned: bool = True, home: bool = True) -> ULogWriter:
    """Without any sensor; ``placed``: global, local or no position."""
    log = ULogWriter()
    log.describe("vehicle_global_position", "double lat;double lon;float alt;")
    local = ("x", "y", "z", "vx", "vy", "vz")
    flags = "".join(f"bool {name};" for name in ("xy_valid", "z_valid", "v_xy_valid", "v_z_valid"))
    log.describe(
        "vehicle_local_position",
        "double ref_lat;double ref_lon;float ref_alt;" + "".join(f"float {name};" for name in local) + flags
        + "bool xy_global;bool z_global;",
    )  # fmt: skip
    log.describe("vehicle_attitude", "float[4] q;")
    log.describe("home_position", "double lat;double lon;float alt;bool valid_hpos;bool valid_alt;")
    if home:
        log.write("home_position", 0.0, "ddfBB", HOME.lat_deg, HOME.lon_deg, HOME.alt_m, 1, 1)
    for t in times(POSITIONS_HZ):
        east, north, up = flight.place(t).tolist()
        if placed == "global":
            log.write("vehicle_global_position", t, "ddf", *geodetic(flight.place(t)))
        if placed == "local":
            told = (HOME.lat_deg, HOME.lon_deg, HOME.alt_m, north, east, -up, SPEED_M_S, 0.0, 0.0)
            log.write("vehicle_local_position", t, "ddf" + "f" * 6 + "B" * 6, *told, 1, 1, 1, 1, 1, 1)
    for t in times(ATTITUDES_HZ):
        if turned:
            log.write("vehicle_attitude", t, "ffff", *quaternion(flight).tolist())
    return log


SINGLE = "float min_distance;float max_distance;float current_distance;float h_fov;float[4] q;int8_t signal_quality;"


def with_single(
    log: ULogWriter, flight: Flight, orientation: int, *, quality: int = -1, q: Any = (0, 0, 0, 0)
) -> bytes:
    log.describe("distance_sensor", SINGLE + "uint8_t orientation;", instances=2)
    for t in times(RANGES_HZ):
        told = (NEAREST_M, FARTHEST_M, flight.hit(t)[0], 0.05, *q, quality, orientation)
        log.write("distance_sensor", t, "fff" + "f" * 5 + "bB", *told, instance=1)
    return log.data


def dataflash_of(flight: Flight, *, placed: str = "POS", turned: str = "ATT") -> DataFlashWriter:
    """Without any sensor, whose records follow: a log's records need not stand in the order of time."""
    log = DataFlashWriter()
    log.describe("PARM", "QNf", "TimeUS,Name,Value")
    log.describe("ORGN", "QBLLf", "TimeUS,Type,Lat,Lng,Alt")
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    log.describe("AHR2", "QfffLLf", "TimeUS,Roll,Pitch,Yaw,Lat,Lng,Alt")
    log.describe("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw")
    start_us = round(START_S * 1e6)
    log.write("ORGN", start_us, 1, round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), HOME.alt_m)
    roll, pitch, heading = np.degrees([flight.roll, flight.pitch, flight.heading]).tolist()
    for t in times(ATTITUDES_HZ):
        t_us = start_us + round(t * 1e6)
        lat, lon, alt = geodetic(flight.place(t))
        lat_e7, lon_e7 = round(lat * 1e7), round(lon * 1e7)
        if placed == "POS":
            log.write("POS", t_us, lat_e7, lon_e7, alt, UP_M, UP_M)
        if turned == "ATT":
            log.write("ATT", t_us, roll, pitch, heading)
        if "AHR2" in (placed, turned):
            log.write("AHR2", t_us, roll, pitch, heading, lat_e7, lon_e7, alt if placed == "AHR2" else 0.0)
    return log


def with_finder(log: DataFlashWriter, flight: Flight, orientation: int, *, status: int | None = None) -> bytes:
    """Centimetres, as before 4.7; ``status``: instead of the one that the distance has."""
    log.write("PARM", 1, b"RNGFND1_MAX_CM", FARTHEST_M * 100)
    log.describe("RFND", "QBCBB", "TimeUS,Instance,Dist,Stat,Orient")
    for t in times(RANGES_HZ):
        range_m = flight.hit(t)[0]
        told = 4 if range_m <= FARTHEST_M else 3
        t_us = round((START_S + t) * 1e6)
        log.write("RFND", t_us, 0, round(range_m * 100), told if status is None else status, orientation)
    return bytes(log.data)


def with_proximity(log: DataFlashWriter, name: str, rows: list[tuple[int, list[float]]]) -> bytes:
    """(layer, eight distances) at two times a second."""
    sectors = ",".join(f"D{45 * number}" for number in range(8))
    health = name == "PRX"
    log.describe(name, "QB" + "B" * health + "f" * 8, f"TimeUS,Layer,{'He,' * health}{sectors}")
    for number, (layer, distances) in enumerate(rows):
        log.write(name, round((START_S + 0.5 * number) * 1e6), layer, *([2] * health), *distances)
    return bytes(log.data)
