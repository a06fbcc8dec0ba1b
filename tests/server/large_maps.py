"""Large maps for the real drawing code, on a clock of their own."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
import viser

from mapping.geometry.arrays import I32
from server.obstacles import drawing
from server.obstacles.drawing import PERIOD_S, MapDrawing
from server.scene.geometry.canvas import Canvas
from server.scene.layers.sights import MapLook, Sights
from server.scene.mirror import ChunkKey, MapMirror, Voxels
from telemetry.topics.obstacles import MapDelta, MapName, MapOrigin
from tests.server.obstacle_messages import delta
from tests.server.test_obstacles_drawing import made
from tests.server.test_scene_obstacles import placed

PART_VOXELS = 20_000
QUIET_TURNS = 50


class Clock:
    """In the place of ``time``, for who draws."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s


class CountingStage(Sights):
    """A real stage, and how many boxes stand on it."""

    def __init__(self, sights: Sights) -> None:
        self._sights = sights
        self.boxes: dict[tuple[MapName, ChunkKey], int] = {}
        self.chunks_drawn = 0

    def look(self, name: MapName, origin: MapOrigin | None) -> MapLook | None:
        return self._sights.look(name, origin)

    def draw_cloud(self, source: Any, look: Any) -> None:
        raise AssertionError("maps only")

    def draw_now(self, source: Any, origin: Any, statuses: Any, routes: Any, tracks: Any = None) -> None:
        raise AssertionError("maps only")

    def draw_chunks(self, name: MapName, look: MapLook, chunks: Mapping[ChunkKey, Voxels | None]) -> int:
        for key, voxels in chunks.items():
            self.boxes[name, key] = 0 if voxels is None else len(voxels.keys)
        self.chunks_drawn += len(chunks)
        return self._sights.draw_chunks(name, look, chunks)

    def drop_chunks(self, name: MapName) -> None:
        self.boxes = {key: count for key, count in self.boxes.items() if key[0] != name}
        self._sights.drop_chunks(name)


@dataclass(frozen=True, slots=True)
class Painter:
    """Draws maps; a ``turn`` is a tenth of a second of it."""

    maps: MapDrawing
    stage: CountingStage
    clock: Clock
    origin: MapOrigin
    port: int
    """Where pages would listen."""

    def turn(self, mirror: MapMirror, place_enu_m: tuple[float, float, float] | None = None) -> None:
        self.clock.now_s += PERIOD_S
        self.maps.draw(self.stage, mirror.sensor, mirror, place_enu_m)

    def finish(self, mirror: MapMirror) -> None:
        """Until nothing has been drawn for longer than an allowance may have to be waited for."""
        quiet, drawn = 0, -1
        while quiet < QUIET_TURNS:
            quiet = quiet + 1 if drawn == self.stage.chunks_drawn else 0
            drawn = self.stage.chunks_drawn
            self.turn(mirror)

    @property
    def sent_bytes(self) -> int:
        """To one page."""
        return sum(each.sent_bytes for each in self.maps.drawn())


@contextmanager
def painting() -> Iterator[Painter]:
    """Nothing is patched but the clock."""
    with redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    clock = Clock()
    try:
        on, placing = placed()
        sights = Sights(server, Canvas(server))
        sights.redraw(on)
        stage = CountingStage(sights)
        with patch.object(drawing, "time", clock):
            yield Painter(made(), stage, clock, placing.origin, server.get_port())
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()


def hills(columns: int, *, side: int = 1000) -> I32:
    """(N, 3) keys of a rolling ground, one voxel per column, row by row."""
    row, column = np.divmod(np.arange(columns), side)
    up = 12.0 + 6.0 * np.sin(column / 37.0) + 6.0 * np.sin(row / 23.0)
    return np.column_stack([column, row, np.floor(up)]).astype(np.int32)


def told(keys: I32, origin: MapOrigin, sensor: MapName = "radar") -> list[MapDelta]:
    """In parts, as nodes tell what is new."""
    parts = np.array_split(keys, max(1, len(keys) // PART_VOXELS))
    random = np.random.default_rng(len(keys))
    return [
        delta(part, random.integers(140, 255, len(part)), sensor=sensor, origin=origin, revision=k, since=k - 1)
        for k, part in enumerate(parts, start=1)
    ]
