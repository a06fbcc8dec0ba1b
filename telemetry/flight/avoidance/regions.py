"""What the sensors say about the region ahead, put together: is it occupied, whose word counts, is it clear again?

And how fast that allows to fly: a region must be deep enough to stop in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mapping.perceiving.braking import PX4_HOLD, Braking, Stopping, no_shorter
from planning.basics.plan_model import Firmware
from telemetry.topics.obstacles import PerceptionSettings, PerceptionStatus, Sensor

SENSOR_WORDS: dict[Sensor, str] = {"radar": "radar", "vision": "vision", "ranges": "range sensors"}
OLD_S = 0.5
"""What a frame that comes later than this shows to be clear need not be so now; nor where none has come for so long."""
LATE_S = 2.0
"""What a frame that comes no later than this saw in the way stands there, until a newer one of that sensor comes."""
BLIND_S = 1.0
"""Without a frame for so long a sensor is no eye any more."""
CLEAR_FRAMES = 3
"""One empty frame may be a drop-out."""
LEAST_LATENCY_S = 0.3
"""From seeing to braking."""
REACTION_S = 0.2
"""From the region's word to the vehicle's first braking."""
FASTER_M_S = 0.1
"""Than allowed, before it is slowed: a vehicle does not keep a speed any better."""
SLOWEST_M_S = 0.3
"""No vehicle is told to fly slower than this: its sensors see nothing that it could stop for."""
USUAL_PERIOD_S: dict[Sensor, float] = {"radar": 0.1, "vision": 0.2, "ranges": 0.1}
"""Between frames."""
JUDGED_FRAMES = 20
"""By the second latest of so many it is judged how late a sensor is: one alone may be a hiccup of ours."""
PERIOD_FADES = 0.95
"""A longer time between two frames counts on, less and less: what came late once may again."""


@dataclass(frozen=True, slots=True)
class Sight:
    """One sensor's newest frame, as far as avoidance is concerned."""

    sensor: Sensor
    t_mono_s: float
    came_mono_s: float
    ages_s: tuple[float, ...]
    """Of its newest frames, as they came."""
    counts: bool
    """It works: it is neither blind nor frozen nor waiting for its first frame."""
    flowed_mono_s: float
    """When its newest frame came that was placed, whether it showed anything or not."""
    occupied: bool
    distance_m: float | None
    """Of what is nearest in its way."""
    depth_m: float
    latency_s: float
    clear_frames: int
    """In a row, up to this one."""
    why: str = ""
    """Its frames are not placed, or it has stopped: in its own words."""
    period_s: float = 0.0
    """Between its frames: so late may what enters the region be seen."""
    since_s: float = 0.0
    """It has worked without a break since then."""
    nearest_m: float = 0.0
    """What is nearer it cannot see."""
    hidden_m: float | None = None
    """Distance of the nearest thing that stood in the way and cannot be seen now: it may still stand there."""
    frames: int = 0
    """Of its map, up to this one."""
    forgot: bool = False
    """Its map began anew since it was last relied on: what stood in the way is not in it any more."""

    @property
    def late_s(self) -> float:
        """How late its frames come."""
        return sorted(self.ages_s)[-2:][0] if self.ages_s else 0.0

    @property
    def is_late(self) -> bool:
        """Too late to show that nothing is in the way."""
        return max(self.late_s, self.came_mono_s - self.t_mono_s) > OLD_S

    def is_fresh(self, now_s: float) -> bool:
        return self.counts and not self.is_late and now_s - self.came_mono_s <= OLD_S

    def is_eye(self, now_s: float) -> bool:
        """It works, and shows in time to be stopped for what is in the way, if not that nothing is."""
        return self.counts and now_s - self.came_mono_s <= BLIND_S and self.came_mono_s - self.t_mono_s <= LATE_S


def largest_speed(sees_enough_for_m_s: float) -> float:
    """As it is ordered."""
    return max(SLOWEST_M_S, math.floor(10 * sees_enough_for_m_s) / 10)


def stopping_of(settings: PerceptionSettings, sensor: Sensor, *, latency_s: float) -> Stopping:
    """``latency_s``: from being in the region to being told of."""
    voxel_m = settings.radar_resolution_m if sensor == "radar" else settings.vision_resolution_m
    return Stopping(
        Braking(settings.brake_decel_m_s2, settings.brake_jerk_m_s3),
        latency_s,
        settings.vehicle_radius_m + settings.position_error_m + voxel_m / 2,
    )


