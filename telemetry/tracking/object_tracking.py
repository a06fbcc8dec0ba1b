"""Frames, poses and settings in; tracks and approach alerts out: no threads, no sockets, no clock of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.perception import SILENT_S
from mapping.sensor_frames import RadarFrame
from mapping.tracking.movers import Movers
from mapping.tracking.tracker import Tracker
from planning.errors import DescribedError
from planning.evading.velocity_obstacles import Limits
from planning.missions.vehicle_profile import parse_profile
from telemetry.perception.perceiver import Perceiver
from telemetry.perception.sensor_kinds import RADAR, SensorKind
from telemetry.perception.status import Outcome
from telemetry.topics.messages import PlanRecord, Topic
from telemetry.topics.obstacles import ObstacleAlert, PerceptionSettings, PerceptionStatus
from telemetry.topics.track_settings import USUAL_MAX_SPEED_M_S, TrackerSettings
from telemetry.topics.tracks import Track, TracksState, TracksStatus
from telemetry.tracking.approach import FOLLOWED_AFRESH, LANDED, ApproachBook
from telemetry.tracking.evasion import Evasion, GroundRoom, Rules, evasion
from telemetry.tracking.followed import UNSEEN_S, Followed, Keep, TrackMemory
from telemetry.tracking.out_of_view import Remembered

USUAL = Limits(max_speed_m_s=USUAL_MAX_SPEED_M_S)
MOST_TRACKS = 64
DOWNWASH_M = 0.5
"""Over the ground below it; beside it nothing is added."""
KEEP_S = UNSEEN_S
"""After the newest frame that could be followed: then its objects are somewhere else, and what it proposed is wrong."""


def tracks_kind(tracker: Tracker) -> SensorKind:
    """The tracks node among those that take a sensor's frames: the radar's, into a tracker of its own."""

    def make(settings: Settings, *, alert_prefix: str = "") -> Movers:
        return Movers(settings, tracker, alert_prefix=alert_prefix)

    return replace(RADAR, status=Topic.TRACKS, make=make)


def limits_of(plan: PlanRecord) -> Limits:
    """What a proposal must keep to, by the profile of the plan on board; the usual where it holds none to be read."""
    try:
        profile = parse_profile(plan.profile_toml.encode(), where="plan on board")
    except DescribedError:
        return USUAL
    return Limits(max_speed_m_s=profile.max_speed_m_s)


class ObjectTracking:
    """A perceiver whose perception follows what moves; ``perceiver`` takes states, settings and ground."""

    def __init__(self, *, run: str, utc_minus_mono_s: float) -> None:
        self._tracker = Tracker(TrackerSettings().params())
        self.perceiver = _Quiet(tracks_kind(self._tracker), run=run, utc_minus_mono_s=utc_minus_mono_s)
        self.limits = USUAL
        self._memory, self._remembered, self._room = TrackMemory(), Remembered(), GroundRoom()
        self._room_m: tuple[float, ...] = ()
        self._followed: list[Followed] = []
        self._followed_t_s = -math.inf
        self._evasion = Evasion()
        self._approaches = ApproachBook(f"approach-{run}", utc_minus_mono_s)
        self._begun = 0

    def on_settings(self, settings: PerceptionSettings) -> None:
        """Other parameters of the tracker take effect at once: everything is followed afresh by them."""
        before = self.perceiver.settings.tracker
        self.perceiver.on_settings(settings)
        after = self.perceiver.settings.tracker
        if after != before:
            self._tracker.tune(after.params())
            self._memory, self._remembered = TrackMemory(), Remembered()

    def on_plan(self, plan: PlanRecord) -> None:
        """Of the vehicle's profile in it come the limits that a proposal keeps to."""
        self.limits = limits_of(plan)

    def work(self, frame: RadarFrame, clock: Callable[[], float]) -> Outcome[TracksStatus]:
        """One frame; never raises for what is in it."""
        outcome = self.perceiver.work(frame, clock)
        alerts = self._begin_afresh(outcome)
        if outcome.accepted:
            self._follow()
            alerts += self._alerts(outcome)
        else:
            alerts += self._pass_time(clock())
        return self._told(outcome, alerts, clock())

    def tick(self, clock: Callable[[], float]) -> Outcome[TracksStatus]:
        """A second without a frame."""
        outcome = self.perceiver.tick(clock, feed=True)
        alerts, now_s = self._begin_afresh(outcome), clock()
        return self._told(outcome, alerts + self._pass_time(now_s), now_s)

    def _pass_time(self, now_s: float) -> list[ObstacleAlert]:
        """Nothing was followed now, whether no frame came or one that is of no use."""
        if now_s - self._followed_t_s > KEEP_S:
            self._followed, self._evasion = [], Evasion()
        return self._approaches.pass_time(now_s, now_s)

    def _begin_afresh(self, outcome: Outcome[PerceptionStatus]) -> list[ObstacleAlert]:
        if self._begun == self.perceiver.begun:
            return []
        self._begun = self.perceiver.begun
        self._memory, self._remembered = TrackMemory(), Remembered()
        self._followed, self._evasion = [], Evasion()
        return self._approaches.end_all(outcome.status.t_mono_s, outcome.status.done_t_mono_s, FOLLOWED_AFRESH)

    def _follow(self) -> None:
        movers: Movers = self.perceiver.perception
        assert movers.pose is not None
        assert movers.blobs is not None
        settings, pose = self.perceiver.settings, movers.pose
        self._followed = self._remembered.observe(self._memory.observe(movers.states, movers.blobs, pose), pose)
        self._followed_t_s = pose.t_mono_s
        below_m = settings.vehicle_radius_m + settings.position_error_m + DOWNWASH_M
        self._room_m = self._room.around(movers.ground, pose.position_enu_m, below_m)
        velocities = settings.velocities
        rules = Rules(keep_of(settings), velocities.limits(self.limits), velocities.nearest_only, self._room_m)
        self._evasion = evasion(self._followed, pose, rules)

    def _alerts(self, outcome: Outcome[PerceptionStatus]) -> list[ObstacleAlert]:
        movers = self.perceiver.perception
        if not movers.is_flying:
            return self._approaches.end_all(outcome.status.t_mono_s, outcome.status.done_t_mono_s, LANDED)
        return self._approaches.observe(
            self._followed,
            heading_rad=movers.pose.heading_rad,
            keep=keep_of(self.perceiver.settings),
            t_mono_s=outcome.status.t_mono_s,
            done_t_mono_s=outcome.status.done_t_mono_s,
        )

    def _told(
        self, outcome: Outcome[PerceptionStatus], alerts: list[ObstacleAlert], done_s: float
    ) -> Outcome[TracksStatus]:
        base, pose, settings = outcome.status, self.perceiver.perception.pose, self.perceiver.settings
        shown, evading = self._followed[:MOST_TRACKS], self._evasion
        state, text = self._state(outcome, done_s)
        t_mono_s = self._followed_t_s if math.isfinite(self._followed_t_s) else base.t_mono_s
        status = TracksStatus(
            state=state,
            text=text,
            t_mono_s=t_mono_s,
            t_utc_s=base.t_utc_s + (t_mono_s - base.t_mono_s),
            done_t_mono_s=done_s,
            frames=base.frames,
            dropped=base.dropped,
            lost_frames=base.lost_frames,
            detections=base.points,
            tracks=self._tracks(shown),
            hidden=len(self._followed) - len(shown),
            velocity_enu_m_s=None
            if pose is None
            else (float(pose.velocity_enu_m_s[0]), float(pose.velocity_enu_m_s[1])),
            max_speed_m_s=settings.velocities.limits(self.limits).max_speed_m_s,
            safety_radius_m=settings.safety_radius_m,
            room_m=self._room_m,
            cones=evading.cones,
            proposal=evading.proposal,
            no_proposal=evading.why_none,
            origin=base.origin,
            latency_s=base.latency_s,
        )
        return Outcome(status, tuple(alerts), outcome.accepted)

    def _state(self, outcome: Outcome[PerceptionStatus], now_s: float) -> tuple[TracksState, str]:
        """Frames that come and are refused, all of them, are no better than none."""
        base, unused_s = outcome.status, now_s - self._followed_t_s
        if base.state == "running" and unused_s > SILENT_S:
            since = f" for {unused_s:.0f} s" if math.isfinite(unused_s) else " yet"
            why = f"No radar frame could be used{since}. Check the sensor and the vehicle."
            return "stale", f"{why} {base.text}".rstrip()
        return "frozen" if base.state == "blind" else base.state, base.text

    def _tracks(self, shown: list[Followed]) -> tuple[Track, ...]:
        """At the vehicle's own height: the radar knows no better."""
        frame = self.perceiver.where.frame
        if not shown or frame is None:
            return ()
        up_m = float(self.perceiver.perception.pose.position_enu_m[2])
        places = np.array([[*one.state.position_enu_m, up_m] for one in shown])
        geodetic, keep = frame.to_geodetic(places), keep_of(self.perceiver.settings)
        return tuple(
            track_of(one, place, lat_lon, keep)
            for one, place, lat_lon in zip(shown, places.tolist(), geodetic[:, :2].tolist(), strict=True)
        )


