"""Maps on their way into the 3D view: chunk by chunk, as coarse and as often as pages can take.

Ten times a second the chunks that changed are drawn, as long as there is an allowance of bytes; then they wait. A map
of more boxes than may be drawn is drawn coarser: one box for 2 x 2 x 2 voxels, then 4 x 4 x 4, and so on.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

from server.errors import reported
from server.obstacles.manoeuvres import Manoeuvres
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_watch import Watch
from server.scene.layers.sights import MapLook, Sights
from server.scene.mirror import CHUNK_M, DETAILS, ChunkKey, MapMirror, coarser
from server.schemas import MapDrawn, Source
from server.work.bucket import Bucket
from telemetry.topics.obstacles import MAP_NAMES, MapName, MapOrigin

log = logging.getLogger("hedgehop.obstacles")

PERIOD_S = 0.1
BOXES_MAX: Mapping[MapName, int] = {"radar": 110_000, "vision": 40_000, "ranges": 10_000, "vision_flight": 40_000}
"""200,000 in all, and those of the camera's whole flight where they are shown."""
FINER_BELOW = 0.6
"""Of the limit: a map that was coarsened gets its detail back only when it fits easily."""
RATE_BYTES_S, BURST_BYTES = 400_000.0, 12_000_000.0
"""To one page, on average and at once."""
CHUNKS_PER_TURN = 24
NEAR_M, FAR_EVERY_S = 48.0, 1.0
"""What is farther from the vehicle is drawn again less often: a chunk in view of the radar changes with every frame."""
TOLD_EVERY_S = 1.0


@dataclass(slots=True)
class _Picture:
    """One map as it is drawn."""

    mirror: MapMirror | None = None
    generation: int = -1
    look: MapLook | None = None
    detail: int = 1
    waiting: dict[ChunkKey, None] = field(default_factory=dict)
    """In the order in which they changed."""
    drawn_s: dict[ChunkKey, float] = field(default_factory=dict)
    sent_bytes: int = 0


class MapDrawing:
    """``run`` draws until it is cancelled. While a replay has maps they are drawn instead of the live ones."""

    def __init__(
        self,
        stage: Sights | None,
        watches: Mapping[Source, Watch],
        manoeuvres: Manoeuvres,
        tracks: Mapping[Source, TracksWatch],
    ) -> None:
        self._stage, self._watches, self._manoeuvres, self._tracks = stage, watches, manoeuvres, tracks
        self._pictures = {name: _Picture() for name in MAP_NAMES}
        self._allowance = Bucket(RATE_BYTES_S, BURST_BYTES, time.monotonic())
        self._told_s = 0.0
        self._source: Source = "live"

    async def run(self) -> None:
        """What cannot be drawn is logged once per turn; the next turn draws again."""
        stage = self._stage
        if stage is None:
            return
        async with asyncio.TaskGroup() as group:
            group.create_task(self._draw_now(stage))
            group.create_task(self._draw_maps(stage))

    async def _draw_now(self, stage: Sights) -> None:
        """Apart from the maps: a region turns red at once."""
        while True:
            await asyncio.sleep(PERIOD_S)
            source = self._shown_source()
            watch = self._watches[source]
            routes = list(self._manoeuvres.routes) if source == "live" else []
            tracks = self._tracks[source].status
            origin = _origin(watch) or (None if tracks is None else tracks.origin)
            await asyncio.to_thread(stage.draw_now, source, origin, dict(watch.statuses), routes, tracks)
            await asyncio.to_thread(stage.draw_cloud, source, watch.fresh_cloud())

    async def _draw_maps(self, stage: Sights) -> None:
        while True:
            await asyncio.sleep(PERIOD_S)
            source = self._shown_source()
            try:
                for name in MAP_NAMES:
                    watch = self._watches[source]
                    await asyncio.to_thread(self.draw, stage, name, watch.mirrors[name], _place(watch))
            except Exception as error:
                log.warning("Drawing a map: %s", reported(error, log, "Drawing a map").what)
            self._tell(source)

    def draw(
        self,
        stage: Sights,
        name: MapName,
        mirror: MapMirror,
        vehicle_enu_m: tuple[float, float, float] | None = None,
    ) -> None:
        """One turn of one map; in a thread. What is near the vehicle comes first."""
        picture = self._pictures[name]
        look = stage.look(name, mirror.origin)
        if picture.mirror is not mirror or picture.generation != mirror.generation:
            stage.drop_chunks(name)
            picture.mirror, picture.generation = mirror, mirror.generation
            picture.waiting, picture.drawn_s, picture.look, picture.sent_bytes = {}, {}, None, 0
        dirty = mirror.taken_dirty()
        detail = fitting_detail(mirror.boxes(), BOXES_MAX[name], picture.detail)
        if look is None:
            # Whatever is drawn later is drawn whole.
            picture.look = None
            return
        if detail != picture.detail or not look.same(picture.look):
            dirty |= set(mirror.chunk_keys)
        picture.detail, picture.look = detail, look
        picture.waiting |= dict.fromkeys(dirty)
        self._draw_waiting(stage, name, mirror, picture, look, vehicle_enu_m)

    def _draw_waiting(
        self,
        stage: Sights,
        name: MapName,
        mirror: MapMirror,
        picture: _Picture,
        look: MapLook,
        vehicle_enu_m: tuple[float, float, float] | None,
    ) -> None:
        now_s = time.monotonic()
        for key in _due(picture, vehicle_enu_m, now_s)[:CHUNKS_PER_TURN]:
            if not self._allowance.left(time.monotonic()) > 0:
                return
            del picture.waiting[key]
            picture.drawn_s[key] = now_s
            voxels = mirror.chunk(key)
            drawn = None if voxels is None else coarser(voxels, picture.detail)
            sent = stage.draw_chunks(name, look, {key: drawn})
            self._allowance.spend(sent)
            picture.sent_bytes += sent

    def _shown_source(self) -> Source:
        return "replay" if _origin(self._watches["replay"]) is not None else "live"

    def _tell(self, source: Source) -> None:
        now_s = time.monotonic()
        if now_s - self._told_s >= TOLD_EVERY_S:
            self._told_s = now_s
            for each, watch in self._watches.items():
                watch.on_drawn(self.drawn() if each == source else [])

    def drawn(self) -> list[MapDrawn]:
        return [_described(name, self._pictures[name]) for name in MAP_NAMES if self._pictures[name].look]


