"""Single ranges of distance sensors, as MAVLink and both autopilots number their directions; messages as frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple

from mapping.sensor_frames import RangeFrame

Direction = tuple[float, float]
"""(bearing clockwise from the nose or from north, elevation), rad"""
Axes = Literal["body", "level", "north"]
"""Directions tilt with the vehicle; or lie in the horizontal plane, from the nose; or there from north."""

NORTH_ALIGNED = 0
"""MAV_FRAME_GLOBAL: the first sector points north, not ahead."""
_UNKNOWN_CM = 65535
_INVALID_SIGNAL = 1
_UP, _DOWN = 24, 25
_LEVEL = {number: math.radians(45.0 * number) for number in range(8)}
"""MAV_SENSOR_ROTATION_YAW_*, clockwise from the nose."""

LEAST_BEAM_RAD = math.radians(5.0)
"""Of a sensor that does not say how wide it looks."""


class Limits(NamedTuple):
    """What is nearer or farther is not measured."""

    nearest_m: float
    farthest_m: float


class Scan(NamedTuple):
    beams: list[tuple[float, float, float]]
    """(bearing, elevation, range) of what was hit"""
    looks_rad: list[float]
    """Bearings of all level directions that were measured in, hit or not."""
    beam_rad: float
    limits: Limits
    axes: Axes


class RangeReader:
    """Of one vehicle; counts the frames of each of its sensors."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def on_message(
        self, message: Any, *, heading_rad: float | None, t_mono_s: float, t_utc_s: float
    ) -> RangeFrame | None:
        """None for any other message, and for one that cannot be understood. All directions count as level."""
        source, scan = sensor_of(message), scan_of(message)
        scan = None if scan is None else from_nose(scan, heading_rad)
        if source is None or scan is None:
            return None
        number = self._numbers[source] = self._numbers.get(source, -1) + 1
        bearing, elevation, range_m = zip(*scan.beams, strict=True) if scan.beams else ((), (), ())
        looks = tuple(scan.looks_rad)
        return RangeFrame(
            t_mono_s, t_utc_s, number, source, bearing, elevation, range_m, looks, scan.beam_rad, *scan.limits
        )


def sensor_of(message: Any) -> str | None:
    """Its name; None for any other message."""
    kind = message.get_type()
    if kind not in _READERS:
        return None
    return f"{kind} {message.get_srcComponent()}" + (f"/{message.id}" if kind == "DISTANCE_SENSOR" else "")


def scan_of(message: Any) -> Scan | None:
    """None for any other message, and for one that is not valid or cannot be understood."""
    reader = _READERS.get(message.get_type())
    return None if reader is None else reader(message)


def from_nose(scan: Scan, heading_rad: float | None) -> Scan | None:
    """Directions from north as directions from the nose; None where nobody knows its heading."""
    if scan.axes != "north":
        return scan
    if heading_rad is None:
        return None
    beams = [((bearing - heading_rad) % math.tau, elevation, range_m) for bearing, elevation, range_m in scan.beams]
    looks = [(bearing - heading_rad) % math.tau for bearing in scan.looks_rad]
    return scan._replace(beams=beams, looks_rad=looks, axes="level")


def single_range(range_m: float, limits: Limits, direction: Direction, fov_rad: float) -> Scan:
    """Of a sensor that looks one way; out of its limits nothing was hit, and nearer than them nothing was seen."""
    hit = limits.nearest_m <= range_m <= limits.farthest_m
    looks = [direction[0]] if direction[1] == 0.0 and range_m >= limits.nearest_m else []
    return Scan([(*direction, range_m)] if hit else [], looks, max(fov_rad, LEAST_BEAM_RAD), limits, "body")


def sector_ranges(
    distances_cm: Iterable[int], limits: Limits, *, offset_deg: float, step_deg: float, from_north: bool
) -> Scan | None:
    """Of OBSTACLE_DISTANCE: beyond the largest distance there is nothing. None where the sectors make no sense."""
    if not (math.isfinite(step_deg) and step_deg != 0.0 and math.isfinite(offset_deg)):
        return None
    measured = [
        (math.radians(offset_deg + number * step_deg) % math.tau, distance_cm / 100.0)
        for number, distance_cm in enumerate(distances_cm)
        if distance_cm != _UNKNOWN_CM
    ]
    hits = [(bearing, 0.0, range_m) for bearing, range_m in measured if range_m <= limits.farthest_m]
    looks, axes = [bearing for bearing, _ in measured], "north" if from_north else "level"
    return Scan(hits, looks, math.radians(abs(step_deg)), limits, axes)


def direction_of(orientation: int) -> Direction | None:
    """Of a MAV_SENSOR_ORIENTATION; None for mountings that are askew."""
    if orientation in _LEVEL:
        return _LEVEL[orientation], 0.0
    return {_UP: (0.0, math.pi / 2), _DOWN: (0.0, -math.pi / 2)}.get(orientation)


def _obstacle_distance(message: Any) -> Scan | None:
    return sector_ranges(
        message.distances,
        _limits(message),
        offset_deg=message.angle_offset,
        step_deg=message.increment_f or float(message.increment),
        from_north=message.frame == NORTH_ALIGNED,
    )


def _distance_sensor(message: Any) -> Scan | None:
    direction = direction_of(message.orientation)
    if direction is None or message.signal_quality == _INVALID_SIGNAL:
        return None
    return single_range(message.current_distance / 100.0, _limits(message), direction, message.horizontal_fov)


def _limits(message: Any) -> Limits:
    return Limits(message.min_distance / 100.0, message.max_distance / 100.0)


_READERS: dict[str, Callable[[Any], Scan | None]] = {
    "OBSTACLE_DISTANCE": _obstacle_distance,
    "DISTANCE_SENSOR": _distance_sensor,
}
