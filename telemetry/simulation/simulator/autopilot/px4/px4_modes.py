"""What the simulated PX4 does in each of its flight modes but MISSION."""

from __future__ import annotations

import math
from typing import Literal, Protocol

from telemetry.simulation.simulator.autopilot.px4.px4_flying import Px4Flying
from telemetry.simulation.simulator.autopilot.px4.speeds import braking_distance_m
from telemetry.simulation.simulator.neu_frame import Vec3

Stage = Literal["ground", "takeoff", "flight", "landing"]
SLOWER_JERK = 0.6
"""Share of MPC_JERK_AUTO with which PX4 reckons where HOLD stops."""


class Px4Mode(Protocol):
    name: str
    stage: Stage
    goal: Vec3 | None

    def enter(self, pilot: Px4Flying) -> str | None:
        """Why the mode cannot be had now, or None."""
        ...

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        """Moves the pilot's trajectory on by one step."""
        ...


class Sticks:
    """Modes that a person flies by hand. Nobody does, so they are had on the ground only."""

    stage: Stage = "ground"
    goal: Vec3 | None = None

    def __init__(self, name: str) -> None:
        self.name = name

    def enter(self, pilot: Px4Flying) -> str | None:
        return "not available" if pilot.armed else None

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        """It stands."""


class Px4Hold:
    """Stops, stays, and goes where it is told (DO_REPOSITION)."""

    name = "HOLD"

    def __init__(self) -> None:
        self.stage: Stage = "flight"
        self.goal: Vec3 | None = None

    def enter(self, pilot: Px4Flying) -> str | None:
        self.stage = "flight" if pilot.flying else "ground"
        self._from, self.goal = pilot.p_neu, _stop(pilot) if pilot.flying else None
        return None

    def go_to(self, pilot: Px4Flying, goal_neu: Vec3) -> None:
        self._from, self.goal = pilot.p_neu, goal_neu

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        if self.goal is not None:
            pilot.fly_towards((self._from, self.goal, self.goal), dt_s)


class TakeOff:
    """Straight up, then HOLD."""

    name = "TAKEOFF"
    stage: Stage = "takeoff"

    def __init__(self, up_m: float | None = None) -> None:
        """``up_m``: height in the frame, or MIS_TAKEOFF_ALT over the ground."""
        self._up_m = up_m
        self.goal: Vec3 | None = None

    def enter(self, pilot: Px4Flying) -> str | None:
        lowest_m = pilot.p_neu[2] + (0.0 if pilot.flying else pilot.parameters["MIS_TAKEOFF_ALT"])
        self.goal = (*pilot.p_neu[:2], lowest_m if self._up_m is None else max(self._up_m, pilot.p_neu[2]))
        return None

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        assert self.goal is not None
        pilot.climb_to(self.goal, dt_s)
        if pilot.p_neu[2] > self.goal[2] - pilot.parameters["NAV_MC_ALT_RAD"]:
            pilot.hold_at(self.goal)


class Px4Landing:
    """Down here; slower from MPC_LAND_ALT1 on, slowest on the last metre."""

    name = "LAND"
    stage: Stage = "landing"

    def __init__(self, over_neu: Vec3 | None = None) -> None:
        self.goal = over_neu

    def enter(self, pilot: Px4Flying) -> str | None:
        self.stage = "landing" if pilot.flying else "ground"
        if self.goal is None:
            self.goal = _stop(pilot)
        return None

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        assert self.goal is not None
        pilot.sink_over(self.goal, self._speed_m_s(pilot), dt_s)

    @staticmethod
    def _speed_m_s(pilot: Px4Flying) -> float:
        p, above_m = pilot.parameters, pilot.above_ground_m
        if above_m < p["MPC_LAND_ALT3"]:
            return p["MPC_LAND_CRWL"]
        slow, fast, low_m, high_m = p["MPC_LAND_SPEED"], p["MPC_Z_V_AUTO_DN"], p["MPC_LAND_ALT2"], p["MPC_LAND_ALT1"]
        return slow + (fast - slow) * max(0.0, min(1.0, (above_m - low_m) / (high_m - low_m)))


