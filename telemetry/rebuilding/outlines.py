"""Obstacles of a whole map: which voxels belong together, and the outline of them from above."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from mapping.geometry.arrays import F64, I32, I64
from telemetry.topics.deltas import packed_keys

_HALF_OF_26 = [d for d in product((-1, 0, 1), repeat=3) if d > (0, 0, 0)]


def clusters(keys: I32) -> I32:
    """(N, 3) voxels, each once -> (N,) number of the cluster: voxels that touch, corners included, are one."""
    packed = packed_keys(keys)
    order = np.argsort(packed)
    in_order = packed[order]
    pairs = [_neighbours(keys, np.array(step, np.int32), order, in_order) for step in _HALF_OF_26]
    one, other = (np.concatenate(side) for side in zip(*pairs, strict=True))
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), shape=(len(keys), len(keys)))
    return connected_components(graph, directed=False)[1]


def _neighbours(
    keys: I32, step: I32, order: NDArray[np.intp], in_order: I64
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    wanted = packed_keys(keys + step)
    at = np.minimum(np.searchsorted(in_order, wanted), len(in_order) - 1)
    there = np.flatnonzero(in_order[at] == wanted)
    return there, order[at[there]]


def outline(columns: I32) -> F64:
    """(N, 2) -> (K, 2) closed convex ring around these cells, counter-clockwise, in cells."""
    cells = np.unique(columns, axis=0).astype(np.float64)
    corners = np.concatenate([cells + offset for offset in product((0.0, 1.0), repeat=2)])
    ring = corners[ConvexHull(corners).vertices]
    return np.vstack([ring, ring[:1]])
