"""A bag's clouds, each with the pose that the robot had then: through its transforms, in east, north and up.

The frame that poses are given in is taken as east, north, up (REP 103); the map's origin is where the first pose was.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32, F64
from telemetry.errors import RecordingError
from telemetry.recording.ros.bag import BagContents
from telemetry.recording.ros.transforms import FrameTrack, FrameWay, Gap, Transform, track_of, tree_of

BASE_LINK = "base_link"
"""REP 105: the robot's own frame."""
MOST_GAP_S = 0.5
_MOST_LISTED = 12
_AROUND_NS = 50_000_000
FORWARD_LEFT_UP = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Right, forward, up of what REP 103 counts forward, left, up."""


@dataclass(frozen=True, slots=True)
class PlacedCloud:
    stamp_ns: int
    xyz_m: F64
    """(N, 3) at the robot: right, forward, up"""
    speed_m_s: F32
    """(N,) NaN where the sensor tells none"""
    snr_db: F32
    pose: PlacedPose


@dataclass(frozen=True, slots=True)
class PlacedPose:
    stamp_ns: int
    p_enu_m: F64
    """From the origin."""
    v_enu_m_s: F64 | None
    R_enu_body: F64
    """Body: right, forward, up."""


@dataclass(frozen=True, slots=True)
class PlacedBag:
    clouds: tuple[PlacedCloud, ...]
    left_out: int
    """Clouds at whose time nobody knows where the sensor was."""
    world: str
    base: str
    origin_ns: int
    notes: tuple[str, ...]


def placed(
    contents: BagContents, *, base: str | None = None, from_transforms: bool = False, most_gap_s: float = MOST_GAP_S
) -> PlacedBag:
    """``base``: the robot's frame; None: that of which the poses are, else ``base_link``.

    ``from_transforms``: poses are the transforms' own, from the root of the tree. Raises RecordingError where nothing
    can be placed: which transform is missing, and between which times.
    """
    if not len(contents.frames):
        raise RecordingError("It holds no cloud of that topic that can be read.", advice=_broken(contents))
    robot = _Robot.of(contents, base, from_transforms=from_transforms)
    most_gap_ns = round(most_gap_s * 1e9)
    origin_ns, origin_m = robot.first(contents.frames["stamp_ns"], most_gap_ns)
    gaps = Counter[Gap]()
    clouds = tuple(_clouds(contents, robot, origin_m, most_gap_ns, gaps))
    start_ns = int(contents.frames["stamp_ns"][0])
    if not clouds:
        gap, _ = gaps.most_common(1)[0]
        raise RecordingError(f"No cloud can be placed: {_words(gap, start_ns)}.", advice=_gap_advice(gap, most_gap_s))
    notes = _notes(contents, robot, gaps, start_ns, most_gap_s)
    return PlacedBag(clouds, sum(gaps.values()), robot.world, robot.base, origin_ns, tuple(notes))


@dataclass(frozen=True, slots=True)
class _Robot:
    """Where the robot's frame is in the world, and the sensors' in the robot's."""

    world: str
    base: str
    pose_at: Callable[[int, int], Transform | Gap]
    tracks: tuple[FrameTrack, ...]
    way_to_base: Callable[[str], FrameWay | None]

    @classmethod
    def of(cls, contents: BagContents, base: str | None, *, from_transforms: bool) -> _Robot:
        tree = tree_of(contents.transforms, contents.names)
        if from_transforms:
            base = _known_base(base, tree.names)
            world = tree.ancestors(base)[-1]
            way = tree.way(world, base)
            assert way is not None
            _check_moves(way, world, base, tree.names)
            return cls(world, base, way.at, way.rising, lambda frame: tree.way(base, frame))
        poses = contents.poses
        if not len(poses):
            raise RecordingError("It holds no pose of that topic that can be read.", advice=_broken(contents))
        child, parent = int(poses["child"][0]), int(poses["parent"][0])
        if (poses["child"] != child).any() or (poses["parent"] != parent).any():
            raise RecordingError("The poses of that topic are of several frames.", advice="Choose another topic.")
        own = contents.names[child] if child >= 0 else None
        chosen = base or own or _known_base(None, tree.names)
        track = track_of(poses, contents.names[parent], own or chosen)
        if own is None or own == chosen:
            return cls(track.parent, chosen, track.at, (track,), lambda frame: tree.way(chosen, frame))
        own_from_chosen = tree.way(own, chosen)
        if own_from_chosen is None:
            what = f"The poses are of the frame {own}, and no transform leads from there to {chosen}."
            raise RecordingError(what, advice=f"Leave --frame out; {_listed(tree.names)}.")
        tracks = (track, *own_from_chosen.rising, *own_from_chosen.falling)
        pose_at = partial(_chosen_pose, track, own_from_chosen)
        return cls(track.parent, chosen, pose_at, tracks, lambda frame: tree.way(chosen, frame))

    def first(self, stamps_ns: Any, most_gap_ns: int) -> tuple[int, F64]:
        """When and where the first pose was."""
        moving = [int(track.stamps_ns[0]) for track in self.tracks if not track.is_static]
        for stamp_ns in [max(moving, default=0), *stamps_ns.tolist()]:
            pose = self.pose_at(stamp_ns, most_gap_ns)
            if isinstance(pose, Transform):
                return stamp_ns, pose.shift_m
        return 0, np.zeros(3)

    def velocity_m_s(self, stamp_ns: int, most_gap_ns: int) -> F64 | None:
        """Over a tenth of a second around that time, or as much of it as is known."""
        around = (
            (ns, self.pose_at(ns, most_gap_ns)) for ns in (stamp_ns - _AROUND_NS, stamp_ns, stamp_ns + _AROUND_NS)
        )
        known = [(ns, pose.shift_m) for ns, pose in around if isinstance(pose, Transform)]
        if len(known) < 2:
            return None
        (begin_ns, begin_m), (end_ns, end_m) = known[0], known[-1]
        return (end_m - begin_m) / ((end_ns - begin_ns) / 1e9)


