"""A point cloud that a page sends: its model in the library, with what the points told; wrong ones in words."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.errors import MissingCrsError, ParameterError, RasterError, RasterTooLargeError
from server.errors import NotFoundError, StorageError
from server.library.terrains import Origin, load_terrain
from server.plan.cloud_points import read_points
from server.plan.file_tasks import import_terrain, without_spikes
from server.schemas import TerrainDoc
from tests.planning.cloud_samples import CORNER, some_points, write_las, write_ply

NOTHING_SAID: dict[str, Any] = {
    "origin": Origin(), "crs": None, "z_scale": None, "vertical_datum": None, "remove_spikes": False, "cell_m": None,
    "keep_noise": False,
}  # fmt: skip


def imported(root: Path, upload: Path, name: str = "survey.laz", **said: Any) -> tuple[TerrainDoc, list[str]]:
    stages: list[str] = []
    doc = import_terrain(
        root, upload, name, **{**NOTHING_SAID, **said}, report=lambda stage, share: stages.append(stage)
    )
    assert isinstance(doc, TerrainDoc)
    return doc, list(dict.fromkeys(stages))


def test_a_cloud_becomes_a_model_that_says_where_it_came_from(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    plane = np.column_stack([rng.uniform(0, 20, (20_000, 2)), rng.uniform(0, 0.1, 20_000)])
    hole = np.hypot(plane[:, 0] - 5, plane[:, 1] - 5) < 0.9
    plane = plane[~hole]
    xyz = CORNER + np.vstack([plane, [[10.0, 10.0, 30.0], [15.0, 15.0, 90.0]]]).round(3)
    classes = np.full(len(xyz), 2, np.uint8)
    classes[-2:] = 5, 7
    (tmp_path / "terrains").mkdir()
    upload = write_las(tmp_path / "0123.laz", xyz, classes)
    doc, stages = imported(tmp_path, upload)
    assert stages == ["Sorting the points", "Thinning the points", "Looking for spikes", "Looking for holes", "Storing"]
    assert (doc.name, doc.vertical_datum, doc.resolution_m) == ("survey.laz", "EGM96 height", 0.5)
    cloud = doc.cloud
    assert cloud is not None
    assert (cloud.points, cloud.taken, cloud.noise, cloud.cell_chosen) == (len(xyz), len(xyz) - 1, 1, False)
    assert [share.what for share in cloud.shares] == ["ground", "vegetation"]
    assert cloud.small_holes >= 1
    assert 0.5 <= cloud.small_holes_m2 <= np.pi * 0.9**2
    assert cloud.canopy_greatest_m == pytest.approx(30.0, abs=0.2)
    assert [round(spike.height_m) for spike in doc.spikes] == [30]
    assert any("noise were left out" in warning for warning in doc.warnings)
    stored = load_terrain(tmp_path / "terrains" / doc.id)
    assert np.nanmax(stored.elevation_m) == pytest.approx(CORNER[2] + 30.0, abs=0.01)

    points = read_points(tmp_path / "terrains" / doc.id)
    assert (cloud.shown, cloud.colored) == (len(points.xyz_m), False)
    assert cloud.shown == len(xyz) - 1
    assert points.xyz_m[:, 2].max() == pytest.approx(CORNER[2] + 30.0)
    bare = without_spikes(tmp_path, tmp_path / "terrains" / doc.id, report=lambda stage, share: None)
    assert bare.cloud is not None
    assert (bare.cloud.shown, bare.cloud.canopy_greatest_m) == (cloud.shown, None)
    assert np.array_equal(read_points(tmp_path / "terrains" / bare.id).xyz_m, points.xyz_m)

    again, _ = imported(tmp_path, upload, remove_spikes=True, cell_m=1.0, keep_noise=True)
    assert again.cloud is not None
    assert (again.resolution_m, again.cloud.cell_chosen, again.cloud.noise, again.spikes) == (1.0, True, 0, [])
    assert any("2 isolated spikes and pits were removed" in warning for warning in again.warnings)
    assert again.sha256 != doc.sha256


def test_what_is_wrong_is_said_of_the_operators_own_file(tmp_path: Path) -> None:
    xyz, classes = some_points(3, 200)
    bare = write_las(tmp_path / "0123.laz", xyz, classes, crs=None)
    cut = tmp_path / "4567.laz"
    cut.write_bytes(bare.read_bytes()[:600])
    far = write_ply(tmp_path / "89ab.ply", np.array([[0.0, 0, 0], [1e9, 1e9, 0]]))
    cases: list[tuple[Path, dict[str, Any], type[Exception], str]] = [
        (bare, {}, MissingCrsError, "no coordinate reference system"),
        (bare, {"crs": "EPSG:32633", "cell_m": -1.0}, ParameterError, "greater than 0"),
        (cut, {"crs": "EPSG:32633"}, RasterError, "survey.laz"),
        (far, {"crs": "EPSG:32633"}, RasterTooLargeError, "larger cells"),
    ]
    for upload, said, kind, words in cases:
        with pytest.raises(kind, match=words) as caught:
            imported(tmp_path, upload, **said)
        assert upload.stem not in str(caught.value)
    assert not (tmp_path / "terrains").exists()


def test_points_that_were_never_kept_or_are_damaged_are_said(tmp_path: Path) -> None:
    xyz, classes = some_points(4, 300)
    (tmp_path / "terrains").mkdir()
    doc, _ = imported(tmp_path, write_las(tmp_path / "a.las", xyz, classes))
    folder = tmp_path / "terrains" / doc.id
    (folder / "points.npy").write_bytes(b"no array")
    with pytest.raises(StorageError, match="damaged"):
        read_points(folder)
    manifest = folder / "manifest.json"
    told = json.loads(manifest.read_text())
    for name in ("shown", "voxel_m", "colored"):  # as those that were stored before points were kept
        del told["doc"]["cloud"][name]
    manifest.write_text(json.dumps(told))
    with pytest.raises(NotFoundError, match="No points"):
        read_points(folder)


def test_rasters_are_asked_for_no_cells(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_bytes(b"II*\0" + bytes(100))
    with pytest.raises(ParameterError, match="its own cells"):
        imported(tmp_path, tmp_path / "a.tif", "dsm.tif", cell_m=0.5)
