"""How a vehicle drives over the UWB paper's lawn: towards each place where branches lie, from several sides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from mapping.uwb.clearing import UwbPose
from telemetry.simulation.scenarios.foliage.foliage_trials import CLEAR_SPOTS, OBSTACLES, before

SPEED_M_S, SCAN_S = 1.0, 0.1
LOOKS_ASIDE_RAD = (0.0, math.radians(30.0), math.radians(-30.0))
LOOK_FROM_M, LOOK_TO_M = (7.0, 6.5, 6.0, 5.5, 5.0, 4.5, 4.0), 3.8
MOST_STEPS_ASIDE = 4
KEEP_M = 1.2
"""So far a vehicle stays away from the middle of anything."""


def drive(waypoints_m: Sequence[tuple[float, float]]) -> list[UwbPose]:
    """At walking speed from point to point, a scan every 0.1 s, turning on the spot at 30 deg/s."""
    poses: list[UwbPose] = []
    heading_rad = 0.0
    for begin, end in itertools.pairwise(waypoints_m):
        wanted_rad = math.atan2(end[0] - begin[0], end[1] - begin[1])
        turn_rad = (wanted_rad - heading_rad + math.pi) % (2.0 * math.pi) - math.pi
        turns = math.ceil(abs(turn_rad) / math.radians(30.0 * SCAN_S))
        for k in range(turns):
            poses.append(UwbPose(len(poses) * SCAN_S, *begin, heading_rad + turn_rad * (k + 1) / turns))
        heading_rad = wanted_rad
        steps = max(1, round(math.dist(begin, end) / (SPEED_M_S * SCAN_S)))
        for k in range(1, steps + 1):
            x_m, y_m = (b + (e - b) * k / steps for b, e in zip(begin, end, strict=True))
            poses.append(UwbPose(len(poses) * SCAN_S, x_m, y_m, heading_rad))
    return poses


def lawn_drive() -> list[UwbPose]:
    """Over open ground first, then towards each clear spot and each obstacle from the lawn's middle, three ways."""
    ways = [look(xy_m, aside_rad) for aside_rad in LOOKS_ASIDE_RAD for xy_m in looked_at()]
    return drive(around_things(((-11.0, -11.0), (-5.0, -11.0), *itertools.chain.from_iterable(ways))))


def looked_at() -> list[tuple[float, float]]:
    """Where branches lie or could lie, in the order of their bearing."""
    places = [*CLEAR_SPOTS, *(before(xy_m) for _, xy_m in OBSTACLES)]
    return sorted(places, key=lambda xy_m: math.atan2(*xy_m))


def look(xy_m: tuple[float, float], aside_rad: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where a way towards a place begins and ends: from the lawn's middle, or so much aside of it."""
    bearing_rad = math.atan2(-xy_m[0], -xy_m[1]) + aside_rad
    *far, near = (
        (xy_m[0] + r * math.sin(bearing_rad), xy_m[1] + r * math.cos(bearing_rad)) for r in (*LOOK_FROM_M, LOOK_TO_M)
    )
    return next(start for start in far if all(math.dist(start, thing) > KEEP_M for thing in things_on_lawn())), near


def things_on_lawn() -> list[tuple[float, float]]:
    return [*looked_at(), *(xy_m for _, xy_m in OBSTACLES)]


def around_things(waypoints_m: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The same way, with a step aside wherever it would lead over an obstacle or branches."""
    out = list(waypoints_m)
    for _ in range(MOST_STEPS_ASIDE):
        before, out = out, [out[0]]
        for begin, end in itertools.pairwise(before):
            beside = [_aside(begin, end, xy_m) for xy_m in things_on_lawn()]
            out += [xy_m for _, xy_m in sorted(found for found in beside if found is not None)[:1]]
            out.append(end)
    return out


def _aside(
    begin: tuple[float, float], end: tuple[float, float], thing: tuple[float, float]
) -> tuple[float, tuple[float, float]] | None:
    """How far along a leg comes too near to a thing, and a point far enough beside it; None if it does not."""
    length_m = math.dist(begin, end)
    x, y = (end[0] - begin[0]) / length_m, (end[1] - begin[1]) / length_m
    east, north = thing[0] - begin[0], thing[1] - begin[1]
    along_m, beside_m = east * x + north * y, north * x - east * y
    if not 0.0 < along_m < length_m or abs(beside_m) >= KEEP_M - 0.1:
        return None
    off_m = beside_m - math.copysign(KEEP_M, beside_m)
    return along_m, (begin[0] + along_m * x - off_m * y, begin[1] + along_m * y + off_m * x)
