"""Telemetry messages as ArduCopter fills them, beside those that it fills as others do."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, quaternion
from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.copter_fence import CEILING, CIRCLE, FLOOR, SHAPES
from telemetry.simulation.simulator.autopilot.pilot import AS_REAL_BOOT_S, Event, HomeSet, Reached, StateChanged
from telemetry.simulation.simulator.protocol.command_protocol import MODE_NUMBERS
from telemetry.simulation.simulator.protocol.common_streams import CommonStreams
from telemetry.simulation.simulator.protocol.mission_protocol import MissionProtocol
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

CAPABILITIES = (
    wire.MAV_PROTOCOL_CAPABILITY_FTP
    | wire.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
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
MISSION_STATES = {"not_started": 2, "active": 3, "paused": 4, "complete": 5}
LANDED_STATES = {"ground": 1, "flight": 2, "takeoff": 3, "landing": 4}

BREACHES = (
    (CIRCLE | SHAPES, wire.FENCE_BREACH_BOUNDARY),
    (CEILING, wire.FENCE_BREACH_MAXALT),
    (FLOOR, wire.FENCE_BREACH_MINALT),
)
"""FENCE_STATUS tells one."""


class ArduStreams(CommonStreams):
    """SIM_STATE alone tells the truth."""

    def __init__(self, vehicle: SimulatedVehicle, pilot: Autopilot, missions: MissionProtocol) -> None:
        super().__init__(vehicle)
        self._pilot = pilot
        self._missions = missions
        self._builders |= {
            wire.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            wire.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            wire.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            wire.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: self._nav_controller,
            wire.MAVLINK_MSG_ID_SIM_STATE: self._sim_state,
            wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._autopilot_version,
            wire.MAVLINK_MSG_ID_WIND: self._wind,
            wire.MAVLINK_MSG_ID_EKF_STATUS_REPORT: self._ekf_status,
            wire.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_state,
            wire.MAVLINK_MSG_ID_FENCE_STATUS: self._fence_status,
        }

    def on_event(self, event: Event) -> list[MAVLink_message]:
        match event:
            case Reached(seq):
                return [wire.MAVLink_mission_item_reached_message(seq)]
            case HomeSet():
                return [message for message in (self.gps_global_origin(), self.home_position()) if message]
            case StateChanged():
                return [self.heartbeat()]
            case _:
                return []

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

    def _sys_status(self) -> MAVLink_message:
        pilot, battery = self._pilot, self._vehicle.battery
        healthy = HEALTHY_WITH_POSITION if pilot.position_ok and pilot.mode.needs_position else HEALTHY_WITH_FIX
        if not pilot.has_fix:
            healthy = HEALTHY_AT_BOOT
        if pilot.ready_to_arm:
            healthy |= wire.MAV_SYS_STATUS_PREARM_CHECK
        enabled = SENSORS_IN_USE if pilot.mode.needs_position else SENSORS_IDLE
        if pilot.fence.acts:
            enabled |= wire.MAV_SYS_STATUS_GEOFENCE
        if pilot.fence.breached:
            healthy &= ~wire.MAV_SYS_STATUS_GEOFENCE
        return wire.MAVLink_sys_status_message(
            SENSORS_PRESENT,
            enabled,
            healthy,
            0,
            round(battery.voltage_v * 1000),
            round(battery.current_a * 100),
            round(battery.share * 100),
            *[0] * 6,
        )

    def _fence_status(self) -> MAVLink_message | None:
        """Of a fence that is switched on alone."""
        fence = self._pilot.fence
        if not fence.is_on:
            return None
        kind = next((told for kinds, told in BREACHES if fence.breached & kinds), wire.FENCE_BREACH_NONE)
        return wire.MAVLink_fence_status_message(
            int(fence.breached != 0), min(fence.count, 65535), kind, int(fence.breached_s * 1000)
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

    def _extended_state(self) -> MAVLink_message:
        return wire.MAVLink_extended_sys_state_message(wire.MAV_VTOL_STATE_MC, LANDED_STATES[self._pilot.stage])
