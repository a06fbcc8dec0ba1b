"""One way through the arena by the code that flies live, tracks node and link, before a simulated vehicle."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from mapping.geometry.arrays import F64
from mapping.perceiving.ground import GroundGrid, ground_grid
from mapping.sensor_frames import RadarFrame
from telemetry.flight.avoidance.avoiding import Avoiding
from telemetry.flight.guided.remaining_mission import remaining_flight
from telemetry.mavlink.items import items_from_mission
from telemetry.simulation.scenarios.arena.arena_course import HALF_M, POLE_RADIUS_M, VEHICLE_RADIUS_M, Approach
from telemetry.simulation.scenarios.arena.arena_radar import Position2GoModel, SampledPosition2Go
from telemetry.simulation.scenarios.stage.course import Course, Waypoint, course_mission
from telemetry.simulation.scenarios.stage.pilots import MissionPilot
from telemetry.simulation.scenarios.stage.setup import ORDER_S, PERCEPTION_S
from telemetry.simulation.scenarios.stage.virtual_link import T0_MONO_S, T0_UTC_S, VEHICLE, Wire
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.sensors.radar_sensor import Radar
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import RadarKind, SimTruth
from telemetry.tracking.object_tracking import ObjectTracking

FRAME = NeuFrame(51.9906, 4.3754, 0.0)
CRUISE_M_S, UP_M = 1.2, 3.0
LOOKS_UP_M = 2.0
"""Lower nothing is followed: every echo would graze the floor."""
MARGIN_M = 0.35
"""Kept beyond the hulls: for the errors of the radar, and for the way that a change of velocity takes."""
STANDS_M = POLE_RADIUS_M + VEHICLE_RADIUS_M + MARGIN_M
STANDS_S = 4.0
MAX_SPEED_M_S, MAX_TURN_DEG = 1.8, 90.0
ARRIVED_M, LATEST_S = 0.5, 60.0
SAME_M = 1.5
"""A track this near to a pole is that pole's."""
LOOK_EVERY = 3
"""Slices between the avoidance's own looks, about as the link's clock has it."""
DRAWN_EVERY = 10


@dataclass(slots=True)
class ArenaFlown:
    """What one way came to, from where the vehicle left its start on."""

    duration_s: float = 0.0
    nearest_gap_m: float = math.inf
    arrived: bool = False
    first_evasion_s: float | None = None
    climbed_m: float = 0.0
    errors: list[tuple[float, float, float]] = field(default_factory=list)
    """Of tracked poles in view: off the nose (rad), error of range (m), error of bearing (rad)."""
    path_enu_m: list[tuple[float, float]] = field(default_factory=list)
    """Five times a second, in the hall's east and north."""


def arena_settings(*, nearest_only: bool, tracker: TrackerSettings | None = None) -> PerceptionSettings:
    """Of the paper's vehicle in its hall; what a console would be set to."""
    return PerceptionSettings(
        vehicle_radius_m=VEHICLE_RADIUS_M,
        position_error_m=0.1,
        tracker=tracker or Position2GoModel().errors,
        velocities=VelocitySettings(
            max_speed_m_s=MAX_SPEED_M_S,
            max_turn_deg=MAX_TURN_DEG,
            nearest_only=nearest_only,
            stands_m=STANDS_M,
            stands_s=STANDS_S,
        ),
    )


def fly(
    approach: Approach, random: np.random.Generator, *, settings: PerceptionSettings, radar: RadarKind
) -> ArenaFlown:
    """From a stand at one wall to the other one."""
    return _Way(approach, random, settings, radar).run()


