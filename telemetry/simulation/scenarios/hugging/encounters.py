"""What a flight among unknown objects was told of them: in time, too late, or where nothing stands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.perceiving.braking import Braking
from telemetry.simulation.scenarios.stage.result import Figure
from telemetry.simulation.scenarios.stage.seen_flight import SeenAlert, SeenFlight
from telemetry.simulation.scenarios.stage.setup import ORDER_S
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.primitives import distances
from telemetry.topics.obstacles import PerceptionSettings, Sensor

IN_THE_WAY_M = 0.5
"""An object this near to the line, or nearer, must be alarmed."""
ITS_OWN_M, ITS_OWN_RAD = 2.0, math.radians(3.5)
"""An alert is about an object when it is this near to it as seen from above: two of the radar's voxels, and, seen from
the vehicle, three sigma of its azimuth with the heading's bias."""
MOST_FALSE_PER_KM, LEAST_ALARMED = 1.0, 0.95
LOW, HIGH = 3, 4
"""Columns of a primitive's row."""


@dataclass(frozen=True, slots=True)
class Passed:
    """An object in the way, and how far away its surface was when the vehicle could first have begun to brake."""

    name: str
    at: int
    """Of the flight's places, the one where it could first have begun to brake."""
    met: int
    """Likewise, where it came to the object."""
    distance_m: float
    needed_m: float
    seen_by: tuple[Sensor, ...]
    """Before it was met."""

    @property
    def in_time(self) -> bool:
        return self.distance_m >= self.needed_m


@dataclass(frozen=True, slots=True)
class Encounters:
    """All of one flight."""

    passed: tuple[Passed, ...]
    false: tuple[SeenAlert, ...]
    false_per_km: float
    missed: int
    figures: tuple[Figure, ...]
    notes: tuple[str, ...]


def encounters(flown: SeenFlight, world: World, settings: PerceptionSettings) -> Encounters:
    passed = passings(flown, world, settings)
    false = false_alarms(flown, world)
    per_km = len(false) / (flown.way_m / 1000) if flown.way_m else math.nan
    missed = sum(not one.in_time for one in passed)
    in_time = 1 - missed / len(passed) if passed else math.nan
    figures = (
        Figure("false alarms per km", per_km, most=MOST_FALSE_PER_KM),
        Figure("share of unknown objects alarmed in time", in_time, least=LEAST_ALARMED),
    )
    flew = f"{flown.way_m:.0f} m flown, through {len(passed)} unknown objects in the way"
    notes = flew, *_words(passed, false, flown, world)
    return Encounters(tuple(passed), tuple(false), per_km, missed, figures, notes)


def passings(flown: SeenFlight, world: World, settings: PerceptionSettings) -> list[Passed]:
    """For every object that the vehicle flew into: was it told while there was room to stop?"""
    track = np.array([truth.position_enu_m for truth in flown.track])
    times = np.array([truth.t_mono_s for truth in flown.track])
    speeds = np.array([math.hypot(*truth.velocity_enu_m_s) for truth in flown.track])
    out = []
    braking = Braking(settings.brake_decel_m_s2, settings.brake_jerk_m_s3)
    for name, rows in objects_of(world).items():
        far_m = away_m(rows, track)
        if far_m.min() > IN_THE_WAY_M:
            continue
        met = int(np.argmax(far_m <= IN_THE_WAY_M))
        told: dict[Sensor, float] = {sensor: _told_s(flown, rows, sensor) + ORDER_S for sensor in flown.perceivers}
        at = min(int(np.searchsorted(times, min(told.values()))), met)
        needed_m = braking.distance_m(float(speeds[at])) + settings.vehicle_radius_m
        seen_by: tuple[Sensor, ...] = tuple(sensor for sensor, t_s in told.items() if t_s < times[met])
        out.append(Passed(name, at, met, float(far_m[at]), float(needed_m), seen_by))
    return out


def _told_s(flown: SeenFlight, rows: F64, sensor: Sensor) -> float:
    mine = (told for told in flown.told if told.alert.sensor == sensor and _is_about(told, rows))
    return min((told.alert.done_t_mono_s for told in mine), default=math.inf)


def false_alarms(flown: SeenFlight, world: World) -> list[SeenAlert]:
    """Obstacles that were told where none is."""
    begun = [told for told in flown.told if told.alert.phase == "begins" and told.place_enu_m is not None]
    return [told for told in begun if not _is_about(told, world.placed.rows)]


def _is_about(told: SeenAlert, rows: F64) -> bool:
    """Whether the alert's obstacle is one of these, as seen from above: a radar knows no heights."""
    obstacle = told.alert.obstacle
    if told.alert.phase == "ends" or told.place_enu_m is None or obstacle is None:
        return False
    return level_away_m(rows, told.place_enu_m) <= ITS_OWN_M + ITS_OWN_RAD * obstacle.distance_m


def _words(passed: list[Passed], false: list[SeenAlert], flown: SeenFlight, world: World) -> list[str]:
    return [_passed_words(one) for one in passed] + [_false_words(told, flown, world) for told in false]


def _passed_words(one: Passed) -> str:
    told = f"told {one.distance_m:.1f} m before" if one.seen_by else "never told"
    by = f" by {' and '.join(one.seen_by)}" if one.seen_by else ""
    return f"{one.name}: {told}{by}, {one.needed_m:.1f} m needed{'' if one.in_time else '  MISSED'}"


def _false_words(told: SeenAlert, flown: SeenFlight, world: World) -> str:
    """With what an engineer asks next: how far from anything, how high over the ground."""
    alert, place = told.alert, told.place_enu_m
    assert alert.obstacle is not None
    assert place is not None
    above_m = place[2] - world.ground_up_m(float(place[0]), float(place[1]))
    return (
        f"FALSE alarm of {alert.sensor} after {alert.t_mono_s - flown.began_s:.1f} s, {alert.obstacle.region}, "
        f"{alert.obstacle.distance_m:.1f} m away, {alert.obstacle.voxels} voxels, {above_m:.1f} m over the ground, "
        f"{level_away_m(world.placed.rows, place):.1f} m from the nearest object"
    )


def objects_of(world: World) -> dict[str, F64]:
    """The rows of each object's primitives, by its name; of several with one name all."""
    rows: dict[str, list[F64]] = {}
    for row, owner in zip(world.placed.rows, world.placed.owner.tolist(), strict=True):
        rows.setdefault(world.shapes[owner].name, []).append(row)
    return {name: np.array(several) for name, several in rows.items()}


def away_m(rows: F64, points_enu: F64) -> F64:
    """(N, 3) -> (N,) to the nearest of the primitives, 0 inside."""
    points = np.ascontiguousarray(points_enu, np.float64).reshape(-1, 3)
    nearest_m, index = np.empty(len(points)), np.empty(len(points), np.int32)
    distances(np.ascontiguousarray(rows), points, nearest_m, index)
    return np.maximum(nearest_m, 0.0)


def level_away_m(rows: F64, place_enu: F64) -> float:
    """As seen from above, of one place: infinite where there are no primitives."""
    found = np.inf
    for row in rows:
        middle = np.array([[place_enu[0], place_enu[1], (row[LOW] + row[HIGH]) / 2]])
        found = min(found, float(away_m(row[None], middle)[0]))
    return found