class Px4Return:
    """Up to its return height, straight home, down."""

    name = "RTL"

    def __init__(self) -> None:
        self.stage: Stage = "flight"
        self.goal: Vec3 | None = None
        self._landing: Px4Landing | None = None

    def enter(self, pilot: Px4Flying) -> str | None:
        self.stage = "flight" if pilot.flying else "ground"
        self._from, self._landing = pilot.p_neu, None
        if not pilot.flying:
            return None
        home_n, home_e, home_u = pilot.home_neu
        up_m = self._height_m(pilot)
        self.goal = (home_n, home_e, up_m)
        self._climb = (*_stop(pilot)[:2], up_m)
        self._climbing = up_m - pilot.p_neu[2] > pilot.parameters["NAV_MC_ALT_RAD"]
        amsl_m = pilot.frame.alt_amsl_m + up_m
        pilot.say(6, f"RTL: start return at {amsl_m:.0f} m ({up_m - home_u:.0f} m above destination)")
        return None

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        if self._landing is not None:
            self._landing.update(pilot, dt_s)
            return
        if self.goal is None:
            return
        if self._climbing:
            pilot.fly_towards((self._from, self._climb, self._climb), dt_s)
            if abs(self._climb[2] - pilot.p_neu[2]) < pilot.parameters["NAV_MC_ALT_RAD"]:
                self._climbing, self._from = False, self._climb
            return
        pilot.fly_towards((self._from, self.goal, self.goal), dt_s)
        if pilot.is_at(self.goal):
            self._landing, self.stage = Px4Landing((*self.goal[:2], 0.0)), "landing"
            self._landing.enter(pilot)
            pilot.say(6, "RTL: land at destination")

    def _height_m(self, pilot: Px4Flying) -> float:
        """In the frame: RTL_RETURN_ALT, close to home no more than the cone, never below where the vehicle is."""
        p, home_u = pilot.parameters, pilot.home_neu[2]
        away_m = math.dist(pilot.p_neu[:2], pilot.home_neu[:2])
        height_m = p["RTL_RETURN_ALT"]
        if p["RTL_CONE_ANG"] > 0 and away_m <= p["RTL_MIN_DIST"]:
            cone_rad = math.radians(max(1.0, min(89.0, p["RTL_CONE_ANG"])))
            height_m = min(height_m, away_m / math.tan(cone_rad))
        return max(pilot.p_neu[2], home_u + height_m)


class Offboard:
    """Led by set-points that must keep coming."""

    name = "OFFBOARD"

    def enter(self, pilot: Px4Flying) -> str | None:
        self.stage: Stage = "flight" if pilot.flying else "takeoff"
        self._from = pilot.p_neu
        return None if pilot.offboard.is_fed(pilot.now_s) else "no set-points"

    @property
    def goal(self) -> Vec3 | None:
        return None

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        self.stage = "flight" if pilot.flying else "takeoff"
        told = pilot.offboard
        if pilot.now_s - told.heard_s > pilot.parameters["COM_OF_LOSS_T"]:
            pilot.say(3, "Offboard control lost")
            pilot.change_mode("HOLD")
        elif told.place_neu is not None:
            pilot.fly_towards((self._from, told.place_neu, told.place_neu), dt_s)
        elif told.velocity_neu is not None:
            pilot.fly_at(told.velocity_neu, dt_s)


def _stop(pilot: Px4Flying) -> Vec3:
    """Where it comes to rest if it brakes now."""
    (n, e, u), (vn, ve, _) = pilot.p_neu, pilot.v_neu
    speed = math.hypot(vn, ve)
    if speed < 1e-3:
        return n, e, u
    p = pilot.parameters
    ahead_m = braking_distance_m(speed, p["MPC_ACC_HOR"], SLOWER_JERK * p["MPC_JERK_AUTO"])
    return n + ahead_m * vn / speed, e + ahead_m * ve / speed, u
