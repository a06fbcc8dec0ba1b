"""One flight in virtual time: vehicle, sensors, perception and avoidance, 20 ms after 20 ms."""

from __future__ import annotations

import math
import tempfile
from collections import deque
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose
from telemetry.flight.avoidance.avoiding import Avoiding
from telemetry.flight.guided.remaining_mission import remaining_flight
from telemetry.mavlink.actions import Action
from telemetry.mavlink.items import items_from_mission
from telemetry.perception.status import Outcome
from telemetry.simulation.scenarios.stage.course import script_request
from telemetry.simulation.scenarios.stage.paper_fields import notice
from telemetry.simulation.scenarios.stage.perceiving import Perceiving, Sensors
from telemetry.simulation.scenarios.stage.pilots import MissionPilot, ScenarioPilot, ScriptPilot
from telemetry.simulation.scenarios.stage.seen_flight import RegionWatch, SeenAlert, SeenFlight, SeenRadarFrame
from telemetry.simulation.scenarios.stage.setup import ORDER_S, Setup, Tell, plan_record_of, vehicle_of
from telemetry.simulation.scenarios.stage.virtual_link import VEHICLE, Wire
from telemetry.topics.messages import FlightStatus, Published, Topic
from telemetry.topics.obstacles import GroundNotice, Sensor
from telemetry.topics.vehicle import SimTruth

TRACK_S = 0.1
AVOIDANCE_EVERY = 3
"""Slices between the avoidance's own looks, about as the link's clock has it."""


def fly(setup: Setup, tell: Tell | None = None) -> SeenFlight:
    """From switching on to the landing; ``tell`` hears what would be on the bus.

    Raises TelemetryError when the flight cannot even be begun.
    """
    with tempfile.TemporaryDirectory(prefix="hedgehop-scenario-") as folder:
        return _Flight(setup, notice(setup.ground, Path(folder)), tell).run()


