"""Maps as files: places on Earth are right, obstacles stay apart, what cannot be written is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from mapping.errors import ParameterError
from mapping.geometry.frames import LocalFrame
from mapping.voxels.point_files import pcd
from planning.terrain.clouds.cloud_tables import pcd_table
from planning.terrain.geotiff import read_dsm
from telemetry.perception.rebuilding.export import KINDS, ExportError, clusters, exported, outline
from telemetry.topics.deltas import FoldedMap, in_parts
from telemetry.topics.obstacles import MapDelta, MapOrigin
from tests.reference.octomap import octree
from tests.reference.octomap_bt import map_from_bt

ORIGIN = MapOrigin(-37.1244507, 175.6892879, 803.0)
FRAME = LocalFrame(ORIGIN.lat_deg, ORIGIN.lon_deg, ORIGIN.alt_amsl_m)
HEAD = MapDelta("radar", 1.0, 2.0, 3, True, 0, 1, ORIGIN, 1.0, b"", b"", b"")
MAST = [(700, -500, k) for k in range(20)]
WALL = [(e, 30, 5) for e in range(-10, 11)]
GROUND = [(e, n, -1) for e in range(3) for n in range(3)]


def folded(*, ground: bool = True, obstacles: bool = True, edge_m: float = 1.0) -> FoldedMap:
    keys = np.array((MAST + WALL if obstacles else []) + (GROUND if ground else []), np.int32)
    explained = np.array([0] * (len(keys) - 9 * ground) + [1] * 9 * ground, np.uint8)
    parts = in_parts(replace(HEAD, resolution_m=edge_m), keys, np.full(len(keys), 200, np.uint8), explained)
    return FoldedMap().folded(parts)


def test_geojson_names_each_obstacle_with_its_place_on_earth() -> None:
    document = json.loads(exported("geojson", folded()))
    by_voxels = {f["properties"]["voxels"]: f for f in document["features"]}
    assert sorted(by_voxels) == [20, 21]
    mast = by_voxels[20]
    lat_deg, lon_deg = mast["properties"]["lat_deg"], mast["properties"]["lon_deg"]
    assert FRAME.to_enu(lat_deg, lon_deg, 803.0)[0][:2] == pytest.approx([700.5, -499.5], abs=0.01)
    assert mast["properties"]["top_alt_rel_home_m"] == 20.0
    assert mast["properties"]["top_alt_amsl_m"] == 823.0
    ring = np.array(mast["geometry"]["coordinates"][0])
    corners = FRAME.to_enu(ring[:, 1], ring[:, 0], 803.0)
    assert sorted({(round(e), round(n)) for e, n, _ in corners}) == [(700, -500), (700, -499), (701, -500), (701, -499)]
    assert ring[0].tolist() == ring[-1].tolist()


def test_geotiff_shows_the_highest_obstacle_where_it_is(tmp_path: Path) -> None:
    path = tmp_path / "map.tif"
    path.write_bytes(exported("tif", folded()))
    dsm = read_dsm(path)
    places = FRAME.to_geodetic([[700.5, -499.5, 0.0], [0.5, 30.5, 0.0], [1.5, 1.5, 0.0]])
    heights = dsm.elevation_at(dsm.xy_from_lat_lon(places[:, :2]))
    assert heights[:2] == pytest.approx([823.0, 809.0], abs=0.01)
    assert np.isnan(heights[2])


def test_point_cloud_and_octomap_hold_all_that_is_occupied() -> None:
    tree = map_from_bt(exported("bt", folded(edge_m=0.5)))
    assert tree.resolution_m == 0.5
    assert {tuple(k) for k in tree.occupied_keys()} == set(MAST + WALL + GROUND)
    ply = exported("ply", folded())
    assert f"element vertex {len(MAST + WALL + GROUND)}".encode() in ply


def test_pcd_is_read_as_any_cloud_is(tmp_path: Path) -> None:
    path = tmp_path / "map.pcd"
    path.write_bytes(exported("pcd", folded(edge_m=0.5)))
    (points, _, _), *more = pcd_table(path).chunks(colors=False)
    assert not more
    assert {tuple(np.floor(point / 0.5).astype(int)) for point in points} == set(MAST + WALL + GROUND)
    with pytest.raises(ParameterError, match="probability"):
        pcd(np.zeros((2, 3)), probability=[0.5])


def test_octomap_itself_reads_the_message_out_of_the_bag(tmp_path: Path) -> None:
    """By rosbags' reader and OctoMap's own, which take nothing of what wrote it."""
    path = tmp_path / "map.mcap"
    path.write_bytes(exported("mcap", folded(edge_m=0.5)))
    with AnyReader([path]) as reader:
        ((connection, stamp_ns, raw),) = reader.messages()
        message: Any = reader.deserialize(raw, connection.msgtype)
    assert (connection.topic, connection.msgtype, stamp_ns) == (
        "/octomap_binary",
        "octomap_msgs/msg/Octomap",
        2 * 10**9,
    )
    assert (message.header.frame_id, message.id, message.binary) == ("map", "OcTree", True)
    tree = octree(message.resolution)
    head, _, _ = exported("bt", folded(edge_m=0.5)).partition(b"data\n")
    (tmp_path / "again.bt").write_bytes(head + b"data\n" + message.data.tobytes())
    assert tree.readBinary(str(tmp_path / "again.bt"))
    for east, north, up in (*MAST, *WALL, *GROUND):
        found = tree.search((np.array([east, north, up]) + 0.5) * 0.5)
        assert found is not None
        assert tree.isNodeOccupied(found)
    assert tree.search([3.0, 3.0, 3.0]) is None


@pytest.mark.parametrize("kind", KINDS)
def test_an_empty_map_is_refused(kind: str) -> None:
    for empty in (FoldedMap(), folded(ground=False, obstacles=False)):
        with pytest.raises(ExportError, match="empty"):
            exported(kind, empty)  # type: ignore[arg-type]


def test_a_grid_that_cannot_fit_is_refused_with_the_number() -> None:
    far = in_parts(
        HEAD, np.array([[0, 0, 0], [90_000, 90_000, 0]], np.int32), np.full(2, 200, np.uint8), np.zeros(2, np.uint8)
    )
    with pytest.raises(ExportError, match="90,001 x 90,001"):
        exported("tif", FoldedMap().folded(far))
    with pytest.raises(ExportError, match="only known ground"):
        exported("tif", folded(obstacles=False))


def test_clusters_touch_by_corners_and_outlines_hold_their_cells() -> None:
    keys = np.array([[0, 0, 0], [1, 1, 1], [3, 3, 3], [4, 3, 3], [0, -1, 0]], np.int32)
    labels = clusters(keys)
    assert labels[0] == labels[1] == labels[4]
    assert labels[2] == labels[3] != labels[0]
    ring = outline(np.array([[0, 0], [2, 0]], np.int32))
    assert ring[:, 0].min() == 0.0
    assert ring[:, 0].max() == 3.0
    x, y = ring[:-1].T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0
