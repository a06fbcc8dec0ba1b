"""The 3D view: draws what changed, moves cameras, and turns clicks and drags into intents.

Runs on the application's event loop; viser's callbacks, which come from viser's own thread, only hand over to it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, Protocol

import numpy as np
import viser

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.cameras.cameras import CAMERAS_EVERY_S, Cameras, lens_of, move, planes
from server.scene.cameras.picking import MarkHit, PlaceHit, pick
from server.scene.cameras.projection import FOV_RAD, nearest_on_path
from server.scene.cameras.shots import Target, shot
from server.scene.geometry.canvas import Canvas, Node
from server.scene.geometry.payload import SceneState
from server.scene.geometry.stage import Drawing
from server.scene.host import SceneHost
from server.scene.layers.layers import MARKS, Key, layers, unchanged
from server.scene.layers.mark_layers import cursor_nodes
from server.scene.layers.sights import Sights
from server.scene.layers.traffic_layer import TrafficStage
from server.scene.layers.vehicles import Vehicles

_POINTER_REACH_PX = 24.0
_SHOTS_DUE_MAX = 100


class Hands(Protocol):
    """Who hears of clicks and drags: ``server.workspace.Workspace``, which owns the view."""

    async def on_terrain_click(self, lat_deg: float, lon_deg: float, known: bool) -> None: ...

    async def on_mark_click(self, mark: str) -> None: ...

    async def on_mark_moved(self, mark: str, lat_deg: float, lon_deg: float) -> None: ...


class SceneView:
    """One scene for all pages; each page has its own camera."""

    def __init__(self, host: SceneHost, hands: Hands) -> None:
        self._host, self._hands = host, hands
        self._server = server = host.server
        self._canvas = Canvas(server)
        self.vehicles = Vehicles(self._canvas)
        self.sights = Sights(server, Canvas(server))
        self.traffic = TrafficStage(self._canvas)
        self._cameras = Cameras(host, self.vehicles)
        self._layers = layers(self._watch_gizmo)
        self._keys: dict[str, Key] = {}
        self._wanted: tuple[Dsm | None, SceneState] | None = None
        self._drawn: Drawing | None = None
        self._dragged: str | None = None
        self._cursor_m: F64 | None = None
        self._one_at_a_time = asyncio.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._shots_due: dict[str, tuple[Target, str]] = {}
        """Asked for by pages whose view had not connected yet."""
        server.on_client_connect(self._joined)
        server.scene.world_axes.visible = False
        server.initial_camera.fov = FOV_RAD
        # Awaited by viser although its signature does not say so.
        server.scene.on_click()(self._clicked)  # pyright: ignore[reportArgumentType]

    async def show(self, dsm: Dsm | None, state: SceneState) -> None:
        """Draws the difference to what is shown. Of calls that come while one is at work the last one counts."""
        self._loop = asyncio.get_running_loop()
        self._wanted = (dsm, state)
        async with self._one_at_a_time:
            if self._wanted is not None:
                wanted, self._wanted = self._wanted, None
                await self._draw(await asyncio.to_thread(Drawing.of, *wanted, self._drawn))

    async def cursor(self, at_m: F64 | None) -> None:
        """Marks the hovered place, (3,) x, y, alt_dsm in the model's coordinates; None takes the mark away."""
        self._cursor_m = None if at_m is None or not np.isfinite(at_m).all() else np.asarray(at_m, dtype=np.float64)
        self._canvas.draw({"cursor": self._cursor_nodes()})

    async def frame(self, page_id: str, target: Target, actor: str = "live") -> None:
        """Moves the camera of one page: terrain, plan, from above, worst point, selected POI, behind a vehicle."""
        client = self._host.client(page_id)
        if client is None:
            self._shots_due.pop(page_id, None)
            self._shots_due[page_id] = target, actor
            while len(self._shots_due) > _SHOTS_DUE_MAX:
                del self._shots_due[next(iter(self._shots_due))]
            return
        self._cameras.free(page_id)
        if self._drawn is None:
            return
        if target == "chase" and self._cameras.chase(page_id, actor):
            self._cameras.follow(self._drawn)
        else:
            move(client, shot(self._drawn, target, aspect=client.camera.aspect), self._drawn)

    def hold_camera(self, page_id: str, *, held: bool) -> None:
        """A hand is on the page's camera, or off it again."""
        self._cameras.hold(page_id, held=held)

    async def run(self) -> None:
        """Cameras that follow, and labels that give way; until cancelled."""
        while True:
            await asyncio.sleep(CAMERAS_EVERY_S)
            if self._drawn is not None:
                self._cameras.follow(self._drawn)
                self._cameras.tidy([*self._canvas.nodes, *self.sights.moving])

    def sample_under(self, page_id: str, x: float, y: float) -> float | None:
        """The distance flown ``s_m`` at the path's place under a page's pointer; None when it points elsewhere.

        ``x`` and ``y`` are shares of the page's 3D view, from its top left.
        """
        client, drawn = self._host.client(page_id), self._drawn
        plan = None if drawn is None else drawn.state.plan
        if client is None or drawn is None or plan is None or len(plan.path_m) < 2 or not drawn.state.view.show_path:
            return None
        path = drawn.frame.scene_from_model(plan.path_m)
        pointer = np.array([x, y])
        return nearest_on_path(lens_of(client), path, plan.path_s_m, pointer, within_px=_POINTER_REACH_PX)

    async def _draw(self, drawing: Drawing | None) -> None:
        if drawing is None:
            self._keys.clear()
            self._canvas.draw({layer.name: [] for layer in self._layers} | {"cursor": []})
            self._drawn = None
            self.vehicles.redraw(None)
            self.sights.redraw(None)
            self.traffic.show(())
            self.traffic.redraw(None)
            return
        keys = {layer.name: layer.key(drawing) for layer in self._layers}
        if self._dragged is not None:
            # Drawn when the hand lets go: the browser that drags moves its mark itself.
            for name in MARKS:
                keys.pop(name)
        todo = [
            layer
            for layer in self._layers
            if layer.name in keys and not unchanged(self._keys.get(layer.name), keys[layer.name])
        ]
        built = await asyncio.to_thread(lambda: {layer.name: layer.build(drawing) for layer in todo})
        before, self._drawn = self._drawn, drawing
        self._canvas.draw(built)
        self._keys |= keys
        self.sights.redraw(drawing)
        self.traffic.redraw(drawing)
        if before is None or before.terrain.terrain_id != drawing.terrain.terrain_id:
            self._aim_all(drawing)
        if before is None or before.frame != drawing.frame or before.dsm is not drawing.dsm:
            self._canvas.draw({"cursor": self._cursor_nodes()})
            self.vehicles.redraw(drawing)

    def _cursor_nodes(self) -> list[Node]:
        return [] if self._cursor_m is None or self._drawn is None else cursor_nodes(self._drawn, self._cursor_m)

    # Cameras

    def _aim_all(self, drawing: Drawing) -> None:
        """A new terrain: every page sees all of it, and pages that come later begin there."""
        pose = shot(drawing, "terrain", aspect=1.6)
        camera = self._server.initial_camera
        camera.position, camera.look_at = tuple(pose.position), tuple(pose.look_at)
        camera.near, camera.far = planes(drawing)
        for client in self._server.get_clients().values():
            move(client, shot(drawing, "terrain", aspect=client.camera.aspect), drawing)

    # Clicks and drags: on viser's thread up to ``_hand_over``

    async def _hand_over(self, intent: Coroutine[Any, Any, None]) -> None:
        """Runs ``intent`` on the application's loop; its errors are reported by viser, which waits for it."""
        if self._loop is None or self._loop.is_closed():
            intent.close()
            return
        await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(intent, self._loop))

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        await self._hand_over(self._click(origin, direction, event.client.camera.fov))

    async def _click(self, origin: F64, direction: F64, fov_rad: float) -> None:
        drawn = self._drawn
        if drawn is None:
            return
        match await asyncio.to_thread(pick, drawn, origin, direction, fov_rad=fov_rad):
            case MarkHit(mark):
                await self._hands.on_mark_click(mark)
            case PlaceHit(lat_deg, lon_deg, known):
                await self._hands.on_terrain_click(lat_deg, lon_deg, known)

    async def _joined(self, client: viser.ClientHandle) -> None:
        """A page's view has connected: its camera goes where the page has asked for meanwhile."""
        page_id = self._host.page_of_client(client.client_id)
        if page_id is not None:
            await self._hand_over(self._catch_up(page_id))

    async def _catch_up(self, page_id: str) -> None:
        due = self._shots_due.pop(page_id, None)
        if due is not None:
            await self.frame(page_id, *due)

    def _watch_gizmo(self, gizmo: viser.TransformControlsHandle) -> None:
        async def on_update(event: viser.TransformControlsEvent) -> None:
            await self._hand_over(self._drag(event.phase, np.array(event.target.position)))

        gizmo.on_update(on_update)

    async def _drag(self, phase: str, at: F64) -> None:
        drawn = self._drawn
        if drawn is None:
            return
        at_m = drawn.frame.model_from_scene(at)
        if phase == "start":
            self._dragged = drawn.state.selection.fence_mark or drawn.state.selection.poi_id
        elif phase == "update":
            await self.cursor(at_m)
        elif self._dragged is not None:
            mark, self._dragged = self._dragged, None
            await self.cursor(None)
            await self._dropped(drawn, mark, at_m)

    async def _dropped(self, drawn: Drawing, mark: str, at_m: F64) -> None:
        lat_deg, lon_deg = drawn.dsm.lat_lon_from_xy(at_m[None, :2])[0]
        if np.isfinite([lat_deg, lon_deg]).all():
            await self._hands.on_mark_moved(mark, float(lat_deg), float(lon_deg))
        # Puts the mark where the document says, also when the move was refused.
        for name in MARKS:
            self._keys.pop(name, None)
        async with self._one_at_a_time:
            await self._draw(self._drawn)
