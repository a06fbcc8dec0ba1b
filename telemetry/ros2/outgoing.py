"""What Hedgehop knows, as messages of ROS 2: the vehicle's pose and fix, alerts, occupied voxels. Pure: no sockets.

Frames: ``home`` (east, north, up of the first home that was told) and ``base_link`` (forward, left, up); a map that
lies where nobody knows is told in ``map_NAME``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from telemetry.recording.mcap_files.foxglove import enu_from_body_quaternion
from telemetry.recording.ros.bag_types import CLOUD, FIX, ODOMETRY, POSE
from telemetry.recording.ros.ros2_export import BASE, HOME
from telemetry.recording.ros.ros2_messages import DIAGNOSTICS, Ros2Messages
from telemetry.ros2.standing import StandingAlerts
from telemetry.topics.deltas import FoldedMap
from telemetry.topics.messages import Published, ServerAlive, Topic
from telemetry.topics.obstacles import MapDelta, ObstacleAlert
from telemetry.topics.vehicle import VehicleState

STALE_S = 1.5
"""An attitude this much older than its position is none."""
MAPS = {Topic.MAP_RADAR: "radar", Topic.MAP_VISION: "vision", Topic.MAP_RANGES: "ranges"}


@dataclass(frozen=True, slots=True)
class OutTopic:
    """Relative to the namespace."""

    name: str
    type: str
    keeps: int
    """So many last messages are handed to who comes late."""


POSE_OUT, ODOM_OUT = OutTopic("pose", POSE, 0), OutTopic("odom", ODOMETRY, 0)
FIX_OUT, ALERTS_OUT = OutTopic("fix", FIX, 0), OutTopic("alerts", DIAGNOSTICS, 10)
VOXELS_OUT = {topic: OutTopic(f"voxels/{name}", CLOUD, 1) for topic, name in MAPS.items()}
OUT_TOPICS = (POSE_OUT, ODOM_OUT, FIX_OUT, ALERTS_OUT, *VOXELS_OUT.values())


class Outgoing:
    """One station's messages, in turn."""

    def __init__(self, now_mono_s: float) -> None:
        self._messages, self._alerts = Ros2Messages(), StandingAlerts(now_mono_s)
        self._home: tuple[float, float, float] | None = None
        self._position_s, self._maps = -math.inf, {topic: FoldedMap() for topic in MAPS}
        self._deltas: dict[Topic, list[MapDelta]] = {topic: [] for topic in MAPS}
        self._revisions: dict[Topic, int] = {}
        self.without_whole = set(MAPS)
        """Maps of which the whole has to be asked for."""

    def hash_of(self, kind: str) -> str:
        return self._messages.hash_of(kind)

    def of(
        self, topic: str, message: Published, *, now_mono_s: float, now_utc_s: float
    ) -> Iterator[tuple[OutTopic, bytes]]:
        """What is told at once; maps wait for ``changed_maps``."""
        shift_s = now_utc_s - now_mono_s
        match message:
            case VehicleState():
                yield from self._vehicle(message, shift_s)
            case ObstacleAlert():
                self._alerts.take(message, now_mono_s)
                yield ALERTS_OUT, self._told_alerts(now_mono_s, now_utc_s)
            case ServerAlive():
                self._alerts.alive(now_mono_s)
            case MapDelta() if topic in MAPS:
                self._map(Topic(topic), message)
            case _:
                pass

    def turned(self, *, now_mono_s: float, now_utc_s: float) -> bytes | None:
        """Alerts with what is stale, or is so no more, where the station has fallen silent or is back; see
        ``is_silent``."""
        return self._told_alerts(now_mono_s, now_utc_s) if self._alerts.turned(now_mono_s) else None

    @property
    def is_silent(self) -> bool:
        return self._alerts.is_silent

    def _told_alerts(self, now_mono_s: float, now_utc_s: float) -> bytes:
        return self._messages.diagnostics(_ns(now_utc_s), self._alerts.statuses(now_mono_s))

    def _map(self, topic: Topic, delta: MapDelta) -> None:
        """Of a map that is not known from its beginning, or of which something was missed, nothing is told."""
        before = (delta.revision,) if delta.whole else (delta.since, delta.revision)
        if delta.whole and delta.part == 0:
            self.without_whole.discard(topic)
        elif self._revisions.get(topic) not in before:
            self.without_whole.add(topic)
        if topic in self.without_whole:
            self._deltas[topic].clear()
            return
        self._revisions[topic] = delta.revision
        self._deltas[topic].append(delta)

    def changed_maps(self) -> Iterator[tuple[Topic, list[MapDelta]]]:
        """What has come since this was asked last; hand it to ``voxels``."""
        for topic, deltas in self._deltas.items():
            if deltas and deltas[-1].part == deltas[-1].parts - 1:
                self._deltas[topic] = []
                yield topic, deltas

    def voxels(self, topic: Topic, deltas: list[MapDelta]) -> bytes:
        """The map with these: middles of the occupied voxels in its own frame, with their probability, known ground
        marked. Takes its time: not for an event loop, and for each topic one at a time."""
        self._maps[topic] = folded = self._maps[topic].folded(deltas)
        last, occupied = deltas[-1], folded.voxels.occupied()
        xyz_m = ((occupied.keys + 0.5) * last.resolution_m).astype(np.float32)
        columns = {name: xyz_m[:, axis] for axis, name in enumerate("xyz")}
        columns |= {
            "probability": occupied.probability.astype(np.float32) / np.float32(255.0),
            "known_ground": occupied.explained.astype(np.float32),
        }
        return self._messages.cloud(_ns(last.t_utc_s), f"map_{last.sensor}", columns)

    def _vehicle(self, state: VehicleState, shift_s: float) -> Iterator[tuple[OutTopic, bytes]]:
        """Each position once."""
        t_s, lat_deg, lon_deg = state.position_t_mono_s, state.lat_deg, state.lon_deg
        if t_s is None or lat_deg is None or lon_deg is None or t_s <= self._position_s:
            return
        self._position_s, stamp_ns = t_s, _ns(t_s + shift_s)
        alt_m = math.nan if state.gnss_alt_ellipsoid_m is None else state.gnss_alt_ellipsoid_m
        has_fix = state.gnss_fix not in ("none", "no_fix", "2d")
        yield FIX_OUT, self._messages.fix(stamp_ns, BASE, (lat_deg, lon_deg, alt_m), has_fix=has_fix)
        p_enu_m, q_wxyz = self._place(state), _attitude(state, t_s)
        if p_enu_m is not None and q_wxyz is not None:
            yield POSE_OUT, self._messages.pose(stamp_ns, HOME, p_enu_m, q_wxyz)
            yield ODOM_OUT, self._messages.odometry(stamp_ns, HOME, BASE, p_enu_m, q_wxyz)

    def _place(self, state: VehicleState) -> F64 | None:
        """(3,) east, north, up of the first home, whatever home is later."""
        home = (state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m)
        lat_deg, lon_deg, up_m = state.lat_deg, state.lon_deg, state.alt_rel_home_m
        if lat_deg is None or lon_deg is None or up_m is None or home[0] is None or home[1] is None or home[2] is None:
            return None
        if self._home is None:
            self._home = (home[0], home[1], home[2])
        east, north, _ = LocalFrame(*self._home).to_enu(lat_deg, lon_deg, self._home[2])[0].tolist()
        return np.array([east, north, up_m + home[2] - self._home[2]])


def _attitude(state: VehicleState, t_s: float) -> F64 | None:
    """w, x, y, z of forward, left, up in east, north, up; None where it is not known, or too old."""
    roll, pitch, heading, attitude_t_s = state.roll_rad, state.pitch_rad, state.heading_rad, state.attitude_t_mono_s
    if roll is None or pitch is None or heading is None or attitude_t_s is None or t_s - attitude_t_s > STALE_S:
        return None
    x, y, z, w = enu_from_body_quaternion(roll, pitch, heading)
    return np.array((w, x, y, z))


def _ns(t_utc_s: float) -> int:
    return max(0, round(t_utc_s * 1e9))
