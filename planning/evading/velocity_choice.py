"""The velocity nearest to a wanted one outside of cones and inside the limits of speed and turn, found exactly.

What is left of the plane is bounded by the cones' edges, the circle of the highest speed and the two rays of the
sharpest turn. The nearest point of it is the wanted one itself, its foot on one border, or where two borders cross.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from planning.errors import ParameterError

HOVERING_M_S = 0.1
"""Slower than this there is no direction to turn from."""
ROUNDING = 1e-9
EDGE_M_S = 1e-12
"""A cone's apex lies on its edge, whatever rounding makes of it."""
CHUNK = 2048
SPEEDS, DIRECTIONS = 24, 180


@dataclass(frozen=True, slots=True)
class Limits:
    """Of the vehicle, in the plane."""

    max_speed_m_s: float = 10.0
    max_turn_rad: float = math.pi
    """From the present direction, to either side. Standing still is always allowed."""
    leave_m_s: float = 0.3
    """At which it goes away, at least, from an obstacle that is already inside its radius."""

    def __post_init__(self) -> None:
        for name in ("max_speed_m_s", "max_turn_rad", "leave_m_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"{value} is no limit.", where=name, advice="Give 0 or more.")


@dataclass(frozen=True, slots=True)
class Forbidden:
    """Cones of velocities, open: their edges are allowed."""

    apex: F64
    """(N, 2)"""
    edges: F64
    """(N, 2, 2) Directions of the left and the right one."""
    inward: F64
    """(N, 2, 2) Normals of the edges, into the cone."""

    @classmethod
    def of(cls, apex: F64, axis: F64, half_angle_rad: F64) -> Forbidden:
        """``axis`` (N, 2) unit vectors; half angles up to a right angle: the cone is where both edges are ahead."""
        cos, sin = np.cos(half_angle_rad)[:, None], np.sin(half_angle_rad)[:, None]
        left_of = np.column_stack([-axis[:, 1], axis[:, 0]])
        edges = np.stack([cos * axis + sin * left_of, cos * axis - sin * left_of], axis=1)
        inward = np.stack([sin * axis - cos * left_of, sin * axis + cos * left_of], axis=1)
        return cls(apex, edges, inward)

    def __len__(self) -> int:
        return len(self.apex)

    def some(self, which: Bools) -> Forbidden:
        return Forbidden(self.apex[which], self.edges[which], self.inward[which])

    def contains(self, velocities: F64) -> Bools:
        """(M, N) for velocities (M, 2)."""
        inside = np.ones((len(velocities), len(self)), np.bool_)
        for side in (0, 1):
            normal = self.inward[:, side]
            inside &= velocities @ normal.T > (self.apex * normal).sum(axis=1) + EDGE_M_S
        return inside


def within(wanted: F64, limits: Limits, exact: Forbidden, wide: Forbidden, *, exact_search: bool) -> F64 | None:
    """(2,) The velocity nearest to ``wanted`` (2,) that is in none of ``exact``; None where there is none.

    ``wide`` are the same cones with something to spare: on their edges it is looked for. Without ``exact_search`` it
    is one of a grid, which takes the same time however many cones there are.
    """
    found = _candidates(wanted, limits, wide) if exact_search else _grid(wanted, limits)
    found = found[_allowed(found, wanted, limits)]
    found = found[np.argsort(np.hypot(*(found - wanted).T), kind="stable")]
    for start in range(0, len(found), CHUNK):
        some = found[start : start + CHUNK]
        free = ~exact.contains(some).any(axis=1)
        if free.any():
            return some[np.argmax(free)]
    return None


def _allowed(found: F64, wanted: F64, limits: Limits) -> Bools:
    """(M,) Inside the limits, rounding aside."""
    speed = np.hypot(*found.T)
    slow = speed <= limits.max_speed_m_s
    if not _turn_counts(wanted, limits):
        return slow
    cross = wanted[0] * found[:, 1] - wanted[1] * found[:, 0]
    turn = np.abs(np.arctan2(cross, found @ wanted))
    return slow & ((turn <= limits.max_turn_rad + ROUNDING) | (speed == 0.0))


def _turn_counts(wanted: F64, limits: Limits) -> bool:
    return math.hypot(*wanted) >= HOVERING_M_S and limits.max_turn_rad < math.pi


def _candidates(wanted: F64, limits: Limits, cones: Forbidden) -> F64:
    """(M, 2) Feet on all borders and their crossings, whether allowed or not."""
    origin, towards = _rays(wanted, limits, cones)
    top_m_s = limits.max_speed_m_s * (1.0 - ROUNDING)
    speed = math.hypot(*wanted)
    on_circle = wanted * min(1.0, top_m_s / speed) if speed > 0.0 else wanted
    return np.concatenate(
        [
            np.array([wanted, on_circle, [0.0, 0.0]]),
            cones.apex,
            _feet(wanted, origin, towards),
            _on_circle(origin, towards, top_m_s),
            _crossings(origin, towards),
        ]
    )


def _rays(wanted: F64, limits: Limits, cones: Forbidden) -> tuple[F64, F64]:
    """Origins and directions (K, 2) of the cones' edges and of the sharpest turns."""
    origin, towards = np.repeat(cones.apex, 2, axis=0), cones.edges.reshape(-1, 2)
    if not _turn_counts(wanted, limits):
        return origin, towards
    angle = math.atan2(wanted[1], wanted[0]) + np.array([-limits.max_turn_rad, limits.max_turn_rad])
    turns = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([origin, np.zeros((2, 2))]), np.concatenate([towards, turns])


def _feet(wanted: F64, origin: F64, towards: F64) -> F64:
    along = ((wanted - origin) * towards).sum(axis=1)
    return (origin + along[:, None] * towards)[along > 0.0]


def _on_circle(origin: F64, towards: F64, top_m_s: float) -> F64:
    """Where rays cross the circle of the highest speed."""
    half = (origin * towards).sum(axis=1)
    under = half * half - (origin * origin).sum(axis=1) + top_m_s * top_m_s
    root = np.sqrt(np.maximum(under, 0.0))
    out = []
    for along in (-half - root, -half + root):
        out.append((origin + along[:, None] * towards)[(under >= 0.0) & (along > 0.0)])
    return np.concatenate(out)


def _crossings(origin: F64, towards: F64) -> F64:
    """Of each ray with each other one."""
    first, second = np.triu_indices(len(origin), 1)
    cross = towards[first, 0] * towards[second, 1] - towards[first, 1] * towards[second, 0]
    off = origin[second] - origin[first]
    meets = np.abs(cross) > ROUNDING
    safe = np.where(meets, cross, 1.0)
    along = (off[:, 0] * towards[second, 1] - off[:, 1] * towards[second, 0]) / safe
    other = (off[:, 0] * towards[first, 1] - off[:, 1] * towards[first, 0]) / safe
    meets &= (along >= 0.0) & (other >= 0.0)
    return origin[first][meets] + along[meets, None] * towards[first][meets]


def _grid(wanted: F64, limits: Limits) -> F64:
    """Speeds and directions from the wanted one on, and standing still."""
    angle = math.atan2(wanted[1], wanted[0]) + np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    speed = limits.max_speed_m_s * (1.0 - ROUNDING) * np.arange(SPEEDS + 1) / SPEEDS
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([wanted[None], (speed[:, None, None] * directions[None]).reshape(-1, 2)])
