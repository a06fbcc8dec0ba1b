"""Where the live vehicle is, what it flies and what is seen around it: as ways past obstacles are sought for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_watch import Watch
from server.obstacles.rest_of_plan import Underway
from server.scene.mirror import Voxels
from telemetry.topics.obstacles import SENSORS, ObstacleAlert


def seen_maps(watch: Watch) -> tuple[Voxels, ...]:
    """What each sensor has seen. They may be large: for a thread."""
    mirrors = [watch.mirrors[sensor] for sensor in SENSORS]
    return tuple(mirror.voxels() for mirror in mirrors if mirror.origin is not None)


def maps_revision(watch: Watch) -> tuple[tuple[str, int, int], ...]:
    """Another one: a map is another. Known without looking into them."""
    mirrors = [watch.mirrors[sensor] for sensor in SENSORS]
    return tuple((mirror.sensor, mirror.generation, mirror.revision) for mirror in mirrors if mirror.origin is not None)


def is_same_seen(one: Sequence[Voxels], other: Sequence[Voxels]) -> bool:
    """Whether both hold the same things that the surface model does not explain. They may be large: for a thread."""
    return len(one) == len(other) and all(
        (a.sensor, a.origin, a.resolution_m) == (b.sensor, b.origin, b.resolution_m)
        and np.array_equal(a.keys[~a.explained], b.keys[~b.explained])
        for a, b in zip(one, other, strict=True)
    )


class Surroundings:
    def __init__(self, library: Library, aboard: Aboard, live: Channel, watch: Watch, tracks: TracksWatch) -> None:
        self._library, self._aboard, self._tracks = library, aboard, tracks
        self.live, self.watch = live, watch

    @property
    def underway(self) -> Underway | None:
        record, state = self._aboard.record, self.live.state
        return None if record is None or state is None else Underway(record, self.live.flight, state)

    def situation(self, standing: ObstacleAlert | None = None, moving: ObstacleAlert | None = None) -> Situation | None:
        """None without a vehicle, its plan, or the surface model of that. Maps may be large: for a thread."""
        record, state = self._aboard.record, self.live.state
        if record is None or state is None:
            return None
        terrain = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
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
            seen_maps(watch),
            watch.settings.vehicle_radius_m,
            ceiling_m=watch.settings.climb_ceiling_m,
            radar_high_deg=watch.settings.radar_high_deg,
            approach=moving,
            tracks=tracks,
            safety_radius_m=watch.settings.safety_radius_m,
        )
