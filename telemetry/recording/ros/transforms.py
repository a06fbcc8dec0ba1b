"""Transforms between a robot's frames at any time: the tree that /tf and /tf_static tell, and ways through it.

REP 105: every frame has one parent. Between two samples a shift goes straight and a rotation turns at a constant rate;
nothing is said of a time before the first sample, after the last, or in too long a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64, I64
from telemetry.errors import RecordingError

MOST_LINKS = 100
"""Of one way through the tree."""


@dataclass(frozen=True, slots=True)
class Transform:
    """p_parent = R @ p_child + shift_m"""

    R: F64
    shift_m: F64

    def __matmul__(self, inner: Transform) -> Transform:
        return Transform(self.R @ inner.R, self.R @ inner.shift_m + self.shift_m)

    @property
    def inverse(self) -> Transform:
        return Transform(self.R.T, -self.R.T @ self.shift_m)

    def __call__(self, xyz_m: F64) -> F64:
        """(N, 3) -> (N, 3)"""
        return xyz_m @ self.R.T + self.shift_m


UNMOVED = Transform(np.eye(3), np.zeros(3))


@dataclass(frozen=True, slots=True)
class Gap:
    """Nothing is known of ``child`` in ``parent`` between these times; None: before the first, or after the last."""

    parent: str
    child: str
    from_ns: int | None
    until_ns: int | None


@dataclass(frozen=True, slots=True)
class FrameTrack:
    """One frame in its parent, over time; a static one has one sample that always holds."""

    parent: str
    child: str
    stamps_ns: I64
    """Ascending, each once."""
    xyz_m: F64
    q_wxyz: F64
    is_static: bool = False

    def at(self, t_ns: int, most_gap_ns: int) -> Transform | Gap:
        sample = self.sample_at(t_ns, most_gap_ns)
        return sample if isinstance(sample, Gap) else Transform(quaternions.rotation(sample[1]), sample[0])

    def sample_at(self, t_ns: int, most_gap_ns: int) -> tuple[F64, F64] | Gap:
        """(shift, quaternion w, x, y, z)"""
        if self.is_static:
            return self.xyz_m[0], self.q_wxyz[0]
        after = int(np.searchsorted(self.stamps_ns, t_ns))
        if after < len(self.stamps_ns) and self.stamps_ns[after] == t_ns:
            return self.xyz_m[after], self.q_wxyz[after]
        begin = int(self.stamps_ns[after - 1]) if after else None
        end = int(self.stamps_ns[after]) if after < len(self.stamps_ns) else None
        if begin is None or end is None or end - begin > most_gap_ns:
            return Gap(self.parent, self.child, begin, end)
        share = (t_ns - begin) / (end - begin)
        shift = self.xyz_m[after - 1] + share * (self.xyz_m[after] - self.xyz_m[after - 1])
        return shift, quaternions.slerp(self.q_wxyz[after - 1], self.q_wxyz[after], share)


def track_of(rows: NDArray[np.void], parent: str, child: str, *, is_static: bool = False) -> FrameTrack:
    """Of rows of ``bag_types.TRANSFORM`` in any order; of two with the same stamp the later one holds."""
    newest_first = rows[::-1]
    _, chosen = np.unique(newest_first["stamp_ns"], return_index=True)
    chosen = chosen[-1:] if is_static else chosen
    found = newest_first[chosen]
    return FrameTrack(parent, child, found["stamp_ns"], found["xyz_m"], found["q_wxyz"], is_static)


class TransformTree:
    """All frames of a bag."""

    def __init__(self, tracks: Sequence[FrameTrack]) -> None:
        """Raises RecordingError where a frame has several parents, or is its own ancestor."""
        self._above: dict[str, FrameTrack] = {}
        for track in tracks:
            other = self._above.setdefault(track.child, track)
            if other.parent != track.parent:
                what = f"The frame {track.child} has two parents, {other.parent} and {track.parent}."
                raise RecordingError(what, advice="Record one tree of transforms (REP 105).")
        for child in self._above:
            self.ancestors(child)

    @property
    def names(self) -> list[str]:
        return sorted(self._above.keys() | {track.parent for track in self._above.values()})

    def ancestors(self, frame: str) -> list[str]:
        """The frame itself, its parent, and so on to the root."""
        found = [frame]
        while (track := self._above.get(found[-1])) is not None:
            if track.parent in found or len(found) > MOST_LINKS:
                what = f"The frames {' -> '.join([*found[:5], track.parent])} go round in a circle, or on without end."
                raise RecordingError(what, advice="Record one tree of transforms (REP 105).")
            found.append(track.parent)
        return found

    def way(self, target: str, source: str) -> FrameWay | None:
        """From points of ``source`` to ``target``; None where nothing connects them."""
        up, down = self.ancestors(source), self.ancestors(target)
        common = next((name for name in up if name in down), None)
        if common is None:
            return None
        rising = [self._above[name] for name in up[: up.index(common)]]
        falling = [self._above[name] for name in down[: down.index(common)]]
        return FrameWay(tuple(rising), tuple(falling))


@dataclass(frozen=True, slots=True)
class FrameWay:
    """Through the tree: up from the source, and down to the target."""

    rising: tuple[FrameTrack, ...]
    falling: tuple[FrameTrack, ...]

    def at(self, t_ns: int, most_gap_ns: int) -> Transform | Gap:
        common_from_source = _chained(self.rising, t_ns, most_gap_ns)
        if isinstance(common_from_source, Gap):
            return common_from_source
        common_from_target = _chained(self.falling, t_ns, most_gap_ns)
        if isinstance(common_from_target, Gap):
            return common_from_target
        return common_from_target.inverse @ common_from_source


def _chained(tracks: Sequence[FrameTrack], t_ns: int, most_gap_ns: int) -> Transform | Gap:
    """From the first track's child to the last one's parent."""
    whole = UNMOVED
    for track in tracks:
        link = track.at(t_ns, most_gap_ns)
        if isinstance(link, Gap):
            return link
        whole = link @ whole
    return whole


def tree_of(rows: NDArray[np.void], names: Sequence[str]) -> TransformTree:
    """Of rows of ``bag_types.TRANSFORM``. A frame that moves at any time is no static one."""
    order = np.lexsort((rows["parent"], rows["child"]))
    ordered: Any = rows[order]
    pair = ordered["child"].astype(np.int64) << 32 | ordered["parent"]
    edges = [0, *(np.flatnonzero(np.diff(pair)) + 1).tolist(), len(ordered)]
    tracks = []
    for begin, end in pairwise(edges):
        group = ordered[begin:end]
        if len(group):
            parent, child = names[int(group["parent"][0])], names[int(group["child"][0])]
            moving = group[group["is_static"] == 0]
            tracks.append(track_of(moving if len(moving) else group, parent, child, is_static=not len(moving)))
    return TransformTree(tracks)
