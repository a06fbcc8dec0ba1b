"""Topics of ROS 2 as an agent's source of readings: points through the robot's frames, its pose, its publisher's clock.

Readings are in the agent's body frame (right, forward, up); REP 103 counts forward, left, up.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64
from mapping.geometry.frames import attitude_of
from telemetry.agent.client import CloudReading, NoticeReading, RadarReading, Reading
from telemetry.agent.link_messages import TARGETS_MAX, Slam
from telemetry.agent.live_radar import reading_of
from telemetry.agent.ros2_status import Ros2Status
from telemetry.recording.ros.bag_types import POINT_TYPES, POSE_TYPES, TF
from telemetry.recording.ros.placing import BASE_LINK, FORWARD_LEFT_UP, MOST_GAP_S
from telemetry.recording.ros.point_messages import MalformedMessageError, points_of
from telemetry.recording.ros.pose_messages import frame_name, pose_of, stamp_ns_of, transform_of
from telemetry.recording.ros.transforms import Gap, Transform
from telemetry.ros2.listener import Heard, Ros2Listener
from telemetry.ros2.message_times import Measured, SessionClocks
from telemetry.ros2.robot_frames import FrameError, LiveTransforms
from telemetry.ros2.topic_faults import Words
from telemetry.ros2.topic_watch import TopicWatch
from telemetry.ros2.zenoh_endpoint import ZenohAddress

TF_TOPIC, TF_STATIC_TOPIC = "/tf", "/tf_static"
ROWS = {"points": 4, "pose": 100, TF_TOPIC: 1000, TF_STATIC_TOPIC: 1000}
"""How many messages wait at most: of points the newest, of transforms all of some seconds."""
WAIT_S = 0.3
"""For the transforms and poses of a frame that has come before them."""
POSES_MOST_HZ = 50.0
_MOST_GAP_NS = round(MOST_GAP_S * 1e9)
_MOST_WAITING = 8


@dataclass(frozen=True, slots=True)
class Ros2Asked:
    """What is to be read."""

    points: str
    sensor: Literal["radar", "vision"]
    pose: str | None = None
    """A topic of poses, or /tf; None: none is passed on."""
    base: str | None = None
    """The robot's frame; None: the one that Odometry names, else ``base_link``."""
    domain: int = 0

    @property
    def rows(self) -> dict[str, int]:
        rows = {TF_STATIC_TOPIC: ROWS[TF_STATIC_TOPIC], TF_TOPIC: ROWS[TF_TOPIC]}
        if self.pose is not None:
            rows.setdefault(self.pose, ROWS["pose"])
        return rows | {self.points: ROWS["points"]}


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A frame until its transforms are there."""

    t_mono_s: float
    stamp_ns: int
    frame: str
    points: NDArray[np.void]
    lost: int
    until_mono_s: float


class Ros2Source:
    """``readings`` blocks, in a thread of its own; ``status`` may be read from any."""

    def __init__(
        self,
        asked: Ros2Asked,
        address: ZenohAddress,
        *,
        tell: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """``tell`` hears what goes wrong, and what is right again."""
        self._asked, self._address, self._tell, self._now = asked, address, tell, now
        self._listener = Ros2Listener(asked.domain, asked.rows, timeless=frozenset({TF_STATIC_TOPIC}))
        self._words = Words(tell=tell, now=now)
        self._watch = TopicWatch(self._listener, self._words, _needed(asked), now=now)
        self._transforms = LiveTransforms()
        self._clocks = SessionClocks(self._listener.graph.session_of)
        self._waiting: deque[_Waiting] = deque()
        self._lost = 0
        self._base, self._pose_t_s = asked.base or BASE_LINK, -1.0
        self._world = self._root = ""
        """Where transforms tell the pose: the frame in which all poses are, and the root of the tree as it is now."""
        self.status = Ros2Status(self._listener)

    def readings(self) -> Iterator[Reading]:
        """Until ``close``."""
        self._listener.open(self._address, tell=self._tell)
        try:
            while not self._listener.is_closed:
                heard = self._listener.hear(0.05)
                if heard is not None:
                    yield from self._taken(heard)
                yield from self._placed()
                self._watch.look()
                self.status.held = self._words.held
                for word in self._words.due():
                    yield NoticeReading(self._now(), word.warning, f"ROS 2: {word.text}")
        finally:
            self._listener.close()

    def close(self) -> None:
        self._listener.close()

    def _taken(self, heard: Heard) -> Iterator[Reading]:
        try:
            if heard.topic == self._asked.points and heard.type in POINT_TYPES:
                self._take_points(heard)
            elif heard.topic == self._asked.pose and heard.type in POSE_TYPES:
                yield from self._take_pose(heard)
            elif heard.type == TF and heard.topic in (TF_TOPIC, TF_STATIC_TOPIC, self._asked.pose):
                self._take_transforms(heard)
            else:
                raise MalformedMessageError(f"{heard.type} on {heard.topic} is not what is read there")
            self._watch.came(heard.topic)
        except (MalformedMessageError, FrameError, AttributeError, TypeError, ValueError, OverflowError) as error:
            self._left_out(heard.topic, str(error))
            self._lost += heard.topic == self._asked.points

    def _left_out(self, topic: str, why: str) -> None:
        reason = f"{topic}: {why[:160]}"
        if reason not in self.status.left_out and len(self.status.left_out) > 200:
            reason = "various reasons"
        self.status.left_out[reason] += 1
        self._words.recurs(f"{topic} is left out", f"{topic}: left out, {why[:160]}.")

    def _take_transforms(self, heard: Heard) -> None:
        if heard.topic != TF_STATIC_TOPIC:  # which may have been published at any time
            self._measured(heard, 0)
        for each in heard.message.transforms:
            try:
                found, stamp_ns = transform_of(each), stamp_ns_of(each.header)
                is_static = heard.topic == TF_STATIC_TOPIC
                place = (found.parent, found.child, stamp_ns or heard.source_ns, found.xyz_m, found.q_wxyz)
                self._transforms.add(*place, is_static=is_static)
            except (MalformedMessageError, FrameError) as error:  # the others of the message stand
                self._left_out(heard.topic, str(error))

    def _take_points(self, heard: Heard) -> None:
        points, without_place = points_of(heard.message, heard.type)
        self.status.without_place += without_place
        if self._asked.sensor == "radar":
            points = self._whole_targets(heard.topic, points)
        header = heard.message.header
        t_mono_s = self._measured_now(heard, header)
        self.status.clock_offset_s = offset_s = self._clocks.of(heard.topic, heard.gid).offset_s
        self._watch.offset(heard.topic, offset_s)
        stamp_ns = stamp_ns_of(header) or heard.source_ns
        lost, self._lost = self._lost + heard.lost, 0
        frame, until_s = frame_name(header.frame_id), self._now() + WAIT_S
        if len(self._waiting) >= _MOST_WAITING:
            place = self._place(self._waiting[0])
            self._give_up(self._waiting.popleft(), place if isinstance(place, str) else "it came too late")
        self._waiting.append(_Waiting(t_mono_s, stamp_ns, frame, points, lost, until_s))

    def _whole_targets(self, topic: str, points: NDArray[np.void]) -> NDArray[np.void]:
        """A target whose speed or strength nobody knows could not be told from the ground, nor be kept as an obstacle.

        Raises MalformedMessageError where there is no other: that must not look like an empty air.
        """
        whole = np.isfinite(points["speed_m_s"]) & np.isfinite(points["snr_db"])
        missing = len(points) - int(np.count_nonzero(whole))
        if missing and missing == len(points):
            what = "its points tell no radial speed, or no strength in dB (snr); read them with --sensor vision"
            raise MalformedMessageError(what)
        if missing:
            self.status.without_speed += missing
            self._words.recurs(f"{topic} has gaps", f"{topic}: targets without a speed or strength are left out.")
        return points[whole]

    def _measured(self, heard: Heard, stamp_ns: int) -> Measured:
        return self._clocks.of(heard.topic, heard.gid).on_message(
            stamp_ns=stamp_ns, source_ns=heard.source_ns, gid=heard.gid,
            received_mono_s=heard.received_mono_s, received_utc_s=heard.received_utc_s,
        )  # fmt: skip

    def _measured_now(self, heard: Heard, header: Any) -> float:
        """Monotonic time. Raises MalformedMessageError for what was published before anybody listened here."""
        measured = self._measured(heard, stamp_ns_of(header))
        if measured.published_mono_s < self._listener.since_mono_s:
            raise MalformedMessageError("it was published before this agent listened")
        self.status.odd_stamps += measured.is_odd
        if measured.is_odd:
            advice = "Its frames count as measured when they were published; set the sensor's clock."
            self._words.recurs(
                f"{heard.topic} has other stamps", f"{heard.topic}: its stamps are of another clock.", advice
            )
        return measured.t_mono_s

    def _take_pose(self, heard: Heard) -> Iterator[Slam]:
        found = pose_of(heard.message, heard.type)
        if self._asked.base is None and found.child:
            self._base = found.child
        t_mono_s = self._measured_now(heard, heard.message.header)
        if not self._pose_t_s - t_mono_s >= 0.0 and t_mono_s - self._pose_t_s < 1.0 / POSES_MOST_HZ:
            return
        pose = Transform(quaternions.rotation(found.q_wxyz), found.xyz_m)
        if found.child and found.child != self._base:
            stamp_ns = stamp_ns_of(heard.message.header) or heard.source_ns
            moved = self._transforms.at(found.child, self._base, stamp_ns, _MOST_GAP_NS)
            if not isinstance(moved, Transform):
                self._left_out(heard.topic, _gap_words(self._base, found.child, moved))
                return
            pose = pose @ moved
        self._pose_t_s = t_mono_s
        self.status.poses += 1
        yield _slam(t_mono_s, pose)

    def _placed(self) -> Iterator[Reading]:
        """In their order: a later frame never passes one that still waits."""
        while self._waiting:
            first = self._waiting[0]
            place = self._place(first)
            if isinstance(place, str):
                if self._now() < first.until_mono_s:
                    return
                self._give_up(self._waiting.popleft(), place)
                continue
            self._waiting.popleft()
            self._words.ends("no transform", "Transforms lead to the robot's frame again.")
            way, pose = place
            if pose is not None:
                self.status.poses += 1
                yield _slam(first.t_mono_s, pose, tracking="lost" if self._root_changed() else "good")
            yield self._reading(first, way)

    def _place(self, waiting: _Waiting) -> tuple[Transform, Transform | None] | str:
        """The way to the robot's frame and, where transforms tell it, the robot's pose; or what is missing of them."""
        way = self._transforms.at(self._base, waiting.frame, waiting.stamp_ns, _MOST_GAP_NS)
        if not isinstance(way, Transform):
            return _gap_words(waiting.frame, self._base, way)
        if self._asked.pose not in (TF_TOPIC, TF_STATIC_TOPIC):
            return way, None
        root = self._transforms.ancestors(self._base)[-1]
        world = self._world or root
        if world == self._base:
            return f"no transform leads on from {self._base[:60]}"
        if not self._transforms.moves(self._base, world):
            return f"all transforms from {self._base[:60]} to {world[:60]} are static: none tells where the robot is"
        pose = self._transforms.at(world, self._base, waiting.stamp_ns, _MOST_GAP_NS)
        return (way, pose) if isinstance(pose, Transform) else _gap_words(self._base, world, pose)

    def _root_changed(self) -> bool:
        """Poses stay in the frame that was the root at the first placed frame; whoever counts on another one hears."""
        before, self._root = self._root, self._transforms.ancestors(self._base)[-1]
        self._world = self._world or self._root
        if before in ("", self._root):
            return False
        advice = f"Poses stay in {self._world[:60]}; start the agent again to have them in {self._root[:60]}."
        what = f"The root of the robot's frames is {self._root[:60]} now, and was {before[:60]}."
        self._words.recurs("root", what, advice)
        return True

    def _give_up(self, waiting: _Waiting, why: str) -> None:
        self._lost += 1 + waiting.lost
        if why not in self.status.unplaced and len(self.status.unplaced) > 200:
            why = "various transforms missing"
        self.status.unplaced[why] += 1
        names = ", ".join(self._transforms.names[:12]) or "none"
        advice = f"Publish it, or name the robot's frame with --frame; frames: {names}."
        self._words.recurs("no transform", f"Frames cannot be placed: {why}.", advice)

    def _reading(self, waiting: _Waiting, way: Transform) -> RadarReading | CloudReading:
        self.status.frames += 1
        xyz_m = way(waiting.points["xyz_m"]) @ FORWARD_LEFT_UP.T
        if self._asked.sensor == "vision":
            return CloudReading(waiting.t_mono_s, xyz_m.astype(np.float32))
        points, lost = waiting.points, self._lost + waiting.lost
        self._lost = 0
        self.status.too_many += max(0, len(points) - TARGETS_MAX)
        return reading_of(waiting.t_mono_s, xyz_m, points["speed_m_s"], points["snr_db"], lost)


def _needed(asked: Ros2Asked) -> dict[str, frozenset[str]]:
    """Topics without which there is nothing to send, and what they must carry."""
    needed = {asked.points: POINT_TYPES}
    if asked.pose is not None:
        needed[asked.pose] = frozenset({TF}) if asked.pose in (TF_TOPIC, TF_STATIC_TOPIC) else POSE_TYPES
    return needed


def _gap_words(source: str, target: str, gap: Transform | Gap | None) -> str:
    if isinstance(gap, Gap):
        return f"no transform from {gap.child[:60]} to {gap.parent[:60]} at its time"
    return f"no transform from {source[:60]} to {target[:60]}"


def _slam(t_mono_s: float, pose: Transform, *, tracking: Literal["good", "lost"] = "good") -> Slam:
    """Body right, forward, up -> the frame in which the poses are."""
    R: F64 = pose.R @ FORWARD_LEFT_UP.T
    w, x, y, z = quaternions.from_attitude(*attitude_of(R)).tolist()
    east, north, up = pose.shift_m.tolist()
    return Slam(t_mono_s, (east, north, up), (w, x, y, z), tracking)
