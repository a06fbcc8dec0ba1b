"""What the simulated PX4 knows, and what its modes use of it: trajectory, speeds, and where it has arrived."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.mission_steps import MissionSteps, Step
from telemetry.simulation.simulator.autopilot.pilot import Answer, AnyPilot
from telemetry.simulation.simulator.autopilot.px4.px4_fence import Px4Fence
from telemetry.simulation.simulator.autopilot.px4.trajectory import Limits, Trajectory
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3


class OffboardInput:
    """What OFFBOARD is told, and how often."""

    SLOWEST_S = 0.5
    """2 Hz"""

    def __init__(self) -> None:
        self.heard_s, self._before_s = -math.inf, -math.inf
        self.place_neu: Vec3 | None = None
        self.velocity_neu: Vec3 | None = None

    def hear(self, now_s: float, place_neu: Vec3 | None, velocity_neu: Vec3 | None) -> None:
        self._before_s, self.heard_s = self.heard_s, now_s
        self.place_neu, self.velocity_neu = place_neu, velocity_neu

    def is_fed(self, now_s: float) -> bool:
        return now_s - self.heard_s <= self.SLOWEST_S and self.heard_s - self._before_s <= self.SLOWEST_S


class Px4Flying(AnyPilot, ABC):
    """State that modes read and change. Positions are in the frame, as estimated."""

    def __init__(self, frame: NeuFrame, parameters: Parameters, boot_s: float) -> None:
        super().__init__(frame, parameters, boot_s)
        self.mission = MissionSteps(first=0)
        self.offboard = OffboardInput()
        self.trajectory = Trajectory(self.p_neu)
        self.cruise_m_s: float | None = None
        """Replaces MPC_XY_CRUISE until the mode changes."""
        self.above_ground_m = 0.0
        self.fence = Px4Fence(parameters)

    @abstractmethod
    def change_mode(self, name: str) -> bool:
        """By itself. Whether the mode could be had."""

    @abstractmethod
    def crash(self, reason: str) -> None:
        """Motors off, whatever comes of it."""

    def keep_to_fence(self, mode: str) -> None:
        """``mode``: that is flown."""
        if not self.position_ok:
            return
        news = self.fence.check(self.p_neu, self.home_neu, self.now_s, armed=self.armed, mode=mode)
        for text in news.texts:
            self.say(2, text)
        if news.terminates:
            self.crash("Flight termination active")
        elif news.mode is not None and self.flying:
            self.change_mode(news.mode)

    @abstractmethod
    def hold_at(self, place_neu: Vec3) -> None:
        """Changes to HOLD, there."""

    def change_speed(self, kind: int, speed_m_s: float) -> Answer:
        """Over ground; any other kind is taken and changes nothing, as is a speed of -1."""
        if kind in (0, 1):
            self.cruise_m_s = speed_m_s if 0 < speed_m_s < math.inf else None
        return "accepted"

    def apply(self, step: Step) -> None:
        first, second, _, _ = step.values
        if step.kind == "speed":
            self.change_speed(int(first), second)
        elif step.kind == "yaw":
            self.heading_goal_rad = math.radians(first)

    def fly_towards(self, points: tuple[Vec3, Vec3, Vec3], dt_s: float) -> None:
        self.trajectory.towards(points, self.p_neu, self._limits(), dt_s)

    def fly_at(self, v_neu: Vec3, dt_s: float) -> None:
        self.trajectory.at_velocity(v_neu, self.p_neu, self._limits(), dt_s)

    def climb_to(self, goal_neu: Vec3, dt_s: float) -> None:
        """Straight up. Close to the ground the target stays at the vehicle's height: the speed leads."""
        self.trajectory.towards((goal_neu, goal_neu, goal_neu), self.p_neu, self._limits(), dt_s)
        if self.above_ground_m < self.parameters["MPC_LAND_ALT1"]:
            self.trajectory.hold_height(self.p_neu[2])

    def sink_over(self, place_neu: Vec3, speed_m_s: float, dt_s: float) -> None:
        self.trajectory.over(place_neu, -speed_m_s, self.p_neu, self._limits(), dt_s)

    def is_at(self, goal_neu: Vec3) -> bool:
        p = self.parameters
        near = math.dist(self.p_neu[:2], goal_neu[:2]) <= p["NAV_ACC_RAD"]
        return near and abs(self.p_neu[2] - goal_neu[2]) <= p["NAV_MC_ALT_RAD"]

    def _limits(self) -> Limits:
        p = self.parameters
        cruise_m_s = min(self.cruise_m_s or p["MPC_XY_CRUISE"], p["MPC_XY_VEL_MAX"])
        return Limits(
            cruise_m_s, p["MPC_Z_V_AUTO_UP"], p["MPC_Z_V_AUTO_DN"], p["MPC_ACC_HOR"], p["MPC_ACC_UP_MAX"],
            p["MPC_ACC_DOWN_MAX"], p["MPC_JERK_AUTO"], p["NAV_ACC_RAD"], p["NAV_MC_ALT_RAD"], p["MPC_XY_TRAJ_P"],
            p["MPC_XY_ERR_MAX"],
        )  # fmt: skip