class _Flight:
    def __init__(self, setup: Setup, ground: GroundNotice, tell: Tell | None) -> None:
        self._setup, self._tell, self._is_told = setup, tell or _nobody, tell is not None
        self._wire = Wire(vehicle_of(setup), order_latency_s=ORDER_S)
        self._sensors = Sensors(setup)
        self._truths: deque[SimTruth] = deque()
        """Of the radar's frames that are still on their way."""
        self._state = self._wire.until_ready()
        plan = plan_record_of(setup)
        self._publish(Topic.PERCEPTION_SETTINGS, setup.settings)
        self._publish(Topic.PLAN, plan)
        self._publish(Topic.GROUND, ground)
        self._perceiving: dict[Sensor, Perceiving] = {
            sensor: Perceiving(sensor, setup, plan, ground) for sensor in setup.sensors
        }
        self._flown = SeenFlight(self._wire.now_s, setup.settings.vehicle_radius_m)
        self._flown.perceivers = {name: one.perceiver for name, one in self._perceiving.items()}
        self._flown.watches = {name: RegionWatch(one.perceiver) for name, one in self._perceiving.items()}
        self._said: dict[str, str] = {}
        self._status = FlightStatus()
        self._slices = 0
        self._revision: int | None = None
        self._avoiding: Avoiding | None = None
        self._pilot: ScenarioPilot = self._pilot_of(setup)

    def run(self) -> SeenFlight:
        flown, wire, setup = self._flown, self._wire, self._setup
        while not self._pilot.is_over and wire.now_s - flown.began_s < setup.longest_s:
            self._step()
            if wire.vehicle.hit is not None or self._has_seen_enough():
                break
        flown.ended_s, flown.hit = wire.now_s, wire.vehicle.hit
        flown.landed = self._pilot.is_over and not wire.vehicle.autopilot.crashed
        return flown

    def _has_seen_enough(self) -> bool:
        flown, setup = self._flown, self._setup
        if setup.most_m is not None and flown.way_m >= setup.most_m:
            return True
        return setup.most_armed_s is not None and flown.armed_s >= setup.most_armed_s

    # Before the take-off.

    def _pilot_of(self, setup: Setup) -> ScenarioPilot:
        if setup.course is not None:
            return ScriptPilot(self._wire, script_request(setup.course, setup.world.frame))
        pilot = MissionPilot(self._wire, items_from_mission(setup.mission))
        if setup.avoids:
            self._avoiding = Avoiding(
                VEHICLE, remaining=lambda state: remaining_flight(pilot.onboard, state), settings=setup.settings
            )
            self._avoiding.enable(self._wire.now_s)
        return pilot

    # Every 20 ms.

    def _step(self) -> None:
        wire, avoiding, before = self._wire, self._avoiding, self._state
        self._slices += 1
        for message in wire.step():
            self._pilot.on_message(message)
            if avoiding is not None:
                self._act(avoiding.on_message(message, wire.now_s))
        assert wire.state is not None
        self._state = wire.state
        self._pilot.on_slice(self._state, is_new=self._state is not before)
        if self._state is not before:
            self._publish(Topic.VEHICLE, self._state)
            if avoiding is not None:
                self._act(avoiding.on_state(self._state, wire.now_s))
        if avoiding is not None and self._slices % AVOIDANCE_EVERY == 0:
            self._avoid(avoiding)
        self._tell_flight()
        for raw in wire.raw:
            self._tell(Topic.RAW, raw, raw.t_utc_s)
        for text in wire.texts:
            self._tell(Topic.TEXT, text, text.t_utc_s)
        truth = wire.truth()
        self._sense(truth)
        for sensor, one in self._perceiving.items():
            for frame, outcome in one.work(wire.now_s):
                self._take(sensor, frame, outcome)
        self._note(truth)

    def _tell_flight(self) -> None:
        engaged = self._avoiding is not None and self._avoiding.is_engaged
        status = self._avoiding.flight_status() if engaged and self._avoiding is not None else self._pilot.status
        if status != self._status:
            self._status = status
            self._publish(Topic.FLIGHT, status)

    def _avoid(self, avoiding: Avoiding) -> None:
        self._act(avoiding.on_tick(self._wire.now_s))
        status = avoiding.status
        if self._say("avoidance", f"{status.state}. {status.text}"):
            self._publish(Topic.AVOIDANCE, status)
        for one in self._perceiving.values():
            one.on_message(status)

    def _act(self, actions: Iterable[Action]) -> None:
        self._wire.perform(actions)

    def _publish(self, topic: Topic, message: Published) -> None:
        """To perception, and to whoever listens."""
        self._tell(topic, message, self._wire.now_utc_s)
        for one in getattr(self, "_perceiving", {}).values():
            one.on_message(message)

    def _sense(self, truth: SimTruth) -> None:
        for frame in self._sensors.measure(truth):
            if isinstance(frame, SlamPose):
                self._tell(Topic.SLAM_POSE, frame, truth.t_utc_s)
                self._perceiving["vision"].on_message(frame)
                continue
            radar = isinstance(frame, RadarFrame)
            self._tell(Topic.RADAR_FRAME if radar else Topic.CLOUD_FRAME, frame, truth.t_utc_s)
            self._perceiving["radar" if radar else "vision"].on_message(frame)
            if radar:
                self._truths.append(truth)

    def _take(self, sensor: Sensor, frame: RadarFrame | CloudFrame | None, outcome: Outcome) -> None:
        flown, status, t_utc_s = self._flown, outcome.status, self._wire.now_utc_s
        perceiver = flown.perceivers[sensor]
        self._say(sensor, f"{status.state}. {status.text}")
        self._tell(perceiver.kind.status, status, t_utc_s)
        away = flown.map_to_world - perceiver.perception.offset_enu_m
        for alert in outcome.alerts:
            flown.told.append(SeenAlert(alert, np.array(alert.obstacle.enu_m) + away if alert.obstacle else None))
        flown.watches[sensor].take(outcome, self._wire.now_s)
        for alert in outcome.alerts:
            self._tell(Topic.ALERT, alert, t_utc_s)
        if self._avoiding is not None:
            self._act(self._avoiding.on_perception(status, self._wire.now_s))
        if self._is_told:
            for delta in self._perceiving[sensor].changes(status.t_mono_s):
                self._tell(perceiver.kind.maps, delta, t_utc_s)
            for delta in self._perceiving[sensor].flight_changes(status.t_mono_s):
                self._tell(Topic.MAP_VISION_FLIGHT, delta, t_utc_s)
            look = self._perceiving[sensor].look(status.t_mono_s)
            if look is not None and perceiver.kind.looks is not None:
                self._tell(perceiver.kind.looks, look, t_utc_s)
        self._keep(sensor, frame, outcome)

    def _keep(self, sensor: Sensor, frame: RadarFrame | CloudFrame | None, outcome: Outcome) -> None:
        """What the figures are made of."""
        flown, perception = self._flown, self._flown.perceivers[sensor].perception
        if frame is None:
            return
        if isinstance(frame, RadarFrame):
            truth = self._truths.popleft()
            pose = perception.track.at(frame.t_mono_s)
            if not isinstance(pose, str):
                flown.radar.append(SeenRadarFrame(frame, truth, pose))
            self._watch_frozen(outcome)
        else:
            flown.vision.append(perception.map.occupied(explained=False) - perception.offset_enu_m + flown.map_to_world)

    def _watch_frozen(self, outcome: Outcome) -> None:
        frozen, revision = outcome.status.state == "frozen", outcome.status.map_revision
        if frozen and self._revision is not None:
            self._flown.new_while_frozen += revision - self._revision
        self._revision = revision if frozen else None

    # What is looked at from outside.

    def _note(self, truth: SimTruth) -> None:
        flown, wire = self._flown, self._wire
        if not truth.armed:
            return
        if wire.vehicle.autopilot.flying:
            self._look(truth)
        if flown.track and truth.t_mono_s - flown.track[-1].t_mono_s < TRACK_S - 1e-6:
            return
        if flown.track:
            flown.way_m += math.dist(truth.position_enu_m[:2], flown.track[-1].position_enu_m[:2])
        flown.track.append(truth)
        self._tell(Topic.TRUTH, truth, truth.t_utc_s)

    def _look(self, truth: SimTruth) -> None:
        flown, (north, east, up) = self._flown, self._wire.vehicle.estimated_neu
        away_m = self._setup.world.at(truth.t_sim_s).distance_m(np.array([truth.position_enu_m]))[0]
        flown.nearest_m = min(flown.nearest_m, float(away_m))
        origin = next(iter(flown.perceivers.values())).where.origin
        if origin is None:
            return
        home = self._setup.world.frame.neu_from_geodetic(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        flown.map_to_world = np.array([home[1], home[0], home[2]])
        for watch in flown.watches.values():
            watch.look(np.array([east, north, up]) - flown.map_to_world, truth.heading_rad, truth.t_mono_s)

    def _say(self, who: str, words: str) -> bool:
        """Whether it is news."""
        words = words.strip()
        if self._said.get(who) == words:
            return False
        self._said[who] = words
        self._flown.said.append((self._wire.now_s, f"{who}: {words}"))
        return True


def _nobody(topic: str, message: Published, t_utc_s: float) -> None:
    """Nobody listens."""