class _Way:
    def __init__(
        self, approach: Approach, random: np.random.Generator, settings: PerceptionSettings, radar: RadarKind
    ) -> None:
        self._approach, self._flown = approach, ArenaFlown()
        seed = int(random.integers(2**31))
        self._wire = Wire(_vehicle(seed, approach.heading_rad), order_latency_s=ORDER_S)
        self._radar: Radar = _radar_of(radar, approach, np.random.default_rng(seed))
        self._radar_due_s = 0.0
        self._waiting: deque[RadarFrame] = deque()
        self._following = ObjectTracking(run="arena", utc_minus_mono_s=T0_UTC_S - T0_MONO_S)
        self._following.on_settings(settings)
        self._wire.until_ready()
        self._pilot = pilot = MissionPilot(self._wire, items_from_mission(_mission(approach)))
        self._avoiding = Avoiding(
            VEHICLE, remaining=lambda state: remaining_flight(pilot.onboard, state), settings=settings
        )
        self._avoiding.on_settings(settings)
        self._avoiding.enable(self._wire.now_s, "sidestep")
        self._began_s: float | None = None
        self._slices = 0

    def run(self) -> ArenaFlown:
        wire, flown, until_s = self._wire, self._flown, self._wire.now_s + LATEST_S
        while wire.now_s < until_s and not flown.arrived:
            self._step()
        return flown

    def _step(self) -> None:
        wire, avoiding, before = self._wire, self._avoiding, self._wire.state
        self._slices += 1
        for message in wire.step():
            self._pilot.on_message(message)
            wire.perform(avoiding.on_message(message, wire.now_s))
        assert wire.state is not None
        self._pilot.on_slice(wire.state, is_new=wire.state is not before)
        if wire.state is not before:
            self._following.perceiver.on_state(wire.state)
            wire.perform(avoiding.on_state(wire.state, wire.now_s))
        if self._slices % LOOK_EVERY == 0:
            wire.perform(avoiding.on_tick(wire.now_s))
        truth = wire.truth()
        self._sense(truth)
        self._follow(truth)
        self._note(truth)

    def _sense(self, truth: SimTruth) -> None:
        if truth.armed and truth.position_enu_m[2] > LOOKS_UP_M and truth.t_sim_s >= self._radar_due_s - 1e-6:
            self._radar_due_s = max(self._radar_due_s + Position2GoModel().every_s, truth.t_sim_s)
            self._waiting.append(self._radar.frame(truth))

    def _follow(self, truth: SimTruth) -> None:
        while self._waiting and self._waiting[0].t_mono_s + PERCEPTION_S <= self._wire.now_s + 1e-9:
            frame = self._waiting.popleft()
            told = self._following.work(frame, lambda: self._wire.now_s)
            if self._following.perceiver.perception.ground is None:
                self._following.perceiver.set_ground(_floor())
            self._wire.perform(self._avoiding.on_tracks(told.status, self._wire.now_s))
            if self._began_s is not None:
                self._flown.errors += _errors(self._approach, told.status, truth)

    def _note(self, truth: SimTruth) -> None:
        """From the moment on at which it has reached its height and goes."""
        place, flown = np.array(truth.position_enu_m[:2]), self._flown
        if self._began_s is None:
            if truth.position_enu_m[2] < UP_M - 0.5:
                return
            self._began_s = self._wire.now_s
        flown.duration_s = self._wire.now_s - self._began_s
        flown.nearest_gap_m = min(flown.nearest_gap_m, self._approach.gap_m(place + self._approach.start_enu_m))
        if self._slices % DRAWN_EVERY == 0:
            flown.path_enu_m.append((place + self._approach.start_enu_m).tolist())
        flown.climbed_m = max(flown.climbed_m, truth.position_enu_m[2] - UP_M)
        if flown.first_evasion_s is None and self._avoiding.is_engaged:
            flown.first_evasion_s = flown.duration_s
        flown.arrived = _is_through(self._approach, place)


def _radar_of(name: RadarKind, approach: Approach, random: np.random.Generator) -> Radar:
    poles = approach.poles_enu_m - approach.start_enu_m
    if name == "iq":
        return SampledPosition2Go(FRAME, poles, POLE_RADIUS_M, seed=int(random.integers(2**31)))
    return _Detections(poles, random)


