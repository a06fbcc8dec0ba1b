"""The simulated vehicle as a whole: truth, sensors and autopilot, advanced in fixed steps of simulated time."""

from __future__ import annotations

import math

import numpy as np

from telemetry.simulation.simulator.airframe.battery import Battery, Pack
from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, AttitudeError, Multirotor, Wind
from telemetry.simulation.simulator.airframe.gnss import Gnss, GnssKind
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent, has_fix, offset_neu
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES, Beginning, Make
from telemetry.simulation.simulator.autopilot.pilot import AS_REAL_BOOT_S, Sensed
from telemetry.simulation.simulator.ground_below import FlatGround, Ground, Obstacles
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3
from telemetry.topics.vehicle import SimTruth

STEP_S = 0.005
STEPS_PER_LOOK = 4
"""The ground is looked up every 20 ms: 0.1 m at 5 m/s."""
GENTLE_M_S = 2.5
"""A slower touch is no crash while it lands, nor while it takes off beside a small step of the ground."""
STEEP_M = 0.5
"""Ground that stands this far above the feet was hit from the side."""
BODY_M, REACH_M = 0.35, 0.3
"""Height of the rotors over the feet, and how far they reach: a ball that must not touch what stands around."""
LONGEST_TEXT = 50
"""Of a STATUSTEXT in one part."""
STANDING_M = 0.3
"""What reaches no higher over the feet than this carries the vehicle."""


