"""Textured meshes: read as an independent library reads them, the tiles that fit, pictures as small as they must be."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from planning.errors import RasterError
from planning.terrain.meshes import mesh_file
from planning.terrain.meshes.mesh_file import Mesh, MeshNames, is_mesh, mesh_in, read_mesh
from planning.terrain.meshes.package import Package
from planning.terrain.meshes.tileset import Tileset
from tests.planning.mesh_samples import (
    NORTH_M,
    WEST_M,
    document,
    dsm_of,
    glb,
    ground,
    local_glb,
    packed,
    picture,
    tileset,
)  # fmt: skip

ZERO_M = np.array([WEST_M - 37.0, NORTH_M - 11.0, 0.0])


def read_zip(path: Path) -> Mesh:
    with zipfile.ZipFile(path) as archive:
        names = mesh_in(archive.namelist())
    assert names is not None
    return read_mesh(path, names, where=path.name)


def test_a_file_reads_as_trimesh_reads_it(tmp_path: Path) -> None:
    node = {"mesh": 0, "rotation": [0.1, 0.2, 0.3, 0.927], "scale": [2.0, 1.0, 0.5], "translation": [3.0, 4.0, 5.0]}
    xyz, uv, faces = ground(6.0)
    path = tmp_path / "part.glb"
    nodes = [{"children": [1], "matrix": [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 7, 8, 9, 1]}, node]
    path.write_bytes(glb(*document(xyz - xyz.mean(axis=0), uv, faces, changed={"nodes": nodes})))
    mesh = read_mesh(path, where="part.glb")
    scene = trimesh.load(path, process=False)
    (theirs,) = scene.dump()  # pyright: ignore[reportAttributeAccessIssue]
    turned = np.asarray(theirs.vertices) @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    np.testing.assert_allclose(mesh.xyz_m, turned, atol=1e-3)
    np.testing.assert_array_equal(mesh.faces, theirs.faces)
    np.testing.assert_allclose(mesh.uv, uv, atol=1e-6)
    (jpeg,) = mesh.pictures
    assert Image.open(io.BytesIO(jpeg)).size == (64, 64)
    assert (mesh.rgba == 255).all()


def test_the_finest_tiles_that_fit_are_chosen(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.zip", tileset(dsm_of()))
    entry = "3d_tiles/model/tileset.json"

    def chosen(most: int) -> tuple[list[str], bool]:
        tiles = Tileset(Package(path, entry))
        return sorted(name.rpartition("/")[2] for _, name in tiles.chosen(most)), tiles.is_coarser

    fine = 2 * 60 * 60
    assert chosen(fine) == (["east.glb", "west.glb"], False)
    assert chosen(fine - 1) == (["coarse.b3dm"], True)
    with pytest.raises(RasterError, match="coarsest tiles have 72 triangles"):
        chosen(71)


def test_tiles_that_add_keep_what_they_add_to(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.zip", tileset(dsm_of(), refine="ADD"))
    tiles = Tileset(Package(path, "3d_tiles/model/tileset.json"))
    assert len(tiles.chosen(10_000)) == 3


def test_which_file_of_an_archive_the_mesh_is() -> None:
    odm = ["odm_texturing/odm_textured_model_geo.glb", "odm_georeferencing/coords.txt", "3d_tiles/model/tileset.json"]
    assert mesh_in([*odm, "3d_tiles/pointcloud/tileset.json"]) == MeshNames(odm[2], odm[1], 0)
    assert mesh_in(odm[:2]) == MeshNames(odm[0], odm[1], 0)
    assert mesh_in(["a/b/tileset.json", "a/tileset.json", "a/c.glb"]) == MeshNames("a/tileset.json", None, 0)
    assert mesh_in(["b.glb", "a.gltf", "__MACOSX/c.glb"]) == MeshNames("a.gltf", None, 1)
    assert mesh_in(["dsm.tif", ".hidden.glb"]) is None


def test_pictures_are_made_no_larger_than_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_file, "MOST_TEXTURE_PX", 32 * 32)
    path = tmp_path / "a.glb"
    path.write_bytes(local_glb(ZERO_M, 20.0, image=picture(size=128)))
    assert is_mesh(path)
    mesh = read_mesh(path, where="a.glb")
    assert Image.open(io.BytesIO(mesh.pictures[0])).size == (32, 32)
    assert mesh.notes == ("The pictures of the mesh are drawn at 25% of their size.",)
