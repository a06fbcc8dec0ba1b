"""A map as files for other programs: points, OctoMap and its ROS message, GeoTIFF of the highest, GeoJSON of all."""

from __future__ import annotations

import json
import tempfile
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from affine import Affine
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from mapping.geometry.arrays import F64, I32, I64
from mapping.voxels.map import VoxelMap
from mapping.voxels.octomap_bt import tree_data, write_bt
from mapping.voxels.point_files import pcd, ply
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import write_dsm
from telemetry.errors import TelemetryError
from telemetry.perception.convert import frame_of
from telemetry.perception.mission_line import local_crs
from telemetry.topics.deltas import FoldedMap, Voxels, packed_keys
from telemetry.topics.obstacles import MapDelta

Kind = Literal["ply", "pcd", "bt", "mcap", "tif", "geojson"]
KINDS: tuple[Kind, ...] = ("ply", "pcd", "bt", "mcap", "tif", "geojson")

OCTOMAP_TOPIC, MAP_FRAME = "/octomap_binary", "map"
"""As octomap_server publishes it; REP 105."""
MOST_CELLS = 100_000_000
"""Of a GeoTIFF: 400 MB before it is compressed."""
_HALF_OF_26 = [d for d in product((-1, 0, 1), repeat=3) if d > (0, 0, 0)]


class ExportError(TelemetryError):
    """A map that cannot be written as it was asked for."""

    code = "map_export"


def exported(kind: Kind, folded: FoldedMap) -> bytes:
    """The whole map as a file of that kind. Raises ExportError when there is nothing in it, or it does not fit.

    ``ply``, ``pcd``, ``bt`` and ``mcap`` (a ROS 2 bag with one octomap_msgs/Octomap) hold every occupied voxel, known
    ground too, in metres of the map; ``tif`` and ``geojson`` only obstacles, placed on Earth.
    """
    head = folded.last
    if head is None or len(folded.voxels.occupied().keys) == 0:
        raise ExportError("The map is empty.", advice="Fly first, with the sensor switched on.")
    if kind in ("ply", "pcd"):
        held, write = folded.voxels.occupied(), ply if kind == "ply" else pcd
        return write(_centres(held, head.resolution_m), probability=held.probability / 255.0)
    if kind == "bt":
        return write_bt(_map_of(folded.voxels, head.resolution_m))
    if kind == "mcap":
        return _mcap(folded.voxels, head)
    obstacles = folded.voxels.occupied(include_explained=False)
    return _tif(obstacles, head) if kind == "tif" else _geojson(obstacles, head)


def _centres(voxels: Voxels, resolution_m: float) -> F64:
    return (voxels.keys.astype(np.float64) + 0.5) * resolution_m


def _map_of(voxels: Voxels, resolution_m: float) -> VoxelMap:
    the_map = VoxelMap(resolution_m=resolution_m)
    the_map.assign(voxels.keys, voxels.probability > 127)
    return the_map


def _mcap(voxels: Voxels, head: MapDelta) -> bytes:
    """A ROS 2 bag of one message, at the time of the map's newest frame."""
    from telemetry.recording.ros.ros2_writer import Ros2Writer  # reads many definitions

    _, data = tree_data(_map_of(voxels, head.resolution_m))
    with tempfile.TemporaryDirectory(prefix="hedgehop-") as folder:
        path = Path(folder) / "map.mcap"
        with Ros2Writer(path, library="hedgehop ros2") as writer:
            stamp_ns = max(0, round(head.t_utc_s * 1e9))
            writer.octomap(OCTOMAP_TOPIC, stamp_ns, MAP_FRAME, head.resolution_m, data)
        return path.read_bytes()


def _tif(obstacles: Voxels, head: MapDelta) -> bytes:
    """Height above sea level of the highest obstacle in each cell; unknown where there is none."""
    edge_m, keys = head.resolution_m, obstacles.keys
    if len(keys) == 0:
        raise ExportError("There are no obstacles in the map, only known ground.", advice="Choose .ply, .pcd or .bt.")
    west, south = keys[:, 0].min(), keys[:, 1].min()
    cols, rows = int(keys[:, 0].max()) - int(west) + 1, int(keys[:, 1].max()) - int(south) + 1
    if rows * cols > MOST_CELLS:
        what = f"A grid of {cols:,} x {rows:,} cells does not fit: {MOST_CELLS:,} are the most."
        raise ExportError(what, advice="Choose .ply, .pcd or .geojson.")
    top_m = np.full((rows, cols), -np.inf, np.float32)
    height_m = (keys[:, 2] + 1.0) * edge_m + head.origin.alt_amsl_m
    np.maximum.at(top_m, (rows - 1 - (keys[:, 1] - south), keys[:, 0] - west), height_m.astype(np.float32))
    top_m[np.isneginf(top_m)] = np.nan
    transform = Affine(edge_m, 0.0, west * edge_m, 0.0, -edge_m, (south + rows) * edge_m)
    with tempfile.TemporaryDirectory(prefix="hedgehop-") as folder:
        path = Path(folder) / "map.tif"
        write_dsm(path, Dsm(top_m, transform, local_crs(head.origin), None, ""))
        return path.read_bytes()


def _geojson(obstacles: Voxels, head: MapDelta) -> bytes:
    """A polygon around each obstacle as seen from above; longitude and latitude, WGS84 (RFC 7946)."""
    labels = clusters(obstacles.keys)
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    features = [_feature(obstacles, rows, head) for rows in np.split(order, starts[1:]) if len(rows)]
    document = {"type": "FeatureCollection", "features": features}
    return (json.dumps(document, allow_nan=False) + "\n").encode()


def _feature(obstacles: Voxels, rows: NDArray[np.intp], head: MapDelta) -> dict[str, Any]:
    keys, edge_m, frame = obstacles.keys[rows], head.resolution_m, frame_of(head.origin)
    ring = outline(keys[:, :2]) * edge_m
    geodetic = frame.to_geodetic(np.column_stack([ring, np.zeros(len(ring))]))
    centre = frame.to_geodetic([((keys.min(axis=0) + keys.max(axis=0) + 1) / 2 * edge_m)])[0]
    bottom_m, top_m = float(keys[:, 2].min()) * edge_m, (float(keys[:, 2].max()) + 1.0) * edge_m
    return {
        "type": "Feature",
        "geometry": {
            "type": "Polygon",
            "coordinates": [[[round(float(lon), 9), round(float(lat), 9)] for lat, lon, _ in geodetic]],
        },
        "properties": {
            "sensor": head.sensor,
            "voxels": len(rows),
            "voxel_m": edge_m,
            "lat_deg": round(float(centre[0]), 9),
            "lon_deg": round(float(centre[1]), 9),
            "top_alt_rel_home_m": round(top_m, 3),
            "bottom_alt_rel_home_m": round(bottom_m, 3),
            "top_alt_amsl_m": round(top_m + head.origin.alt_amsl_m, 3),
            "largest_probability": round(float(obstacles.probability[rows].max()) / 255.0, 3),
        },
    }


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
