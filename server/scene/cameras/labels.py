"""Which labels a page sees: none over another one, none over a vehicle; the less important one gives way.

viser draws every label for every page at the same size on the screen. What lies over what depends on the page's own
camera, so each page is told for itself which of them to hide.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.cameras.projection import Lens
from server.scene.geometry.canvas import Node

LETTER_PX, LINE_PX = 8.2, 22.0
"""Of a label of size 1, margins included."""
_MARGIN_PX = 4.0
_VEHICLE_PX = 14.0
"""Half of the least square around a vehicle that stays free."""

_ORDER = ("/now_", "/vehicle_", "/gizmo", "/selected", "/home", "/site", "/look_at", "/poi_label", "/worst_label")
"""Which gives way to which, by the beginnings of their names: the place nearest to terrain gives way to all."""


@dataclass(frozen=True, slots=True)
class Label:
    name: str
    text: str
    at: F64
    """(3,) scene"""
    size: float
    anchor: str


@dataclass(frozen=True, slots=True)
class Screen:
    """One page's picture."""

    lens: Lens
    width_px: float
    height_px: float


def labels_of(nodes: Iterable[Node]) -> list[Label]:
    """All labels among nodes; one below another node stands where that one is."""
    known = {node.name: node for node in nodes}
    return [_label(node, known) for node in known.values() if node.kind == "label"]


def _label(node: Node, known: Mapping[str, Node]) -> Label:
    at = np.array(node.props["position"], dtype=np.float64)
    parent = known.get(node.name.rpartition("/")[0])
    if parent is not None and "position" in parent.props:
        at = at + np.array(parent.props["position"], dtype=np.float64)
    props = node.props
    return Label(node.name, props["text"], at, props.get("font_screen_scale", 1.0), props.get("anchor", "center"))


def hidden(labels: Iterable[Label], vehicles: Iterable[tuple[F64, float]], screen: Screen) -> frozenset[str]:
    """Names of the labels that give way. ``vehicles``: (3,) scene and radius of each."""
    taken = [box for at, radius in vehicles if (box := _vehicle_box(at, radius, screen)) is not None]
    own = len(taken)
    away = set()
    for label in sorted(labels, key=lambda one: (_rank(one.name), one.name)):
        box = _box(label, screen)
        if box is None:
            continue
        # What a vehicle itself is labelled with stands beside it.
        others = taken[own:] if label.name.startswith("/vehicle_") else taken
        if any(_overlap(box, other) for other in others):
            away.add(label.name)
        else:
            taken.append(box)
    return frozenset(away)


def _rank(name: str) -> int:
    return next((rank for rank, start in enumerate(_ORDER) if name.startswith(start)), len(_ORDER) - 2)


_Box = tuple[float, float, float, float]
"""Left, top, right, bottom in pixels."""


def _place_px(at: F64, screen: Screen) -> tuple[F64, float] | None:
    shares, depth = screen.lens.project(at[None])
    if not depth[0] > 0:
        return None
    return shares[0] * [screen.width_px, screen.height_px], float(depth[0])


def _box(label: Label, screen: Screen) -> _Box | None:
    """None behind the camera."""
    place = _place_px(label.at, screen)
    if place is None:
        return None
    x, y = place[0].tolist()
    width, height = label.size * LETTER_PX * (len(label.text) + 1.5), label.size * LINE_PX
    left = x if label.anchor.endswith("left") else x - width if label.anchor.endswith("right") else x - width / 2
    top = y - height if label.anchor.startswith("bottom") else y if label.anchor.startswith("top") else y - height / 2
    return left - _MARGIN_PX, top - _MARGIN_PX, left + width + _MARGIN_PX, top + height + _MARGIN_PX


def _vehicle_box(at: F64, radius: float, screen: Screen) -> _Box | None:
    place = _place_px(at, screen)
    if place is None:
        return None
    (x, y), depth = place[0].tolist(), place[1]
    half = max(_VEHICLE_PX, radius / depth * screen.height_px / (2 * np.tan(screen.lens.fov_rad / 2)))
    return x - half, y - half, x + half, y + half


def _overlap(a: _Box, b: _Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