def fitting_detail(boxes: tuple[int, ...], most: int, present: int) -> int:
    """The finest detail whose boxes may all be drawn; back to a finer one only when there is room to grow."""
    fitting = next((detail for detail, count in zip(DETAILS, boxes, strict=True) if count <= most), DETAILS[-1])
    if fitting >= present:
        return fitting
    roomy = next(
        (detail for detail, count in zip(DETAILS, boxes, strict=True) if count <= FINER_BELOW * most), DETAILS[-1]
    )
    return min(present, roomy)


def _due(picture: _Picture, vehicle_enu_m: tuple[float, float, float] | None, now_s: float) -> list[ChunkKey]:
    """Chunks near the vehicle, then those that have waited long enough, in the order in which they changed."""
    if vehicle_enu_m is None:
        return list(picture.waiting)
    near = [key for key in picture.waiting if _apart_m(key, vehicle_enu_m) < NEAR_M]
    among = set(near)
    rest = [key for key in picture.waiting if key not in among]
    return near + [key for key in rest if now_s - picture.drawn_s.get(key, -math.inf) >= FAR_EVERY_S]


def _apart_m(key: ChunkKey, place_enu_m: tuple[float, float, float]) -> float:
    return math.dist([(k + 0.5) * CHUNK_M for k in key], place_enu_m)


def _place(watch: Watch) -> tuple[float, float, float] | None:
    """Of the vehicle, in the maps' frame."""
    return next(
        (status.region.enu_m for status in watch.statuses.values() if status.region is not None and status.placed), None
    )


def _origin(watch: Watch) -> MapOrigin | None:
    """Of whatever was heard: regions are told before the first voxel."""
    origins = [status.origin for status in watch.statuses.values()]
    origins += [mirror.origin for mirror in watch.mirrors.values()]
    return next((origin for origin in origins if origin is not None), None)


def _described(name: MapName, picture: _Picture) -> MapDrawn:
    assert picture.mirror is not None
    boxes = picture.mirror.boxes()
    detail = picture.detail
    shown = picture.look is not None and picture.look.visible
    text = "" if detail == 1 else f"drawn coarser: 1 box for {detail} x {detail} x {detail} voxels"
    return MapDrawn(
        sensor=name,
        voxels=boxes[0],
        drawn=boxes[DETAILS.index(detail)] if shown else 0,
        detail=detail,
        sent_bytes=picture.sent_bytes,
        text=text,
    )
