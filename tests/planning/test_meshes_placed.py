"""Textured meshes are laid where the surface model is, or refused with what to put beside them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.errors import RasterFormatError
from planning.terrain.dsm import Dsm
from planning.terrain.meshes.mesh_file import Mesh, MeshPart, read_mesh
from planning.terrain.meshes.on_model import offset_of, placed_on
from tests.planning.mesh_samples import (
    GEOID_M,
    NORTH_M,
    WEST_M,
    document,
    dsm_of,
    glb,
    ground,
    height_m,
    local_glb,
    packed,
    tileset,
)  # fmt: skip
from tests.planning.test_meshes import ZERO_M, read_zip

COORDS = f"WGS84 UTM 33N\n{ZERO_M[0]:.0f} {ZERO_M[1]:.0f}\n1.0 2.0 3.0\n".encode()


def off_ground_m(xyz_m: np.ndarray) -> float:
    return float(np.abs(xyz_m[:, 2] - height_m(xyz_m[:, 0], xyz_m[:, 1])).max())


def test_a_tileset_lies_on_the_model_by_the_earths_own_frame(tmp_path: Path) -> None:
    dsm = dsm_of()
    placed = placed_on(dsm, read_zip(packed(tmp_path / "a.zip", tileset(dsm))), name="a.zip")
    assert placed.shift_m == pytest.approx(-GEOID_M, abs=0.4)
    assert off_ground_m(placed.mesh.xyz_m) < 0.5
    assert "above the ellipsoid" in placed.notes[0]
    assert "-41" in placed.notes[0]
    same = placed_on(dsm_of("ellipsoid WGS 84", above_m=GEOID_M), read_zip(tmp_path / "a.zip"), name="a.zip")
    assert (same.shift_m, same.notes) == (0.0, ())


@pytest.mark.parametrize("wrong_way", [False, True])
def test_open_drone_maps_offset_puts_a_file_in_its_place(tmp_path: Path, wrong_way: bool) -> None:
    data = local_glb(ZERO_M)
    if wrong_way:  # z up, as some programs write it against the specification
        xyz, uv, faces = ground(1.0)
        data = glb(*document((xyz - ZERO_M) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]).T, uv, faces))
    files = {"odm_texturing/odm_textured_model_geo.glb": data, "odm_georeferencing/coords.txt": COORDS}
    placed = placed_on(dsm_of(), read_zip(packed(tmp_path / "a.zip", files)), name="a.zip")
    assert off_ground_m(placed.mesh.xyz_m) < 0.05
    assert placed.shift_m == 0.0
    assert any("z up" in note for note in placed.notes) == wrong_way


def test_a_file_without_a_place_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(local_glb(ZERO_M))
    with pytest.raises(RasterFormatError, match=r"Nothing tells where a\.glb lies") as told:
        placed_on(dsm_of(), read_mesh(path, where="a.glb"), name="a.glb")
    told_zone = re.search(r"coords\.txt of two lines: '(WGS84 UTM 33N)'", told.value.advice)
    assert told_zone
    assert "a_offset.xyz" in told.value.advice
    # What it says to put beside it, put beside it.
    coords = f"{told_zone[1]}\n{ZERO_M[0]:.0f} {ZERO_M[1]:.0f}\n".encode()
    offset = f"{ZERO_M[0]:.0f} {ZERO_M[1]:.0f} 0".encode()
    for beside in ({"coords.txt": coords}, {"a_offset.xyz": offset}):
        placed = placed_on(
            dsm_of(), read_zip(packed(tmp_path / "a.zip", {"a.glb": path.read_bytes(), **beside})), name=""
        )
        assert off_ground_m(placed.mesh.xyz_m) < 0.05


@pytest.mark.parametrize(
    ("epsg", "west_m", "north_m", "zone"),
    [(32756, 400_000.0, 6_250_000.0, "56S"), (2056, 2_600_000.0, 1_200_000.0, "32N"), (32601, 500_000.0, 7e6, "1N")],
)
def test_the_zone_that_is_told_is_the_models(epsg: int, west_m: float, north_m: float, zone: str) -> None:
    dsm = Dsm(np.zeros((40, 40), np.float32), Affine(0.5, 0, west_m, 0, -0.5, north_m), CRS.from_epsg(epsg), None, "")
    mesh = Mesh(
        np.eye(3), np.zeros((3, 2), np.float32), np.zeros((3, 4), np.uint8), np.array([[0, 1, 2]], np.uint32),
        (MeshPart(3, 1, None),), (), np.zeros(3), None, (),
    )  # fmt: skip
    with pytest.raises(RasterFormatError, match="Nothing tells") as told:
        placed_on(dsm, mesh, name="house.glb")
    assert f"'WGS84 UTM {zone}'" in told.value.advice
    assert "house_offset.xyz" in told.value.advice


def test_a_mesh_of_another_place_or_height_is_refused(tmp_path: Path) -> None:
    files = {"a.glb": local_glb(ZERO_M), "a_offset.xyz": f"{ZERO_M[0]}, {ZERO_M[1]}, 0".encode()}
    mesh = read_zip(packed(tmp_path / "a.zip", files))
    with pytest.raises(RasterFormatError, match=r"does not lie on the surface model: half of it is 9\.\d m"):
        placed_on(dsm_of(above_m=9.5), mesh, name="a.zip")
    moved = {**files, "a_offset.xyz": f"{ZERO_M[0] + 900}, {ZERO_M[1]}, 0".encode()}
    with pytest.raises(RasterFormatError, match="lies elsewhere"):
        placed_on(dsm_of(), read_zip(packed(tmp_path / "b.zip", moved)), name="b.zip")


def test_a_zone_of_another_system_is_brought_into_the_models() -> None:
    zero_m, crs = offset_of("WGS84 UTM 33S\n500000 8000000\n", "a.zip")
    assert crs is not None
    assert (crs.to_epsg(), zero_m.tolist()) == (32733, [500_000.0, 8_000_000.0, 0.0])
    for text in ("", "nowhere", "WGS84 UTM 61N\n1 2", "WGS84 UTM 33N\n1", "nan 1 2", "1,2,3,4"):
        with pytest.raises(RasterFormatError, match=r"no two or three numbers|no zone 61"):
            offset_of(text, "a.zip")


def test_triangles_far_beside_the_model_are_left_out(tmp_path: Path) -> None:
    xyz, uv, faces = ground(1.0)
    far = np.vstack([xyz, [[WEST_M + 900, NORTH_M, 0], [WEST_M + 910, NORTH_M, 0], [WEST_M + 900, NORTH_M - 9, 0]]])
    more = np.vstack([faces, [[len(xyz), len(xyz) + 1, len(xyz) + 2]]])
    data = glb(*document(far - ZERO_M, np.vstack([uv, np.zeros((3, 2))]), more))
    mesh = read_zip(packed(tmp_path / "a.zip", {"a.glb": data, "coords.txt": COORDS}))
    placed = placed_on(dsm_of(), mesh, name="a.zip")
    assert len(placed.mesh.faces) == len(faces)
    assert "1 triangles of a.zip" in placed.notes[-1]
    assert np.ptp(placed.mesh.xyz_m[:, 0]) < 61.0
