"""Feeds the 3D view: what it must show now, and the place that profile and view mark together."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from planning.terrain.dsm import Dsm
from server.errors import JobCancelledError, NotFoundError, reported
from server.library import Library
from server.library.orthophotos import load_mesh
from server.plan import tasks
from server.scene.geometry.payload import (
    OverlayScene,
    PlanScene,
    PointsScene,
    ReviewScene,
    SceneState,
    SiteMark,
    TerrainScene,
    TexturedScene,
)
from server.scene.geometry.plain import plain_around, plain_scene
from server.scene.layers.vehicles import actor_of
from server.scene.view import SceneView
from server.schemas import (
    CloudDoc,
    CursorMessage,
    ErrorDoc,
    FrameView,
    MeshDoc,
    NoticeMessage,
    Pages,
    PlanDoc,
    SelectionDoc,
    ViewDoc,
)
from server.work.jobs import Lane

PointsState = Literal["none", "loading", "drawn", "failed"]
log = logging.getLogger("hedgehop.scene")


class Picture:
    """Draws the latest wish; wishes that come while it draws are merged into one.

    ``changed()`` is called when the terrain on show is another one, and when its points come or go.
    A recording that is open is drawn instead of the plan, unless a vehicle is armed: then the terrain stays as it is.
    """

    def __init__(
        self,
        view: SceneView,
        library: Library,
        lane: Lane,
        pages: Pages,
        *,
        changed: Callable[[], None],
    ) -> None:
        self._view, self._library, self._lane, self._pages = view, library, lane, pages
        self._changed = changed
        self._vehicle: tuple[bool, tuple[float, float] | None] = (False, None)
        self._plain: Dsm | None = None
        self._review: tuple[str | None, ReviewScene] | None = None
        self._wish: tuple[PlanDoc, SelectionDoc, ViewDoc, PlanScene | None, bool] | None = None
        self._wake = asyncio.Event()
        self._terrain: TerrainScene | None = None
        self._terrain_key: tuple[str | None, str | None, str] | None = None
        self._dsm: Dsm | None = None
        self._points: PointsScene | None = None
        self._points_of: str | None = None
        """Model whose points were asked for: those that cannot be had are asked for once while they are wanted."""
        self._points_state: PointsState = "none"
        self._textured: TexturedScene | None = None
        self._textured_of: str | None = None
        """Mesh that was asked for, as of the points."""
        self._textured_state: PointsState = "none"
        self._overlay: tuple[OverlayScene | None, tuple[SiteMark, ...]] = (None, ())

    @property
    def legend_m(self) -> tuple[float, float] | None:
        """Lowest and highest height of the colours on show."""
        return None if self._terrain is None else (self._terrain.legend_min_m, self._terrain.legend_max_m)

    @property
    def cloud(self) -> CloudDoc | None:
        """That of the surface model on show, where its points can be drawn."""
        terrain_id = None if self._terrain is None or self._terrain_key is None else self._terrain_key[0]
        if terrain_id is None:
            return None
        cloud = next((doc.cloud for doc in self._library.terrains() if doc.id == terrain_id), None)
        return cloud if cloud is not None and cloud.shown else None

    @property
    def mesh(self) -> MeshDoc | None:
        """The textured mesh of the surface model on show."""
        terrain_id = None if self._terrain is None or self._terrain_key is None else self._terrain_key[0]
        return None if terrain_id is None else self._library.mesh_of(terrain_id)

    @property
    def textured_state(self) -> PointsState:
        """What has become of that mesh."""
        return self._textured_state

    @property
    def points_state(self) -> PointsState:
        """What has become of the points of the surface model on show."""
        return self._points_state

    @property
    def dsm(self) -> Dsm | None:
        """The open surface model, at full resolution."""
        return self._dsm

    def want(
        self, document: PlanDoc, selection: SelectionDoc, view: ViewDoc, plan: PlanScene | None, *, stale: bool
    ) -> None:
        self._wish = (document, selection, view, plan, stale)
        self._wake.set()

    def show_review(self, terrain_id: str | None, scene: ReviewScene | None) -> None:
        """A recorded flight over its surface model, or on its own plain ground; without either, the plan again."""
        drawable = scene is not None and (terrain_id is not None or scene.ground is not None)
        self._review = (terrain_id, scene) if drawable and scene is not None else None
        self._wake.set()

    def lay_over(self, overlay: OverlayScene | None, sites: tuple[SiteMark, ...]) -> None:
        """Colours and landing sites on the surface model that the overlay belongs to, and on no other."""
        self._overlay = overlay, sites
        self._wake.set()

    def on_vehicle(self, armed: bool, home: tuple[float, float] | None) -> None:
        """``home``: (lat_deg, lon_deg); without a surface model plain ground around it is drawn."""
        if (armed, home) != self._vehicle:
            self._vehicle = armed, home
            self._wake.set()

    @property
    def review(self) -> tuple[str | None, ReviewScene] | None:
        """What is drawn instead of the plan, and over which surface model."""
        if self._review is None or self._wish is None:
            return None
        other_terrain = self._review[0] != self._wish[0].terrain_id
        return None if other_terrain and self._vehicle[0] else self._review

    async def run(self) -> None:
        """Until cancelled; what cannot be drawn is told, and the next wish is drawn."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            if self._wish is None:
                continue
            try:
                await self._draw(*self._wish)
            except Exception as error:
                self._tell(reported(error, log, "Drawing"))

    async def _draw(
        self, document: PlanDoc, selection: SelectionDoc, view: ViewDoc, plan: PlanScene | None, stale: bool
    ) -> None:
        review = None
        if self.review is not None:
            terrain_id, review = self.review
            photo_id = document.orthophoto_id if document.terrain_id == terrain_id else None
            document, selection = PlanDoc(terrain_id=terrain_id, orthophoto_id=photo_id), SelectionDoc()
            plan, stale = None, False
        ground = self._live_ground(document.terrain_id) if review is None else review.ground
        if ground is not None:
            await self._load_own(ground, None if review is None else review.drawn)
        else:
            await self._load_terrain(document.terrain_id, document.orthophoto_id, view.shading)
        await self._load_points(wanted=view.show_points)
        await self._load_textured(wanted=view.show_textured)
        overlay, sites = self._overlay
        if overlay is None or overlay.terrain_id != document.terrain_id:
            overlay, sites = None, ()
        state = SceneState(
            terrain=self._terrain,
            plan=plan,
            plan_is_stale=stale,
            document=document,
            selection=selection,
            view=view,
            review=review,
            overlay=overlay,
            sites=sites,
            points=self._points,
            textured=self._textured,
        )
        await self._view.show(self._dsm, state)

    def _live_ground(self, terrain_id: str | None) -> Dsm | None:
        """The same for as long as home stays on it: another one would forget the path flown so far."""
        home = self._vehicle[1]
        if terrain_id is not None or home is None:
            return None
        if self._plain is None or np.isnan(self._plain.elevation_at(self._plain.xy_from_lat_lon(np.array([home])))[0]):
            self._plain = plain_around(*home)
        return self._plain

    async def _load_own(self, ground: Dsm, drawn: TerrainScene | None) -> None:
        """Ground that is not of the library."""
        if self._dsm is not ground:
            drawn = drawn or await asyncio.to_thread(plain_scene, ground)
            self._terrain, self._dsm, self._terrain_key = drawn, ground, None
            self._changed()

    async def _load_terrain(self, terrain_id: str | None, orthophoto_id: str | None, shading: str) -> None:
        """Another shading of the same model replaces the old one only when it is ready."""
        photo_id = self._photo_of(terrain_id, orthophoto_id) if shading == "orthophoto" else None
        key = (terrain_id, photo_id, shading)
        if key == self._terrain_key:
            return
        if self._terrain_key is None or self._terrain_key[0] != terrain_id:
            self._terrain, self._dsm = None, None
        self._terrain_key = key
        if terrain_id is not None:
            await self._draw_terrain(terrain_id, photo_id, shading)
        self._changed()

    def _photo_of(self, terrain_id: str | None, photo_id: str | None) -> str | None:
        """The photo unless it is gone or belongs to another surface model: then height colours are drawn."""
        known = {photo.id for photo in self._library.orthophotos() if photo.terrain_id == terrain_id}
        return photo_id if photo_id in known else None

    async def _draw_terrain(self, terrain_id: str, photo_id: str | None, shading: str) -> None:
        try:
            directory = self._library.terrain_dir(terrain_id)
            photo = None if photo_id is None else self._library.orthophoto_dir(photo_id)
            self._dsm = await asyncio.to_thread(self._library.load_terrain, terrain_id)
            self._terrain = await self._lane.call(tasks.draw_terrain, terrain_id, directory, photo, shading)
        except JobCancelledError:
            self._terrain_key = None
            self._wake.set()
        except NotFoundError:
            # Whoever computes the plan says that its surface model is gone.
            pass
        except Exception as error:
            self._tell(reported(error, log, "Drawing the surface model"))

    async def _load_points(self, *, wanted: bool) -> None:
        """Those of the model on show; of another one they are let go."""
        terrain = self._terrain
        terrain_id = None if terrain is None or self.cloud is None else terrain.terrain_id
        if not wanted and self._points is None:
            self._points_of = None  # what failed is asked for again
            self._tell_points("none")
        if terrain_id == self._points_of:
            return
        self._points, self._points_of = None, None
        if terrain is None or terrain_id is None or not wanted:
            self._tell_points("none")
            return
        self._points_of = terrain_id
        self._tell_points("loading")
        try:
            directory = self._library.terrain_dir(terrain_id)
            legend_m = terrain.legend_min_m, terrain.legend_max_m
            self._points = await self._lane.call(tasks.draw_points, terrain_id, directory, *legend_m)
            self._tell_points("drawn")
        except JobCancelledError:
            self._points_of = None
            self._wake.set()
        except NotFoundError:
            # The model is gone, and whoever computes the plan says so.
            self._tell_points("none")
        except Exception as error:
            self._tell_points("failed")
            self._tell(reported(error, log, "Drawing the points"))

    def _tell_points(self, state: PointsState) -> None:
        if state != self._points_state:
            self._points_state = state
            self._changed()

    async def _load_textured(self, *, wanted: bool) -> None:
        """That of the model on show, once it is wanted; another one is let go."""
        mesh = self.mesh
        if not wanted and self._textured is None:
            self._textured_of = None  # what failed is asked for again
            self._tell_textured("none")
        if (None if mesh is None else mesh.id) == self._textured_of:
            return
        self._textured, self._textured_of = None, None
        if mesh is None or not wanted:
            self._tell_textured("none")
            return
        self._textured_of = mesh.id
        self._tell_textured("loading")
        try:
            glb, origin_m = await asyncio.to_thread(load_mesh, self._library.mesh_dir(mesh.id))
            self._textured = TexturedScene(mesh.terrain_id, mesh.id, glb, origin_m)
            self._tell_textured("drawn")
        except NotFoundError:
            self._tell_textured("none")
        except Exception as error:
            self._tell_textured("failed")
            self._tell(reported(error, log, "Drawing the textured mesh"))

    def _tell_textured(self, state: PointsState) -> None:
        if state != self._textured_state:
            self._textured_state = state
            self._changed()

    def _tell(self, error: ErrorDoc) -> None:
        self._pages.publish(NoticeMessage(level="error", error=error))

    async def mark(self, plan: PlanScene | None, s_m: float | None) -> CursorMessage:
        """Marks the path at a distance in 3D and says what is there."""
        if plan is None or s_m is None or not math.isfinite(s_m):
            await self._view.cursor(None)
            return CursorMessage(s_m=None)
        s_m = float(np.clip(s_m, plan.path_s_m[0], plan.path_s_m[-1]))
        xyz = np.array([np.interp(s_m, plan.path_s_m, plan.path_m[:, axis]) for axis in range(3)])
        await self._view.cursor(xyz)
        ground_m = float(np.interp(s_m, plan.path_s_m, plan.path_ground_alt_dsm_m))
        lat_deg, lon_deg = (None, None) if self._dsm is None else self._dsm.lat_lon_from_xy(xyz[:2])[0].tolist()
        return CursorMessage(
            s_m=s_m,
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            ground_rel_home_m=None if np.isnan(ground_m) else ground_m - plan.home_m[2],
            path_rel_home_m=float(xyz[2] - plan.home_m[2]),
        )

    async def mark_under(
        self, plan: PlanScene | None, page_id: str, pointer: tuple[float, float] | None
    ) -> CursorMessage:
        """The same for the pointer in a page's 3D view, in shares of its width and height; None: it left."""
        return await self.mark(plan, None if pointer is None else self._view.sample_under(page_id, *pointer))

    async def frame(self, message: FrameView, page_id: str) -> None:
        await self._view.frame(page_id, message.target, actor_of(message.source, message.vehicle))

    def hold_camera(self, page_id: str, *, held: bool) -> None:
        self._view.hold_camera(page_id, held=held)
