"""What was seen, on the stage: maps by their chunks, and above them what happens now.

Each has a canvas of its own, drawn from a thread: vehicles wait for none of it, and neither waits for the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry.canvas import Canvas, Node
from server.scene.geometry.enu import EnuPlacing
from server.scene.geometry.stage import Drawing
from server.scene.layers.region_layers import Route, conflict_nodes, region_nodes, route_nodes
from server.scene.layers.track_layer import track_nodes
from server.scene.layers.voxel_layers import chunk_nodes, chunk_place, cloud_nodes, sent_bytes
from server.scene.mirror import ChunkKey, Voxels
from server.schemas import Source
from telemetry.topics.looks import CloudLook
from telemetry.topics.obstacles import MapName, MapOrigin, PerceptionStatus, Sensor
from telemetry.topics.tracks import TracksStatus


@dataclass(frozen=True, slots=True)
class MapLook:
    """All on which the picture of a map depends, but for its voxels."""

    drawing: Drawing
    origin: MapOrigin
    with_ground: bool
    visible: bool

    def same(self, other: MapLook | None) -> bool:
        return (
            other is not None
            and self.drawing.dsm is other.drawing.dsm
            and self.drawing.frame == other.drawing.frame
            and (self.origin, self.with_ground, self.visible) == (other.origin, other.with_ground, other.visible)
        )


class Sights:
    """``draw_chunks`` is for one thread, ``draw_now`` and ``draw_cloud`` for another, the rest for the event loop."""

    def __init__(self, server: viser.ViserServer, moving: Canvas) -> None:
        """``moving``: a canvas that nobody else draws on, for what happens now."""
        self._server, self._moving = server, moving
        self._maps = Canvas(server)
        self._moving_nodes: tuple[Node, ...] = ()
        self._nodes: dict[str, list[Node]] = {}
        self._drawing: Drawing | None = None
        self._placing: EnuPlacing | None = None
        self._shown: set[str] = set()
        self._now: tuple[object, ...] = ()
        self._cloud: tuple[object, ...] = ("", None, None)

    @property
    def dsm(self) -> Dsm | None:
        return None if self._drawing is None else self._drawing.dsm

    @property
    def moving(self) -> tuple[Node, ...]:
        """What ``draw_now`` and ``draw_cloud`` have drawn."""
        return self._moving_nodes

    def redraw(self, drawing: Drawing | None) -> None:
        """Another model, frame or choice of layers; what moves is drawn again at the next turn."""
        self._drawing = drawing

    def look(self, name: MapName, origin: MapOrigin | None) -> MapLook | None:
        """None while there is nothing to draw a map on."""
        if self._drawing is None or origin is None:
            return None
        view = self._drawing.state.view
        visible = {"radar": view.show_radar_map, "vision_flight": view.show_vision_flight}.get(
            name, view.show_vision_map
        )
        return MapLook(self._drawing, origin, view.show_explained, visible)

    def draw_now(
        self,
        source: Source,
        origin: MapOrigin | None,
        statuses: Mapping[Sensor, PerceptionStatus],
        routes: Sequence[Route],
        tracks: TracksStatus | None = None,
    ) -> None:
        """Regions, conflicts, manoeuvres and moving objects, ten times a second. Up to 20 ms where many move."""
        drawing = self._drawing
        placing = self._place(drawing, origin)
        key = (drawing, placing, tracks, *statuses.values(), *routes)
        if len(key) == len(self._now) and all(a is b for a, b in zip(key, self._now, strict=True)):
            return
        self._now = key
        drawn: dict[str, list[Node]] = {}
        if drawing is not None and placing is not None:
            prefix = f"/now_{source}"
            drawn = {
                f"regions_{source}": region_nodes(drawing, placing, statuses, prefix=prefix),
                f"conflicts_{source}": conflict_nodes(drawing, placing, statuses, prefix=prefix),
                f"routes_{source}": route_nodes(drawing, placing, routes, prefix=prefix),
                f"tracks_{source}": track_nodes(drawing, placing, tracks, prefix=prefix),
            }
        gone = self._shown - {layer for layer, nodes in drawn.items() if nodes}
        self._shown = {layer for layer, nodes in drawn.items() if nodes}
        changed = {layer: drawn.get(layer, []) for layer in self._shown | gone}
        if changed:
            self._draw_moving(changed)

    def draw_cloud(self, source: Source, look: CloudLook | None) -> None:
        """The camera's newest points; nothing travels while the layer is off."""
        drawing = self._drawing
        wanted = look if drawing is not None and drawing.state.view.show_cloud else None
        key = (source, wanted, drawing if wanted is not None else None)
        if key[0] == self._cloud[0] and all(a is b for a, b in zip(key[1:], self._cloud[1:], strict=True)):
            return
        self._cloud = key
        placing = None if wanted is None else self._place(drawing, wanted.origin)
        nodes: list[Node] = []
        if drawing is not None and placing is not None:
            nodes = cloud_nodes(drawing, placing, wanted, prefix=f"/now_{source}")
        self._draw_moving({"cloud": nodes})

    def _draw_moving(self, layers: Mapping[str, list[Node]]) -> None:
        self._moving.draw(layers)
        self._moving_nodes = tuple(self._moving.nodes)

    def ground_up_m(self, origin: MapOrigin, enu_m: F64) -> F64:
        """(N, 3) places -> (N,) up of the surface model there, above home; NaN where it is unknown."""
        dsm = self.dsm
        placing = None if dsm is None else EnuPlacing.of(dsm, origin)
        if dsm is None or placing is None:
            return np.full(len(enu_m), np.nan)
        return dsm.elevation_at(placing.model_from_enu(enu_m)[:, :2]) - placing.home_alt_dsm_m

    def draw_chunks(self, name: MapName, look: MapLook, chunks: Mapping[ChunkKey, Voxels | None]) -> int:
        """None: the chunk is empty. Returns how many bytes it comes to for one page. Heavy: for a thread."""
        placing = EnuPlacing.of(look.drawing.dsm, look.origin)
        if placing is None:
            return 0
        sent = 0
        for key, voxels in chunks.items():
            chunk = chunk_name(name, key)
            nodes: list[Node] = []
            if voxels is not None and look.visible:
                place = chunk_place(look.drawing, placing, key)
                nodes = chunk_nodes(chunk, name, key, voxels, place, with_ground=look.with_ground)
            sent += sent_bytes(self._nodes.get(chunk, []), nodes)
            self._draw(chunk, nodes)
        return sent

    def drop_chunks(self, name: MapName) -> None:
        """All of the map: another one takes its place. For the thread that draws."""
        for chunk in [chunk for chunk in self._nodes if chunk.startswith(f"/map_{name}/")]:
            self._draw(chunk, [])

    def _draw(self, name: str, nodes: list[Node]) -> None:
        with self._server.atomic():
            self._maps.put(name, nodes)
        if nodes:
            self._nodes[name] = nodes
        else:
            self._nodes.pop(name, None)

    def _place(self, drawing: Drawing | None, origin: MapOrigin | None) -> EnuPlacing | None:
        if drawing is None or origin is None:
            return None
        dsm = drawing.dsm
        if self._placing is None or self._placing.dsm is not dsm or self._placing.origin != origin:
            self._placing = EnuPlacing.of(dsm, origin)
        return self._placing


def chunk_name(name: MapName, key: ChunkKey) -> str:
    return f"/map_{name}/{key[0]}_{key[1]}_{key[2]}"
