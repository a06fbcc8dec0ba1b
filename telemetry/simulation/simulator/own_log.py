"""The simulated vehicle's own logs: one DataFlash log for each time it was armed, as ArduPilot writes them."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

EVERY_S = 0.1
MOST_LOGS, MOST_BYTES = 20, 16 << 20
"""Then the oldest goes, and nothing more is written into one."""
_GPS_EPOCH_UTC_S, _WEEK_S, _LEAP_S = 315_964_800, 604_800, 18
_HOME = 1
_FIXES = {"3d": 3, "rtk_fixed": 6}
_KINDS = {
    "MSG": (1, "QZ", "<Q64s", "TimeUS,Message"),
    "MODE": (2, "QMBB", "<QBBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ORGN": (3, "QBLLe", "<QBiii", "TimeUS,Type,Lat,Lng,Alt"),
    "POS": (4, "QLLfff", "<Qiifff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "ATT": (5, "Qfff", "<Qfff", "TimeUS,Roll,Pitch,Yaw"),
    "XKF1": (6, "QBfff", "<QBfff", "TimeUS,C,VN,VE,VD"),
    "GPS": (7, "QBBIHBcLLe", "<QBBIHBhiii", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt"),
    "BAT": (8, "QBfffB", "<QBfffB", "TimeUS,Inst,Volt,Curr,CurrTot,RemPct"),
}
"""Number, letters, the same for ``struct``, columns."""


@dataclass(slots=True)
class SimulatedLog:
    begun_utc_s: float
    content: bytearray = field(default_factory=bytearray)


class OwnLogs:
    def __init__(
        self, vehicle: SimulatedVehicle, mode_numbers: Mapping[str, int], version: str, *, are_kept: bool = True
    ) -> None:
        self._are_kept = are_kept
        self._vehicle, self._mode_numbers, self._version = vehicle, mode_numbers, version
        self._started_utc_s = time.time()
        self._is_open = False
        self._mode, self._written_s = "", 0.0
        self.logs: list[SimulatedLog] = []

    def look(self) -> None:
        """After everything that may have armed or disarmed the vehicle."""
        if not self._are_kept or self._vehicle.autopilot.armed == self._is_open:
            return
        self._is_open = not self._is_open
        if self._is_open:
            self._begin()
        else:
            self._write("MSG", b"Disarming motors")

    def on_slice(self) -> None:
        """After each slice of simulated time."""
        vehicle = self._vehicle
        self.look()
        if not self._is_open or len(self.logs[-1].content) > MOST_BYTES:
            return
        if vehicle.autopilot.mode.name != self._mode:
            self._mode = vehicle.autopilot.mode.name
            number = self._mode_numbers.get(self._mode, 0)
            self._write("MODE", number, number, 1)
        if vehicle.now_s - self._written_s >= EVERY_S:
            self._written_s = vehicle.now_s
            self._sample()

    def on_text(self, text: str) -> None:
        if self._is_open:
            self._write("MSG", text.encode())

    def _begin(self) -> None:
        self.logs = [*self.logs[-MOST_LOGS + 1 :], SimulatedLog(self._started_utc_s + self._vehicle.now_s)]
        self._mode = ""
        self._format("FMT", 128, "BBnNZ", "Type,Length,Name,Format,Columns", 89)
        for name, (number, letters, packing, columns) in _KINDS.items():
            self._format(name, number, letters, columns, struct.calcsize(packing) + 3)
        self._write("MSG", b"Arming motors")
        self._write("MSG", f"ArduCopter V{self._version} (simulated by Hedgehop)".encode())
        lat, lon, alt_m = self._geodetic(self._vehicle.autopilot.home_neu)
        self._write("ORGN", _HOME, lat, lon, round(100 * alt_m))

    def _format(self, name: str, number: int, letters: str, columns: str, length: int) -> None:
        head = struct.pack("<BB4s16s64s", number, length, name.encode(), letters.encode(), columns.encode())
        self.logs[-1].content += b"\xa3\x95\x80" + head

    def _write(self, name: str, *values: Any) -> None:
        number, _, packing, _ = _KINDS[name]
        record = struct.pack(packing, round(self._vehicle.now_s * 1e6), *values)
        self.logs[-1].content += bytes((0xA3, 0x95, number)) + record

    def _sample(self) -> None:
        vehicle, pilot = self._vehicle, self._vehicle.autopilot
        lat, lon, alt_m = self._geodetic(vehicle.reported_neu)
        up_m = pilot.p_neu[2]
        self._write("POS", lat, lon, alt_m, up_m - pilot.home_neu[2], up_m)
        self._write("ATT", *(math.degrees(angle) for angle in vehicle.attitude_rad))
        north, east, up = pilot.v_neu
        self._write("XKF1", 0, north, east, -up)
        battery = vehicle.battery
        self._write("BAT", 0, battery.voltage_v, battery.current_a, battery.used_mah, round(battery.share * 100))
        if not vehicle.has_fix:
            return
        receiver = vehicle.gnss.receiver
        gps_s = self._started_utc_s + vehicle.now_s - _GPS_EPOCH_UTC_S + _LEAP_S
        week, in_week_s = divmod(gps_s, _WEEK_S)
        fix, hdop = _FIXES[receiver.fix], round(100 * receiver.hdop)
        ms = round(1000 * in_week_s)
        self._write("GPS", 0, fix, ms, int(week), receiver.satellites, hdop, lat, lon, round(100 * alt_m))

    def _geodetic(self, p_neu: tuple[float, float, float]) -> tuple[int, int, float]:
        lat_deg, lon_deg, alt_m = self._vehicle.frame.geodetic_from_neu(p_neu)
        return round(lat_deg * 1e7), round(lon_deg * 1e7), alt_m
