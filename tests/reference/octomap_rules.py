"""OctoMap's insertion of a scan, written slowly with dictionaries and sets (Hornung et al. 2013)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

Key = tuple[int, int, int]
Point = tuple[float, float, float]


class SlowMap:
    """Log-odds by voxel, as the paper says: update each voxel once per scan, endpoints first, then clamp."""

    def __init__(self, resolution_m: float, hit: float, miss: float, clamp: tuple[float, float]) -> None:
        self.resolution_m = resolution_m
        self.hit, self.miss = _log_odds(hit), _log_odds(miss)
        self.lowest, self.highest = _log_odds(clamp[0]), _log_odds(clamp[1])
        self.voxels: dict[Key, float] = {}

    def key(self, point: Point) -> Key:
        x, y, z = (math.floor(value / self.resolution_m) for value in point)
        return x, y, z

    def insert(self, points: Iterable[Point], origin: Point, max_range_m: float, discretize: bool) -> None:
        ends = set(points)
        if discretize:
            ends = {self._centre(self.key(point)) for point in ends}
        near = {end for end in ends if math.dist(end, origin) <= max_range_m}
        hits = {self.key(end) for end in near}
        misses = {key for end in near for key in self.ray(origin, end)}
        for end in ends - near:
            share = max_range_m / math.dist(end, origin)
            last = tuple(o + share * (e - o) for o, e in zip(origin, end, strict=True))
            misses |= set(self.ray(origin, (last[0], last[1], last[2])))
        for key in misses - hits:
            self.voxels[key] = max(self.lowest, self.voxels.get(key, 0.0) + self.miss)
        for key in hits:
            self.voxels[key] = min(self.highest, self.voxels.get(key, 0.0) + self.hit)

    def ray(self, origin: Point, end: Point) -> list[Key]:
        """Voxels that the segment crosses, without the last one: cut at every border, the middles of the pieces."""
        cuts = {0.0, 1.0}
        for o, e in zip(origin, end, strict=True):
            lowest, highest = sorted((o / self.resolution_m, e / self.resolution_m))
            cuts |= {
                (n * self.resolution_m - o) / (e - o)
                for n in range(math.ceil(lowest), math.floor(highest) + 1)
                if e != o
            }
        shares = sorted(share for share in cuts if 0.0 <= share <= 1.0)
        middles = [(a + b) / 2 for a, b in itertools.pairwise(shares) if b - a > 1e-12]
        keys = [self._at(origin, end, share) for share in middles]
        return [key for key in keys if key != self.key(end)]

    def _at(self, origin: Point, end: Point, share: float) -> Key:
        x, y, z = (o + share * (e - o) for o, e in zip(origin, end, strict=True))
        return self.key((x, y, z))

    def _centre(self, key: Key) -> Point:
        x, y, z = ((k + 0.5) * self.resolution_m for k in key)
        return x, y, z


def _log_odds(probability: float) -> float:
    return math.log(probability / (1.0 - probability))
