"""Layer of moving objects: where each is, how surely, where it goes, and how near it will come."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.enu import EnuPlacing
from server.scene.geometry.mark_shapes import GEM, label_node, line_node, many_node, raised, shape_node
from server.scene.geometry.stage import Drawing
from telemetry.topics.tracks import Track, TracksStatus

ARROW_S = 3.0
"""An arrow ends where its object will be then."""
SIGMAS = 2.0
"""Of the ellipse of uncertainty: 86 % of the places."""
MOST = 32
"""Nearest first; each is a handful of small nodes."""
_PIECES = 24
_LEAST_ARROW_M = 0.5
_STILL_PX, _MOVING_PX, _DANGEROUS_PX = 2.0, 3.0, 6.0


def track_nodes(drawing: Drawing, placing: EnuPlacing, status: TracksStatus | None, *, prefix: str) -> list[Node]:
    """An ellipse, an arrow and a label each; one that comes too near is thick and red, with where it will pass."""
    if status is None or status.state != "running" or not drawing.state.view.show_tracks:
        return []
    offset_m = _offset_m(placing, status)
    nodes: list[Node] = []
    for track in status.tracks[:MOST]:
        nodes += _track(drawing, placing, track, np.array(track.enu_m) + offset_m, f"{prefix}/track/{track.id}")
    return nodes


def ellipse_enu_m(track: Track) -> F64:
    """(N, 2) around the track's place, closed: ``SIGMAS`` standard deviations to all sides."""
    ee, en, nn = track.covariance_m2
    values, axes = np.linalg.eigh(np.array([[ee, en], [en, nn]]))
    angle = np.linspace(0.0, math.tau, _PIECES + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return (axes @ (SIGMAS * np.sqrt(np.maximum(values, 0.0))[:, None] * circle)).T


def _track(drawing: Drawing, placing: EnuPlacing, track: Track, at_enu_m: F64, name: str) -> list[Node]:
    color = palette.TRACK_DANGEROUS if track.dangerous else palette.TRACK
    width_px = _DANGEROUS_PX if track.dangerous else _MOVING_PX if track.moving else _STILL_PX
    ring = at_enu_m + np.column_stack([ellipse_enu_m(track), np.zeros(_PIECES + 1)])
    velocity = np.array([*track.velocity_enu_m_s, 0.0])
    at, *corners = _scene(drawing, placing, np.vstack([at_enu_m, ring]))
    nodes = [
        shape_node(f"{name}/at", GEM, at, drawing.body_m, color),
        line_node(f"{name}/ellipse", np.array(corners), color, width_px=_STILL_PX),
        label_node(f"{name}/words", _words(track), raised(at, drawing.mark_m)),
    ]
    if track.moving and np.linalg.norm(velocity) * ARROW_S > _LEAST_ARROW_M:
        arrow = _scene(drawing, placing, _arrow(at_enu_m, velocity * ARROW_S))
        nodes.append(line_node(f"{name}/arrow", arrow, color, width_px=width_px))
    if track.dangerous and track.closest_in_s > 0:
        there = _scene(drawing, placing, np.stack([at_enu_m, at_enu_m + velocity * track.closest_in_s]))
        nodes += [
            many_node(f"{name}/closest", GEM, there[1:], drawing.body_m, color),
            label_node(f"{name}/closest_words", _closest_words(track), raised(there[1], drawing.mark_m)),
        ]
    return nodes


def _arrow(from_enu_m: F64, by_m: F64) -> F64:
    """(5, 3) one line: shaft, and a head of a quarter of its length."""
    tip = from_enu_m + by_m
    aside = 0.12 * np.array([-by_m[1], by_m[0], 0.0])
    back = tip - 0.25 * by_m
    return np.stack([from_enu_m, tip, back + aside, tip, back - aside])


def _scene(drawing: Drawing, placing: EnuPlacing, points_enu_m: F64) -> F64:
    return drawing.frame.scene_from_model(placing.model_from_enu(points_enu_m))


def _offset_m(placing: EnuPlacing, status: TracksStatus) -> F64:
    """(3,) from the tracks' own origin to the one that is drawn from: each node took home from its own first state."""
    own, drawn = status.origin, placing.origin
    if own is None or own == drawn:
        return np.zeros(3)
    frame = LocalFrame(drawn.lat_deg, drawn.lon_deg, drawn.alt_amsl_m)
    return frame.to_enu(own.lat_deg, own.lon_deg, own.alt_amsl_m)[0]


def _words(track: Track) -> str:
    speed_m_s = math.hypot(*track.velocity_enu_m_s)
    how = f"{speed_m_s:.1f} m/s" if track.moving else "still"
    return f"{track.id}: {track.range_m:.0f} m, {how}, for {track.age_s:.0f} s"


def _closest_words(track: Track) -> str:
    return f"{track.id}: passes {track.closest_m:.1f} m away in {track.closest_in_s:.0f} s"
