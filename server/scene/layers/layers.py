"""The layers of the 3D view: what each draws, and on what it depends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from server.scene.geometry.canvas import Node, Ready
from server.scene.geometry.payload import OverlayScene, PlanScene, PointsScene, ReviewScene, TerrainScene, TexturedScene
from server.scene.geometry.stage import Drawing
from server.scene.layers.fence_layer import fence_nodes
from server.scene.layers.flight_layers import flight_nodes, review_nodes
from server.scene.layers.ground_layers import points_nodes, surface_nodes, terrain_nodes, textured_nodes, unknown_nodes
from server.scene.layers.mark_layers import is_first_home, place_nodes, poi_nodes
from server.scene.layers.site_layer import site_nodes

_POIS, _FENCE = "pois", "fence"
MARKS = (_POIS, _FENCE)
"""Layers of what hands drag."""
Key = tuple[Any, ...]
_PAYLOADS = (TerrainScene, PointsScene, TexturedScene, PlanScene, ReviewScene, OverlayScene)


@dataclass(frozen=True, slots=True)
class Layer:
    name: str
    build: Callable[[Drawing], list[Node]]
    key: Callable[[Drawing], Key]
    """Equal keys: nothing to draw again."""


def layers(gizmo_ready: Ready) -> tuple[Layer, ...]:
    return (
        Layer("terrain", terrain_nodes, lambda d: (d.terrain, d.frame, d.state.overlay, d.has_mesh)),
        Layer("points", points_nodes, lambda d: (d.points, d.frame)),
        Layer("textured", textured_nodes, lambda d: (d.textured, d.frame)),
        Layer("unknown", unknown_nodes, lambda d: (d.terrain, d.frame, d.state.view.show_unknown)),
        Layer("surface", surface_nodes, lambda d: (*_plan_key(d), d.state.view.show_surface)),
        Layer("flight", flight_nodes, lambda d: (*_plan_key(d), d.state.view.show_path)),
        Layer("sites", site_nodes, _sites_key),
        Layer("review", review_nodes, lambda d: (d.terrain, d.frame, d.state.review)),
        Layer("places", place_nodes, _places_key),
        Layer(_FENCE, lambda d: fence_nodes(d, gizmo_ready), _fence_key),
        Layer(_POIS, lambda d: poi_nodes(d, gizmo_ready), _pois_key),
    )


def unchanged(old: Key | None, new: Key) -> bool:
    """Payloads are compared by identity: a worker's answer is a new object, and comparing arrays takes long."""
    if old is None or len(old) != len(new):
        return False
    return all(a is b or (not isinstance(a, _PAYLOADS) and a == b) for a, b in zip(old, new, strict=True))


def _plan_key(drawing: Drawing) -> Key:
    return drawing.state.plan, drawing.state.plan_is_stale, drawing.frame


def _places_key(drawing: Drawing) -> Key:
    document, plan = drawing.state.document, drawing.state.plan
    planned_home = None if document.home is not None or plan is None else tuple(plan.home_m)
    mission = document.mission
    places = document.home, document.source, document.survey.polygon, mission.look_at, mission.heading, planned_home
    return drawing.terrain, drawing.frame, *places


def _sites_key(drawing: Drawing) -> Key:
    """Their numbers keep off the names of points of interest."""
    document, sites = drawing.state.document, drawing.state.sites
    names = (document.pois, document.source, document.home) if sites else ()
    return drawing.terrain, drawing.frame, sites, drawing.state.selection.site_rank, *names


def _fence_key(drawing: Drawing) -> Key:
    document = drawing.state.document
    return drawing.terrain, drawing.frame, document.fence, document.rally, drawing.state.selection


def _pois_key(drawing: Drawing) -> Key:
    document = drawing.state.document
    return (
        drawing.terrain,
        drawing.frame,
        document.pois,
        document.source,
        is_first_home(drawing),
        drawing.state.selection,
    )
