"""Second step of a scan: walks the rays and marks the voxels they pass through (Amanatides and Woo 1987)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mapping.voxels.blocks import touch, voxel_in
from mapping.voxels.marks import BLOCK_BITS
from mapping.voxels.store import (
    MISS,
    N_REFUSED,
    SIDE_BITS,
)

REMEMBERED = 1 << 12
"""Blocks whose pages need not be looked up: around the sensor all rays pass through the same ones."""


@njit(cache=True, nogil=True, inline="always")
def _first_border(origin, key, resolution, direction):
    """Sign of the step along one axis, distance along the ray to the first border, distance between borders."""
    if direction > 0.0:
        return 1, ((key + 1) * resolution - origin) / direction, resolution / direction
    if direction < 0.0:
        return -1, (key * resolution - origin) / direction, -resolution / direction
    return 0, np.inf, np.inf


@njit(cache=True, nogil=True)
def mark_rays(store, grid, ends, n_ends, resolution, origin, max_range):
    """Marks every voxel between ``origin`` and each end, the first one too, the end's own not.

    A ray that is longer than ``max_range`` is walked that far. Ties between axes go as in OctoMap.
    """
    scale = 1.0 / resolution
    ox, oy, oz = origin[0], origin[1], origin[2]
    kx, ky, kz = math.floor(ox * scale), math.floor(oy * scale), math.floor(oz * scale)
    pages_of = np.empty((0 if grid.marks.size > 0 else REMEMBERED, 4), np.int64)
    pages_of[:, 3] = -1
    for i in range(n_ends):
        dx, dy, dz = ends[i, 0] - ox, ends[i, 1] - oy, ends[i, 2] - oz
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        if length == 0.0:
            continue
        # OctoMap's unit vectors are in single precision, which is what decides where a ray grazes an edge.
        fx, fy, fz = np.float32(dx), np.float32(dy), np.float32(dz)
        norm = np.float32(math.sqrt(np.float64(fx * fx + fy * fy + fz * fz)))
        dx, dy, dz = np.float64(fx / norm), np.float64(fy / norm), np.float64(fz / norm)
        ex, ey, ez = ends[i, 0], ends[i, 1], ends[i, 2]
        if length > max_range:
            length = max_range
            ex, ey, ez = ox + dx * length, oy + dy * length, oz + dz * length
        x, y, z = math.floor(ex * scale), math.floor(ey * scale), math.floor(ez * scale)
        steps = abs(x - kx) + abs(y - ky) + abs(z - kz)
        sx, tx, gx = _first_border(ox, kx, resolution, dx)
        sy, ty, gy = _first_border(oy, ky, resolution, dy)
        sz, tz, gz = _first_border(oz, kz, resolution, dz)
        if grid.marks.size > 0:
            _walk_grid(grid, kx, ky, kz, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length)
        else:
            _walk_blocks(store, pages_of, kx, ky, kz, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length)


@njit(cache=True, nogil=True)
def _walk_grid(grid, x, y, z, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length):
    """One ray through the grid. Branches, not selects: processors foresee the pattern of a straight line.

    Rounding at a border may lead the last step one voxel too far: a grid has a block more on each side.
    """
    marks, touched, at_x, at_y, at_z = grid.marks, grid.touched, grid.at_x, grid.at_y, grid.at_z
    x, y, z = x - grid.x0, y - grid.y0, z - grid.z0
    place_x, place_y, place_z = at_x[np.uint64(x)], at_y[np.uint64(y)], at_z[np.uint64(z)]
    for _ in range(steps):
        place = np.uint64(place_x + place_y + place_z)
        marks[place] |= np.uint8(MISS)
        touched[place >> np.uint64(BLOCK_BITS)] = 1
        if tx < ty:
            if tx < tz:
                if tx > length:
                    break
                x += sx
                place_x = at_x[np.uint64(x)]
                tx += gx
            else:
                if tz > length:
                    break
                z += sz
                place_z = at_z[np.uint64(z)]
                tz += gz
        elif ty < tz:
            if ty > length:
                break
            y += sy
            place_y = at_y[np.uint64(y)]
            ty += gy
        else:
            if tz > length:
                break
            z += sz
            place_z = at_z[np.uint64(z)]
            tz += gz


@njit(cache=True, nogil=True)
def _walk_blocks(store, pages_of, x, y, z, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length):
    """One ray through pages of marks: for scans that are too wide for a grid.

    ``pages_of`` (REMEMBERED, 4) holds the key and the page of blocks that rays of this scan have met, -1: of none.
    """
    pages = store.marks
    bx, by, bz, page = (x >> SIDE_BITS) + 1, 0, 0, -1
    for _ in range(steps):
        if x >> SIDE_BITS != bx or y >> SIDE_BITS != by or z >> SIDE_BITS != bz:
            bx, by, bz = x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS
            met = (bx * 0x1F1F + by * 0x3779 + bz * 0x6A09) & (REMEMBERED - 1)
            page = pages_of[met, 3]
            if page < 0 or pages_of[met, 0] != bx or pages_of[met, 1] != by or pages_of[met, 2] != bz:
                page = touch(store, bx, by, bz)
                pages_of[met, 0], pages_of[met, 1], pages_of[met, 2], pages_of[met, 3] = bx, by, bz, page
        if page >= 0:
            voxel = voxel_in(x, y, z)
            pages[page, voxel >> 6] |= np.uint64(1) << np.uint64(voxel & 63)
        else:
            store.counts[N_REFUSED] += 1
        if min(tx, ty, tz) > length:
            break
        if tx < ty and tx < tz:
            x += sx
            tx += gx
        elif not tx < ty and ty < tz:
            y += sy
            ty += gy
        else:
            z += sz
            tz += gz
