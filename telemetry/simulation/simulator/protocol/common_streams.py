"""Telemetry messages that ArduCopter and PX4 fill alike, each built from the vehicle's state when it is due."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, quaternion
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

HOVER_THROTTLE_PERCENT = 36
TARGET_MASK = 65016
"""Position only, as both report their target."""
NO_FIX = 1
"""A receiver that is there and sees too few satellites."""
FIXES = {"3d": 3, "rtk_fixed": 6}


class CommonStreams:
    """Builds messages by id. Values are those of the vehicle's estimate."""

    def __init__(self, vehicle: SimulatedVehicle) -> None:
        self._vehicle = vehicle
        self._flown = vehicle.autopilot
        self._started_utc_s = time.time()
        self._builders: dict[int, Callable[[], MAVLink_message | None]] = {
            wire.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            wire.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps_raw,
            wire.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            wire.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self._attitude_quaternion,
            wire.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._local_position,
            wire.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            wire.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self.gps_global_origin,
            wire.MAVLINK_MSG_ID_VFR_HUD: self._vfr_hud,
            wire.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: self._position_target,
            wire.MAVLINK_MSG_ID_BATTERY_STATUS: self._battery_status,
            wire.MAVLINK_MSG_ID_VIBRATION: self._vibration,
            wire.MAVLINK_MSG_ID_HOME_POSITION: self.home_position,
        }

    def __contains__(self, message_id: int) -> bool:
        return message_id in self._builders

    def build(self, message_id: int) -> MAVLink_message | None:
        """The message now; None for one that the vehicle does not have or has nothing to say in yet."""
        builder = self._builders.get(message_id)
        return builder() if builder else None

    @property
    def boot_ms(self) -> int:
        return int(self._vehicle.now_s * 1000)

    def home_position(self) -> MAVLink_message | None:
        if not self._flown.home_known:
            return None
        lat, lon, alt_m = self._geodetic(self._flown.home_neu)
        n, e, u = self._flown.home_neu
        return wire.MAVLink_home_position_message(
            lat, lon, mm(alt_m), n, e, -u, [math.nan] * 4, 0, 0, 0, int(self._vehicle.now_s * 1e6)
        )

    def gps_global_origin(self) -> MAVLink_message | None:
        if not self._flown.home_known:
            return None
        lat, lon, alt_m = self._geodetic((0.0, 0.0, 0.0))
        return wire.MAVLink_gps_global_origin_message(lat, lon, mm(alt_m), int(self._vehicle.now_s * 1e6))

    def _system_time(self) -> MAVLink_message:
        utc_us = int((self._started_utc_s + self._vehicle.now_s) * 1e6) if self._flown.has_fix else 0
        return wire.MAVLink_system_time_message(utc_us, self.boot_ms)

    def _gps_raw(self) -> MAVLink_message:
        if not self._vehicle.has_fix:
            lost_us = int(self._vehicle.now_s * 1e6) if self._flown.has_fix else 0
            return wire.MAVLink_gps_raw_int_message(lost_us, NO_FIX if lost_us else 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
        receiver = self._vehicle.gnss.receiver
        lat, lon, alt_m = self._geodetic(self._vehicle.reported_neu)
        north, east, _ = self._vehicle.truth.v_neu  # a receiver knows nothing of the estimate
        return wire.MAVLink_gps_raw_int_message(
            int(self._vehicle.now_s * 1e6),
            FIXES[receiver.fix],
            lat,
            lon,
            mm(alt_m),
            round(receiver.hdop * 100),
            round(receiver.hdop * 165),
            round(100 * math.hypot(north, east)),
            round(100 * math.degrees(math.atan2(east, north))) % 36000,
            receiver.satellites,
            mm(alt_m),
            mm(receiver.h_acc_m),
            mm(receiver.v_acc_m),
        )

    def _attitude(self) -> MAVLink_message:
        roll, pitch, heading = self._vehicle.attitude_rad
        return wire.MAVLink_attitude_message(
            self.boot_ms, roll, pitch, math.remainder(heading, 2 * math.pi), 0, 0, self._vehicle.truth.yaw_rate_rad_s
        )

    def _attitude_quaternion(self) -> MAVLink_message:
        q = quaternion(*self._vehicle.attitude_rad)
        return wire.MAVLink_attitude_quaternion_message(self.boot_ms, *q, 0, 0, self._vehicle.truth.yaw_rate_rad_s)

    def _local_position(self) -> MAVLink_message | None:
        if not self._flown.position_ok:
            return None
        (n, e, u), (vn, ve, vu) = self._vehicle.reported_neu, self._flown.v_neu
        return wire.MAVLink_local_position_ned_message(self.boot_ms, n, e, -u, vn, ve, -vu)

    def _global_position(self) -> MAVLink_message:
        heading_cdeg = round(100 * math.degrees(self._vehicle.attitude_rad[2])) % 36000
        if not self._flown.has_fix:
            return wire.MAVLink_global_position_int_message(self.boot_ms, 0, 0, 0, 0, 0, 0, 0, heading_cdeg)
        lat, lon, alt_m = self._geodetic(self._vehicle.reported_neu)
        north, east, up = (round(100 * v) for v in self._flown.v_neu)
        above_home_m = self._flown.p_neu[2] - self._flown.home_neu[2]
        return wire.MAVLink_global_position_int_message(
            self.boot_ms, lat, lon, mm(alt_m), mm(above_home_m), north, east, -up, heading_cdeg
        )

    def _vfr_hud(self) -> MAVLink_message:
        vehicle, (north, east, up) = self._vehicle, self._flown.v_neu
        wn, we, _ = vehicle.wind_neu
        share = 1 + vehicle.truth.accel_neu[2] / GRAVITY_M_S2 if self._flown.flying else 0
        _, _, alt_m = vehicle.frame.geodetic_from_neu(self._flown.p_neu)
        return wire.MAVLink_vfr_hud_message(
            math.hypot(north - wn, east - we),
            math.hypot(north, east),
            int(math.degrees(vehicle.attitude_rad[2])) % 360,
            max(0, min(100, round(HOVER_THROTTLE_PERCENT * share))),
            alt_m if self._flown.has_fix else 0.0,
            up,
        )

    def _position_target(self) -> MAVLink_message | None:
        goal = self._flown.goal_neu
        if goal is None or not self._flown.flying:
            return None
        lat, lon, _ = self._geodetic(goal)
        alt_m = self._vehicle.frame.alt_amsl_m + goal[2]
        return wire.MAVLink_position_target_global_int_message(
            self.boot_ms, 0, TARGET_MASK, lat, lon, alt_m, 0, 0, 0, 0, 0, 0, 0, 0
        )

    def _battery_status(self) -> MAVLink_message:
        battery = self._vehicle.battery
        voltage_mv = round(battery.voltage_v * 1000)
        return wire.MAVLink_battery_status_message(
            0, 0, 0, 32767, [voltage_mv] + [65535] * 9, round(battery.current_a * 100), round(battery.used_mah),
            round(battery.used_mah * battery.voltage_v * 0.036), round(battery.share * 100),
            charge_state=wire.MAV_BATTERY_CHARGE_STATE_OK,
        )  # fmt: skip

    def _vibration(self) -> MAVLink_message:
        """Of a quiet airframe: a trace on the ground, more with turning rotors."""
        axes_m_s2 = (3.1, 2.8, 6.4) if self._flown.flying else (0.1, 0.1, 0.1)
        return wire.MAVLink_vibration_message(int(self._vehicle.now_s * 1e6), *axes_m_s2, 0, 0, 0)

    def _geodetic(self, p_neu: tuple[float, float, float]) -> tuple[int, int, float]:
        lat, lon, alt_m = self._vehicle.frame.geodetic_from_neu(p_neu)
        return round(lat * 1e7), round(lon * 1e7), alt_m


def mm(metres: float) -> int:
    return round(1000 * metres)
