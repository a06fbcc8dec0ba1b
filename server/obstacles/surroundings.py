"""Where the live vehicle is, what it flies and what is seen around it: as ways past obstacles are sought for."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64, I64, Bools
from mapping.geometry.frames import LocalFrame, apart_m
from mapping.perceiving.vision_perception import DIVERGED_M
from server.errors import NotReadyError
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_watch import Watch
from server.obstacles.rest_of_plan import Underway
from server.scene.mirror import Voxels
from telemetry.flight.home_watch import home_of_takeoff
from telemetry.topics.deltas import packed_keys
from telemetry.topics.obstacles import SENSORS, ObstacleAlert, Sensor

COLUMN_M = 1.0
SAME_M = 1.5
"""What is seen so near to what was seen before is the same thing: positions wander, and frames differ."""
COMES_WITHIN_S, LOOK_S = 10.0, 0.02
"""The largest map that is told comes in eight seconds."""
_UNKNOWN = "what stands in the way is not known"
_ASKED = "They are asked for; ask again."
_STARTED = "See that it is started again"
_MEANWHILE = "Until then hold, or steer clear by sight."
SEEN_BEFORE = (
    "The camera saw more near it before than its newest frame shows; that does not count. Look at Camera, flight in the"
    " 3D view, or turn the nose there and ask again."
)
SEEN_BEFORE_LOST = "Not all is known here that the camera saw before its newest frame; that does not count."
_EMPTY = "It counts again after the landing, or once you empty the maps."


async def seen_maps(watch: Watch, within_s: float | None = None) -> tuple[Voxels, ...]:
    """What each sensor has seen in this flight, of the camera its newest frame: a map that is just told is waited for.

    Raises NotReadyError where that does not come (``within_s``; None: as long as the largest takes), or was too much to
    be kept.
    """
    within_s = COMES_WITHIN_S if within_s is None else within_s
    until_s = time.monotonic() + within_s
    return tuple([voxels for sensor in SENSORS for voxels in await _seen(watch, sensor, until_s, within_s)])


async def seen_so_far(watch: Watch) -> tuple[Voxels, ...]:
    """What is known of it at once: for who must decide now, and certifies nothing."""
    return tuple([v for sensor in SENSORS for v in await asyncio.to_thread(watch.mirrors[sensor].seen_so_far)])


def are_maps_whole(watch: Watch) -> bool:
    """Whether nothing is waited for."""
    return not watch.awaited and all(watch.mirrors[sensor].is_complete for sensor in SENSORS)


async def _seen(watch: Watch, sensor: Sensor, until_s: float, within_s: float) -> tuple[Voxels, ...]:
    mirror = watch.mirrors[sensor]
    while sensor in watch.awaited or (seen := await asyncio.to_thread(mirror.seen)) is None:
        if time.monotonic() > until_s:
            raise _missing(watch, sensor, within_s)
        await asyncio.sleep(LOOK_S)
    if mirror.has_forgotten:
        what = f"The {sensor} map began anew, and not all that it had seen could be kept: {_UNKNOWN}."
        raise NotReadyError(what, where=sensor, advice=f"{_EMPTY} {_MEANWHILE}")
    return seen


def _missing(watch: Watch, sensor: Sensor, within_s: float) -> NotReadyError:
    what = f"Parts of the {sensor} map have been missing for {within_s:.0f} s"
    if watch.is_silent(sensor):
        what = f"{what}, and its node does not run: {_UNKNOWN}."
        advice = f"{_STARTED}, or empty the maps." if watch.is_disarmed else f"{_STARTED}. {_EMPTY} {_MEANWHILE}"
        return NotReadyError(what, where=sensor, advice=advice)
    advice = _ASKED if watch.is_disarmed else f"{_ASKED} {_MEANWHILE}"
    return NotReadyError(f"{what}: {_UNKNOWN}.", where=sensor, advice=advice)


def maps_revision(watch: Watch) -> tuple[int, ...]:
    """Another one: what sensors have seen may be another. Known without looking into the maps."""
    return tuple(watch.mirrors[sensor].folds for sensor in SENSORS)


def is_same_seen(one: Sequence[Voxels], other: Sequence[Voxels]) -> bool:
    """Whether both hold the same things that the surface model does not explain. They may be large: for a thread."""
    return len(one) == len(other) and all(
        (a.sensor, a.origin, a.resolution_m) == (b.sensor, b.origin, b.resolution_m)
        and np.array_equal(a.keys[~a.explained], b.keys[~b.explained])
        for a, b in zip(one, other, strict=True)
    )


def is_more_seen_near(
    before: Sequence[Voxels], now: Sequence[Voxels], line_deg: Sequence[tuple[float, float]], within_m: float
) -> bool:
    """Whether sensors see things by now farther than ``SAME_M`` from all that they had seen, and that the surface model
    does not explain, so near to a line (lat_deg, lon_deg) over ground. For a thread, as ``is_same_seen``."""
    lat_deg, lon_deg = np.array(line_deg).T
    for map_ in now:
        if (origin := map_.origin) is None:
            continue
        frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        line_m = frame.to_enu(lat_deg, lon_deg, origin.alt_amsl_m)[:, :2]
        grid = map_.sensor, origin, map_.resolution_m
        known = [packed_keys(a.keys[~a.explained]) for a in before if (a.sensor, a.origin, a.resolution_m) == grid]
        numbers = packed_keys(map_.keys[~map_.explained])
        fresh = ~_are_among(numbers, np.concatenate([np.zeros(0, np.int64), *known]))
        # Few of many: a line with many returns from it is long.
        centres = map_.centres_enu_m[~map_.explained][fresh]
        near = _are_near(centres[:, :2], line_m, within_m + map_.resolution_m)
        if near.any() and not _are_beside(centres[near], _seen_enu_m(before, frame)):
            return True
    return False


def is_more_than(maps: Sequence[Voxels], other: Sequence[Voxels]) -> bool:
    """Whether ``other`` holds things farther than ``SAME_M`` from all that ``maps`` hold, and that the surface model
    does not explain. For a thread."""
    for map_ in other:
        if (origin := map_.origin) is not None and not map_.explained.all():
            frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
            if not _are_beside(map_.centres_enu_m[~map_.explained], _seen_enu_m(maps, frame)):
                return True
    return False


async def seen_before_near(
    watch: Watch, maps: Sequence[Voxels], line_deg: Sequence[tuple[float, float]], within_m: float
) -> str | None:
    """In words, that the camera saw things on its way, so near to a line (lat_deg, lon_deg), of which ``maps`` tell
    nothing; None where it did not. They do not count: nothing is ever taken out of the map of its whole flight, neither
    a wrong match nor who walked by, and how far that map has turned or drifted without GNSS nobody measures."""
    before = await asyncio.to_thread(watch.mirrors["vision_flight"].seen_so_far)
    status = watch.statuses.get("vision")
    drift_m = max(DIVERGED_M, 0.0 if status is None else status.divergence_m or 0.0)
    if await asyncio.to_thread(is_more_seen_near, maps, before, line_deg, within_m + drift_m):
        return SEEN_BEFORE
    return SEEN_BEFORE_LOST if watch.is_lacking("vision_flight") else None


def returns_from(
    places_deg: Sequence[tuple[float, float]], ends_deg: Sequence[tuple[float, float]], within_m: float
) -> list[tuple[float, float]]:
    """A line (lat_deg, lon_deg) along places that are flown, and along straight ways from there to each of the ends: so
    many that whatever such a way passes over lies within ``within_m`` of the line."""
    line = list(places_deg[:1])
    for a, b in pairwise(places_deg):
        steps = max(1, math.ceil(apart_m(a, b) / (2.0 * max(within_m, 1.0))))
        line += [(a[0] + (b[0] - a[0]) * k / steps, a[1] + (b[1] - a[1]) * k / steps) for k in range(1, steps + 1)]
    return [*line, *(place for end in ends_deg for start in reversed(line) for place in (start, end))]


def _seen_enu_m(maps: Sequence[Voxels], frame: LocalFrame) -> F64:
    """(N, 3) centres of what the surface model does not explain, of all maps, from the origin of ``frame``."""
    seen = [np.zeros((0, 3))]
    for map_ in maps:
        if (origin := map_.origin) is not None:
            shift = frame.to_enu(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
            seen.append(map_.centres_enu_m[~map_.explained] + shift)
    return np.concatenate(seen)


def _are_beside(points_m: F64, known_m: F64) -> bool:
    """Whether each of (N, 3) lies within ``SAME_M`` of one of (M, 3)."""
    low, high = points_m.min(axis=0) - SAME_M, points_m.max(axis=0) + SAME_M
    known_m = known_m[((known_m >= low) & (known_m <= high)).all(axis=1)]
    if not len(known_m):
        return False
    from scipy.spatial import KDTree

    return bool(np.isfinite(KDTree(known_m).query(points_m, distance_upper_bound=SAME_M)[0]).all())


def _are_among(numbers: I64, known: I64) -> Bools:
    """Which are. Of millions, sorting is faster than ``np.isin``."""
    known = np.sort(known)
    at = np.searchsorted(known, numbers)
    among = at < len(known)
    among[among] = known[at[among]] == numbers[among]
    return among


def _are_near(points_m: F64, line_m: F64, within_m: float) -> Bools:
    """As ``_is_near``, up to half the diagonal of a column of ``COLUMN_M`` farther: for many, over each other."""
    places = np.floor(points_m / COLUMN_M).astype(np.int32)
    _, first, column = np.unique(packed_keys(np.pad(places, ((0, 0), (0, 1)))), return_index=True, return_inverse=True)
    middles_m = (places[first].astype(np.float64) + 0.5) * COLUMN_M
    return _is_near(middles_m, line_m, within_m + COLUMN_M * math.sqrt(0.5))[column]


def _is_near(points_m: F64, line_m: F64, within_m: float) -> Bools:
    """(N,) of (N, 2) points and a line (K, 2)."""
    near = ((points_m >= line_m.min(axis=0) - within_m) & (points_m <= line_m.max(axis=0) + within_m)).all(axis=1)
    among = points_m[near]
    left = np.arange(len(among))
    for a, b in pairwise(line_m if len(line_m) > 1 else np.vstack([line_m, line_m])):
        from_a = among[left] - a
        share = np.clip(from_a @ (b - a) / max(float((b - a) @ (b - a)), 1e-9), 0.0, 1.0)
        left = left[np.hypot(*(from_a - share[:, None] * (b - a)).T) > within_m]
    near[np.flatnonzero(near)[left]] = False
    return near


class Surroundings:
    def __init__(self, library: Library, aboard: Aboard, live: Channel, watch: Watch, tracks: TracksWatch) -> None:
        self._library, self._aboard, self._tracks = library, aboard, tracks
        self.live, self.watch = live, watch

    @property
    def underway(self) -> Underway | None:
        record, state = self._aboard.record, self.live.state
        return None if record is None or state is None else Underway(record, self.live.flight, state)

    async def situation(
        self, standing: ObstacleAlert | None = None, moving: ObstacleAlert | None = None, *, at_once: bool = False
    ) -> Situation | None:
        """None without a vehicle, its plan, or the surface model of that. ``at_once``: with what is known of the maps;
        else raises NotReadyError as ``seen_maps``."""
        maps = await (seen_so_far if at_once else seen_maps)(self.watch)
        record, state = self._aboard.record, self.live.state
        if record is None or state is None:
            return None
        flown_over = FlownOver(record.terrain_id, record.terrain_sha256)
        terrain = await asyncio.to_thread(lambda: terrain_of(flown_over, self._library.terrains()))
        if terrain is None:
            return None
        watch, tracks = self.watch, self._tracks.fresh()
        statuses = [*watch.statuses.values(), *([] if tracks is None else [tracks])]
        origin = next((status.origin for status in statuses if status.origin is not None), None)
        if origin is None:
            return None
        return Situation(
            standing,
            state,
            self.live.flight,
            watch.avoidance.height_offset_m,
            record,
            self._library.terrain_dir(terrain.id),
            origin,
            maps,
            watch.settings.vehicle_radius_m,
            ceiling_m=watch.settings.climb_ceiling_m,
            radar_high_deg=watch.settings.radar_high_deg,
            approach=moving,
            tracks=tracks,
            safety_radius_m=watch.settings.safety_radius_m,
            took_off=home_of_takeoff(self.live.track.states),
        )
