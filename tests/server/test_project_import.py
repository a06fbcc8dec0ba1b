"""A project's ZIP becomes a surface model with its orthophoto and points; what does not fit is said and left out."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import Transformer
from scipy.spatial import KDTree

from mapping.geometry.arrays import F64
from planning.errors import MissingCrsError, ParameterError, RasterFormatError
from server.library import Library
from server.plan.cloud_points import read_points
from server.plan.file_jobs import use_if_free
from server.plan.file_tasks import import_terrain
from server.schemas import PlanDoc, PoiDoc, TerrainDoc
from tests.planning.cloud_samples import write_las
from tests.planning.geotiff_samples import hill, write_raster
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
) -> Path:  # fmt: skip
    folder.mkdir(exist_ok=True)
    points = surface_points() if xyz is None else xyz
    files = {
        "model": write_raster(folder / "model.tif", hill(), crs=model_crs),
        "photo": write_raster(folder / "photo.tif", np.full((3, 40, 50), 120, np.uint8), crs=photo_crs),
        "cloud": write_las(
            folder / "cloud.laz", points, np.full(len(points), 2, np.uint8), crs=cloud_crs, near=points[0].round()
        ),
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
