"""What pages are told of traversability, and what the 3D view lays over the model: each only what is new for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from server.scene.geometry.payload import OverlayScene, SiteMark
from server.schemas import Pages, TraversabilityMessage, TraversabilityState, UwbLiveDoc, ViewDoc
from server.traversability.legend import legend_of
from server.traversability.task import Worked


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """The maps of one surface model, in its folder. Compared by identity: they hold arrays."""

    terrain_id: str
    file: Path
    worked: Worked

    def state(self) -> TraversabilityState:
        worked = self.worked
        return TraversabilityState(
            state="ready",
            text=worked.text,
            terrain_id=self.terrain_id,
            resolution_m=worked.resolution_m,
            cells=worked.cells,
            untraversable=worked.untraversable,
            cleared=worked.cleared,
            seen=worked.seen,
            uwb_log=worked.uwb_log,
            uwb_rule=worked.uwb_rule,
            uwb_left_out=worked.uwb_left_out,
            scans=worked.scans,
        )


class Told:
    """``show`` puts a layer and landing sites into the 3D view."""

    def __init__(self, pages: Pages, *, show: Callable[[OverlayScene | None, tuple[SiteMark, ...]], None]) -> None:
        self._pages, self._show = pages, show
        self.view = ViewDoc()
        self.kept: Kept | None = None
        self.live = UwbLiveDoc()
        """Whatever becomes of the map, the radar does as it does."""
        self._on_show: tuple[object, ...] = ()
        self._last = self.state = TraversabilityState()

    def message(self) -> TraversabilityMessage:
        return TraversabilityMessage(traversability=self.state)

    def replace(self, state: TraversabilityState, kept: Kept | None) -> None:
        self.state, self.kept = state, kept
        self.publish()

    def change(self, **changes: object) -> None:
        self.state = self.state.model_copy(update=changes)
        self.publish()

    def publish(self) -> None:
        """The legend goes with the layer on show."""
        view = self.view
        legend = legend_of(view.traversability_layer, with_radar=bool(self.state.uwb_log))
        shown = legend if self.kept is not None else ()
        texts, colors = [each.text for each in shown], [each.color for each in shown]
        self.state = self.state.model_copy(update={"legend": texts, "legend_colors": colors, "live": self.live})
        if self.state != self._last:
            self._last = self.state
            self._pages.publish(self.message())
        self._draw(view)

    def _draw(self, view: ViewDoc) -> None:
        kept = self.kept if view.show_traversability else None
        sites = tuple(SiteMark(site.rank, site.lat_deg, site.lon_deg) for site in self.state.sites)
        key = (kept, view.traversability_layer, sites)
        if len(self._on_show) == len(key) and all(a is b or a == b for a, b in zip(self._on_show, key, strict=True)):
            return
        self._on_show = key
        overlay = None if kept is None else kept.worked.overlay(kept.terrain_id, view.traversability_layer)
        self._show(overlay, () if kept is None else sites)
