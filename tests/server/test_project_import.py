"""A project's ZIP becomes a surface model with its orthophoto and points; what does not fit is said and left out."""

from __future__ import annotations

import asyncio
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS, Transformer
from scipy.spatial import KDTree

from mapping.geometry.arrays import F64, U8
from planning.errors import MissingCrsError, ParameterError, RasterFormatError
from planning.terrain.clouds.read import CloudParams
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.projects import Project
from server.errors import BadRequestError, JobCancelledError, StorageFullError
from server.library import Library
from server.library.terrains import UNKNOWN_ORIGIN, store_terrain
from server.plan import project_task
from server.plan.beside_model import placed_on
from server.plan.cloud_points import read_points
from server.plan.file_jobs import FileJobs, use_if_free
from server.plan.file_tasks import import_terrain, without_spikes
from server.schemas import PlanDoc, PoiDoc, TerrainDoc
from tests.planning.cloud_samples import write_las
from tests.planning.geotiff_samples import hill, write_raster
from tests.server.fakes import Told
from tests.server.test_cloud_import import NOTHING_SAID

UTM, NEXT_ZONE = "EPSG:32633", "EPSG:32634"
OFFSET_M = np.array([500_000.0, 4_169_000.0, 0.0])
NAMES = {
    "model": "odm_dem/dsm.tif",
    "photo": "odm_orthophoto/odm_orthophoto.tif",
    "cloud": "odm_georeferencing/odm_georeferenced_model.laz",
}
PIX4D = {
    "model": "h_dsm.tif",
    "photo": "h_mosaic.tif",
    "cloud": "h_densified_point_cloud.laz",
    "offset": "h_offset.xyz",
}


def surface_points() -> F64:
    """(N, 3) on the hill of the model: its cells' middles."""
    heights_m = hill().astype(np.float64)
    row, column = np.mgrid[:40, :50]
    xy = np.column_stack([500_000.25 + 0.5 * column.ravel(), 4_169_999.75 - 0.5 * row.ravel()])
    return np.column_stack([xy, heights_m.ravel()]).round(3)


def project(
    folder: Path, names: dict[str, str] = NAMES, *, model_crs: str | None = UTM, photo_crs: str | None = UTM,
    cloud_crs: str | None = UTM, xyz: F64 | None = None, offset: str = "500000 4169000 0", without: str = "",
    classes: U8 | None = None,
) -> Path:  # fmt: skip
    folder.mkdir(exist_ok=True)
    points = surface_points() if xyz is None else xyz
    kinds = np.full(len(points), 2, np.uint8) if classes is None else classes
    files = {
        "model": write_raster(folder / "model.tif", hill(), crs=model_crs),
        "photo": write_raster(folder / "photo.tif", np.full((3, 40, 50), 120, np.uint8), crs=photo_crs),
        "cloud": write_las(folder / "cloud.laz", points, kinds, crs=cloud_crs, near=points[0].round()),
        "offset": folder / "offset.xyz",
    }
    files["offset"].write_text(offset)
    upload = folder / "0123abcd.zip"
    with zipfile.ZipFile(upload, "w") as archive:
        for kind, name in names.items():
            if kind != without:
                archive.write(files[kind], name)
        archive.writestr("odm_report/report.pdf", b"no raster")
    return upload


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path / "data")


def imported(library: Library, upload: Path, **said: Any) -> TerrainDoc:
    doc = import_terrain(
        library.root, upload, "survey.zip", **{**NOTHING_SAID, **said}, report=lambda stage, share: None
    )
    assert isinstance(doc, TerrainDoc)
    library.refresh()
    assert sorted(path.name for path in upload.parent.glob(f"{upload.stem}-*")) == []
    return doc