class SimulatedVehicle:
    """Depends on nothing but its arguments and the commands given between steps."""

    def __init__(
        self,
        frame: NeuFrame,
        *,
        make: Make = "ardupilot",
        ground: Ground | None = None,
        obstacles: Obstacles | None = None,
        seed: int = 0,
        gnss: GnssKind = "rtk",
        gnss_script: tuple[GnssEvent, ...] = (),
        parameters: Parameters | None = None,
        boot_s: float = AS_REAL_BOOT_S,
        speedup: float = 1.0,
    ) -> None:
        wind_seed, gnss_seed, attitude_seed = np.random.SeedSequence(seed).spawn(3)
        self.frame = frame
        self.personality = PERSONALITIES[make]
        self.parameters = parameters or self.personality.parameters()
        self.ground = ground or FlatGround()
        self.obstacles = obstacles
        self.gnss_script = gnss_script
        self.hit: str | None = None
        """What it crashed into."""
        self.wind = Wind(np.random.default_rng(wind_seed))
        self.gnss = Gnss(gnss, np.random.default_rng(gnss_seed))
        self.attitude_error = (
            AttitudeError() if gnss == "perfect" else AttitudeError.drawn(np.random.default_rng(attitude_seed))
        )
        self.battery = Battery(Pack(capacity_mah=self.parameters[self.personality.capacity]))
        self.truth = Multirotor(self.personality.airframe)
        beginning = Beginning(boot_s, speedup, seed, receiver_is_coarse=gnss == "standalone")
        self.autopilot = self.personality.pilot(frame, self.parameters, beginning)
        self.wind_neu: Vec3 = (0.0, 0.0, 0.0)
        self._steps = 0
        self._ground_m = 0.0
        self._resting = True

    @property
    def now_s(self) -> float:
        """Simulated time since switching on."""
        return self._steps * STEP_S

    @property
    def estimated_neu(self) -> Vec3:
        return self.autopilot.p_neu

    @property
    def reported_neu(self) -> Vec3:
        """The position that is told to others: the estimate, with the script's glitches. Control does without those,
        as an estimator that refuses a fix does for a while."""
        (n, e, u), (dn, de, du) = self.autopilot.p_neu, offset_neu(self.gnss_script, self.now_s)
        return n + dn, e + de, u + du

    @property
    def has_fix(self) -> bool:
        """Whether the receiver has one. Without it the vehicle goes on by its inertial estimate."""
        return self.autopilot.has_fix and has_fix(self.gnss_script, self.now_s)

    @property
    def attitude_rad(self) -> Vec3:
        """Roll, pitch, heading as it takes them to be."""
        return self.attitude_error.reported(self.truth.attitude_rad)

    def sim_truth(self, t_mono_s: float, t_utc_s: float) -> SimTruth:
        """Where it really is, for simulated sensors."""
        (n, e, u), (vn, ve, vu) = self.truth.p_neu, self.truth.v_neu
        roll, pitch, heading = self.truth.attitude_rad
        frame = self.frame
        return SimTruth(
            t_mono_s, t_utc_s, self.now_s, frame.lat_deg, frame.lon_deg, frame.alt_amsl_m,
            (e, n, u), (ve, vn, vu), roll, pitch, heading, self.autopilot.armed,
        )  # fmt: skip

    def advance(self, seconds: float) -> None:
        """Go on by this much simulated time, in whole steps."""
        for _ in range(round(seconds / STEP_S)):
            self.step()

    def step(self) -> None:
        self._steps += 1
        if self._steps % STEPS_PER_LOOK == 1 and not self._resting:
            self._look_around()
        self.gnss.step(STEP_S)
        demand = self.autopilot.update(self._sense(), STEP_S)
        if self.battery.empty and self.autopilot.flying:
            self.autopilot.crash("Battery empty")
            demand = None
        self.battery.step(self._thrust(demand is not None), STEP_S)
        if demand is None and self._resting:
            return
        wind_from = math.radians(self.parameters["SIM_WIND_DIR"])
        self.wind_neu = self.wind.step(self.parameters["SIM_WIND_SPD"], wind_from, STEP_S)
        self.truth.step(demand, self.wind_neu, STEP_S)
        self._meet_ground()

    def _sense(self) -> Sensed:
        (n, e, u), (vn, ve, vu) = self.truth.p_neu, self.truth.v_neu
        (dn, de, du), (rn, re, ru) = self.gnss.error_neu, self.gnss.error_rate_neu
        return Sensed(
            p_neu=(n + dn, e + de, u + du),
            v_neu=(vn + rn, ve + re, vu + ru),
            heading_rad=self.truth.heading_rad,
            touching=self._resting,
            voltage_v=self.battery.voltage_v,
            used_mah=self.battery.used_mah,
            above_ground_m=max(0.0, u - self._ground_m),
        )

    def _thrust(self, motors: bool) -> float | None:
        return max(0.0, 1 + self.truth.accel_neu[2] / GRAVITY_M_S2) if motors else None

    def _look_around(self) -> None:
        n, e, u = self.truth.p_neu
        self._ground_m = self.ground.up_m(n, e)
        if self.obstacles is None:
            return
        obstacles = self.obstacles.at(self.now_s)
        self._ground_m = max(self._ground_m, obstacles.top_under_m((e, n, u + STANDING_M)))
        if self.autopilot.flying and (name := obstacles.touching((e, n, u + BODY_M), REACH_M)):
            self._crash_into(name)
            self.truth.v_neu = (0.0, 0.0, min(0.0, self.truth.v_neu[2]))

    def _crash_into(self, name: str) -> None:
        self.hit = name
        self.autopilot.crash(f"Crash: Disarming: hit {name}"[:LONGEST_TEXT])

    def _meet_ground(self) -> None:
        under_m = self._ground_m - self.truth.p_neu[2]
        if under_m < 0:
            self._resting = False
            return
        if self._resting:
            self.truth.rest_on(self._ground_m)
            return
        stage, v = self.autopilot.stage, self.truth.v_neu
        self._resting = True
        self.autopilot.say(6, f"SIM Hit ground at {math.hypot(*v):.6f} m/s")
        gentle = abs(v[2]) < GENTLE_M_S and math.hypot(v[0], v[1]) < GENTLE_M_S and under_m < STEEP_M
        if self.autopilot.flying and not (gentle and stage in ("takeoff", "landing")):
            self._crash_into("the ground")
        if under_m >= STEEP_M:
            self._ground_m = self.truth.p_neu[2]
        self.truth.rest_on(self._ground_m)
