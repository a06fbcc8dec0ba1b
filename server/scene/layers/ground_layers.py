"""Layers of the ground: the terrain with its texture or its points, unknown terrain, the safe surface."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F32, U8
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.glb import textured_glb
from server.scene.geometry.mesh import gap_mesh, grid_mesh
from server.scene.geometry.payload import HeightGrid, OverlayScene, Relief, TerrainScene
from server.scene.geometry.stage import Drawing

_SURFACE_OPACITY = 0.26
SURFACE_BELOW_M = 0.04
_HATCH_PX = 14
_HATCH_TEXTURE_PX = 1200
_POINT_SHARE, _LEAST_POINT_M = 1.1, 0.03
"""Of a voxel's edge: points of level ground nearly close up, those of a mast stand apart."""


def terrain_nodes(drawing: Drawing) -> list[Node]:
    if not drawing.has_mesh:
        return []
    texture = laid_over(drawing.terrain, drawing.state.overlay)
    glb = textured_glb(grid_mesh(drawing.terrain.grid, drawing.frame), texture)
    return [_glb_node("/terrain", glb, drawing)]


def points_nodes(drawing: Drawing) -> list[Node]:
    """The cloud that the surface model was made of, in the model's place."""
    points = drawing.points
    if points is None:
        return []
    frame = drawing.frame
    # Stretched by the browser: another exaggeration sends no point again.
    origin_m = np.array([frame.centre_x_m, frame.centre_y_m, frame.reference_alt_dsm_m])
    props = {
        "points": (points.points_m - origin_m).astype(np.float32),
        "colors": points.rgb,
        "point_size": max(_LEAST_POINT_M, _POINT_SHARE * points.voxel_m),
        "point_shape": "circle",
        "point_shading": "flat",
        "precision": "float32",
        "scale": (1.0, 1.0, frame.exaggeration),
    }
    return [Node("/points", "point_cloud", props)]


def textured_nodes(drawing: Drawing) -> list[Node]:
    """The textured mesh, in the model's place."""
    mesh, frame = drawing.textured, drawing.frame
    if mesh is None:
        return []
    x, y, z = frame.scene_from_model(mesh.origin_m).tolist()
    # A name of its own for each: another mesh is another node.
    node = _glb_node(f"/textured/{mesh.mesh_id}", mesh.glb, drawing)
    return [Node(node.name, node.kind, {**node.props, "position": (x, y, z)})]


def unknown_nodes(drawing: Drawing) -> list[Node]:
    """Hatched plates where the model knows nothing: no one takes them for ground."""
    grid = drawing.terrain.grid
    if not drawing.state.view.show_unknown or np.isfinite(grid.alt_dsm_m).all():
        return []
    mesh = gap_mesh(grid, drawing.plates, drawing.frame)
    return [] if mesh is None else [_glb_node("/unknown", textured_glb(mesh, _hatching(grid)), drawing)]


def surface_nodes(drawing: Drawing) -> list[Node]:
    plan = drawing.state.plan
    if plan is None or not drawing.state.view.show_surface or not len(plan.safe_surface.faces):
        return []
    color = palette.dimmed(palette.SURFACE, stale=drawing.state.plan_is_stale)
    props = {
        "vertices": _below_path(plan.safe_surface, drawing),
        "faces": plan.safe_surface.faces,
        "color": tuple(int(channel) for channel in color),
        "opacity": _SURFACE_OPACITY,
        "side": "double",
        "scale": (1.0, 1.0, drawing.frame.exaggeration),
        "cast_shadow": False,
        "receive_shadow": False,
    }
    return [Node("/surface", "mesh_simple", props)]


def _below_path(surface: Relief, drawing: Drawing) -> F32:
    """(V, 3) so little below what the path touches that it does not veil it."""
    frame = drawing.frame
    origin_m = np.array([frame.centre_x_m, frame.centre_y_m, frame.reference_alt_dsm_m + SURFACE_BELOW_M])
    return (surface.points_m - origin_m).astype(np.float32)


def _glb_node(name: str, glb: bytes, drawing: Drawing) -> Node:
    scale = (1.0, 1.0, drawing.frame.exaggeration)
    return Node(name, "glb", {"glb_data": glb, "scale": scale, "cast_shadow": False, "receive_shadow": False})


def _hatching(grid: HeightGrid) -> U8:
    """(h', w', 3) diagonal stripes in the shape of the grid's extent; opaque, since what shines through misleads."""
    rows, cols = grid.alt_dsm_m.shape
    zoom = _HATCH_TEXTURE_PX / max(rows, cols)
    row, col = np.indices((max(1, round(rows * zoom)), max(1, round(cols * zoom))))
    return np.array(palette.UNKNOWN, dtype=np.uint8)[(row + col) // _HATCH_PX % 2]


def laid_over(terrain: TerrainScene, overlay: OverlayScene | None) -> U8:
    """(th, tw, 3) the terrain's texture, under the overlay's colours where it has any.

    In the texture instead of above it: nothing floats, and nothing flickers between two surfaces.
    """
    texture = terrain.texture_rgb
    if overlay is None:
        return texture
    rows, cols = texture.shape[:2]
    grid = terrain.grid
    x_m = grid.west_m + (np.arange(cols) + 0.5) / cols * grid.alt_dsm_m.shape[1] * grid.cell_m
    y_m = grid.north_m - (np.arange(rows) + 0.5) / rows * grid.alt_dsm_m.shape[0] * grid.cell_m
    col = np.floor((x_m - overlay.west_m) / overlay.cell_m).astype(np.intp)
    row = np.floor((overlay.north_m - y_m) / overlay.cell_m).astype(np.intp)
    in_row = np.flatnonzero((row >= 0) & (row < overlay.rgba.shape[0]))
    in_col = np.flatnonzero((col >= 0) & (col < overlay.rgba.shape[1]))
    out, target = texture.copy(), np.ix_(in_row, in_col)
    colors = overlay.rgba[np.ix_(row[in_row], col[in_col])].astype(np.float32)
    share = colors[..., 3:] / np.float32(255)
    out[target] = np.round(share * colors[..., :3] + (1 - share) * out[target]).astype(np.uint8)
    return out
