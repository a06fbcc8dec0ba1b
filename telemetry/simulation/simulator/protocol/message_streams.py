"""Telemetry messages of the simulated vehicle, each built from its state when it is due."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, quaternion
from telemetry.simulation.simulator.autopilot.pilot import AS_REAL_BOOT_S
from telemetry.simulation.simulator.protocol.command_protocol import MODE_NUMBERS
from telemetry.simulation.simulator.protocol.mission_protocol import MissionProtocol
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

CAPABILITIES = (
    wire.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | wire.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | wire.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | wire.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | wire.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | wire.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | wire.MAV_PROTOCOL_CAPABILITY_MAVLINK2
)
FIRMWARE, FIRMWARE_VERSION = "4.7.0-dev", 4 << 24 | 7 << 16
SENSORS_PRESENT, SENSORS_IDLE, SENSORS_IN_USE = 0x5371FC2F, 0x52619C2F, 0x5361FC2F
HEALTHY_AT_BOOT, HEALTHY_WITH_FIX, HEALTHY_WITH_POSITION = 0x47519C0F, 0x47719C2F, 0x4771FC2F
EKF_AT_BOOT, EKF_WITH_TILT, EKF_WITH_POSITION = 1024, 167, 831
HOVER_THROTTLE_PERCENT = 36
TARGET_MASK = 65016
"""Position only, as ArduCopter reports its target."""
MISSION_STATES = {"not_started": 2, "active": 3, "paused": 4, "complete": 5}
LANDED_STATES = {"ground": 1, "flight": 2, "takeoff": 3, "landing": 4}
NO_FIX = 1
"""A receiver that is there and sees too few satellites."""
FIXES = {"3d": 3, "rtk_fixed": 6}


class Streams:
    """Builds messages by id. Values are those of the vehicle's estimate; SIM_STATE alone tells the truth."""

    def __init__(self, vehicle: SimulatedVehicle, missions: MissionProtocol) -> None:
        self._vehicle = vehicle
        self._pilot = vehicle.autopilot
        self._missions = missions
        self._started_utc_s = time.time()
        self._builders: dict[int, Callable[[], MAVLink_message | None]] = {
            wire.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            wire.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            wire.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            wire.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps_raw,
            wire.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            wire.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self._attitude_quaternion,
            wire.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._local_position,
            wire.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            wire.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            wire.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self.gps_global_origin,
            wire.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: self._nav_controller,
            wire.MAVLINK_MSG_ID_VFR_HUD: self._vfr_hud,
            wire.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: self._position_target,
            wire.MAVLINK_MSG_ID_SIM_STATE: self._sim_state,
            wire.MAVLINK_MSG_ID_BATTERY_STATUS: self._battery_status,
            wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._autopilot_version,
            wire.MAVLINK_MSG_ID_VIBRATION: self._vibration,
            wire.MAVLINK_MSG_ID_WIND: self._wind,
            wire.MAVLINK_MSG_ID_EKF_STATUS_REPORT: self._ekf_status,
            wire.MAVLINK_MSG_ID_HOME_POSITION: self.home_position,
            wire.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_state,
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

    def heartbeat(self) -> MAVLink_message:
        pilot = self._pilot
        base = wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | wire.MAV_MODE_FLAG_STABILIZE_ENABLED
        base |= wire.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        if pilot.mode.name == "GUIDED" or (pilot.armed and pilot.mode.needs_position):
            base |= wire.MAV_MODE_FLAG_GUIDED_ENABLED
        if pilot.armed:
            base |= wire.MAV_MODE_FLAG_SAFETY_ARMED
        status = wire.MAV_STATE_STANDBY if pilot.ready else wire.MAV_STATE_BOOT
        if pilot.flying:
            status = wire.MAV_STATE_ACTIVE
        if pilot.armed and pilot.failsafe_active:
            status = wire.MAV_STATE_CRITICAL
        return wire.MAVLink_heartbeat_message(
            wire.MAV_TYPE_QUADROTOR,
            wire.MAV_AUTOPILOT_ARDUPILOTMEGA,
            base,
            MODE_NUMBERS[pilot.mode.name],
            status,
            3,
        )

    def mission_current(self) -> MAVLink_message:
        total = self._missions.total
        state = MISSION_STATES[self._pilot.auto.state] if total else 1
        flying_it = 1 if self._pilot.mode is self._pilot.auto else 2
        return wire.MAVLink_mission_current_message(
            self._pilot.mission.current, total, state, flying_it if total else 0
        )

    def home_position(self) -> MAVLink_message | None:
        if not self._pilot.home_known:
            return None
        lat, lon, alt_m = self._geodetic(self._pilot.home_neu)
        n, e, u = self._pilot.home_neu
        return wire.MAVLink_home_position_message(
            lat, lon, _mm(alt_m), n, e, -u, [math.nan] * 4, 0, 0, 0, int(self._vehicle.now_s * 1e6)
        )

    def gps_global_origin(self) -> MAVLink_message | None:
        if not self._pilot.home_known:
            return None
        lat, lon, alt_m = self._geodetic((0.0, 0.0, 0.0))
        return wire.MAVLink_gps_global_origin_message(lat, lon, _mm(alt_m), int(self._vehicle.now_s * 1e6))

    def _sys_status(self) -> MAVLink_message:
        pilot, battery = self._pilot, self._vehicle.battery
        healthy = HEALTHY_WITH_POSITION if pilot.position_ok and pilot.mode.needs_position else HEALTHY_WITH_FIX
        if not pilot.has_fix:
            healthy = HEALTHY_AT_BOOT
        if pilot.ready_to_arm:
            healthy |= wire.MAV_SYS_STATUS_PREARM_CHECK
        return wire.MAVLink_sys_status_message(
            SENSORS_PRESENT,
            SENSORS_IN_USE if pilot.mode.needs_position else SENSORS_IDLE,
            healthy,
            0,
            round(battery.voltage_v * 1000),
            round(battery.current_a * 100),
            round(battery.share * 100),
            *[0] * 6,
        )

    def _system_time(self) -> MAVLink_message:
        utc_us = int((self._started_utc_s + self._vehicle.now_s) * 1e6) if self._pilot.has_fix else 0
        return wire.MAVLink_system_time_message(utc_us, self.boot_ms)

    def _gps_raw(self) -> MAVLink_message:
        if not self._vehicle.has_fix:
            lost_us = int(self._vehicle.now_s * 1e6) if self._pilot.has_fix else 0
            return wire.MAVLink_gps_raw_int_message(lost_us, NO_FIX if lost_us else 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
        receiver = self._vehicle.gnss.receiver
        lat, lon, alt_m = self._geodetic(self._vehicle.reported_neu)
        north, east, _ = self._pilot.v_neu
        return wire.MAVLink_gps_raw_int_message(
            int(self._vehicle.now_s * 1e6),
            FIXES[receiver.fix],
            lat,
            lon,
            _mm(alt_m),
            round(receiver.hdop * 100),
            round(receiver.hdop * 165),
            round(100 * math.hypot(north, east)),
            round(100 * math.degrees(math.atan2(east, north))) % 36000,
            receiver.satellites,
            _mm(alt_m),
            _mm(receiver.h_acc_m),
            _mm(receiver.v_acc_m),
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
        if not self._pilot.position_ok:
            return None
        (n, e, u), (vn, ve, vu) = self._vehicle.reported_neu, self._pilot.v_neu
        return wire.MAVLink_local_position_ned_message(self.boot_ms, n, e, -u, vn, ve, -vu)

    def _global_position(self) -> MAVLink_message:
        heading_cdeg = round(100 * math.degrees(self._vehicle.attitude_rad[2])) % 36000
        if not self._pilot.has_fix:
            return wire.MAVLink_global_position_int_message(self.boot_ms, 0, 0, 0, 0, 0, 0, 0, heading_cdeg)
        lat, lon, alt_m = self._geodetic(self._vehicle.reported_neu)
        north, east, up = (round(100 * v) for v in self._pilot.v_neu)
        above_home_m = self._pilot.p_neu[2] - self._pilot.home_neu[2]
        return wire.MAVLink_global_position_int_message(
            self.boot_ms, lat, lon, _mm(alt_m), _mm(above_home_m), north, east, -up, heading_cdeg
        )

    def _nav_controller(self) -> MAVLink_message:
        roll, pitch, _ = self._vehicle.truth.attitude_rad
        goal, (n, e, u) = self._pilot.goal_neu, self._pilot.p_neu
        north, east = (goal[0] - n, goal[1] - e) if goal else (0.0, 0.0)
        bearing = round(math.degrees(math.atan2(east, north))) if goal else 0
        tn, te, tu = self._pilot.target[0]
        off_m = math.hypot(tn - n, te - e) if self._pilot.flying else 0.0
        return wire.MAVLink_nav_controller_output_message(
            math.degrees(roll),
            math.degrees(pitch),
            bearing,
            bearing % 360,
            min(65535, round(math.hypot(north, east))),
            tu - u if self._pilot.flying else 0.0,
            0,
            off_m,
        )

    def _vfr_hud(self) -> MAVLink_message:
        vehicle, (north, east, up) = self._vehicle, self._pilot.v_neu
        wn, we, _ = vehicle.wind_neu
        share = 1 + vehicle.truth.accel_neu[2] / GRAVITY_M_S2 if self._pilot.flying else 0
        _, _, alt_m = vehicle.frame.geodetic_from_neu(self._pilot.p_neu)
        return wire.MAVLink_vfr_hud_message(
            math.hypot(north - wn, east - we),
            math.hypot(north, east),
            int(math.degrees(vehicle.attitude_rad[2])) % 360,
            max(0, min(100, round(HOVER_THROTTLE_PERCENT * share))),
            alt_m if self._pilot.has_fix else 0.0,
            up,
        )

    def _position_target(self) -> MAVLink_message | None:
        goal = self._pilot.goal_neu
        if goal is None or not self._pilot.flying:
            return None
        lat, lon, _ = self._geodetic(goal)
        alt_m = self._vehicle.frame.alt_amsl_m + goal[2]
        return wire.MAVLink_position_target_global_int_message(
            self.boot_ms, 0, TARGET_MASK, lat, lon, alt_m, 0, 0, 0, 0, 0, 0, 0, 0
        )

    def _sim_state(self) -> MAVLink_message:
        truth = self._vehicle.truth
        roll, pitch, heading = truth.attitude_rad
        lat, lon, alt_m = self._geodetic(truth.p_neu)
        north, east, up = truth.accel_neu
        c, s = math.cos(heading), math.sin(heading)
        # Latitude and longitude as floats hold degrees times 1e7, as the recorded ArduCopter sent them.
        return wire.MAVLink_sim_state_message(
            *quaternion(roll, pitch, heading), roll, pitch, math.remainder(heading, 2 * math.pi),
            north * c + east * s, east * c - north * s, -GRAVITY_M_S2 - up, 0, 0, truth.yaw_rate_rad_s,
            float(lat), float(lon), alt_m, 0, 0, truth.v_neu[0], truth.v_neu[1], -truth.v_neu[2], lat, lon,
        )  # fmt: skip

    def _battery_status(self) -> MAVLink_message:
        battery = self._vehicle.battery
        voltage_mv = round(battery.voltage_v * 1000)
        return wire.MAVLink_battery_status_message(
            0, 0, 0, 32767, [voltage_mv] + [65535] * 9, round(battery.current_a * 100), round(battery.used_mah),
            round(battery.used_mah * battery.voltage_v * 0.036), round(battery.share * 100),
            charge_state=wire.MAV_BATTERY_CHARGE_STATE_OK,
        )  # fmt: skip

    def _autopilot_version(self) -> MAVLink_message:
        return wire.MAVLink_autopilot_version_message(
            CAPABILITIES, FIRMWARE_VERSION, 0, 0, 0, list(b"hedgehop"), [0] * 8, [0] * 8, 0, 0, 0, [0] * 18
        )

    def _wind(self) -> MAVLink_message:
        parameters = self._vehicle.parameters
        return wire.MAVLink_wind_message(parameters["SIM_WIND_DIR"], parameters["SIM_WIND_SPD"], 0)

    def _ekf_status(self) -> MAVLink_message:
        flags = EKF_WITH_POSITION if self._pilot.position_ok and self._vehicle.has_fix else EKF_WITH_TILT
        if self._vehicle.now_s < self._pilot.boot_s * 6.2 / AS_REAL_BOOT_S:
            flags = EKF_AT_BOOT
        return wire.MAVLink_ekf_status_report_message(flags, 0.01, 0.004, 0.001, 0.005, 0)

    def _vibration(self) -> MAVLink_message:
        """Of a quiet airframe: a trace on the ground, more with turning rotors."""
        axes_m_s2 = (3.1, 2.8, 6.4) if self._pilot.flying else (0.1, 0.1, 0.1)
        return wire.MAVLink_vibration_message(int(self._vehicle.now_s * 1e6), *axes_m_s2, 0, 0, 0)

    def _extended_state(self) -> MAVLink_message:
        return wire.MAVLink_extended_sys_state_message(wire.MAV_VTOL_STATE_MC, LANDED_STATES[self._pilot.stage])

    def _geodetic(self, p_neu: tuple[float, float, float]) -> tuple[int, int, float]:
        lat, lon, alt_m = self._vehicle.frame.geodetic_from_neu(p_neu)
        return round(lat * 1e7), round(lon * 1e7), alt_m


def _mm(metres: float) -> int:
    return round(1000 * metres)
