"""Telemetry messages as PX4 fills them, beside those that it fills as others do; and what it sends unasked."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.mavlink.texts.event_messages import ComponentMetadata
from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, quaternion
from telemetry.simulation.simulator.autopilot.pilot import Event, Reached
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.protocol.common_streams import CommonStreams
from telemetry.simulation.simulator.protocol.px4.px4_metadata import component_metadata
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

AUTO = 4
_MAIN = {"MANUAL": 1, "ALTCTL": 2, "POSCTL": 3, "ACRO": 5, "OFFBOARD": 6, "STABILIZED": 7}
_SUB = {"TAKEOFF": 2, "HOLD": 3, "MISSION": 4, "RTL": 5, "LAND": 6}
MODE_NUMBERS: dict[str, int] = {
    **{name: main << 16 for name, main in _MAIN.items()},
    **{name: AUTO << 16 | sub << 24 for name, sub in _SUB.items()},
}
MODE_NAMES = {number: name for name, number in MODE_NUMBERS.items()}
"""As a heartbeat's ``custom_mode`` has them: a main mode, and a sub mode of AUTO."""
CAPABILITIES = (
    wire.MAV_PROTOCOL_CAPABILITY_FTP
    | wire.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | wire.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | wire.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    | wire.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | wire.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | wire.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | wire.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | wire.MAV_PROTOCOL_CAPABILITY_MAVLINK2
)
FIRMWARE, FIRMWARE_VERSION = "1.17.0", 1 << 24 | 17 << 16 | 255
SENSORS_PRESENT, SENSORS_ENABLED, SENSORS_HEALTHY = 0x300402F, 0x301402F, 0x320C83F
"""As recorded. The check before arming shows in the bit of health alone."""
HEARTBEAT_MODE = 29
NO_MISSION = 65535
MISSION_STATES = {"not_started": 2, "active": 3, "paused": 4, "complete": 5}
LANDED_STATES = {"ground": 1, "flight": 2, "takeoff": 3, "landing": 4}
ESTIMATOR_GOOD, ESTIMATOR_TILT = 895, wire.ESTIMATOR_ATTITUDE
REACHED_FOR_S = 10.0
"""So long an item that was reached is told again every second."""
FAST_HZ = 50.0
UNASKED_HZ: dict[int, float] = {
    wire.MAVLINK_MSG_ID_ATTITUDE: FAST_HZ,
    wire.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: FAST_HZ,
    wire.MAVLINK_MSG_ID_ATTITUDE_TARGET: FAST_HZ,
    wire.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: FAST_HZ,
    wire.MAVLINK_MSG_ID_LOCAL_POSITION_NED: FAST_HZ,
    wire.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: FAST_HZ,
    wire.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: FAST_HZ,
    wire.MAVLINK_MSG_ID_GPS_RAW_INT: 5.0,
    wire.MAVLINK_MSG_ID_VFR_HUD: 4.0,
    wire.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
    wire.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1.0,
    wire.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    wire.MAVLINK_MSG_ID_MISSION_ITEM_REACHED: 1.0,
    wire.MAVLINK_MSG_ID_ALTITUDE: 1.0,
    wire.MAVLINK_MSG_ID_SCALED_PRESSURE: 1.0,
    wire.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    wire.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 0.5,
    wire.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
}
"""In simulation, to port 14550. Where it is going is not among them (POSITION_TARGET_GLOBAL_INT)."""


def name_of(main: int, sub: int) -> str | None:
    return MODE_NAMES.get(main << 16 | (sub << 24 if main == AUTO else 0))


