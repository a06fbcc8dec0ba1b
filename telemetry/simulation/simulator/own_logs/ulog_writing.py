"""ULogs as PX4 writes them, of what the simulated PX4 knows of itself, and where it really was."""

from __future__ import annotations

import math
import time

from telemetry.simulation.simulator.airframe.dynamics import quaternion
from telemetry.simulation.simulator.autopilot.pilot import Event, HomeSet, Reached, Text
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.own_logs import ulog_records
from telemetry.simulation.simulator.own_logs.ulog_records import mark, record
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

SLOWLY_S = 1.0
"""Topics that change seldom, and the mark."""
NAV_STATES = {
    "MANUAL": 0, "ALTCTL": 1, "POSCTL": 2, "MISSION": 3, "HOLD": 4, "RTL": 5, "ACRO": 10, "OFFBOARD": 14,
    "STABILIZED": 15, "TAKEOFF": 17, "LAND": 18,
}  # fmt: skip
DISARMED, ARMED = 1, 2
ROTARY_WING, QUADROTOR, COMPONENT = 1, 2, 1
CELLS = 3
_FIXES = {"3d": 3, "rtk_fixed": 6}


class UlogWriter:
    folder = "/fs/microsd/log"
    first_number = 0
    words_while_armed = ""

    def __init__(self, vehicle: SimulatedVehicle, started_utc_s: float, *, version: int) -> None:
        pilot = vehicle.autopilot
        assert isinstance(pilot, Px4Pilot)
        self._vehicle, self._pilot, self._started_utc_s, self._version = vehicle, pilot, started_utc_s, version
        self._armed_us = self._homes = 0
        self._reached = -1
        self._slow_s = -math.inf

    @property
    def is_wanted(self) -> bool:
        """Of SDLOG_MODE's values the simulated one knows never (-1) and while armed."""
        return self._vehicle.parameters["SDLOG_MODE"] >= 0

    def path(self, _: int, begun_utc_s: float) -> str:
        return f"{self.folder}/{time.strftime('%Y-%m-%d/%H_%M_%S', time.gmtime(begun_utc_s))}.ulg"

    def head(self) -> bytes:
        self._armed_us, self._homes, self._reached, self._slow_s = self._now_us, 0, -1, -math.inf
        told: dict[str, str | int] = {
            "sys_name": "PX4",
            "ver_hw": "SIMULATED_BY_HEDGEHOP",
            "ver_sw_release": self._version,
            "boot_time_utc_us": round(self._started_utc_s * 1e6),
        }
        parameters = self._vehicle.parameters
        values = {
            name: int(parameters[name]) if spec.kind != "float" else parameters[name]
            for name, spec in self._vehicle.personality.specs.items()
        }
        return ulog_records.head(self._now_us, told, values) + self._home()

    def mode(self) -> bytes:
        return self._status()

    def end(self) -> bytes:
        return self._status() + self._landed()

    def event(self, event: Event) -> bytes:
        if isinstance(event, Text):
            return ulog_records.text(self._now_us, event.severity, event.text)
        if isinstance(event, Reached):
            self._reached = event.seq
            return self._mission()
        return self._home() if isinstance(event, HomeSet) else b""

    def sample(self) -> bytes:
        often = self._attitude() + self._local() + self._setpoint() + self._global() + self._truth()
        if self._vehicle.now_s - self._slow_s < SLOWLY_S:
            return often
        self._slow_s = self._vehicle.now_s
        seldom = self._status() + self._landed() + self._battery() + self._receiver() + self._mission() + self._wind()
        return mark() + often + seldom

    @property
    def _now_us(self) -> int:
        return round(self._vehicle.now_s * 1e6)

    def _status(self) -> bytes:
        pilot, state = self._pilot, NAV_STATES[self._pilot.mode.name]
        system_id = int(self._vehicle.parameters["MAV_SYS_ID"])
        return record(
            "vehicle_status", self._now_us, self._armed_us, ARMED if pilot.armed else DISARMED, state, state,
            ROTARY_WING, pilot.failsafe_active, pilot.failsafe_active, QUADROTOR, system_id, COMPONENT,
            pilot.ready_to_arm,
        )  # fmt: skip

    def _landed(self) -> bytes:
        landed = not self._pilot.is_in_air
        return record("vehicle_land_detected", self._now_us, landed, landed, landed)

    def _attitude(self) -> bytes:
        return record("vehicle_attitude", self._now_us, self._now_us, *quaternion(*self._vehicle.attitude_rad))

    def _local(self) -> bytes:
        vehicle, frame, known = self._vehicle, self._vehicle.frame, self._pilot.position_ok
        (n, e, u), (vn, ve, vu) = vehicle.reported_neu, self._pilot.v_neu
        receiver = vehicle.gnss.receiver
        heading_rad = math.remainder(vehicle.attitude_rad[2], math.tau)
        return record(
            "vehicle_local_position", self._now_us, self._now_us, self._now_us, frame.lat_deg, frame.lon_deg,
            n, e, -u, vn, ve, -vu, heading_rad, frame.alt_amsl_m, self._pilot.above_ground_m, receiver.h_acc_m,
            receiver.v_acc_m, known, known, known, known, known, known, True,
        )  # fmt: skip

    def _setpoint(self) -> bytes:
        if not self._pilot.flying:
            return b""
        (n, e, u), (vn, ve, vu), (an, ae, au) = self._pilot.target
        yaw_rad = math.remainder(self._pilot.heading_goal_rad, math.tau)
        name = "vehicle_local_position_setpoint"
        return record(name, self._now_us, n, e, -u, vn, ve, -vu, an, ae, -au, yaw_rad)

    def _global(self) -> bytes:
        receiver, known = self._vehicle.gnss.receiver, self._pilot.has_fix
        place = self._vehicle.frame.geodetic_from_neu(self._vehicle.reported_neu)
        accuracy_m = receiver.h_acc_m, receiver.v_acc_m
        return record("vehicle_global_position", self._now_us, self._now_us, *place, *accuracy_m, known, known)

    def _truth(self) -> bytes:
        place = self._vehicle.frame.geodetic_from_neu(self._vehicle.truth.p_neu)
        return record("vehicle_global_position_groundtruth", self._now_us, self._now_us, *place, True, True)

    def _receiver(self) -> bytes:
        if not self._vehicle.has_fix:
            return b""
        receiver, (vn, ve, vu) = self._vehicle.gnss.receiver, self._pilot.v_neu
        place = self._vehicle.frame.geodetic_from_neu(self._vehicle.reported_neu)
        utc_us = round((self._started_utc_s + self._vehicle.now_s) * 1e6)
        return record(
            "sensor_gps", self._now_us, *place, utc_us, receiver.h_acc_m, receiver.v_acc_m, receiver.hdop,
            vn, ve, -vu, _FIXES[receiver.fix], True, receiver.satellites,
        )  # fmt: skip

    def _battery(self) -> bytes:
        battery = self._vehicle.battery
        charge = battery.voltage_v, battery.current_a, battery.used_mah, battery.share
        return record("battery_status", self._now_us, *charge, True, CELLS)

    def _home(self) -> bytes:
        if not self._pilot.home_known:
            return b""
        self._homes += 1
        n, e, u = self._pilot.home_neu
        place = self._vehicle.frame.geodetic_from_neu((n, e, u))
        return record("home_position", self._now_us, *place, n, e, -u, self._homes, True, True, True)

    def _mission(self) -> bytes:
        pilot = self._pilot
        total = len(pilot.mission.steps)
        finished = pilot.missions.state == "complete"
        current = min(pilot.mission.current, max(0, total - 1))
        return record("mission_result", self._now_us, self._reached, current, total, total > 0, finished)

    def _wind(self) -> bytes:
        north_m_s, east_m_s, _ = self._vehicle.wind_neu
        return record("wind", self._now_us, north_m_s, east_m_s)
