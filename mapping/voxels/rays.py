"""Second step of a scan: walks the rays and marks the voxels they pass through (Amanatides and Woo 1987)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mapping.voxels.blocks import touch, voxel_in
from mapping.voxels.store import (
    MISS,
    N_REFUSED,
    SIDE_BITS,
)


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

    A ray that is longer than ``max_range`` is walked that far. Ties between axes go as in OctoMap. Returns the lowest
    and the highest key (2, 3) that rays reach.
    """
    scale = 1.0 / resolution
    ox, oy, oz = origin[0], origin[1], origin[2]
    kx, ky, kz = math.floor(ox * scale), math.floor(oy * scale), math.floor(oz * scale)
    reached = np.empty((2, 3), np.int64)
    reached[:, 0], reached[:, 1], reached[:, 2] = kx, ky, kz
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
        reached[0, 0], reached[1, 0] = min(reached[0, 0], x), max(reached[1, 0], x)
        reached[0, 1], reached[1, 1] = min(reached[0, 1], y), max(reached[1, 1], y)
        reached[0, 2], reached[1, 2] = min(reached[0, 2], z), max(reached[1, 2], z)
        steps = abs(x - kx) + abs(y - ky) + abs(z - kz)
        sx, tx, gx = _first_border(ox, kx, resolution, dx)
        sy, ty, gy = _first_border(oy, ky, resolution, dy)
        sz, tz, gz = _first_border(oz, kz, resolution, dz)
        if grid.size_x > 0:
            _walk_grid(grid, kx, ky, kz, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length)
        else:
            _walk_blocks(store, kx, ky, kz, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length)
    return reached


@njit(cache=True, nogil=True)
def _walk_grid(grid, x, y, z, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length):
    """One ray through the grid. Branches, not selects: processors foresee the pattern of a straight line."""
    marks = grid.marks
    sy, sz = sy * grid.size_x, sz * grid.size_x * grid.size_y
    place = ((z - grid.z0) * grid.size_y + y - grid.y0) * grid.size_x + x - grid.x0
    for _ in range(steps):
        marks[np.uint64(place)] |= np.uint8(MISS)
        if tx < ty:
            if tx < tz:
                if tx > length:
                    break
                place += sx
                tx += gx
            else:
                if tz > length:
                    break
                place += sz
                tz += gz
        elif ty < tz:
            if ty > length:
                break
            place += sy
            ty += gy
        else:
            if tz > length:
                break
            place += sz
            tz += gz


@njit(cache=True, nogil=True)
def _walk_blocks(store, x, y, z, sx, sy, sz, tx, ty, tz, gx, gy, gz, steps, length):
    """One ray through pages of marks: for scans that are too wide for a grid."""
    pages = store.marks
    bx, by, bz, page = (x >> SIDE_BITS) + 1, 0, 0, -1
    for _ in range(steps):
        if x >> SIDE_BITS != bx or y >> SIDE_BITS != by or z >> SIDE_BITS != bz:
            bx, by, bz = x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS
            page = touch(store, bx, by, bz)
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
