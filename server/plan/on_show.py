"""What all pages show together: layers, selection, the tool in hand, and the place that profile and 3D view mark."""

from __future__ import annotations

from collections.abc import Callable

from server.plan.computing import Computing
from server.plan.picture import Picture
from server.plan.plan_desk import PlanDesk
from server.scene.geometry.payload import PlanScene, ReviewScene
from server.schemas import (
    ClientMessage,
    FrameView,
    HoldCamera,
    HoverProfile,
    HoverView,
    Pages,
    PlanDoc,
    SelectionDoc,
    SelectionMessage,
    SetSelection,
    SetView,
    ViewDoc,
    ViewMessage,
)


class OnShow:
    """Any page changes it for all. ``layers_changed(view)`` follows every new view."""

    def __init__(
        self,
        picture: Picture,
        desk: PlanDesk,
        computing: Computing,
        pages: Pages,
        *,
        layers_changed: Callable[[ViewDoc], None],
    ) -> None:
        self._picture, self._desk, self._computing, self._pages = picture, desk, computing, pages
        self._layers_changed = layers_changed
        self.view, self.selection = ViewDoc(), SelectionDoc()

    @property
    def document(self) -> PlanDoc:
        """The open plan, also while a recording is shown instead of it."""
        return self._desk.document

    @property
    def is_review(self) -> bool:
        """Whether a recording is shown instead of the plan."""
        return self._picture.review is not None

    async def on_client_message(self, page_id: str, message: ClientMessage) -> None:
        match message:
            case HoverProfile():
                self._pages.publish(await self._picture.mark(self._plan, message.s_m))
            case HoverView():
                place = None if message.x is None or message.y is None else (message.x, message.y)
                self._pages.publish(await self._picture.mark_under(self._plan, page_id, place))
            case SetView():
                self.show_view(message.view)
            case SetSelection():
                self.select(message.selection)
            case FrameView():
                await self._picture.frame(message, page_id)
            case HoldCamera():
                self._picture.hold_camera(page_id, held=message.held)

    def show_view(self, view: ViewDoc) -> None:
        self.view = view
        self._layers_changed(view)
        self.tell_legend()
        self.draw()

    def show_orthophoto(self) -> None:
        self.show_view(self.view.model_copy(update={"shading": "orthophoto"}))

    def show_textured(self) -> None:
        """The mesh that has just come, in the surface model's place."""
        self.show_view(self.view.model_copy(update={"show_textured": True, "show_mesh": False}))

    def hide_textured(self) -> None:
        """The mesh is gone: the surface model is drawn again where it had given way to it, and not to its points."""
        gave_way = self.view.show_textured and not self.view.show_points
        update = {"show_textured": False, "show_mesh": self.view.show_mesh or gave_way}
        self.show_view(self.view.model_copy(update=update))

    @property
    def terrain_id(self) -> str | None:
        """Of the surface model on show, the plan's or that of the recording that is open."""
        review = self._picture.review
        return self.document.terrain_id if review is None else review[0]

    def show_review(self, terrain_id: str | None, scene: ReviewScene | None) -> None:
        """A recording in the 3D view instead of the plan; None: the plan again."""
        self._picture.show_review(terrain_id, scene)

    def select(self, selection: SelectionDoc) -> None:
        self.selection = selection
        self._pages.publish(SelectionMessage(selection=selection))
        self.draw()

    def tell_legend(self) -> None:
        """The heights that the colours mean, and the points there are, change with the surface model on show."""
        low_m, high_m = self._picture.legend_m or (None, None)
        cloud, mesh = self._picture.cloud, self._picture.mesh
        self.view = self.view.model_copy(
            update={
                "legend_min_m": low_m,
                "legend_max_m": high_m,
                "points_shown": 0 if cloud is None else cloud.shown,
                "points_state": self._picture.points_state,
                "points_of": 0 if cloud is None else cloud.points,
                "points_colored": cloud is not None and cloud.colored,
                "textured_triangles": 0 if mesh is None else mesh.triangles,
                "textured_state": self._picture.textured_state,
            }
        )
        self._pages.publish(ViewMessage(view=self.view))

    def draw(self) -> None:
        stale = self._computing.state.state == "running"
        self._picture.want(self.document, self.selection, self.view, self._computing.scene, stale=stale)

    @property
    def _plan(self) -> PlanScene | None:
        """The plan on show; while a recording is, there is none to point at."""
        return None if self.is_review else self._computing.scene