def _known_base(base: str | None, names: Sequence[str]) -> str:
    wanted = base or BASE_LINK
    if wanted in names:
        return wanted
    what = f"No transform tells of the robot's frame {wanted}."
    raise RecordingError(what, advice=f"Give its name with --frame; {_listed(names)}.")


def _listed(names: Sequence[str]) -> str:
    return f"frames of the bag: {', '.join(names[:_MOST_LISTED]) or 'none'}"


def _check_moves(way: FrameWay, world: str, base: str, names: Sequence[str]) -> None:
    """Where each transform above the robot is static, or there is none, every cloud would be seen from one place."""
    if any(not track.is_static for track in way.rising):
        return
    why = f"all transforms from {base} to {world} are static" if way.rising else f"no transform leads from {base} on"
    what = f"Nothing tells where the robot was: {why}."
    raise RecordingError(
        what, advice=f"Give a topic of poses with --pose, or the robot's frame with --frame; {_listed(names)}."
    )


def _chosen_pose(track: FrameTrack, own_from_chosen: FrameWay, t_ns: int, most_gap_ns: int) -> Transform | Gap:
    """Of the frame that was chosen, by the poses of another one."""
    pose, moved = track.at(t_ns, most_gap_ns), own_from_chosen.at(t_ns, most_gap_ns)
    if isinstance(pose, Gap) or isinstance(moved, Gap):
        return pose if isinstance(pose, Gap) else moved
    return pose @ moved


def _clouds(
    contents: BagContents, robot: _Robot, origin_m: F64, most_gap_ns: int, gaps: Counter[Gap]
) -> Iterator[PlacedCloud]:
    ways: dict[int, FrameWay | None] = {}
    for stamp, first, count, frame in contents.frames.tolist():
        if frame not in ways:
            ways[frame] = robot.way_to_base(contents.names[frame])
        way = ways[frame]
        mount = Gap(robot.base, contents.names[frame], None, None) if way is None else way.at(stamp, most_gap_ns)
        pose = robot.pose_at(stamp, most_gap_ns)
        gap = next((each for each in (pose, mount) if isinstance(each, Gap)), None)
        if gap is not None or isinstance(mount, Gap) or isinstance(pose, Gap):
            gaps.update([gap] if gap else [])
            continue
        points = contents.points[first : first + count]
        velocity = robot.velocity_m_s(stamp, most_gap_ns)
        at = PlacedPose(stamp, pose.shift_m - origin_m, velocity, pose.R @ FORWARD_LEFT_UP.T)
        xyz_m = mount(points["xyz_m"]) @ FORWARD_LEFT_UP.T
        yield PlacedCloud(stamp, xyz_m, points["speed_m_s"], points["snr_db"], at)


def _notes(contents: BagContents, robot: _Robot, gaps: Counter[Gap], start_ns: int, most_gap_s: float) -> Iterator[str]:
    yield (
        f"The bag's frame {robot.world} is taken as east, north, up (REP 103), its origin put where {robot.base} was "
        "first: where its x axis does not point east, the map is turned by as much."
    )
    for gap, count in gaps.most_common(3):
        of = len(contents.frames)
        advice = _gap_advice(gap, most_gap_s)
        yield f"{count:,} of {of:,} clouds were left out: {_words(gap, start_ns)}. {advice}"
    if contents.unstamped:
        yield f"{contents.unstamped:,} messages have no time of their own: when they were recorded stands for it."
    if contents.other_clock:
        yield (
            f"{contents.other_clock:,} messages have a sensor's clock (timebase) over 1 s away from their header: the "
            "header counts, which must be of the clock of the poses."
        )
    if contents.without_place:
        yield f"{contents.without_place:,} points were no numbers and were left out."
    if contents.broken:
        yield f"{contents.broken:,} messages contradict themselves and were left out: {contents.first_broken}."


def _words(gap: Gap, start_ns: int) -> str:
    """Times count from the first cloud's."""
    begin, end = (None if ns is None else f"{(ns - start_ns) / 1e9:.3f} s" for ns in (gap.from_ns, gap.until_ns))
    what = f"no transform from {gap.child} to {gap.parent}"
    if begin is None and end is None:
        return f"{what} at any time"
    if begin is None or end is None:
        return f"{what} before {end}" if begin is None else f"{what} after {begin}"
    return f"{what} between {begin} and {end}"


def _gap_advice(gap: Gap, most_gap_s: float) -> str:
    if gap.from_ns is None and gap.until_ns is None:
        return "Record /tf_static as well, from the start, or name the robot's frame with --frame."
    if gap.from_ns is None or gap.until_ns is None:
        return "Record poses and transforms before the first cloud and until after the last."
    return f"At most {most_gap_s:g} s are bridged; --max-gap-s bridges more."


def _broken(contents: BagContents) -> str:
    if contents.broken:
        return f"{contents.broken:,} messages contradict themselves, the first of {contents.first_broken}."
    return "Choose another topic; `hedgehop bag` lists them."