def track_of(one: Followed, place: Sequence[float], lat_lon: Sequence[float], keep: Keep) -> Track:
    """As it travels on the bus: ``place`` east, north and up, ``lat_lon`` in degrees."""
    state, spread = one.state, one.state.covariance
    return Track(
        id=state.id,
        enu_m=(place[0], place[1], place[2]),
        velocity_enu_m_s=_flat(one.velocity_enu_m_s),
        covariance_m2=(float(spread[0, 0]), float(spread[0, 1]), float(spread[1, 1])),
        age_s=state.age_s,
        updates=state.updates,
        moving=one.moving,
        range_m=one.range_m,
        bearing_deg=math.degrees(one.bearing_rad) % 360.0,
        closest_m=one.closest_m,
        closest_in_s=one.closest_in_s,
        dangerous=one.is_dangerous(keep),
        lat_deg=lat_lon[0],
        lon_deg=lat_lon[1],
        remembered=one.remembered,
    )


def keep_of(settings: PerceptionSettings) -> Keep:
    velocities = settings.velocities
    return Keep(settings.safety_radius_m, settings.approach_s, velocities.stands_m, velocities.stands_s)


def _flat(vector: F64) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


class _Quiet(Perceiver):
    """Says nothing of maps that begin afresh: there is none."""

    def _begin_afresh(self, why: str) -> None:
        super()._begin_afresh("")