def test_model_photo_and_points_of_one_drop(library: Library, tmp_path: Path) -> None:
    doc = imported(library, project(tmp_path / "a"))
    assert (doc.name, doc.width_px, doc.height_px, doc.warnings) == ("survey.zip", 50, 40, [])
    (photo,) = library.orthophotos()
    assert (photo.name, photo.terrain_id) == ("odm_orthophoto.tif", doc.id)
    assert doc.cloud is not None
    assert (doc.cloud.made_model, doc.cloud.points, doc.cloud.shown) == (False, 2000, 2000)
    points = read_points(library.terrain_dir(doc.id))
    dsm = library.load_terrain(doc.id)
    np.testing.assert_allclose(points.xyz_m[:, 2], dsm.elevation_at(points.xyz_m[:, :2]), atol=2e-3)


def test_without_photo_and_cloud_it_is_a_model(library: Library, tmp_path: Path) -> None:
    doc = imported(library, project(tmp_path / "a", {"model": NAMES["model"]}))
    assert (doc.cloud, doc.warnings, library.orthophotos()) == (None, [], [])


def test_parts_that_name_no_system_are_taken_to_be_in_the_models_and_said(library: Library, tmp_path: Path) -> None:
    doc = imported(library, project(tmp_path / "a", photo_crs=None, cloud_crs=None))
    assert doc.cloud is not None
    assert len(library.orthophotos()) == 1
    for warning, part in zip(doc.warnings, ("odm_orthophoto.tif", "odm_georeferenced_model.laz"), strict=True):
        assert part in warning
        assert "names no reference system" in warning


def test_a_cloud_in_another_system_is_brought_into_the_models(library: Library, tmp_path: Path) -> None:
    xyz = surface_points()
    x, y = Transformer.from_crs(UTM, NEXT_ZONE, always_xy=True).transform(xyz[:, 0], xyz[:, 1])
    doc = imported(
        library, project(tmp_path / "a", cloud_crs=NEXT_ZONE, xyz=np.column_stack([x, y, xyz[:, 2]]).round(3))
    )
    assert any("brought into the model's system" in warning for warning in doc.warnings)
    points = read_points(library.terrain_dir(doc.id)).xyz_m
    off_m, _ = KDTree(points).query(xyz)
    assert off_m.max() < 0.02


@pytest.mark.parametrize(
    ("moved_m", "words"),
    [((5000.0, 0.0, 0.0), "lies elsewhere"), ((0.0, 0.0, 41.5), "41.5 m above"), ((0.0, 0.0, -30.0), "30.0 m below")],
)
def test_a_cloud_that_does_not_fit_is_not_shown(
    library: Library, tmp_path: Path, moved_m: tuple[float, ...], words: str
) -> None:
    doc = imported(library, project(tmp_path / "a", xyz=surface_points() + moved_m))
    assert doc.cloud is None
    (warning,) = doc.warnings
    assert words in warning
    assert "export both in one" in warning


def test_a_model_of_bare_ground_under_trees_is_said_and_no_plan_takes_it_by_itself(
    library: Library, tmp_path: Path
) -> None:
    xyz = surface_points()
    xyz[::20, 2] += 14.0
    doc = imported(library, project(tmp_path / "a", xyz=xyz))
    (warning,) = doc.warnings
    assert warning.startswith("20% of odm_georeferencing/odm_georeferenced_model.laz's cells stand more than 2 m above")
    assert "up to 14.0 m" in warning
    assert "terrain model (DTM), without trees and buildings. Open the cloud itself as the model." in warning
    assert doc.cloud is not None
    assert doc.cloud.shown == 2000
    assert doc.in_doubt
    assert use_if_free(PlanDoc(), doc, None) is None


def test_a_cloud_half_beside_the_model_is_not_shown(library: Library, tmp_path: Path) -> None:
    doc = imported(library, project(tmp_path / "a", xyz=surface_points() + np.array([12.5, 0.0, 0.0])))
    assert doc.cloud is None
    assert any("50% of its points lie over it" in warning for warning in doc.warnings)