class Px4Streams(CommonStreams):
    def __init__(self, vehicle: SimulatedVehicle, pilot: Px4Pilot) -> None:
        super().__init__(vehicle)
        self._pilot = pilot
        self._reached: tuple[int, float] | None = None
        self._builders |= {
            wire.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            wire.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            wire.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            wire.MAVLINK_MSG_ID_MISSION_ITEM_REACHED: self._mission_item_reached,
            wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._autopilot_version,
            wire.MAVLINK_MSG_ID_ESTIMATOR_STATUS: self._estimator_status,
            wire.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_state,
            wire.MAVLINK_MSG_ID_ALTITUDE: self._altitude,
            wire.MAVLINK_MSG_ID_ATTITUDE_TARGET: self._attitude_target,
            wire.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: self._local_target,
            wire.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: self._servo_output,
            wire.MAVLINK_MSG_ID_SCALED_PRESSURE: self._scaled_pressure,
            wire.MAVLINK_MSG_ID_WIND_COV: self._wind_cov,
            ComponentMetadata.id: self._component_metadata,
        }

    def on_event(self, event: Event) -> list[MAVLink_message]:
        if isinstance(event, Reached):
            self._reached = (event.seq, self._vehicle.now_s)
            return [wire.MAVLink_mission_item_reached_message(event.seq), self.mission_current()]
        return []

    def heartbeat(self) -> MAVLink_message:
        pilot = self._pilot
        armed = wire.MAV_MODE_FLAG_SAFETY_ARMED if pilot.armed else 0
        status = wire.MAV_STATE_ACTIVE if pilot.armed else wire.MAV_STATE_STANDBY
        if pilot.armed and pilot.failsafe_active:
            status = wire.MAV_STATE_CRITICAL
        number = MODE_NUMBERS[pilot.mode.name]
        return wire.MAVLink_heartbeat_message(
            wire.MAV_TYPE_QUADROTOR, wire.MAV_AUTOPILOT_PX4, HEARTBEAT_MODE | armed, number, status, 3
        )

    def mission_current(self) -> MAVLink_message:
        count, pilot = len(self._pilot.mission.steps), self._pilot
        if not count:
            return wire.MAVLink_mission_current_message(0, NO_MISSION, 1, 0)
        flies_it = pilot.mode is pilot.missions and pilot.missions.state == "active"
        state = MISSION_STATES[pilot.missions.state]
        return wire.MAVLink_mission_current_message(pilot.mission.current, count, state, 1 if flies_it else 2)

    def _mission_item_reached(self) -> MAVLink_message | None:
        if self._reached is None or self._vehicle.now_s - self._reached[1] > REACHED_FOR_S:
            return None
        return wire.MAVLink_mission_item_reached_message(self._reached[0])

    def _sys_status(self) -> MAVLink_message:
        battery = self._vehicle.battery
        ready = wire.MAV_SYS_STATUS_PREARM_CHECK if self._pilot.ready_to_arm else 0
        return wire.MAVLink_sys_status_message(
            SENSORS_PRESENT, SENSORS_ENABLED, SENSORS_HEALTHY | ready, 0, round(battery.voltage_v * 1000),
            round(battery.current_a * 100), round(battery.share * 100), *[0] * 6,
        )  # fmt: skip

    def _estimator_status(self) -> MAVLink_message:
        """Its position is constant, it says, until it is armed."""
        flags = ESTIMATOR_GOOD if self._pilot.position_ok and self._vehicle.has_fix else ESTIMATOR_TILT
        if not self._pilot.armed:
            flags |= wire.ESTIMATOR_CONST_POS_MODE
        receiver = self._vehicle.gnss.receiver
        ratios = (0.02, 0.02, 0.03, 0.04, 0.0, math.nan)
        return wire.MAVLink_estimator_status_message(
            int(self._vehicle.now_s * 1e6), flags, *ratios, receiver.h_acc_m, receiver.v_acc_m
        )

    def _extended_state(self) -> MAVLink_message:
        return wire.MAVLink_extended_sys_state_message(0, LANDED_STATES[self._pilot.landed_stage])

    def _altitude(self) -> MAVLink_message:
        up_m, frame = self._pilot.p_neu[2], self._vehicle.frame
        amsl_m, home_m = frame.alt_amsl_m + up_m, up_m - self._pilot.home_neu[2]
        below_m = self._pilot.above_ground_m
        return wire.MAVLink_altitude_message(
            int(self._vehicle.now_s * 1e6), amsl_m, amsl_m, up_m, home_m, amsl_m - below_m, below_m
        )

    def _attitude_target(self) -> MAVLink_message:
        roll, pitch, _ = self._vehicle.attitude_rad
        q = quaternion(roll, pitch, self._pilot.heading_goal_rad)
        return wire.MAVLink_attitude_target_message(self.boot_ms, 0, list(q), 0, 0, 0, self._thrust())

    def _local_target(self) -> MAVLink_message:
        """On the ground there is none."""
        if not self._pilot.flying:
            nan = math.nan
            return wire.MAVLink_position_target_local_ned_message(
                self.boot_ms, 1, 0, nan, nan, nan, nan, nan, nan, 0, 0, 100, self._pilot.heading_goal_rad, 0
            )
        (n, e, u), (vn, ve, vu), (an, ae, au) = self._pilot.target
        yaw = math.remainder(self._pilot.heading_goal_rad, math.tau)
        return wire.MAVLink_position_target_local_ned_message(
            self.boot_ms, 1, 0, n, e, -u, vn, ve, -vu, an, ae, -au, yaw, 0
        )

    def _servo_output(self) -> MAVLink_message:
        motor = round(1000 + 1000 * self._thrust())
        return wire.MAVLink_servo_output_raw_message(int(self._vehicle.now_s * 1e6), 0, *[motor] * 4, *[0] * 4)

    def _thrust(self) -> float:
        if not self._pilot.flying:
            return 0.0
        share = 1 + self._vehicle.truth.accel_neu[2] / GRAVITY_M_S2
        return max(0.0, min(1.0, self._vehicle.parameters["MPC_THR_HOVER"] * share))

    def _scaled_pressure(self) -> MAVLink_message:
        amsl_m = self._vehicle.frame.alt_amsl_m + self._pilot.p_neu[2]
        hpa = 1013.25 * (1 - 2.25577e-5 * amsl_m) ** 5.25588
        return wire.MAVLink_scaled_pressure_message(self.boot_ms, hpa, 0.0, 2500)

    def _component_metadata(self) -> MAVLink_message:
        return component_metadata(round(self._vehicle.now_s * 1000))

    def _wind_cov(self) -> MAVLink_message:
        north, east, _ = self._vehicle.wind_neu
        return wire.MAVLink_wind_cov_message(int(self._vehicle.now_s * 1e6), north, east, 0, 0, 0, 0, 0, 0)

    def _autopilot_version(self) -> MAVLink_message:
        return wire.MAVLink_autopilot_version_message(
            CAPABILITIES, FIRMWARE_VERSION, 0, 0, 0, list(b"hedgehop"), [0] * 8, [0] * 8, 0, 0, 0, [0] * 18
        )
