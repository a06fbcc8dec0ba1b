"""Sidestep: the velocity proposed against a moving object, flown level, then back onto the mission's line.

The velocity comes from the velocity obstacles (Wessendorp 2021); here it becomes a way that keeps clear of all that
stands still, and whose way back does not lead into the object after all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from planning.evading.keep_clear import Room, Seen, Surface
from planning.evading.line_ahead import LineAhead
from planning.evading.way_past import AvoidanceParams, NoWay

AHEAD_M = (4.0, 8.0, 16.0, 32.0)
"""Along the line from beside the end of the sidestep to where the line is joined again."""
STANDS_M_S = 0.3
"""A slower proposal means: stay here."""
ENOUGH_SHARE = 0.8
"""Of what is to be kept: the object goes on while the proposal is on its way here."""
BRAKE_M_S2, SPARE_S = 2.5, 0.5
"""It slows down towards the end of a leg: that is put so much farther away that all objects have passed by then. Of
150 encounters flown so, a third came nearer than was told where the end lay at the closest approach."""
HOLD_TIMES = (1.0, 1.5, 2.0, 3.0)
"""The proposed velocity leads into nothing while it is flown; who stops may be run into. So it is held longer then."""
AFTER_S = 10.0
"""So long after its end it must still keep clear; later there would be another alert."""
BEYOND_M = 20.0
_LOOK_S, _LOOK_M = 0.2, 1.0


@dataclass(frozen=True, slots=True)
class Mover:
    """A moving object, expected to go on as it does."""

    enu_m: tuple[float, float]
    velocity_enu_m_s: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Proposed:
    """What was proposed, and what it is to be kept clear of."""

    velocity_enu_m_s: tuple[float, float]
    hold_s: float
    movers: tuple[Mover, ...]
    keep_m: float
    """From moving objects, between middles, in the plane."""
    back_m_s: float
    """Speed of the way back."""


@dataclass(frozen=True, slots=True)
class Sidestep:
    points_enu_m: F64
    """(M, 3) the vehicle, the end of the sidestep, and where there is a way back its end on the line or above it."""
    speeds_m_s: tuple[float, ...]
    """(M - 1,) of each leg."""
    wait_s: float
    """At the end of the sidestep: of one that is no more than staying here."""
    leg: int | None
    """Of the line ahead, on which the last point lies; None: it is held there."""
    seen_m: float
    surface_m: float
    """Smallest distances, as of ``Manoeuvre``."""
    moving_m: float
    """The same to the moving objects, if they go on as they do; in the plane, and ``AFTER_S`` longer."""
    length_m: float


def sidestep(
    position_enu_m: ArrayLike,
    line_enu_m: ArrayLike | None,
    proposed: Proposed,
    seen: Sequence[Seen],
    surface: Surface | None = None,
    params: AvoidanceParams | None = None,
) -> Sidestep | NoWay:
    """``position_enu_m`` (3,), ``line_enu_m`` (K, 3) the mission ahead or None, ``seen`` unexplained voxels. Pure.

    Without a mission, or without a way back that keeps clear, the vehicle holds at the end of the sidestep.
    """
    params = params or AvoidanceParams()
    position = np.asarray(position_enu_m, np.float64).reshape(3)
    velocity = np.array([*proposed.velocity_enu_m_s, 0.0])
    speed_m_s = float(np.linalg.norm(velocity))
    if not (np.isfinite(position).all() and np.isfinite([speed_m_s, proposed.hold_s]).all()):
        return NoWay("sidestep", "The vehicle's position or the proposed velocity is unknown.")
    stays_m = 0.0
    slows_s = 0.0 if speed_m_s < STANDS_M_S else speed_m_s / (2 * BRAKE_M_S2) + SPARE_S
    for times in HOLD_TIMES:
        held = replace(proposed, hold_s=times * proposed.hold_s + slows_s)
        way = _way(position, velocity, held, line_enu_m, seen, surface, params)
        if isinstance(way, NoWay):
            # No room to slow down behind the closest approach: then at it, rather than not at all.
            short = _way(position, velocity, proposed, line_enu_m, seen, surface, params)
            return short if isinstance(short, Sidestep) else way
        if isinstance(way, Sidestep):
            return way
        stays_m = max(stays_m, way)
    return NoWay("sidestep", f"At its end it keeps only {stays_m:.1f} m from what moves.")


def _way(
    position: F64,
    velocity: F64,
    proposed: Proposed,
    line_enu_m: ArrayLike | None,
    seen: Sequence[Seen],
    surface: Surface | None,
    params: AvoidanceParams,
) -> Sidestep | NoWay | float:
    """How near what moves would come, where the vehicle can neither stay at the end nor find a way back from it."""
    speed_m_s = float(np.linalg.norm(velocity))
    stays = speed_m_s < STANDS_M_S
    out = position if stays else position + velocity * proposed.hold_s
    if np.linalg.norm(out - position) > params.ahead_m:
        return NoWay("sidestep", f"It would lead {np.linalg.norm(out - position):.0f} m away.")
    line = _line(line_enu_m, params)
    reach = np.vstack([position, out] if line is None else [position, out, line.between(0.0, line.length_m)])
    room = Room(reach, params.keep_m + BEYOND_M, seen, surface)
    here = np.vstack([position, position])
    keep_m = min(params.keep_m, room.seen_m(here), room.surface_m(here))
    if keep_m < params.radius_m:
        return NoWay("sidestep", f"The vehicle is only {keep_m:.1f} m from what was seen.")
    first = np.vstack([position, out])
    if not room.is_clear(first, keep_m):
        return NoWay("sidestep", _why_not(room, first))
    wait_s = proposed.hold_s if stays else 0.0
    speeds = (proposed.back_m_s if stays else speed_m_s, proposed.back_m_s)
    first_m = _moving_m(first, speeds, wait_s, proposed.movers)
    now_m = _moving_m(here, speeds, 0.0, proposed.movers)
    enough_m = ENOUGH_SHARE * min(proposed.keep_m, now_m)
    if first_m < enough_m:
        return NoWay("sidestep", f"The proposed velocity keeps only {first_m:.1f} m from what moves by now.")
    least_m = min(proposed.keep_m, first_m)
    for back, leg in _ways_back(first, line):
        points, on = np.vstack([first, back[:1]]), np.vstack([first, back])
        moving_m = _moving_m(on, (*speeds, proposed.back_m_s), wait_s, proposed.movers, ends=2)
        if moving_m >= least_m and room.is_clear(np.vstack([first[1:], back]), keep_m):
            return _made(points, speeds, wait_s, leg, room, moving_m)
    held_m = _moving_m(first, speeds, wait_s, proposed.movers, ends=1)
    return held_m if held_m < enough_m else _made(first, speeds[:1], wait_s, None, room, held_m)


def _line(line_enu_m: ArrayLike | None, params: AvoidanceParams) -> LineAhead | None:
    if line_enu_m is None:
        return None
    line = LineAhead(np.asarray(line_enu_m, np.float64), params.ahead_m)
    return line if len(line.points_m) > 1 and np.isfinite(line.points_m).all() else None


def _ways_back(first: F64, line: LineAhead | None) -> Iterator[tuple[F64, int]]:
    """Each the place where the line is joined, never lower than the vehicle is, and the waypoint after it."""
    if line is None:
        return
    places = np.arange(0.0, line.length_m + _LOOK_M, _LOOK_M).clip(max=line.length_m)
    away_m = [np.linalg.norm(line.at(along_m)[:2] - first[1, :2]) for along_m in places]
    beside_m = float(places[int(np.argmin(away_m))])
    joins = [beside_m + ahead_m for ahead_m in AHEAD_M if beside_m + ahead_m < line.length_m] or [line.length_m]
    for along_m in joins:
        there = line.at(along_m)
        there = np.array([there[0], there[1], max(there[2], first[1, 2])])
        yield np.vstack([there, line.after(along_m)]), line.leg_at(along_m)


def _moving_m(
    points: F64,
    speeds_m_s: tuple[float, ...],
    wait_s: float,
    movers: tuple[Mover, ...],
    *,
    ends: int | None = None,
) -> float:
    """Smallest distance in the plane, the vehicle on its way and each object on its own.

    ``ends``: the point at which the way ends, and ``AFTER_S`` begin. At the last point of all the vehicle stays.
    """
    if not movers:
        return np.inf
    lengths_m = np.linalg.norm(np.diff(points, axis=0), axis=1)
    took_s = [length_m / speed_m_s for length_m, speed_m_s in zip(lengths_m, speeds_m_s, strict=False)]
    took_s[0] += wait_s
    at_s = np.concatenate([[0.0], np.cumsum(took_s)])
    until_s = at_s[-1] if ends is None else at_s[ends] + AFTER_S
    if ends is not None and ends + 1 < len(points):
        until_s = min(until_s, at_s[-1])  # what follows that leg of the mission is not looked at
    t_s = np.arange(0.0, until_s + _LOOK_S, _LOOK_S)
    # Staying takes its time at one place: there the leg's length is 0 and its time is not.
    own = np.column_stack([np.interp(t_s, at_s, points[:, k]) for k in (0, 1)])
    away_m = [
        np.linalg.norm(own - (np.array(m.enu_m) + t_s[:, None] * np.array(m.velocity_enu_m_s)), axis=1) for m in movers
    ]
    return float(np.min(away_m))


def _made(
    points: F64, speeds: tuple[float, ...], wait_s: float, leg: int | None, room: Room, moving_m: float
) -> Sidestep:
    return Sidestep(
        points_enu_m=points,
        speeds_m_s=speeds,
        wait_s=wait_s,
        leg=leg,
        seen_m=room.seen_m(points),
        surface_m=room.surface_m(points),
        moving_m=moving_m,
        length_m=length_m(points),
    )


def _why_not(room: Room, first: F64) -> str:
    ground_m, seen_m = room.surface_m(first), room.seen_m(first)
    what = "the ground" if ground_m < seen_m else "what was seen"
    return f"The proposed velocity leads within {min(ground_m, seen_m):.1f} m of {what}."