@pytest.mark.parametrize(("far_m", "fits"), [(0.0, True), (20.0, False)])
def test_a_cloud_beside_its_place_is_told_by_its_heights(far_m: float, fits: bool) -> None:
    rows, columns = np.mgrid[:200, :200]
    heights_m = (100.0 + 10.0 * np.sin(2 * np.pi * columns / 40.0)).astype(np.float32)
    dsm = Dsm(heights_m, Affine(1.0, 0.0, 5e5, 0.0, -1.0, 4.17e6), CRS.from_user_input(UTM), None, "")
    moved = replace(dsm, transform=dsm.transform @ Affine.translation(far_m, 0.0))
    xyz_m = np.column_stack([5e5 + far_m + columns.ravel() + 0.5, 4.17e6 - rows.ravel() - 0.5, heights_m.ravel()])
    placed = placed_on(dsm, ThinnedCloud(xyz_m, None, 0.1), moved, has_crs=True, name="a.laz")
    assert (placed.points is not None, placed.is_above) == (fits, not fits)
    assert fits or "does not lie on the surface model" in placed.notes[-1]


def test_points_that_are_nowhere_are_left_out() -> None:
    dsm = Dsm(np.full((9, 9), 5.0, np.float32), Affine(1, 0, 0, 0, -1, 9), CRS.from_user_input(UTM), None, "")
    xyz_m = np.vstack([np.tile([4.5, 4.5, 5.0], (7, 1)), [[np.inf, 1.0, 1.0], [1.0, 1.0, np.nan]]])
    rgb = np.arange(27, dtype=np.uint8).reshape(9, 3)
    placed = placed_on(dsm, ThinnedCloud(xyz_m, rgb, 0.1), dsm, has_crs=True, name="a.laz")
    assert placed.points is not None
    assert placed.points.rgb is not None
    assert len(placed.points.xyz_m) == len(placed.points.rgb) == 7
    assert np.isfinite(placed.points.xyz_m).all()


def test_heights_in_two_datums_are_not_laid_over_each_other(library: Library, tmp_path: Path) -> None:
    apart = imported(library, project(tmp_path / "a", model_crs=f"{UTM}+5703", cloud_crs=f"{UTM}+5773"))
    assert apart.cloud is None
    (warning,) = apart.warnings
    assert "has heights in EGM96 height, the surface model in NAVD88 height" in warning
    same = imported(library, project(tmp_path / "b", model_crs=f"{UTM}+5773", cloud_crs=f"{UTM}+5773"))
    assert same.cloud is not None


def test_points_far_off_the_model_are_left_out_and_counted(library: Library, tmp_path: Path) -> None:
    far = np.array([[500_000.0, 4_170_000.0 - 300.0, 100.0], [500_010.0, 4_169_990.0, 20_000.0]])
    doc = imported(library, project(tmp_path / "a", xyz=np.vstack([surface_points(), far])))
    assert doc.cloud is not None
    assert doc.cloud.shown == len(read_points(library.terrain_dir(doc.id)).xyz_m) == 2000
    assert any("2 of the 2,002 points" in warning and "were left out" in warning for warning in doc.warnings)


def test_what_is_said_of_the_cloud_is_said_with_the_model(library: Library, tmp_path: Path) -> None:
    classes = np.full(2000, 2, np.uint8)
    classes[:7] = 18
    doc = imported(library, project(tmp_path / "a", classes=classes))
    (warning,) = doc.warnings
    assert "odm_georeferenced_model.laz: 7 points that the file calls noise" in warning


@pytest.mark.parametrize(
    "names",
    [
        {"model": "odm_dem/dtm.tif"},
        {"model": "hill_dtm.tif", "offset": "hill_offset.xyz"},
        {"model": "dtm/dem.tif", "photo": "ortho.tif"},
        {"model": "hill_dsm.tif", "photo": "hill_dtm.tif"},
        {"model": "DTM/1.TIF", "photo": "DTM/2.TIF"},
    ],
)
def test_a_terrain_model_is_no_surface_model(library: Library, tmp_path: Path, names: dict[str, str]) -> None:
    with pytest.raises(RasterFormatError, match=r"a terrain model .*DTM") as caught:
        imported(library, project(tmp_path / "a", names))
    assert "Export the surface model (DSM)" in caught.value.advice
    assert library.terrains() == []


