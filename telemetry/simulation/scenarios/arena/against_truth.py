"""A radar's frames followed and held against poles whose places are known (Wessendorp 2021, IV-B and fig. 7)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import RadarDataError
from mapping.geometry.arrays import F64
from mapping.radar.detections import Detections
from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackState
from telemetry.sensors.optitrack import Capture
from telemetry.simulation.scenarios.arena.arena_radar import Position2GoModel

NEAR_M = 1.0
"""An object nearer to a pole than this, and nearest to it, is that pole."""


class Seen(NamedTuple):
    """Right of the radar and ahead of it, in metres."""

    t_s: float
    right_m: float
    forward_m: float


class TrackError(NamedTuple):
    """Of one frame: where the pole truly was, and by how much its track missed it."""

    off_rad: float
    """Of the boresight, to either side."""
    away_m: float
    range_m: float
    """Positive: the track had it farther away."""
    bearing_rad: float
    """Positive: the track had it farther to the right."""


@dataclass(slots=True)
class Pole:
    """One that stands, and what was followed of it."""

    place_en_m: tuple[float, float]
    in_view: list[Seen] = field(default_factory=list)
    """Where it truly was, of each frame with it in view."""
    followed: list[Seen] = field(default_factory=list)
    """Where its track had it."""
    errors: list[TrackError] = field(default_factory=list)
    """One for each of ``followed``."""


@dataclass(slots=True)
class TruthComparison:
    poles: list[Pole]
    others: list[Seen] = field(default_factory=list)
    """Objects that were followed where no pole is."""
    frames: int = 0
    left_out: int = 0
    """Frames of times that the capture does not cover."""
    path_en_m: list[tuple[float, float]] = field(default_factory=list)
    frame_s: list[float] = field(default_factory=list)
    """What processing and following of each frame took, where it was measured."""


def compared(
    frames: Iterable[tuple[float, Detections]], capture: Capture, poles_en_m: F64, *, offset_s: float = 0.0
) -> TruthComparison:
    """``offset_s``: how long after the capture's first row the radar's first frame was.

    Raises RadarDataError where the times have nothing in common, or a pole stands where no radar could see it.
    """
    radar = Position2GoModel()
    tracker = Tracker(radar.errors.params())
    found = TruthComparison([Pole((float(east), float(north))) for east, north in poles_en_m])
    for t_radar_s, detections in frames:
        t_s = t_radar_s + offset_s
        if not capture.covers(t_s):
            found.left_out += 1
            continue
        position, heading_rad = capture.position_at(t_s), capture.heading_at(t_s)
        states = tracker.step(
            t_s,
            _in_view(radar, detections),
            position_enu_m=position,
            velocity_enu_m_s=capture.velocity_at(t_s),
            heading_rad=heading_rad,
        )
        found.frames += 1
        found.path_en_m.append((float(position[0]), float(position[1])))
        _note(found, radar, [s for s in states if s.confirmed and s.seen], (t_s, position, heading_rad))
    if not found.frames:
        what = f"None of the radar's {found.left_out} frames lies within the {capture.t_s[-1]:.1f} s of the capture."
        advice = "Give the time between the two files' beginnings: --offset-s."
        raise RadarDataError(what, where="times", advice=advice)
    _check_places(found, radar)
    return found


def _check_places(found: TruthComparison, radar: Position2GoModel) -> None:
    """Raises RadarDataError for a pole beyond the radar's reach from all of the way: most likely a slip."""
    path = np.array(found.path_en_m)
    for number, pole in enumerate(found.poles, start=1):
        nearest_m = float(np.hypot(*(path - pole.place_en_m).T).min())
        if nearest_m > radar.farthest_m:
            east, north = pole.place_en_m
            raise RadarDataError(
                f"Pole {number}, x {east:g} m and z {0.0 - north:g} m, is never nearer than {nearest_m:.1f} m to the "
                f"vehicle, and the radar sees {radar.farthest_m:g} m.",
                where=f"pole {number}",
                advice="Give its x and z in the capture's metres.",
            )


def _in_view(radar: Position2GoModel, found: Detections) -> F64:
    kept = radar.sees(found.range_m, found.azimuth_rad)
    return np.column_stack([found.range_m, found.azimuth_rad, found.radial_speed_m_s])[kept]


def _note(
    found: TruthComparison, radar: Position2GoModel, states: list[TrackState], where: tuple[float, F64, float]
) -> None:
    t_s, position, heading_rad = where
    places = [_from_nose(state.position_enu_m - position, heading_rad) for state in states]
    true = [_from_nose(np.array(pole.place_en_m) - position, heading_rad) for pole in found.poles]
    free = set(range(len(places)))
    for pole, at in zip(found.poles, true, strict=True):
        away_m = {k: math.dist(places[k], at) for k in free}
        nearest = min(away_m, key=lambda k: away_m[k], default=-1)
        followed = nearest >= 0 and away_m[nearest] <= NEAR_M
        if followed:
            free.discard(nearest)
        range_m, bearing_rad = np.array([math.hypot(*at)]), np.array([math.atan2(*at)])
        if not radar.sees(range_m, bearing_rad)[0]:
            continue
        pole.in_view.append(Seen(t_s, *at))
        if followed:
            place = places[nearest]
            pole.followed.append(Seen(t_s, *place))
            true_m, true_rad = float(range_m[0]), float(bearing_rad[0])
            turned_rad = math.remainder(math.atan2(*place) - true_rad, math.tau)
            pole.errors.append(TrackError(abs(true_rad), true_m, math.hypot(*place) - true_m, turned_rad))
    found.others += [Seen(t_s, *places[k]) for k in sorted(free)]


def rms(errors: ArrayLike) -> float:
    """NaN where there are none."""
    values = np.asarray(errors, np.float64)
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def _from_nose(away_en_m: F64, heading_rad: float) -> tuple[float, float]:
    """Right and forward."""
    east, north = (float(value) for value in away_en_m)
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return east * cos - north * sin, east * sin + north * cos
