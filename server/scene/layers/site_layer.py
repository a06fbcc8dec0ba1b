"""Layer of landing sites: a ball on each, and a pole that leans away from others, so that numbers stay readable."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.mark_shapes import BALL, label_node, line_node, raised, shape_node
from server.scene.geometry.payload import SiteMark
from server.scene.geometry.stage import Drawing
from server.scene.layers.mark_layers import poi_places

_POLE = 5.0
_APART = 7.0
"""Sites may be a few metres apart, their numbers have the same size on every model. All in radii of a mark."""
_NAME_WIDE, _NAME_HIGH = 16.0, 10.0
"""Half of what the name of a point of interest takes of a view with north up; poles rise into it from the south."""
_ROUNDS = 100


def site_nodes(drawing: Drawing) -> list[Node]:
    """L1 is the best; the selected one in the accent colour, and larger."""
    xy_m = drawing.places_xy_m(drawing.state.sites)
    sites = [site for site, place in zip(drawing.state.sites, xy_m, strict=True) if np.isfinite(place).all()]
    places = drawing.on_ground(xy_m)
    tops = raised(places, _POLE * drawing.mark_m)
    tops[:, :2] = drawing.mark_m * _apart(places[:, :2] / drawing.mark_m, _names(drawing) / drawing.mark_m)
    return [node for site, at, top in zip(sites, places, tops, strict=True) for node in _site(drawing, site, at, top)]


def _site(drawing: Drawing, site: SiteMark, at: F64, top: F64) -> list[Node]:
    is_chosen = site.rank == drawing.state.selection.site_rank
    color, size = (palette.ACCENT, 1.4) if is_chosen else (palette.SITE, 1.0)
    return [
        shape_node(f"/site/{site.rank}", BALL, at, 0.7 * size * drawing.mark_m, color),
        line_node(f"/site_pole/{site.rank}", np.stack([at, top]), color, width_px=3.0 * size),
        label_node(f"/site_label/{site.rank}", f"L{site.rank}", top, size=size),
    ]


def _names(drawing: Drawing) -> F64:
    """(M, 2) where names of points of interest and of home are written."""
    home = drawing.state.document.home
    at = None if home is None else drawing.ground_of(home)
    places = poi_places(drawing)[1] if at is None else np.vstack([poi_places(drawing)[1], at])
    return places[:, :2] - np.array([0.0, 0.2 * _NAME_HIGH * drawing.mark_m])


def _apart(xy: F64, names: F64) -> F64:
    """(N, 2) the same places, pushed from one another and off the names, in radii of a mark."""
    turn = 2.4 * np.arange(len(xy))
    # Two at the very same place have no direction to be pushed in.
    out = xy + 1e-3 * np.column_stack([np.cos(turn), np.sin(turn)])
    for _ in range(_ROUNDS):
        away = out[:, None] - out[None]
        distance = np.linalg.norm(away, axis=2) + np.eye(len(out))
        push = np.clip(_APART - distance, 0.0, None) * (1 - np.eye(len(out))) / 2
        out = out + ((push / distance)[..., None] * away).sum(axis=1)
        out[:, 1] += _off_names(out, names)
    return out


def _off_names(xy: F64, names: F64) -> F64:
    """(N,) how far north or south each is to go: names are wider than high."""
    east, north = np.moveaxis(xy[:, None] - names[None], 2, 0)
    over = np.clip(_NAME_HIGH - np.abs(north), 0.0, None) * (np.abs(east) < _NAME_WIDE)
    return (np.where(north < 0, -over, over) / 2).sum(axis=1)