def braking_of(firmware: Firmware, decel_m_s2: float, jerk_m_s3: float) -> Braking:
    """As the vehicle's profile says; a PX4 is not believed to stop sooner than PX4 does by itself."""
    said = Braking(decel_m_s2, jerk_m_s3)
    return no_shorter(said, PX4_HOLD) if firmware == "px4" else said


def sees_enough_for(settings: PerceptionSettings, sensor: Sensor) -> float:
    """The speed from which a vehicle can stop in a sensor's region, before any frame has told how late it is."""
    usual = stopping_of(settings, sensor, latency_s=LEAST_LATENCY_S + USUAL_PERIOD_S[sensor])
    return usual.largest_speed_m_s(depth_of(settings, sensor))


def depth_of(settings: PerceptionSettings, sensor: Sensor) -> float:
    of = {"radar": settings.radar_depth_m, "vision": settings.vision_depth_m, "ranges": settings.ranges_depth_m}
    return of[sensor]


class Regions:
    """The newest sight of each sensor."""

    def __init__(self, settings: PerceptionSettings) -> None:
        self.settings = settings
        self.sights: dict[Sensor, Sight] = {}

    @property
    def braking(self) -> Braking:
        return Braking(self.settings.brake_decel_m_s2, self.settings.brake_jerk_m_s3)

    def take(self, status: PerceptionStatus, now_s: float) -> None:
        """Frames out of order, or that come twice, change nothing, nor does one that was refused or looks elsewhere."""
        if status.state == "running" and status.region is None:
            return
        before = self.sights.get(status.sensor)
        if before is not None and before.counts and status.t_mono_s < before.t_mono_s:
            return
        again = before is not None and status.t_mono_s == before.t_mono_s
        hidden_m = None if status.region is None else status.region.hidden_m
        found_m = self._in_the_way_m(status)
        occupied = found_m is not None
        counted = 0 if before is None else before.clear_frames
        self.sights[status.sensor] = Sight(
            sensor=status.sensor,
            t_mono_s=status.t_mono_s,
            came_mono_s=before.came_mono_s if before is not None and again else now_s,
            ages_s=_ages_s(status, before, None if again else now_s),
            counts=status.state == "running",
            flowed_mono_s=_flowed_s(status, before, now_s),
            why=status.text,
            occupied=occupied,
            distance_m=found_m,
            depth_m=self._depth_m(status),
            latency_s=status.latency_s or 0.0,
            clear_frames=0 if occupied or hidden_m is not None or status.state != "running" else counted + (not again),
            period_s=_period_s(status, before),
            since_s=_since_s(status, before),
            nearest_m=0.0 if status.region is None else status.region.nearest_m,
            hidden_m=hidden_m,
            forgot=before is not None and (before.forgot or status.frames < before.frames),
            frames=status.frames,
        )

    def counted(self, now_s: float) -> tuple[Sensor, ...]:
        """Sensors whose word counts at present."""
        return tuple(sight.sensor for sight in self.fresh(now_s))

    def occupied(self, now_s: float) -> tuple[Sight, ...]:
        """Sights with something in the way, late ones as well, nearest first."""
        found = [sight for sight in self.eyes(now_s) if sight.occupied]
        return tuple(sorted(found, key=lambda sight: sight.distance_m or 0.0))

    def seen_by(self, now_s: float) -> frozenset[Sensor]:
        """Sensors that see something in the way: late ones only where no other does."""
        found = self.occupied(now_s)
        return frozenset(sight.sensor for sight in [s for s in found if s.is_fresh(now_s)] or found)

    def rely(self) -> None:
        """From now on a map that begins anew has forgotten something."""
        self.sights = {sensor: replace(sight, forgot=False) for sensor, sight in self.sights.items()}

    def is_clear(self, engaged: frozenset[Sensor], now_s: float) -> bool:
        """SEEN to be clear: nobody sees anything, and those who did have looked there and seen nothing for several
        fresh frames. Of nobody in particular: whoever works."""
        trusted = self._trusted(engaged, now_s)
        return (
            len(trusted) > 0
            and not self.occupied(now_s)
            and all(_has_seen_clear(sight) and sight.is_fresh(now_s) for sight in trusted)
        )

    def hidden(self, engaged: frozenset[Sensor], now_s: float) -> Sight | None:
        """Of the sensors that are counted on: one that cannot see what stood in the way."""
        trusted = self._trusted(engaged, now_s)
        return next((sight for sight in trusted if sight.hidden_m is not None or sight.forgot), None)

    def nearest_m(self, engaged: frozenset[Sensor], now_s: float) -> float:
        """Distance of the nearest thing that stands, or may stand, in the way."""
        known = self._trusted(engaged, now_s)
        seen = [sight.distance_m for sight in known if sight.distance_m is not None]
        return min([*seen, *(sight.hidden_m for sight in known if sight.hidden_m is not None)], default=math.inf)

    def blind_m(self, engaged: frozenset[Sensor], now_s: float) -> float:
        """What is nearer cannot be seen by one of the sensors that are counted on."""
        known = self._trusted(engaged, now_s)
        return max((sight.nearest_m for sight in known), default=0.0)

    def _trusted(self, engaged: frozenset[Sensor], now_s: float) -> list[Sight]:
        return [self.sights[sensor] for sensor in engaged] or self.fresh(now_s)

    def oldest(self, engaged: frozenset[Sensor], now_s: float) -> Sight | None:
        """Of the sensors that are counted on: the one whose frames are too old, if there is one."""
        old = [self.sights[sensor] for sensor in engaged if not self.sights[sensor].is_fresh(now_s)]
        return min(old, key=lambda sight: sight.t_mono_s, default=None)

    def silent(self, engaged: frozenset[Sensor], now_s: float) -> Sight | None:
        """Of the sensors that are counted on: one that has sent no frame for too long, or none that can be placed."""
        sights = (self.sights[sensor] for sensor in engaged)
        return next((sight for sight in sights if sight.is_late or now_s - sight.flowed_mono_s > OLD_S), None)

    def stopping(self, sight: Sight) -> Stopping:
        """Before what this sensor sees."""
        latency_s = max(LEAST_LATENCY_S, max(sight.latency_s, sight.late_s) + REACTION_S) + sight.period_s
        return stopping_of(self.settings, sight.sensor, latency_s=latency_s)

    def eyes(self, now_s: float) -> list[Sight]:
        """Those that work, late frames or not."""
        return [sight for sight in self.sights.values() if sight.is_eye(now_s)]

    def fresh(self, now_s: float) -> list[Sight]:
        """Those whose word counts at present."""
        return [sight for sight in self.sights.values() if sight.is_fresh(now_s)]

    def slowest(self, now_s: float) -> tuple[Sight, float] | None:
        """The sensor whose region allows least speed, and that speed: what only it sees must be stopped for, too."""
        speeds = [(sight, self.stopping(sight).largest_speed_m_s(sight.depth_m)) for sight in self.eyes(now_s)]
        return min(speeds, key=lambda pair: pair[1], default=None)

    def _depth_m(self, status: PerceptionStatus) -> float:
        if status.region is not None:
            return status.region.depth_m
        return depth_of(self.settings, status.sensor)

    def _in_the_way_m(self, status: PerceptionStatus) -> float | None:
        """Distance of what is in the region, or in the corridor no farther than the region is deep and not below it.

        A level region cannot see what stands on a line that climbs or descends; the corridor can.
        """
        depth_m = self._depth_m(status)
        below_m = (status.region.height_m if status.region is not None else self.settings.height_m) / 2
        near = [o.distance_m for o in status.obstacles if o.region == "roi"]
        near += [
            o.distance_m
            for o in status.obstacles
            if o.region == "corridor" and o.distance_m <= depth_m and o.height_difference_m > -below_m
        ]
        if near:
            return min(near)
        return depth_m if status.region is not None and status.region.occupied else None