def test_a_file_that_is_called_a_terrain_model_is_opened_with_a_warning(library: Library, tmp_path: Path) -> None:
    upload = write_raster(tmp_path / "0123abcd.tif", hill())
    said: dict[str, Any] = {**NOTHING_SAID, "report": lambda stage, share: None}
    named, plain = (import_terrain(library.root, upload, name, **said) for name in ("hill-DTM.tif", "hill-dsm.tif"))
    assert isinstance(named, TerrainDoc)
    (warning,) = named.warnings
    assert "hill-DTM.tif is a terrain model (DTM) by its name" in warning
    assert isinstance(plain, TerrainDoc)
    assert plain.warnings == []
    metashape = imported(library, project(tmp_path / "a", {"model": "hill_dem.tif", "photo": "hill_ortho.tif"}))
    assert any("hill_dem.tif: make sure that it was built of all points" in warning for warning in metashape.warnings)


def test_pix4ds_offset_is_added_where_it_is_needed(library: Library, tmp_path: Path) -> None:
    near_zero = surface_points() - OFFSET_M
    doc = imported(library, project(tmp_path / "a", PIX4D, cloud_crs=None, xyz=near_zero))
    assert any("offset of its project was added" in warning for warning in doc.warnings)
    points = read_points(library.terrain_dir(doc.id)).xyz_m
    assert points.mean(axis=0) == pytest.approx(surface_points().mean(axis=0), abs=0.01)
    wrong = imported(library, project(tmp_path / "b", PIX4D, offset="500000 nobody 0"))
    assert wrong.cloud is None
    assert any("no three numbers" in warning for warning in wrong.warnings)


def test_what_is_wrong_names_the_projects_file(library: Library, tmp_path: Path) -> None:
    with pytest.raises(MissingCrsError, match=r"survey\.zip, odm_dem/dsm\.tif"):
        imported(library, project(tmp_path / "a", model_crs=None))
    assert imported(library, project(tmp_path / "a", model_crs=None), crs=UTM).cloud is not None
    with pytest.raises(RasterFormatError, match="no surface model") as caught:
        imported(library, project(tmp_path / "b", without="model"))
    assert "odm_georeferenced_model.laz" in caught.value.advice
    with pytest.raises(ParameterError, match="its own cells"):
        imported(library, project(tmp_path / "c"), cell_m=1.0)
    cut = project(tmp_path / "d", xyz=surface_points())
    (tmp_path / "d" / "cloud.laz").write_bytes(b"LASF" + bytes(300))
    with zipfile.ZipFile(cut, "w") as archive:
        archive.write(tmp_path / "d" / "model.tif", NAMES["model"])
        archive.write(tmp_path / "d" / "cloud.laz", NAMES["cloud"])
        archive.writestr(NAMES["photo"], b"II*\0 and nothing else")
    before = len(library.orthophotos())
    doc = imported(library, cut)
    assert (doc.cloud, len(library.orthophotos())) == (None, before)
    photo, cloud = doc.warnings
    assert photo.startswith("The orthophoto is left out. odm_orthophoto/odm_orthophoto.tif:")
    assert cloud.startswith("The point cloud is left out. odm_georeferencing/odm_georeferenced_model.laz:")


