"""The sensors' frames at their rates, on their way through perception as they would go through its nodes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose
from telemetry.perception.known_ground import ground_around
from telemetry.perception.map_changes import ChangeTeller
from telemetry.perception.map_worker import FLIGHT_DELTA_S
from telemetry.perception.perceiver import GroundWanted, Perceiver
from telemetry.perception.sensor_kinds import KINDS
from telemetry.perception.showing import Showing
from telemetry.perception.status import Outcome
from telemetry.simulation.scenarios.stage.setup import PERCEPTION_S, Setup
from telemetry.simulation.scenarios.stage.virtual_link import T0_MONO_S, T0_UTC_S
from telemetry.simulation.simulator.sensors import CLOUD_HZ, RADAR_HZ, SLAM_HZ, SlamDrift, StereoSensor, radar_sensor
from telemetry.topics.looks import CloudLook, RadarLook
from telemetry.topics.messages import FlightStatus, PlanRecord, Published
from telemetry.topics.obstacles import AvoidanceStatus, GroundNotice, MapDelta, Sensor
from telemetry.topics.vehicle import SimTruth, VehicleState

TICK_S = 1.0


class Sensors:
    """Radar 10 Hz, stereo camera 5 Hz, its SLAM 30 Hz: measures while the vehicle is armed, from where it really is."""

    def __init__(self, setup: Setup) -> None:
        self._radar = radar_sensor(setup.radar, setup.world, seed=setup.seed) if "radar" in setup.sensors else None
        self._stereo = None
        if "vision" in setup.sensors:
            self._stereo = StereoSensor(setup.world, seed=setup.seed, dark=setup.dark)
        self._slam = SlamDrift(seed=setup.seed)
        self._due_s: dict[str, float] = dict.fromkeys(("radar", "cloud", "slam"), 0.0)

    def measure(self, truth: SimTruth) -> Iterator[RadarFrame | CloudFrame | SlamPose]:
        """What is due now."""
        if not truth.armed:
            return
        if self._stereo is not None:
            if self._is_due("slam", SLAM_HZ, truth):
                yield self._slam.pose(truth, self._stereo.share_seen)
            if self._is_due("cloud", CLOUD_HZ, truth):
                yield self._stereo.frame(truth)
        if self._radar is not None and self._is_due("radar", RADAR_HZ, truth):
            yield self._radar.frame(truth)

    def _is_due(self, name: str, hz: float, truth: SimTruth) -> bool:
        if truth.t_sim_s < self._due_s[name] - 1e-6:
            return False
        self._due_s[name] = max(self._due_s[name] + 1 / hz, truth.t_sim_s)
        return True


class Perceiving:
    """One sensor: frames come out ``PERCEPTION_S`` after they were measured."""

    def __init__(self, sensor: Sensor, setup: Setup, plan: PlanRecord, ground: GroundNotice) -> None:
        self.perceiver = Perceiver(KINDS[sensor], run=str(setup.seed), utc_minus_mono_s=T0_UTC_S - T0_MONO_S)
        self.perceiver.on_settings(setup.settings)
        self.perceiver.on_plan(plan)
        self.perceiver.on_ground(ground)
        self._laid: GroundWanted | None = None
        self._changes = ChangeTeller(sensor, T0_UTC_S - T0_MONO_S)
        self._showing = Showing(T0_UTC_S - T0_MONO_S)
        self._flight_changes = ChangeTeller("vision_flight", T0_UTC_S - T0_MONO_S)
        self._waiting: deque[RadarFrame | CloudFrame] = deque()
        self._worked_s = self._flight_told_s = 0.0

    def on_message(self, message: Published) -> None:
        if isinstance(message, VehicleState):
            self.perceiver.on_state(message)
        elif isinstance(message, SlamPose):
            self.perceiver.on_camera(message)
        elif isinstance(message, FlightStatus):
            self.perceiver.flown.flight = message
        elif isinstance(message, AvoidanceStatus):
            self.perceiver.flown.avoidance = message
        elif isinstance(message, RadarFrame | CloudFrame):
            self._waiting.append(message)

    def work(self, now_s: float) -> list[tuple[RadarFrame | CloudFrame | None, Outcome]]:
        """What is done by now; a second without a frame is told as well."""
        out: list[tuple[RadarFrame | CloudFrame | None, Outcome]] = []
        self._lay_ground()
        while self._waiting and self._waiting[0].t_mono_s + PERCEPTION_S <= now_s + 1e-9:
            frame = self._waiting.popleft()
            out.append((frame, self.perceiver.work(frame, lambda: now_s)))
            self.perceiver.perception.accumulate()
            self._worked_s = now_s
        if now_s - self._worked_s >= TICK_S:
            out.append((None, self.perceiver.tick(lambda: now_s, feed=True)))
            self._worked_s = now_s
        return out

    def changes(self, now_s: float) -> list[MapDelta]:
        """What of the map has not been told yet, for a recording."""
        return self._changes.changes(self.perceiver.perception.map, self.perceiver.where.origin, now_s)

    def flight_changes(self, now_s: float) -> list[MapDelta]:
        """The same of the map of the whole flight."""
        flight = self.perceiver.perception.flight
        if flight is None or now_s < self._flight_told_s + FLIGHT_DELTA_S:
            return []
        self._flight_told_s = now_s
        return self._flight_changes.changes(flight.map, self.perceiver.where.origin, now_s)

    def look(self, now_s: float) -> RadarLook | CloudLook | None:
        """What the newest frame showed, likewise."""
        return self._showing.due(self.perceiver.perception, self.perceiver.where.origin, now_s)

    def _lay_ground(self) -> None:
        wanted = self.perceiver.ground_wanted
        if wanted != self._laid and wanted.notice is not None and wanted.origin is not None:
            self.perceiver.set_ground(ground_around(wanted.notice, wanted.origin))
            self._laid = wanted