def _has_seen_clear(sight: Sight) -> bool:
    return sight.clear_frames >= CLEAR_FRAMES and not sight.forgot


def _ages_s(status: PerceptionStatus, before: Sight | None, came_mono_s: float | None) -> tuple[float, ...]:
    """``came_mono_s``: None where the same frame is told again."""
    known = () if before is None else before.ages_s
    if came_mono_s is None or status.state != "running":
        return known
    return (*known, came_mono_s - status.t_mono_s)[-JUDGED_FRAMES:]


def _flowed_s(status: PerceptionStatus, before: Sight | None, now_s: float) -> float:
    if status.state in ("running", "blind") and (before is None or status.t_mono_s != before.t_mono_s):
        return now_s
    return -math.inf if before is None else before.flowed_mono_s


def _period_s(status: PerceptionStatus, before: Sight | None) -> float:
    if before is None or not before.counts or status.state != "running":
        return 0.0 if before is None else before.period_s
    return max(min(status.t_mono_s - before.t_mono_s, BLIND_S), PERIOD_FADES * before.period_s)


def _since_s(status: PerceptionStatus, before: Sight | None) -> float:
    goes_on = before is not None and before.counts and status.t_mono_s - before.t_mono_s <= OLD_S
    return before.since_s if before is not None and goes_on else status.t_mono_s
