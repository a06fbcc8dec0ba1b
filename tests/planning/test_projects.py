"""Projects of mapping programs, told from folders of tiles by their files' names; and read as one model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planning.errors import RasterFormatError
from planning.terrain import projects
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.projects import Project, is_terrain, project_of, shortened
from tests.planning.geotiff_samples import hill, write_raster

ROOT = Path(__file__).parents[2]
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


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("dtm.tif", True), ("a/hill_DTM_1m.TIF", True), ("dtm1m.tif", True), ("dtm/dem.tif", True),
        ("3_dsm_ortho/extras/dtm/tile_1.tif", True), ("DGM1/a.tif", True), ("bare-earth.tif", True),
        ("dsm-ground.tif", True), ("dtm/hill_dsm.tif", False), ("dtm/1_dsm/a.tif", False), ("dsm.tif", False),
        ("hill.tif", False), ("midtmorning.tif", False), ("dsm_ground_control.tif", False),
    ],
)  # fmt: skip
def test_terrain_models_are_told_by_their_name_or_the_nearest_folders(name: str, says: bool) -> None:
    assert is_terrain(name) is says


def test_a_folder_of_terrain_models_is_refused_and_one_that_is_given_by_name_is_warned_of(tmp_path: Path) -> None:
    write_raster(make(tmp_path / "all" / "odm_dem.d" / "dtm.tif"), hill())
    with pytest.raises(RasterFormatError, match=r"only a terrain model \(DTM\), odm_dem\.d/dtm\.tif"):
        open_dsm(tmp_path / "all")
    (warning,) = open_dsm(tmp_path / "all" / "odm_dem.d" / "dtm.tif").warnings
    assert "would fly into them" in warning
    write_raster(make(tmp_path / "metashape" / "dem.tif"), hill())
    write_raster(tmp_path / "metashape" / "ortho.tif", np.full((3, 40, 50), 90, np.uint8))
    (warning,) = open_dsm(tmp_path / "metashape").warnings
    assert "dem.tif: make sure" in warning


def test_a_name_of_any_length_is_shortened_in_messages() -> None:
    long = f"{'a' * 40_000}/odm_dem/dsm.tif"
    with pytest.raises(RasterFormatError) as caught:
        found([long, "b/odm_dem/dsm.tif"])
    assert len(str(caught.value)) < 400
    assert "/odm_dem/dsm.tif" in caught.value.what
    assert shortened("a\x1b[31mb") == "a?[31mb"


def test_the_console_tells_dropped_folders_by_the_same_names() -> None:
    told = json.loads((ROOT / "web/src/store/project_names.json").read_text())
    programs = {program["name"]: (program["kinds"], program["least"]) for program in told["programs"]}
    ours = {
        name: ({kind: found.pattern for kind, found in kinds.items()}, least)
        for name, kinds, least in projects.PROGRAMS
    }
    assert list(programs) == list(ours)
    assert programs == ours
    words = (projects.SURFACE, projects.TERRAIN, projects.GROUND)
    assert (told["surface"], told["terrain"], told["ground"]) == tuple(word.pattern for word in words)
    assert told["tiles"] == projects.TILES


def make(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
