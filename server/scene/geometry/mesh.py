"""From a grid of heights to triangles: every known cell's centre is a vertex, unknown cells are left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import map_coordinates

from mapping.geometry.arrays import F32, F64, U32, Bools
from server.scene.geometry.payload import HeightGrid
from server.scene.geometry.scene_frame import LocalFrame


@dataclass(frozen=True, slots=True)
class Mesh:
    vertices: F32
    """(V, 3) x east, y north of the model's centre, z above the reference, metres, not exaggerated."""
    faces: U32
    """(F, 3) counter-clockwise seen from above"""
    uv: F32
    """(V, 2) shares of the grid's extent from the north-western corner"""


def grid_mesh(grid: HeightGrid, frame: LocalFrame) -> Mesh:
    """Triangles between neighbouring known cells.

    The outermost vertices are drawn out to the grid's edge, so that the mesh covers the model and not half a
    cell less on each side.
    """
    rows, cols = grid.alt_dsm_m.shape
    u, v = _shares(cols), _shares(rows)
    x_m = grid.west_m + u * cols * grid.cell_m - frame.centre_x_m
    y_m = grid.north_m - v * rows * grid.cell_m - frame.centre_y_m
    known = np.isfinite(grid.alt_dsm_m)
    row, col = np.nonzero(known)
    z_m = grid.alt_dsm_m[known] - frame.reference_alt_dsm_m
    return Mesh(
        vertices=np.column_stack([x_m[col], y_m[row], z_m]).astype(np.float32),
        faces=_faces(known),
        uv=np.column_stack([u[col], v[row]]).astype(np.float32),
    )


def _shares(count: int) -> F64:
    shares = (np.arange(count) + 0.5) / count
    if count > 1:
        shares[0], shares[-1] = 0.0, 1.0
    return shares


def _faces(known: Bools) -> U32:
    number = np.cumsum(known.ravel()).reshape(known.shape).astype(np.uint32) - np.uint32(1)
    nw, ne, sw, se = (
        (number[r : r - 1 or None, c : c - 1 or None], known[r : r - 1 or None, c : c - 1 or None])
        for r, c in ((0, 0), (0, 1), (1, 0), (1, 1))
    )
    triangles = ((nw, sw, ne), (ne, sw, se))
    return np.concatenate([_drawn(*corners) for corners in triangles])


_Corner = tuple[U32, Bools]


def _drawn(a: _Corner, b: _Corner, c: _Corner) -> U32:
    """The triangles whose corners are all known."""
    drawn = a[1] & b[1] & c[1]
    return np.column_stack([corner[0][drawn] for corner in (a, b, c)])


def gap_mesh(grid: HeightGrid, plates: HeightGrid, frame: LocalFrame) -> Mesh | None:
    """The triangles that `grid_mesh` leaves out, at the plates' heights and down to them; None without gaps."""
    known = np.isfinite(grid.alt_dsm_m)
    whole = grid_mesh(filled(grid, plates), frame)
    faces = whole.faces[~known.ravel()[whole.faces].all(axis=1)]
    if not len(faces):
        return None
    used, faces = np.unique(faces, return_inverse=True)
    return Mesh(whole.vertices[used], faces.reshape(-1, 3).astype(np.uint32), whole.uv[used])


def filled(grid: HeightGrid, plates: HeightGrid) -> HeightGrid:
    """The grid with plates in its holes."""
    return replace(grid, alt_dsm_m=np.where(np.isfinite(grid.alt_dsm_m), grid.alt_dsm_m, plates.alt_dsm_m))


def drawn_alt_dsm_m(grid: HeightGrid, xy_m: F64) -> F64:
    """Height of a drawn grid without holes under projected points (N, 2); beside it, that of its edge.

    The drawing stands above the model by up to a cell's slope, and marks must not sink into it.
    """
    xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
    at = np.array([(grid.north_m - xy[:, 1]) / grid.cell_m - 0.5, (xy[:, 0] - grid.west_m) / grid.cell_m - 0.5])
    return map_coordinates(grid.alt_dsm_m, at, order=1, mode="nearest", output=np.float64)
