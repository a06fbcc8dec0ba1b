"""Point clouds of each format against a slow oracle, and wrong ones of every kind."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.arrays import F64
from planning.errors import (
    MissingCrsError,
    NoElevationError,
    ParameterError,
    RasterError,
    RasterFormatError,
    RasterTooLargeError,
)
from planning.terrain.clouds.canopy import canopy_of, shares_of
from planning.terrain.clouds.grid import Sorter, cell_for, grid_for, rounded_up
from planning.terrain.clouds.read import LIMITS, CloudParams, read_cloud
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm
from tests.planning.cloud_samples import (
    CORNER,
    UTM_EGM96,
    highest_slowly,
    some_points,
    write_copc,
    write_e57,
    write_las,
    write_pcd,
    write_ply,
)

CELL_M = 0.25
DECLARED = CloudParams(cell_m=CELL_M, crs="EPSG:32633")
NOISE = (7, 18)


def held_against(dsm: Dsm, xyz_m: F64) -> None:
    """Each cell is known where there is a point, and only there, and as high as its highest."""
    cells = highest_slowly(xyz_m, dsm.resolution_m)
    known = np.argwhere(~np.isnan(dsm.elevation_m))
    west, north = dsm.transform.c / dsm.resolution_m, dsm.transform.f / dsm.resolution_m
    found = {
        (round(west) + int(column), round(north) - int(row) - 1): float(dsm.elevation_m[row, column])
        for row, column in known
    }
    assert found.keys() == cells.keys()
    for place, top_m in cells.items():
        assert top_m <= found[place] <= top_m + 2e-4


@pytest.mark.parametrize(("name", "point_format"), [("a.laz", 6), ("old.las", 3)])
def test_las_and_laz(tmp_path: Path, name: str, point_format: int) -> None:
    xyz, classes = some_points(1)
    crs = UTM_EGM96 if point_format >= 6 else "EPSG:32633"
    made = read_cloud(write_las(tmp_path / name, xyz, classes, crs=crs, point_format=point_format), CloudParams(CELL_M))
    noise = np.isin(classes, NOISE)
    held_against(made.dsm, xyz[~noise])
    assert made.ground is not None
    held_against(made.ground, xyz[classes == 2])
    assert (made.points, made.taken, made.noise) == (len(xyz), int((~noise).sum()), int(noise.sum()))
    assert made.dsm.crs.to_epsg() == 32633
    assert "noise were left out" in " ".join(made.notes)


def test_copc_is_a_laz_with_parts_of_any_length(tmp_path: Path) -> None:
    xyz, classes = some_points(14)
    made = read_cloud(write_copc(tmp_path / "a.copc.laz", xyz, classes), CloudParams(CELL_M))
    held_against(made.dsm, xyz[~np.isin(classes, NOISE)])
    assert made.points == len(xyz)


def test_e57_scans_are_placed_by_their_poses_and_invalid_points_left_out(tmp_path: Path) -> None:
    xyz, _ = some_points(15, 1000)
    local = xyz - CORNER
    turn = np.array([math.cos(0.3), 0.0, 0.0, math.sin(0.3)])
    invalid = np.zeros(len(xyz), np.uint8)
    invalid[::5] = 2
    poses = [(np.array([1.0, 0, 0, 0]), CORNER), (turn, CORNER + 20.0)]
    path = write_e57(tmp_path / "a.e57", [local, local], poses=poses, invalid=invalid)
    made = read_cloud(path, DECLARED)
    cosine, sine = math.cos(0.6), math.sin(0.6)
    turned = local @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1.0]]) + CORNER + 20.0
    held_against(made.dsm, np.vstack([each[invalid == 0] for each in (xyz, turned)]))
    assert (made.points, made.not_numbers) == (2 * len(xyz), 2 * int((invalid > 0).sum()))
    assert made.ground is None


def test_what_is_of_which_class_and_how_high_it_stands(tmp_path: Path) -> None:
    xyz, classes = some_points(16)
    made = read_cloud(write_las(tmp_path / "a.laz", xyz, classes), CloudParams(CELL_M))
    counted = np.bincount(classes[~np.isin(classes, NOISE)], minlength=256)
    assert list(made.classes) == counted.tolist()
    shares = shares_of(made.classes)
    assert list(shares) == ["ground", "vegetation", "buildings"]
    assert sum(shares.values()) == pytest.approx(1.0)
    assert made.ground is not None
    tops = highest_slowly(xyz[~np.isin(classes, NOISE)], CELL_M)
    above_m = [tops[place] - ground_m for place, ground_m in highest_slowly(xyz[classes == 2], CELL_M).items()]
    canopy = canopy_of(made.dsm.elevation_m, made.ground.elevation_m)
    assert canopy.cells == len(above_m)
    assert canopy.greatest_m == pytest.approx(max(above_m), abs=1e-3)
    tall = [height_m for height_m in above_m if height_m >= 2.0]
    assert canopy.share == pytest.approx(len(tall) / len(above_m), abs=1e-3)
    assert canopy.median_m == pytest.approx(float(np.median(tall)), abs=1e-2)


def test_points_that_nobody_classified_have_no_shares() -> None:
    counts = [0] * 256
    assert shares_of(counts) == {}
    counts[0], counts[1] = 5, 7
    assert shares_of(counts) == {}
    assert canopy_of(np.ones((2, 2), np.float32), np.full((2, 2), np.nan, np.float32)).cells == 0


def test_datum_is_the_files_and_noise_can_be_kept(tmp_path: Path) -> None:
    xyz, classes = some_points(2)
    made = read_cloud(write_las(tmp_path / "a.laz", xyz, classes), CloudParams(CELL_M, keep_noise=True))
    held_against(made.dsm, xyz)
    assert made.dsm.vertical_datum == "EGM96 height"
    assert made.noise == 0


def test_deleted_points_are_left_out(tmp_path: Path) -> None:
    xyz, classes = some_points(3)
    classes[:], deleted = 2, np.zeros(len(xyz), np.uint8)
    deleted[::3] = 1
    made = read_cloud(write_las(tmp_path / "a.laz", xyz, classes, withheld=deleted), CloudParams(CELL_M))
    held_against(made.dsm, xyz[deleted == 0])


@pytest.mark.parametrize("order", ["<", ">", ""])
def test_ply(tmp_path: Path, order: str) -> None:
    xyz, classes = some_points(4)
    made = read_cloud(write_ply(tmp_path / "a.ply", xyz, classes, order=order), DECLARED)
    held_against(made.dsm, xyz[~np.isin(classes, NOISE)])
    assert made.ground is not None
    held_against(made.ground, xyz[classes == 2])
    assert made.dsm.vertical_datum is None


@pytest.mark.parametrize("text", [False, True])
def test_pcd_with_returns_that_are_no_points(tmp_path: Path, text: bool) -> None:
    xyz, _ = some_points(5)
    holed = xyz.copy()
    holed[::7] = np.nan
    made = read_cloud(write_pcd(tmp_path / "a.pcd", holed, text=text), DECLARED)
    held_against(made.dsm, holed[np.isfinite(holed[:, 0])])
    assert made.ground is None
    assert made.not_numbers == len(holed[::7])
    assert "without a place or height" in " ".join(made.notes)


def test_a_sensors_pose_that_is_not_applied_is_told(tmp_path: Path) -> None:
    xyz, _ = some_points(6, 50)
    made = read_cloud(write_pcd(tmp_path / "a.pcd", xyz, VIEWPOINT="0 0 2 1 0 0 0"), DECLARED)
    assert "was not applied" in " ".join(made.notes)


def test_places_in_32_bits_on_a_map_grid_are_told(tmp_path: Path) -> None:
    xyz, _ = some_points(7, 50)
    coarse = read_cloud(write_ply(tmp_path / "a.ply", xyz, real="f4"), DECLARED)
    assert "0.25 m apart" in " ".join(coarse.notes)
    local = read_cloud(write_ply(tmp_path / "b.ply", xyz - CORNER, real="f4"), DECLARED)
    assert local.notes == ()


def test_feet_become_metres(tmp_path: Path) -> None:
    xyz, classes = some_points(8)
    foot_m = 1200 / 3937
    made = read_cloud(write_las(tmp_path / "a.laz", xyz, classes, crs="EPSG:2229+6360"), CloudParams(CELL_M))
    held_against(made.dsm, xyz[~np.isin(classes, NOISE)] * foot_m)
    assert made.dsm.crs.axis_info[0].unit_name == "metre"
    assert made.dsm.vertical_datum == "NAVD88 height"
    assert "to metres" in " ".join(made.notes)


def test_datum_and_unit_of_heights_from_geotiff_keys(tmp_path: Path) -> None:
    xyz, classes = some_points(8, 500)
    keys = {1024: 1, 3072: 32633, 4096: 5773, 4099: 9002}
    path = write_las(tmp_path / "a.las", xyz, classes, crs=None, point_format=1, geo_keys=keys)
    made = read_cloud(path, CloudParams(CELL_M))
    assert made.dsm.vertical_datum == "EGM96 height"
    assert made.dsm.crs.to_epsg() == 32633
    assert "use --z-scale 0.3048" in " ".join(made.notes)


def test_the_cell_comes_of_the_density() -> None:
    assert cell_for((0.0, 0.0, 100.0, 100.0), 640_000) == 0.25
    assert cell_for((0.0, 0.0, 100.0, 100.0), 630_000) == 0.5
    assert cell_for((0.0, 0.0, 1e9, 1e9), 1) == 5.0


def test_heights_in_32_bits_are_never_lower() -> None:
    heights_m = np.random.default_rng(0).uniform(-500, 9000, 20_000)
    assert (rounded_up(heights_m) >= heights_m).all()
    assert (rounded_up(heights_m) - heights_m).max() < 2e-3


def test_order_and_chunks_make_no_difference() -> None:
    xyz, classes = some_points(9)
    bounds = (*xyz.min(axis=0)[:2].tolist(), *xyz.max(axis=0)[:2].tolist())
    grid = grid_for(bounds, CELL_M, max_px=10**6)
    grids = []
    for parts in ([slice(None)], [slice(700, None), slice(0, 700)]):
        highest_m, ground_m = (np.full(grid.shape, -np.inf, np.float32) for _ in range(2))
        sorter = Sorter(grid, highest_m, ground_m)
        for part in parts:
            sorter.add(xyz[part], classes[part])
        grids.append((sorter.highest_m, sorter.ground_m))
    np.testing.assert_array_equal(grids[0], grids[1])


def cut(path: Path) -> Path:
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * 0.7)])
    return path


def written(name: str, data: bytes) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(data)
        return folder / name

    return write


def plain(folder: Path) -> tuple[Path, F64]:
    return folder / "a", some_points(10, 500)[0]


def las(folder: Path, crs: str = UTM_EGM96) -> Path:
    xyz, classes = some_points(10, 500)
    return write_las(folder / "a.laz", xyz, classes, crs=crs)


def with_wrong_bounds(folder: Path) -> Path:
    xyz, classes = some_points(10, 500)
    path = write_las(folder / "a.las", xyz, classes)
    data = bytearray(path.read_bytes())
    data[179:187] = np.float64(CORNER[0] + 5.0).tobytes()  # greatest x
    path.write_bytes(data)
    return path


PLY = b"ply\nformat ascii 1.0\n"
WRONG: list[tuple[str, Callable[[Path], Path], type[RasterError], str]] = [
    ("nothing", lambda folder: folder / "a.laz", RasterFormatError, "no such file"),
    ("empty", written("a.laz", b""), RasterFormatError, "empty file"),
    ("other", written("a.laz", b"hello world"), RasterFormatError, "no point cloud"),
    ("e57 of a head", written("a.e57", b"ASTM-E57" + bytes(100)), RasterFormatError, "corrupt"),
    ("e57 cut", lambda folder: cut(write_e57(folder / "a.e57", [some_points(10, 5000)[0]])),
     RasterFormatError, "corrupt"),
    ("e57 of no points", lambda folder: write_e57(folder / "a.e57", []), NoElevationError, "no points"),
    ("e57 of no pose", lambda folder: write_e57(folder / "a.e57", [plain(folder)[1]], poses=[(np.zeros(4), CORNER)]),
     RasterFormatError, "pose of its scan 1 is none"),
    ("tiff", written("a.tif", b"II*\0" + bytes(100)), RasterFormatError, "TIFF"),
    ("las of a head", written("a.las", b"LASF" + bytes(40)), RasterFormatError, "corrupt"),
    ("laz cut", lambda folder: cut(las(folder)), RasterFormatError, "a.laz"),
    ("ply cut", lambda folder: cut(write_ply(*plain(folder))), RasterFormatError, "It ends after"),
    ("ply text cut", lambda folder: cut(write_ply(*plain(folder), order="")), RasterFormatError, "a"),
    ("pcd cut", lambda folder: cut(write_pcd(*plain(folder))), RasterFormatError, "It ends after"),
    ("endless ply", written("a.ply", b"ply\n" + b"x" * 100_000), RasterFormatError, "end_header"),
    ("ply of faces", written("a.ply", PLY + b"element face 3\nend_header\n"), RasterFormatError, "first"),
    ("ply of lists", written("a.ply", PLY + b"element vertex 1\nproperty list uchar int x\nend_header\n"),
     RasterFormatError, "lists"),
    ("ply without z", written("a.ply", PLY + b"element vertex 1\nproperty float x\nproperty float y\n"
     b"end_header\n1 2\n"), RasterFormatError, "no x, y and z"),
    ("ply of words", written("a.ply", PLY + b"element vertex 1\nproperty float x\nproperty float y\n"
     b"property float z\nend_header\none two three\n"), RasterFormatError, "cannot be decoded"),
    ("pcd compressed", lambda folder: write_pcd(*plain(folder), DATA="binary_compressed"),
     RasterFormatError, "compressed"),
    ("pcd of strange sizes", lambda folder: write_pcd(*plain(folder), SIZE="8 8 3 8"),
     RasterFormatError, "strange sizes"),
    ("pcd of too few types", lambda folder: write_pcd(*plain(folder), TYPE="F F"), RasterFormatError, "do not fit"),
    ("pcd of many", lambda folder: write_pcd(*plain(folder), COUNT="1 1 999999999999 1"), RasterError, "a"),
    ("pcd of no count", lambda folder: write_pcd(*plain(folder), POINTS="-5"), RasterFormatError, "no count"),
    ("no points", lambda folder: write_ply(folder / "a", np.zeros((0, 3))), NoElevationError, "no points"),
    ("no numbers", lambda folder: write_ply(folder / "a", np.full((9, 3), np.nan)), NoElevationError, "no point with"),
    ("wrong bounds", with_wrong_bounds, RasterFormatError, "outside of the bounds"),
    ("degrees", lambda folder: las(folder, crs="EPSG:4326"), RasterFormatError, "in degrees"),
    ("far apart", lambda folder: write_ply(folder / "a", np.array([[0.0, 0, 0], [1e9, 1e9, 0]])),
     RasterTooLargeError, "--cell-m"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "error", "words"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG])
def test_wrong_files_are_refused(
    tmp_path: Path, make: Callable[[Path], Path], error: type[RasterError], words: str
) -> None:
    path = make(tmp_path)
    declared = None if path.suffix in (".las", ".laz") else "EPSG:32633"
    with pytest.raises(error) as caught:
        read_cloud(path, CloudParams(crs=declared))
    assert words in str(caught.value)
    assert path.name in caught.value.where


@pytest.mark.parametrize("name", ["a.laz", "a.ply", "a.pcd"])
def test_a_cloud_of_no_system_asks_for_one(tmp_path: Path, name: str) -> None:
    xyz, classes = some_points(11, 100)
    write = {".laz": lambda path: write_las(path, xyz, classes, crs=None)}
    write |= {".ply": lambda path: write_ply(path, xyz), ".pcd": lambda path: write_pcd(path, xyz)}
    path = write[Path(name).suffix](tmp_path / name)
    with pytest.raises(MissingCrsError, match="--crs"):
        read_cloud(path)


def test_a_cloud_given_as_a_surface_model_is_sent_here(tmp_path: Path) -> None:
    with pytest.raises(RasterFormatError, match="hedgehop cloud"):
        read_dsm(las(tmp_path))


def test_sizes_that_are_none_are_refused() -> None:
    for value in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ParameterError):
            CloudParams(cell_m=value)
        with pytest.raises(ParameterError):
            CloudParams(z_scale=value)


def test_memory_and_time_end(tmp_path: Path) -> None:
    xyz, _ = some_points(12, 20_000)
    path = write_ply(tmp_path / "a.ply", xyz)
    for limits in (replace(LIMITS, max_px=100), replace(LIMITS, decode_s=1e-3)):
        with pytest.raises(RasterTooLargeError):
            read_cloud(path, replace(DECLARED, limits=limits))


def test_flipped_bits_never_come_through_as_another_error(tmp_path: Path) -> None:
    xyz, classes = some_points(13, 300)
    whole = write_las(tmp_path / "a.laz", xyz, classes).read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(3):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 4):
            data[at] ^= int(rng.integers(1, 256))
        (tmp_path / "b.laz").write_bytes(data)
        with suppress(RasterError):
            made = read_cloud(tmp_path / "b.laz", CloudParams(crs="EPSG:32633"))
            assert made.taken <= made.points


def test_only_the_child_loads_what_decodes() -> None:
    code = (
        "import sys, server.cli.terrain.cloud_command; sys.exit(bool({'laspy', 'lazrs', 'pye57'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