def test_a_photo_that_cannot_be_stored_leaves_no_model(
    library: Library, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise StorageFullError("The disk is full.")

    monkeypatch.setattr(project_task, "store_orthophoto", full)
    with pytest.raises(StorageFullError):
        imported(library, project(tmp_path / "a"))
    library.refresh()
    assert library.terrains() == []


def test_what_a_job_stored_before_it_failed_is_told_to_the_pages(library: Library, tmp_path: Path) -> None:
    """A model whose worker was killed while its orthophoto was stored."""
    doc = import_terrain(
        library.root, project(tmp_path / "a"), "a.zip", **NOTHING_SAID, report=lambda stage, share: None
    )
    works: list[Any] = []

    async def call(*_: object, **__: object) -> None:
        raise JobCancelledError("It was cancelled.")

    pages = Told()
    board: Any = SimpleNamespace(start=lambda name, work, clean: works.append(work))
    on_show: Any = SimpleNamespace(terrain_id=None)
    files = FileJobs(library, board, cast("Any", None), on_show, pages)
    files.add_terrain(tmp_path / "b", "b.zip", crs=None, z_scale=None, vertical_datum=None, remove_spikes=False)
    with pytest.raises(JobCancelledError):
        asyncio.run(works[0](SimpleNamespace(call=call), lambda *_: None))
    assert [entry.id for entry in library.terrains()] == [doc.id]


def test_each_file_is_gone_once_it_was_read_and_a_full_disk_is_told_before_anything_is_stored(
    library: Library, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left: list[list[str]] = []

    def watched(root: Path, *told: Any, **more: Any) -> TerrainDoc:
        left.append([path.name for path in tmp_path.glob("a/0123abcd-*/project/*")])
        return store_terrain(root, *told, **more)

    monkeypatch.setattr(project_task, "store_terrain", watched)
    imported(library, project(tmp_path / "a"))
    assert left == [[]]
    found = unpacked(tmp_path)
    monkeypatch.setattr(project_task, "free_bytes", lambda _: 2**30 + 7_999)
    with pytest.raises(StorageFullError, match="surface model") as caught:
        project_task.import_project(
            library.root, "survey.zip", found, origin=UNKNOWN_ORIGIN, params=CloudParams(), without_spikes=False,
            report=lambda stage, share: None,
        )  # fmt: skip
    assert "Free some space" in caught.value.advice
    assert len(left) == 1


def unpacked(folder: Path) -> project_task.Unpacked:
    model = write_raster(folder / "dsm.tif", hill())
    return project_task.Unpacked(Project("OpenDroneMap", "odm_dem/dsm.tif", None, None, None), model, None, None, None)


def test_paths_in_an_archive_that_nobody_gives_are_refused(library: Library, tmp_path: Path) -> None:
    with pytest.raises(BadRequestError, match="path in the archive has 1,31"):
        imported(library, project(tmp_path / "a", {"model": f"{'a' * 1300}/odm_dem/dsm.tif"}))
    doc = imported(
        library, project(tmp_path / "b", {**NAMES, "photo": f"{'p' * 900}/{NAMES['photo']}"}, photo_crs=None)
    )
    (warning,) = doc.warnings
    assert len(warning) < 300


def test_damaged_points_do_not_keep_spikes_from_being_removed(library: Library, tmp_path: Path) -> None:
    doc = imported(library, project(tmp_path / "a", without="photo"))
    directory = library.terrain_dir(doc.id)
    (directory / "points.npy").write_bytes(b"nothing")
    copy = without_spikes(library.root, directory, report=lambda stage, share: None)
    assert copy.cloud is not None
    assert copy.cloud.shown == 0
    assert any("points of its cloud were left out" in warning for warning in copy.warnings)


def test_a_plan_without_points_takes_the_model_with_its_photo_and_another_is_left_alone(
    library: Library, tmp_path: Path
) -> None:
    doc = imported(library, project(tmp_path / "a", without="cloud"))
    (photo,) = library.orthophotos()
    taken = use_if_free(PlanDoc(), doc, photo.id)
    assert taken is not None
    assert (taken[1].terrain_id, taken[1].orthophoto_id) == (doc.id, photo.id)
    busy = PlanDoc(terrain_id="other", pois=[PoiDoc(id="p1", lat_deg=37.0, lon_deg=15.0, name="P1")])
    assert use_if_free(busy, doc, photo.id) is None
