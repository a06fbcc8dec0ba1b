"""Thinned clouds: few enough, of the file's own points, upright things kept, the same in whatever order they come."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pye57
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64, U16
from planning.terrain.clouds import decode
from planning.terrain.clouds.cloud_tables import pcd_table, ply_table
from planning.terrain.clouds.read import CloudParams, _left_out, read_cloud
from planning.terrain.clouds.thin import ThinnedCloud, Thinner, highest_of_each
from tests.planning.cloud_samples import CORNER, some_points, write_e57, write_las, write_pcd, write_ply

MOST = 500
SHADES = np.array([[0x12, 0x34, 0x56], [255, 0, 9], [1, 2, 3]], np.uint16)


def thinned(xyz: F64, most: int = MOST, *, parts: int = 1, rgb: U16 | None = None) -> ThinnedCloud:
    low, high = xyz.min(axis=0), xyz.max(axis=0)
    thinner = Thinner.over((low[0], low[1], high[0], high[1]), len(xyz), most=most)
    for part in np.array_split(np.arange(len(xyz)), parts):
        thinner.add(xyz[part], None if rgb is None else rgb[part])
    return thinner.thinned()


def rows(points: F64) -> set[tuple[float, ...]]:
    return set(map(tuple, points.tolist()))


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    count=st.integers(1, 6000),
    parts=st.integers(1, 7),
    spread=st.sampled_from([0.5, 40.0]),
)
def test_few_enough_real_points_in_any_order(seed: int, count: int, parts: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    xyz = CORNER + rng.uniform(0, (spread, 20.0, 9.0), (count, 3))
    found = thinned(xyz, parts=parts)
    assert 0 < len(found.xyz_m) <= MOST
    assert rows(found.xyz_m) <= rows(xyz)
    assert found.xyz_m[:, 2].max() == xyz[:, 2].max()
    again = thinned(xyz[rng.permutation(count)], parts=parts + 2)
    assert rows(again.xyz_m) == rows(found.xyz_m)
    assert again.voxel_m == found.voxel_m
    steps = np.floor((found.xyz_m - [*xyz.min(axis=0)[:2], 0.0]) / found.voxel_m)
    assert len(np.unique(steps, axis=0)) == len(steps)


def test_what_few_points_there_are_all_stay() -> None:
    xyz, _ = some_points(1, MOST)
    assert rows(thinned(xyz).xyz_m) == rows(xyz)


def test_a_cloud_a_thousand_times_too_dense_uses_most_of_the_budget_and_keeps_its_mast() -> None:
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(0, 100, (500_000, 2)), rng.normal(0, 0.02, 500_000)])
    mast = np.column_stack([np.full(300, 50.0), np.full(300, 50.0), np.linspace(0, 30, 300)])
    found = thinned(np.vstack([ground, mast]), parts=9)
    assert 0.8 * MOST <= len(found.xyz_m) <= MOST
    upright = found.xyz_m[found.xyz_m[:, 2] > 1.0]
    # A point for each voxel of its height, where thinning by places alone would have left one in all.
    assert len(upright) >= 30 / found.voxel_m - 2
    assert np.diff(np.sort(upright[:, 2])).max() <= 2 * found.voxel_m
    assert upright[:, 2].max() == 30.0


def test_the_highest_of_each_voxel_and_of_equals_the_first() -> None:
    xyz = np.array([[0.1, 0.1, 0.2], [0.2, 0.2, 0.9], [0.3, 0.3, 0.9], [0.1, 0.1, 1.1], [1.5, 0.0, -3.0]])
    assert sorted(highest_of_each(xyz, (0.0, 0.0), 1.0).tolist()) == [1, 3, 4]


@pytest.mark.parametrize("height", [1e300, -1e300, 5e6])
def test_a_height_that_is_mad_breaks_nothing(height: float) -> None:
    xyz = np.vstack([some_points(2, 900)[0], [*CORNER[:2], height]])
    found = thinned(xyz)
    assert len(found.xyz_m) <= MOST
    assert found.xyz_m[:, 2].max() == xyz[:, 2].max()


def test_colours_stay_with_their_points_and_of_sixteen_bits_the_upper_ones_count() -> None:
    xyz, _ = some_points(3, 4000)
    rgb = np.column_stack([np.arange(len(xyz)) % 256] * 3).astype(np.uint16)
    for scale in (1, 256):
        found = thinned(xyz, parts=3, rgb=rgb * np.uint16(scale))
        assert found.rgb is not None
        of = {tuple(point): shade for point, shade in zip(xyz.tolist(), rgb.tolist(), strict=True)}
        assert [of[tuple(point)] for point in found.xyz_m.tolist()] == found.rgb.tolist()
    assert thinned(xyz, rgb=np.zeros_like(rgb)).rgb is None


def test_what_was_left_out_of_the_model_is_left_out_of_the_points(tmp_path: Path) -> None:
    xyz, classes = some_points(4)
    path = write_las(tmp_path / "a.laz", xyz, classes)
    assert read_cloud(path).thinned is None
    found = read_cloud(path, CloudParams(most_points=100_000)).thinned
    assert found is not None
    assert rows(found.xyz_m.round(3)) == rows(xyz[~np.isin(classes, (7, 18))])
    assert found.rgb is None


def test_las_of_feet_has_its_points_in_the_metres_of_its_model(tmp_path: Path) -> None:
    xyz, classes = some_points(5, 300)
    path = write_las(tmp_path / "a.las", xyz, classes, crs="EPSG:2263")
    made = read_cloud(path, CloudParams(most_points=1000, keep_noise=True))
    assert made.thinned is not None
    heights_m = made.dsm.elevation_at(made.thinned.xyz_m[:, :2])
    assert np.isfinite(heights_m).all()
    assert (made.thinned.xyz_m[:, 2] <= heights_m).all()
    assert made.thinned.xyz_m[:, 2].max() == pytest.approx(heights_m.max(), abs=1e-3)


def test_each_format_tells_its_colours(tmp_path: Path) -> None:
    xyz = CORNER + np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    eight = SHADES.astype(np.uint8)
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), CORNER
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.red, las.green, las.blue = (SHADES * 256).T
    las.write(str(tmp_path / "a.laz"))
    e57 = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    e57.write_scan_raw(
        {f"cartesian{axis}": np.ascontiguousarray(column) for axis, column in zip("XYZ", xyz.T, strict=True)}
        | {
            f"color{name}": np.ascontiguousarray(row)
            for name, row in zip(("Red", "Green", "Blue"), eight.T, strict=True)
        }
    )
    e57.close()
    ply = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property double {axis}\n" for axis in "xyz")
    ply += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) + "end_header\n"
    ply += "".join(" ".join(map(str, [*p, *c])) + "\n" for p, c in zip(xyz.tolist(), eight.tolist(), strict=True))
    (tmp_path / "a.ply").write_text(ply)
    record = np.zeros(3, [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("rgb", "<u4")])
    record["x"], record["y"], record["z"] = xyz.T
    record["rgb"] = (0xFF << 24) | (SHADES.astype(np.uint32) @ np.array([65536, 256, 1], np.uint32))
    pcd = "VERSION 0.7\nFIELDS x y z rgb\nSIZE 8 8 8 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\n"
    pcd += "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA binary\n"
    (tmp_path / "a.pcd").write_bytes(pcd.encode() + record.tobytes())
    for name in ("a.laz", "a.e57", "a.ply", "a.pcd"):
        params = CloudParams(cell_m=1.0, crs="EPSG:32633", most_points=10)
        found = read_cloud(tmp_path / name, params).thinned
        assert found is not None, name
        assert found.rgb is not None, name
        order = np.argsort(found.xyz_m[:, 2])
        np.testing.assert_array_equal(found.rgb[order], eight, err_msg=name)


def test_fields_that_only_sound_like_colours_are_none(tmp_path: Path) -> None:
    xyz = some_points(6, 20)[0]
    assert ply_table(write_ply(tmp_path / "a.ply", xyz)).colors == ()
    assert pcd_table(write_pcd(tmp_path / "a.pcd", xyz)).colors == ()
    found = read_cloud(write_e57(tmp_path / "a.e57", [xyz]), CloudParams(crs="EPSG:32633", most_points=10)).thinned
    assert found is not None
    assert found.rgb is None


def test_of_very_many_points_some_are_looked_at_and_the_model_is_of_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decode, "_MOST_THINNED", 300)
    xyz = (CORNER + np.random.default_rng(1).uniform(0, 20, (1000, 3))).round(3)
    cloud = write_las(tmp_path / "a.las", xyz, np.full(1000, 2, np.uint8))
    sent: list[dict[str, Any]] = []
    job = {
        "source": str(cloud),
        "format": "las",
        **{name: str(tmp_path / name) for name in ("target", "points", "colors", "ground")},
    }
    order = {"cell_m": 1.0, "xy_m": 1.0, "z_m": 1.0, "max_px": 10**6, "keep_noise": False, "most_points": 5000}
    decode.read_cloud(job, lambda kind, **told: sent.append({"kind": kind, **told}), lambda header: order)
    done = sent[-1]
    assert (done["kind"], done["taken"], done["every"], done["shown"]) == ("done", 1000, 4, 250)
    assert any("one of each 4" in note for note in _left_out({**done, "cell_m": 1.0}))
    assert not any("one of each" in note for note in _left_out({**done, "every": 1}))
