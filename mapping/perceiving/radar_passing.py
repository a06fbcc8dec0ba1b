"""What has only passed by: a radar's map keeps all it has seen, but nothing stands where something flew through."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import F64, I32, Bools
from mapping.geometry.poses import Pose
from mapping.perceiving.radar_moved import Moved, MovedParams
from mapping.perceiving.radar_near import Column, cells, columns

Key = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class PassingParams:
    """Alarms are as ever while something passes, and for ``gone_s`` after it."""

    gone_s: float = 2.0
    """Not seen any more for so long it has gone."""
    stays_s: float = 2.0
    """What is seen for so long within one block stands there, whatever radial speed the radar says it has."""
    block_m: float = 3.0
    beside: int = 2
    """Columns to all sides of what stands that belong to it: echoes of one thing are spread so far."""
    moved: MovedParams = field(default_factory=MovedParams)
    beyond: float = 1.1
    """Times the fastest that the assumed radar tells: faster ones come from a radar that folds speeds elsewhere."""


@dataclass(slots=True, eq=False)
class _Block:
    first_s: float
    last_s: float
    columns: set[Column] = field(default_factory=set)
    keys: set[Key] = field(default_factory=set)


class Passing:
    """Remembers voxels that became believed through moving targets alone, until it is known what they are.

    A trail that stays is a nuisance, an obstacle that is taken back a crash: only what has moved as its Doppler says
    is taken back.
    """

    def __init__(self, params: PassingParams | None = None) -> None:
        self._params = params or PassingParams()
        self._moved = Moved(self._params.moved)
        self._folds_as_assumed = True
        self.clear()

    def clear(self) -> None:
        self._blocks: dict[Column, _Block] = {}
        self._standing: set[Column] = set()
        self._moved.clear()

    def look_at_speeds(self, radial_m_s: F64) -> None:
        """(N,) Of all targets of a frame: once one is faster than the assumed radar tells, nothing is taken back."""
        most = self._params.beyond * self._params.moved.folded_m_s / 2
        self._folds_as_assumed &= not np.any(np.abs(radial_m_s) > most)

    def remember(self, t_s: float, points_enu: F64, radial_m_s: F64, surplus_m_s: F64, pose: Pose) -> None:
        """Moving targets (N, 3), believed or not, with (N,) their radial speeds as measured and over ground."""
        self._moved.remember(t_s, points_enu, radial_m_s, surplus_m_s, pose)

    def observe(self, t_s: float, points_enu: F64, moving: Bools, resolution_m: float) -> tuple[I32, list[Column]]:
        """Believed targets (N, 3) of a frame, and which of them move -> voxels, and columns, of what has gone."""
        for column in columns(points_enu[~moving]):
            self._stands(column)
        self._pass(t_s, points_enu[moving], resolution_m)
        return self._taken_back(self._gone(t_s), resolution_m)

    def _gone(self, t_s: float) -> list[_Block]:
        """What else is not seen any more stands, or is not known to have moved, and stays."""
        ended: dict[Column, _Block] = {}
        for place, block in list(self._blocks.items()):
            if block.last_s - block.first_s >= self._params.stays_s:
                self._standing |= block.columns
                del self._blocks[place]
            elif t_s - block.last_s > self._params.gone_s:
                ended[place] = self._blocks.pop(place)
        gone = self._that_moved(ended) if ended else []
        kept = [block for block in ended.values() if block not in gone]
        self._standing.update(column for block in kept for column in block.columns)
        return gone

    def _that_moved(self, ended: dict[Column, _Block]) -> list[_Block]:
        if not self._folds_as_assumed:
            return []
        size, seen = self._params.block_m, self._moved.all()
        return [
            block
            for (e, n), block in ended.items()
            if self._moved.through(seen, (e * size, n * size), size, block.first_s)
        ]

    def _stands(self, column: Column) -> None:
        if column in self._standing:
            return
        reach = range(-self._params.beside, self._params.beside + 1)
        self._standing.update((column[0] + e, column[1] + n) for e in reach for n in reach)

    def _pass(self, t_s: float, points: F64, resolution_m: float) -> None:
        places = zip(*cells(points[:, :2], self._params.block_m), strict=True)
        keys = zip(*cells(points, resolution_m), strict=True)
        for column, place, key in zip(columns(points), places, keys, strict=True):
            if column in self._standing:
                continue
            block = self._blocks.get(place)
            if block is None:
                block = self._blocks[place] = _Block(t_s, t_s)
            block.last_s = t_s
            block.columns.add(column)
            block.keys.add(key)

    def _taken_back(self, gone: list[_Block], resolution_m: float) -> tuple[I32, list[Column]]:
        """But for what stands there."""
        keys = {key for block in gone for key in block.keys if _column_of(key, resolution_m) not in self._standing}
        columns = [column for block in gone for column in block.columns if column not in self._standing]
        return np.array(sorted(keys), np.int32).reshape(-1, 3), columns


def _column_of(key: Key, resolution_m: float) -> Column:
    """In which a voxel's centre lies."""
    return math.floor((key[0] + 0.5) * resolution_m), math.floor((key[1] + 0.5) * resolution_m)