class _Detections:
    """The Position2Go's detections, as the tracks node takes a radar's frames."""

    def __init__(self, poles_enu_m: F64, random: np.random.Generator) -> None:
        self._poles_enu_m, self._random = poles_enu_m, random
        self._radar, self._number = Position2GoModel(), 0

    def frame(self, truth: SimTruth) -> RadarFrame:
        self._number += 1
        place, velocity = np.array(truth.position_enu_m[:2]), np.array(truth.velocity_enu_m_s[:2])
        rows = []
        for pole in self._poles_enu_m:
            range_m, bearing_rad = _polar(pole - place, truth.heading_rad)
            rows.append((range_m - POLE_RADIUS_M, bearing_rad, -float((pole - place) @ velocity) / range_m))
        return self._radar.told(truth, self._number, self._radar.frame(np.array(rows), self._random))


def _vehicle(seed: int, heading_rad: float) -> SimulatedVehicle:
    """Its nose along its way, as the paper's: a radar on the nose sees nothing of a way that begins behind it."""
    parameters = Parameters()
    parameters.set("WPNAV_SPEED", 100 * CRUISE_M_S)
    vehicle = SimulatedVehicle(FRAME, seed=seed, parameters=parameters, boot_s=3.0)
    vehicle.truth.heading_rad = heading_rad % math.tau
    return vehicle


def _mission(approach: Approach):
    """Through the hall and on by a little, so that it does not slow down before the far wall."""
    way = approach.goal_enu_m - approach.start_enu_m
    beyond = way * (1.0 + 2.0 / approach.length_m)
    course = Course((Waypoint((float(beyond[0]), float(beyond[1]), UP_M), CRUISE_M_S),), UP_M)
    return course_mission(course, FRAME)


@lru_cache(maxsize=1)
def _floor() -> GroundGrid:
    """Level, and known well beyond the hall."""
    half = 8 * HALF_M
    cells = round(2 * half)
    return ground_grid(np.zeros((cells, cells), np.float32), [[0.0, -1.0, half], [1.0, 0.0, half]])


def _errors(approach: Approach, status: TracksStatus, truth: SimTruth) -> list[tuple[float, float, float]]:
    """Of the track nearest to each pole in view: an echo comes from the side of a pole that faces the radar."""
    out, sensor = [], Position2GoModel()
    place = np.array(truth.position_enu_m[:2])
    back_s = truth.t_mono_s - status.t_mono_s
    then = place - back_s * np.array(truth.velocity_enu_m_s[:2])
    for pole in approach.poles_enu_m - approach.start_enu_m:
        true = _polar(pole - then, truth.heading_rad)
        found = [np.array(t.enu_m[:2]) - then for t in status.tracks if not t.remembered]
        near = [xy for xy in found if np.hypot(*(xy + then - pole)) <= SAME_M]
        if not near or not sensor.sees(np.array([true[0] - POLE_RADIUS_M]), np.array([true[1]]))[0]:
            continue
        tracked = _polar(_nearest(near, pole - then), truth.heading_rad)
        off_m = abs(tracked[0] - (true[0] - POLE_RADIUS_M))
        out.append((abs(true[1]), off_m, abs(math.remainder(tracked[1] - true[1], 2 * math.pi))))
    return out


def _nearest(places: Sequence[F64], to: F64) -> F64:
    return min(places, key=lambda xy: float(np.hypot(*(xy - to))))


def _polar(offset_enu_m: F64, heading_rad: float) -> tuple[float, float]:
    bearing = math.remainder(math.atan2(*offset_enu_m) - heading_rad, 2 * math.pi)
    return float(np.hypot(*offset_enu_m)), bearing


def _is_through(approach: Approach, place: F64) -> bool:
    """At the far wall, however far aside."""
    along = place @ (approach.goal_enu_m - approach.start_enu_m) / approach.length_m
    return float(along) >= approach.length_m - ARRIVED_M
