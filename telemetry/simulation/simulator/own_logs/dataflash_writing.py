"""DataFlash logs as ArduPilot writes them."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import Any

from telemetry.simulation.simulator.autopilot.pilot import Event, Text
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

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


class DataflashWriter:
    folder = "/APM/LOGS"
    first_number = 1
    words_while_armed = "Disarm for log download"
    is_wanted = True

    def __init__(
        self, vehicle: SimulatedVehicle, started_utc_s: float, *, mode_numbers: Mapping[str, int], version: str
    ) -> None:
        self._vehicle, self._started_utc_s = vehicle, started_utc_s
        self._mode_numbers, self._version = mode_numbers, version

    def path(self, number: int, _: float) -> str:
        return f"{self.folder}/{number:08d}.BIN"

    def head(self) -> bytes:
        lat, lon, alt_m = self._geodetic(self._vehicle.autopilot.home_neu)
        return b"".join([
            _format("FMT", 128, "BBnNZ", "Type,Length,Name,Format,Columns", 89),
            *(
                _format(name, number, letters, columns, struct.calcsize(packing) + 3)
                for name, (number, letters, packing, columns) in _KINDS.items()
            ),
            self._record("MSG", b"Arming motors"),
            self._record("MSG", f"ArduCopter V{self._version} (simulated by Hedgehop)".encode()),
            self._record("ORGN", _HOME, lat, lon, round(100 * alt_m)),
        ])  # fmt: skip

    def mode(self) -> bytes:
        number = self._mode_numbers.get(self._vehicle.autopilot.mode.name, 0)
        return self._record("MODE", number, number, 1)

    def event(self, event: Event) -> bytes:
        return self._record("MSG", event.text.encode()) if isinstance(event, Text) else b""

    def end(self) -> bytes:
        return self._record("MSG", b"Disarming motors")

    def sample(self) -> bytes:
        vehicle, pilot = self._vehicle, self._vehicle.autopilot
        lat, lon, alt_m = self._geodetic(vehicle.reported_neu)
        up_m, battery = pilot.p_neu[2], vehicle.battery
        north, east, up = pilot.v_neu
        percent = round(battery.share * 100)
        return b"".join([
            self._record("POS", lat, lon, alt_m, up_m - pilot.home_neu[2], up_m),
            self._record("ATT", *(math.degrees(angle) for angle in vehicle.attitude_rad)),
            self._record("XKF1", 0, north, east, -up),
            self._record("BAT", 0, battery.voltage_v, battery.current_a, battery.used_mah, percent),
            self._receiver(lat, lon, alt_m) if vehicle.has_fix else b"",
        ])  # fmt: skip

    def _receiver(self, lat: int, lon: int, alt_m: float) -> bytes:
        receiver = self._vehicle.gnss.receiver
        gps_s = self._started_utc_s + self._vehicle.now_s - _GPS_EPOCH_UTC_S + _LEAP_S
        week, in_week_s = divmod(gps_s, _WEEK_S)
        fix, hdop = _FIXES[receiver.fix], round(100 * receiver.hdop)
        ms = round(1000 * in_week_s)
        return self._record("GPS", 0, fix, ms, int(week), receiver.satellites, hdop, lat, lon, round(100 * alt_m))

    def _record(self, name: str, *values: Any) -> bytes:
        number, _, packing, _ = _KINDS[name]
        return bytes((0xA3, 0x95, number)) + struct.pack(packing, round(self._vehicle.now_s * 1e6), *values)

    def _geodetic(self, p_neu: tuple[float, float, float]) -> tuple[int, int, float]:
        lat_deg, lon_deg, alt_m = self._vehicle.frame.geodetic_from_neu(p_neu)
        return round(lat_deg * 1e7), round(lon_deg * 1e7), alt_m


def _format(name: str, number: int, letters: str, columns: str, length: int) -> bytes:
    return b"\xa3\x95\x80" + struct.pack(
        "<BB4s16s64s", number, length, name.encode(), letters.encode(), columns.encode()
    )
