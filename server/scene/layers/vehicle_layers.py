"""Layers of the vehicles: a quadrotor with a nose, a plumb line to the ground, its home, and the path it has flown.

They change ten times a second: the same nodes keep their names and the shapes of their arrays, so that only the new
numbers travel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from viser import transforms

from mapping.geometry.arrays import F64
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.mark_shapes import CONE, Rgb, dots_node, label_node, line_node, shape_node
from server.scene.geometry.stage import Drawing

VEHICLE_M = 1.6
"""Half the drawn quadrotor's width: larger than most, so that it is seen among voxels of a metre."""
_DOT_PX = 11.0
"""Of the dot in its middle, which is seen from where the whole model is seen."""
_CHUNK_SEGMENTS = 256
_ROTOR_AT = 0.72


@dataclass(frozen=True, slots=True)
class VehiclePose:
    """A vehicle on the surface model that is on show; angles as in ``telemetry.topics.vehicle``."""

    place_m: F64
    """(3,) x, y, alt_dsm"""
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    heading_rad: float = 0.0
    home_m: F64 | None = None
    """(3,) where it took off"""
    label: str = ""
    """Its name, where several fly."""


@dataclass(frozen=True, slots=True)
class _Style:
    body: Rgb
    nose: Rgb
    label: str = ""


_LIVE, _REPLAY = _Style(palette.VEHICLE, palette.NOSE), _Style(palette.REPLAY, palette.REPLAY_NOSE, "REPLAY")
REPLAY = "replay"
"""The actor of a recording; every other one lives."""


def vehicle_nodes(drawing: Drawing, actor: str, pose: VehiclePose | None) -> list[Node]:
    """The marks of one vehicle; none when it is nowhere on this model."""
    if pose is None:
        return []
    style, name = _REPLAY if actor == REPLAY else _LIVE, f"/vehicle_{actor}"
    label = pose.label or style.label
    at = drawing.frame.scene_from_model(pose.place_m)
    size, middle = VEHICLE_M, np.zeros(3)
    return [
        Node(name, "frame", {"show_axes": False, "position": _triple(at), "wxyz": scene_wxyz(pose)}),
        shape_node(f"{name}/body", _BODY, middle, size, style.body),
        shape_node(f"{name}/nose", _NOSE, middle, size, style.nose),
        dots_node(f"{name}/dot", middle[None], style.body, size_px=_DOT_PX),
        *([label_node(f"{name}/label", label, np.array([0.0, 0.0, 0.9 * size]))] if label else []),
        _plumb(drawing, name, pose, at, style),
        *_home(drawing, name, pose, style),
    ]


def scene_wxyz(pose: VehiclePose) -> tuple[float, float, float, float]:
    """R_scene_body as a quaternion; body x forward, y left, z up. Height exaggeration does not bend attitudes."""
    yaw = transforms.SO3.from_z_radians(math.pi / 2 - pose.heading_rad)
    R = yaw @ transforms.SO3.from_y_radians(-pose.pitch_rad) @ transforms.SO3.from_x_radians(pose.roll_rad)
    w, x, y, z = R.wxyz.tolist()
    return w, x, y, z


def track_nodes(drawing: Drawing, actor: str, points_m: F64) -> list[Node]:
    """The flown path (N, 3), parted where a row is NaN, in pieces of equal size: a longer path changes the last piece
    only."""
    if len(points_m) < 2:
        return []
    points = drawing.frame.scene_from_model(points_m)
    starts = range(0, len(points) - 1, _CHUNK_SEGMENTS)
    return [_piece(actor, number, points[start:]) for number, start in enumerate(starts)]


def way_nodes(drawing: Drawing, actor: str, points_m: F64, *, is_certified: bool) -> list[Node]:
    """A guided way (K, 3) and a dot where it ends; red where it may not be flown."""
    if len(points_m) < 2:
        return []
    points = drawing.frame.scene_from_model(points_m)
    color = palette.ACCENT if is_certified else palette.INSIDE
    name = f"/way_{actor}"
    return [
        line_node(name, points, color, width_px=4.0),
        dots_node(f"{name}/end", points[-1:], color, size_px=_DOT_PX),
    ]


def _piece(actor: str, number: int, points: F64) -> Node:
    points = points[: _CHUNK_SEGMENTS + 1]
    # The rest of an unfinished piece stands on its last point, unseen.
    rest = np.repeat(points[-1:], _CHUNK_SEGMENTS + 1 - len(points), axis=0)
    color, width_px = (palette.REPLAY, 3.0) if actor == REPLAY else (palette.VEHICLE, 4.0)
    return line_node(f"/track_{actor}/{number}", np.concatenate([points, rest]), color, width_px=width_px)


def _plumb(drawing: Drawing, name: str, pose: VehiclePose, at: F64, style: _Style) -> Node:
    foot = drawing.on_ground(pose.place_m[None, :2])
    line = np.stack([foot[0] if len(foot) else at, at])
    return line_node(f"{name}_plumb", line, style.body, width_px=1.5)


def _home(drawing: Drawing, name: str, pose: VehiclePose, style: _Style) -> list[Node]:
    if pose.home_m is None:
        return []
    at = drawing.on_ground(pose.home_m[None, :2])
    return [shape_node(f"{name}_home", CONE, at[0], drawing.body_m, style.body)] if len(at) else []


def _quadrotor() -> trimesh.Trimesh:
    """Body, two arms and four rotors, x forward, one unit from its middle to the rotors' far edges."""
    parts = [trimesh.creation.box((0.5, 0.34, 0.2))]
    for angle in (math.pi / 4, -math.pi / 4):
        arm = trimesh.creation.box((2 * _ROTOR_AT, 0.09, 0.07))
        parts.append(_turned(arm, angle))
    for angle in (math.pi / 4 + quarter * math.pi / 2 for quarter in range(4)):
        rotor = trimesh.creation.annulus(r_min=0.2, r_max=0.28, height=0.07, sections=20)
        rotor.apply_translation((_ROTOR_AT * math.cos(angle), _ROTOR_AT * math.sin(angle), 0.08))
        parts.append(rotor)
    whole = trimesh.util.concatenate(parts)
    assert isinstance(whole, trimesh.Trimesh)
    return whole


def _nose() -> trimesh.Trimesh:
    """A cone that points forward: which way the vehicle looks is seen from afar."""
    cone = trimesh.creation.cone(radius=0.17, height=0.62, sections=16)
    cone.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0.0, 1.0, 0.0)))
    cone.apply_translation((0.25, 0.0, 0.0))
    return cone


def _turned(mesh: trimesh.Trimesh, angle_rad: float) -> trimesh.Trimesh:
    mesh.apply_transform(trimesh.transformations.rotation_matrix(angle_rad, (0.0, 0.0, 1.0)))
    return mesh


def _arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.uint32)


_BODY, _NOSE = _arrays(_quadrotor()), _arrays(_nose())


def _triple(at: F64) -> tuple[float, float, float]:
    return float(at[0]), float(at[1]), float(at[2])
