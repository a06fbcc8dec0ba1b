"""The ODA data set's optitrack.csv: where a motion capture system saw the vehicle, 80 times a second.

A row is time in ns, x, y and z in metres with y up, and a quaternion of which the real part comes first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from mapping.errors import ParameterError, RadarDataError
from mapping.geometry.arrays import F64

Forward = Literal["x", "z", "-x", "-z"]
_FORWARD = {"x": (1.0, 0.0, 0.0), "z": (0.0, 0.0, 1.0), "-x": (-1.0, 0.0, 0.0), "-z": (0.0, 0.0, -1.0)}
_COLUMNS, _FEWEST = 8, 3
_MOST_COLUMNS = 64
"""A capture may hold more than it is read for; a row of the radar's samples holds thousands of values."""
_HALF_WINDOW_S = 0.1
"""To both sides: over so long a velocity is taken."""


@dataclass(frozen=True, slots=True)
class Capture:
    """East is the capture's x, north its -z."""

    t_s: F64
    """(N,) Since its first row."""
    position_en_m: F64
    """(N, 2)"""
    forward_en: F64
    """(N, 2) The nose's direction over ground; of any length."""

    def covers(self, t_s: float) -> bool:
        return bool(self.t_s[0] + _HALF_WINDOW_S <= t_s <= self.t_s[-1] - _HALF_WINDOW_S)

    def position_at(self, t_s: float) -> F64:
        return _between(t_s, self.t_s, self.position_en_m)

    def velocity_at(self, t_s: float) -> F64:
        return (self.position_at(t_s + _HALF_WINDOW_S) - self.position_at(t_s - _HALF_WINDOW_S)) / (2 * _HALF_WINDOW_S)

    def heading_at(self, t_s: float) -> float:
        """Clockwise from north."""
        east, north = _between(t_s, self.t_s, self.forward_en)
        return math.atan2(east, north)


def read_optitrack(path: Path, *, forward: Forward = "x") -> Capture:
    """``forward``: which of the captured body's axes is its nose. Raises RadarDataError, ParameterError, OSError."""
    if forward not in get_args(Forward):
        raise ParameterError(f'There is no axis "{forward}".', where="forward", advice="Choose x, z, -x or -z.")
    rows = _rows(path)
    position_en_m = np.column_stack([rows[:, 1], -rows[:, 3]])
    nose = _turned(rows[:, 4:8], np.array(_FORWARD[forward]))
    return Capture((rows[:, 0] - rows[0, 0]) * 1e-9, position_en_m, np.column_stack([nose[:, 0], -nose[:, 2]]))


def _rows(path: Path) -> F64:
    rows: list[list[float]] = []
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            fields = line.strip().rstrip(",").split(",")
            if fields == [""]:
                continue
            values = _numbers(fields)
            if values is None and number == 1:
                continue
            where = f"{path.name}, line {number}"
            if len(fields) > _MOST_COLUMNS:
                what = f"A row of {len(fields):,} values is none of a capture."
                advice = "These look like the radar's samples: radar.csv comes first, optitrack.csv second."
                raise RadarDataError(what, where=where, advice=advice)
            if values is None or len(values) < _COLUMNS or not all(map(math.isfinite, values[:_COLUMNS])):
                advice = "A row is time in ns, x, y, z in metres and a quaternion."
                raise RadarDataError(f"There are no {_COLUMNS} numbers.", where=where, advice=advice)
            if rows and values[0] <= rows[-1][0]:
                what = f"The time, {values[0]:.0f} ns, is not after the one before, {rows[-1][0]:.0f} ns."
                raise RadarDataError(what, where=where, advice="The first column holds nanoseconds that rise.")
            if math.hypot(*values[4:_COLUMNS]) < 0.5:
                raise RadarDataError("The quaternion is none.", where=where, advice="Leave out rows without attitude.")
            rows.append(values[:_COLUMNS])
    if len(rows) < _FEWEST:
        raise RadarDataError(f"There are {len(rows)} rows in it.", where=path.name, advice="Record it again.")
    return np.array(rows)


def _numbers(fields: list[str]) -> list[float] | None:
    try:
        return [float(field) for field in fields]
    except ValueError:
        return None


def _turned(quaternion: F64, axis: F64) -> F64:
    """(N, 3)"""
    unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    real, vector = unit[:, :1], unit[:, 1:]
    across = np.cross(vector, axis)
    return np.asarray(axis + 2 * real * across + 2 * np.cross(vector, across))


def _between(t_s: float, times_s: F64, values: F64) -> F64:
    return np.array([np.interp(t_s, times_s, column) for column in values.T])
