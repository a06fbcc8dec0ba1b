"""The robot's frames while it moves: what /tf and /tf_static said last, and ways between frames at a time."""

from __future__ import annotations

from bisect import bisect_left, insort
from dataclasses import dataclass, field
from operator import itemgetter

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.recording.ros.bag_types import LONGEST_NAME, MOST_NAMES
from telemetry.recording.ros.transforms import MOST_LINKS, FrameTrack, FrameWay, Gap, Transform

KEPT_NS = 10_000_000_000
"""Of each frame, counted back from its newest sample."""
MOST_SAMPLES = 4000
_Sample = tuple[int, F64, F64]
"""(stamp in ns, shift, quaternion w, x, y, z)"""


class FrameError(ValueError):
    """A transform that does not fit the tree."""


@dataclass(slots=True)
class _Link:
    """One frame in its parent."""

    parent: str
    is_static: bool
    samples: list[_Sample] = field(default_factory=list)
    """By stamp, each once."""

    def take(self, sample: _Sample) -> None:
        if self.is_static:
            self.samples[:] = [sample]
            return
        place = bisect_left(self.samples, sample[0], key=itemgetter(0))
        if place < len(self.samples) and self.samples[place][0] == sample[0]:
            self.samples[place] = sample
            return
        if self.samples and sample[0] < self.samples[-1][0] - KEPT_NS:  # its clock began anew
            self.samples.clear()
        insort(self.samples, sample, key=itemgetter(0))
        oldest = bisect_left(self.samples, self.samples[-1][0] - KEPT_NS, key=itemgetter(0))
        del self.samples[: max(oldest, len(self.samples) - MOST_SAMPLES)]

    def around(self, child: str, t_ns: int) -> FrameTrack:
        """No more of it than the samples before and after that time."""
        place = bisect_left(self.samples, t_ns, key=itemgetter(0))
        near = self.samples if self.is_static else self.samples[max(0, place - 1) : place + 1]
        stamps = np.array([each[0] for each in near], np.int64)
        shifts = np.array([each[1] for each in near], np.float64).reshape(-1, 3)
        turns = np.array([each[2] for each in near], np.float64).reshape(-1, 4)
        return FrameTrack(self.parent, child, stamps, shifts, turns, self.is_static)


class LiveTransforms:
    """The tree as it is now. REP 105: each frame has one parent."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}

    def __contains__(self, frame: str) -> bool:
        return frame in self._links or any(link.parent == frame for link in self._links.values())

    @property
    def names(self) -> list[str]:
        return sorted(self._links.keys() | {link.parent for link in self._links.values()})

    def add(self, parent: str, child: str, stamp_ns: int, xyz_m: F64, q_wxyz: F64, *, is_static: bool) -> None:
        """Raises FrameError for a second parent, a circle, too many frames, or one that is fixed and is to move.

        What is fixed stays fixed, whichever was told first: a single odd transform must not unmount a sensor for good.
        """
        link = self._links.get(child)
        if link is None:
            if len(self._links) >= MOST_NAMES or max(len(parent), len(child)) > LONGEST_NAME:
                raise FrameError("there are too many frames, or their names are absurdly long")
            if parent == child or child in self.ancestors(parent):
                raise FrameError(f"the frames {child} and {parent} go round in a circle")
            link = self._links[child] = _Link(parent, is_static)
        if link.parent != parent:
            raise FrameError(f"the frame {child} has two parents, {link.parent} and {parent}")
        if link.is_static and not is_static:
            raise FrameError(f"the frame {child} is fixed by /tf_static, and moved by /tf")
        link.is_static = is_static
        link.take((stamp_ns, xyz_m, q_wxyz))

    def ancestors(self, frame: str) -> list[str]:
        """The frame itself, its parent, and so on to the root."""
        found = [frame]
        while (link := self._links.get(found[-1])) is not None and len(found) <= MOST_LINKS:
            found.append(link.parent)
        return found

    def moves(self, frame: str, root: str) -> bool:
        """Whether any transform between them is not static."""
        above = self.ancestors(frame)
        return root in above and any(not self._links[name].is_static for name in above[: above.index(root)])

    def at(self, target: str, source: str, t_ns: int, most_gap_ns: int) -> Transform | Gap | None:
        """From points of ``source`` to ``target`` at that time; None where nothing connects them."""
        up, down = self.ancestors(source), self.ancestors(target)
        common = next((name for name in up if name in down), None)
        if common is None:
            return None
        rising = tuple(self._links[name].around(name, t_ns) for name in up[: up.index(common)])
        falling = tuple(self._links[name].around(name, t_ns) for name in down[: down.index(common)])
        return FrameWay(rising, falling).at(t_ns, most_gap_ns)
