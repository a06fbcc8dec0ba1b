"""Projects of mapping programs, told from folders of tiles by their files' names; and read as one model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planning.errors import RasterFormatError
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.projects import Project, project_of
from tests.planning.geotiff_samples import hill, write_raster

ODM = [
    "odm_dem/dsm.tif", "odm_dem/dtm.tif", "odm_orthophoto/odm_orthophoto.tif", "odm_orthophoto/odm_orthophoto.png",
    "odm_georeferencing/odm_georeferenced_model.laz", "odm_report/report.pdf", "cameras.json",
]  # fmt: skip
PIX4D = [
    "hill/1_initial/params/hill_offset.xyz", "hill/2_densification/point_cloud/hill_group1_densified_point_cloud.las",
    "hill/3_dsm_ortho/1_dsm/hill_dsm.tif", "hill/3_dsm_ortho/1_dsm/tiles/hill_dsm_1_1.tif",
    "hill/3_dsm_ortho/2_mosaic/hill_mosaic_group1.tif", "hill/3_dsm_ortho/2_mosaic/hill_transparent_mosaic_group1.tif",
    "hill/3_dsm_ortho/2_mosaic/tiles/hill_mosaic_group1_1_1.tif",
]  # fmt: skip


def found(names: list[str]) -> Project | None:
    return project_of(names, where="a.zip")


@pytest.mark.parametrize("prefix", ["", "all/", "a/deeper/place/"])
def test_open_drone_maps_layout_wherever_it_lies(prefix: str) -> None:
    project = found([prefix + name for name in ODM])
    assert project is not None
    assert (project.program, project.model) == ("OpenDroneMap", f"{prefix}odm_dem/dsm.tif")
    assert project.orthophoto == f"{prefix}odm_orthophoto/odm_orthophoto.tif"
    assert project.cloud == f"{prefix}odm_georeferencing/odm_georeferenced_model.laz"
    alone = found([prefix + "odm_dem/dsm.tif", prefix + "odm_dem/dtm.tif"])
    assert alone is not None
    assert alone.model == f"{prefix}odm_dem/dsm.tif"


def test_pix4ds_names_with_the_mosaic_that_says_where_it_is_empty() -> None:
    project = found(PIX4D)
    assert project is not None
    assert project.program == "Pix4D"
    assert project.model == "hill/3_dsm_ortho/1_dsm/hill_dsm.tif"
    assert project.orthophoto == "hill/3_dsm_ortho/2_mosaic/hill_transparent_mosaic_group1.tif"
    assert project.cloud == "hill/2_densification/point_cloud/hill_group1_densified_point_cloud.las"
    assert project.offset == "hill/1_initial/params/hill_offset.xyz"
    assert project.more == ("hill/3_dsm_ortho/2_mosaic/hill_mosaic_group1.tif",)


@pytest.mark.parametrize(
    "names",
    [
        ["DEM.tif", "Orthomosaic.tif", "dense_cloud.laz"],
        ["hill_dem.tif", "hill_orthomosaic.tif"],
        ["hill dsm.tif", "hill point cloud.las", "hill dtm.tif"],
    ],
)
def test_what_metashape_calls_its_exports(names: list[str]) -> None:
    project = found(names)
    assert project is not None
    assert (project.program, project.model) == ("Metashape", names[0])


@pytest.mark.parametrize(
    "names",
    [
        [],
        ["a.tif", "b.tif"],
        ["x_dsm.tif"],
        ["north_dsm.tif", "south_dsm.tif"],
        ["tiles/2600_1200_dsm.tif", "tiles/2601_1200_dsm.tif"],
        ["a_dem.tif", "b.tif", "cloud.laz"],
        ["dem.tif", "academic.tif"],
        ["__MACOSX/odm_dem/dsm.tif", ".trash/odm_dem/dsm.tif"],
        ["odm_orthophoto/odm_orthophoto.tif"],
    ],
)
def test_what_is_no_project(names: list[str]) -> None:
    assert found(names) is None


def test_two_projects_in_one_are_told_apart_by_nobody() -> None:
    with pytest.raises(RasterFormatError, match=r"2 surface models: east/odm_dem/dsm\.tif, west/odm_dem"):
        found([f"{place}/{name}" for place in ("west", "east") for name in ODM])


def test_a_folder_with_a_project_is_its_surface_model(tmp_path: Path) -> None:
    model = write_raster(make(tmp_path / "odm_dem" / "dsm.tif"), hill())
    write_raster(make(tmp_path / "odm_dem" / "dtm.tif"), hill() + 500)
    write_raster(make(tmp_path / "odm_orthophoto" / "odm_orthophoto.tif"), np.full((3, 40, 50), 90, np.uint8))
    assert np.array_equal(read_dsm(tmp_path).elevation_m, read_dsm(model).elevation_m, equal_nan=True)
    assert open_dsm(tmp_path).bounds_m == read_dsm(model).bounds_m
    model.unlink()
    make(tmp_path / "odm_georeferencing" / "odm_georeferenced_model.laz").write_bytes(b"LASF")
    with pytest.raises(RasterFormatError, match="no surface model") as caught:
        read_dsm(tmp_path)
    assert "hedgehop cloud odm_georeferencing/odm_georeferenced_model.laz" in caught.value.advice


def make(path: Path) -> Path:
    path.parent.mkdir(exist_ok=True)
    return path
