"""Maps as they travel: cut into parts that are not too large, and added up again to what they came to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import I32, I64, U8
from telemetry.topics.obstacles import MapDelta, pack_keys, unpack_keys

MOST_VOXELS = 20_000
"""In one message: some 300 kB."""


def in_parts(head: MapDelta, keys: I32, probability: U8, explained: U8) -> list[MapDelta]:
    """``head`` with these voxels ((N, 3), (N,), (N,)), cut into parts; at least one, so that an empty map is told."""
    starts = range(0, max(len(keys), 1), MOST_VOXELS)
    return [
        replace(
            head,
            part=number,
            parts=len(starts),
            keys=pack_keys(keys[start : start + MOST_VOXELS]),
            probability=probability[start : start + MOST_VOXELS].tobytes(),
            explained=explained[start : start + MOST_VOXELS].tobytes(),
        )
        for number, start in enumerate(starts)
    ]


@dataclass(frozen=True, slots=True)
class Voxels:
    """What a map holds, sorted by key."""

    keys: I32
    """(N, 3)"""
    probability: U8
    """(N,) 255 is 1"""
    explained: U8
    """(N,)"""

    def occupied(self, *, include_explained: bool = True) -> Voxels:
        keep = self.probability > 127
        if not include_explained:
            keep &= self.explained == 0
        return Voxels(self.keys[keep], self.probability[keep], self.explained[keep])


NOTHING = Voxels(np.empty((0, 3), np.int32), np.empty(0, np.uint8), np.empty(0, np.uint8))


@dataclass(frozen=True, slots=True)
class FoldedMap:
    """A map as its deltas add up to. Immutable: what was folded once may be kept and gone on from."""

    last: MapDelta | None = None
    """The newest delta: time, revision, origin and resolution are the map's."""
    voxels: Voxels = NOTHING

    def folded(self, deltas: Iterable[MapDelta]) -> FoldedMap:
        """The map after these, in order."""
        several, last = [self.voxels], self.last
        for delta in deltas:
            if delta.whole and delta.part == 0:
                several.clear()
            several.append(voxels_of(delta))
            last = delta
        return FoldedMap(last, _newest(several))

    def whole(self) -> list[MapDelta]:
        """The map as messages that need none before them; nothing if there never was a map."""
        if self.last is None:
            return []
        return in_parts(
            replace(self.last, whole=True), self.voxels.keys, self.voxels.probability, self.voxels.explained
        )


def voxels_of(delta: MapDelta) -> Voxels:
    return Voxels(
        unpack_keys(delta.keys), np.frombuffer(delta.probability, np.uint8), np.frombuffer(delta.explained, np.uint8)
    )


def _newest(several: list[Voxels]) -> Voxels:
    """Of every voxel what was said last."""
    if not several:
        return NOTHING
    keys = np.concatenate([voxels.keys for voxels in several])[::-1]
    probability = np.concatenate([voxels.probability for voxels in several])[::-1]
    explained = np.concatenate([voxels.explained for voxels in several])[::-1]
    _, first = np.unique(packed_keys(keys), return_index=True)
    return Voxels(keys[first], probability[first], explained[first])


def packed_keys(keys: I32) -> I64:
    """(N, 3) -> (N,) one number per key, for keys within a million voxels of the origin."""
    shifted = keys.astype(np.int64) + (1 << 20)
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]
