"""Textured meshes that are broken, hostile or of a kind that is not read: refused in words that say what to do."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.errors import RasterError
from planning.terrain.meshes import package, tileset
from planning.terrain.meshes.gltf import Gltf
from planning.terrain.meshes.mesh_file import MeshNames, read_mesh
from planning.terrain.meshes.package import Package
from planning.terrain.meshes.tileset import Tileset
from tests.planning.mesh_samples import b3dm, document, dsm_of, glb, packed, picture
from tests.planning.mesh_samples import tileset as sample

XYZ = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
UV = np.zeros((3, 2))
FACES = np.array([[0, 1, 2]])
Json = dict[str, Any]


def changed(change: Callable[[Json], None], **how: Any) -> bytes:
    told, body = document(XYZ, UV, FACES, **how)
    change(told)
    return glb(told, body)


def parts_of(tmp_path: Path, data: bytes) -> list[Any]:
    path = tmp_path / "a.glb"
    path.write_bytes(data)
    return list(Gltf(Package(path, None), "a.glb").parts())


def put(*way: Any, value: Any) -> Callable[[Json], None]:
    def change(told: Json) -> None:
        inside: Any = told
        for step in way[:-1]:
            inside = inside[step]
        inside[way[-1]] = value

    return change


DRACO = put("meshes", 0, "primitives", 0, "extensions", value={"KHR_draco_mesh_compression": {}})
WRONG = {
    "draco needed": (put("extensionsRequired", value=["KHR_draco_mesh_compression"]), "compressed by Draco"),
    "draco": (DRACO, "compressed by Draco"),
    "meshopt": (put("extensionsRequired", value=["EXT_meshopt_compression"]), "compressed by meshopt"),
    "meshopt view": (put("bufferViews", 0, "extensions", value={"EXT_meshopt_compression": {}}), "by meshopt"),
    "ktx2": (put("textures", 0, value={"extensions": {"KHR_texture_basisu": {"source": 0}}}), "KTX2"),
    "unknown": (put("extensionsRequired", value=["X_new"]), "needs the extension X_new"),
    "version": (put("asset", value={"version": "1.0"}), "no glTF 2.0"),
    "address": (put("buffers", 0, "uri", value="https://a.example/b.bin"), "names a file elsewhere"),
    "way out": (put("buffers", 0, "uri", value="../../etc/passwd"), "outside of it"),
    "root": (put("buffers", 0, "uri", value="/etc/passwd"), "names a file elsewhere"),
    "drive": (put("buffers", 0, "uri", value="c:/b.bin"), "names a file elsewhere"),
    "beside": (put("buffers", 0, "uri", value="b.bin"), "needs another file"),
    "damaged text": (put("buffers", 0, "uri", value="data:a;base64,%%"), "damaged"),
    "huge count": (put("accessors", 0, "count", value=2**39), "fewer"),
    "no count": (put("accessors", 0, "count", value=-3), "a number from 0 belongs"),
    "text count": (put("accessors", 0, "count", value="3"), "a number from 0 belongs"),
    "view behind the end": (put("bufferViews", 0, "byteOffset", value=10**6), "behind its end"),
    "long buffer": (put("buffers", 0, "byteLength", value=10**9), "cut short"),
    "short stride": (put("bufferViews", 0, "byteStride", value=4), "fewer"),
    "no accessor": (put("accessors", 2, "bufferView", value=99), "there is no 99"),
    "sparse": (put("accessors", 0, "sparse", value={}), "sparsely"),
    "circle": (put("nodes", value=[{"children": [1], "mesh": 0}, {"children": [0]}]), "in a circle"),
    "twice": (put("nodes", value=[{"children": [1, 1]}, {"mesh": 0}]), "in a circle"),
    "wrong matrix": (put("nodes", 0, "matrix", value=[float("nan")] * 16), "16 numbers"),
    "no rotation": (put("nodes", 0, "rotation", value=[0, 0, 0, 0]), "rotation"),
    "strips": (put("meshes", 0, "primitives", 0, "mode", value=5), "strips or fans"),
    "moved pictures": (
        put("materials", 0, "pbrMetallicRoughness", "baseColorTexture", value={
            "index": 0, "extensions": {"KHR_texture_transform": {}}
        }), "KHR_texture_transform",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_in_a_file_is_said(tmp_path: Path, name: str) -> None:
    change, words = WRONG[name]
    with pytest.raises(RasterError, match=words) as told:
        parts_of(tmp_path, changed(change))
    assert told.value.advice


def test_a_file_that_is_right_is_read(tmp_path: Path) -> None:
    assert len(parts_of(tmp_path, changed(lambda told: None))) == 1


def test_places_that_are_no_numbers_and_triangles_without_vertices(tmp_path: Path) -> None:
    for xyz, faces, words in (
        (np.array([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]), FACES, "no numbers"),
        (XYZ, np.array([[0, 1, 3]]), "names vertex 3 of 3"),
    ):
        told, body = document(np.nan_to_num(xyz), UV, faces)
        data = xyz[:, [0, 2, 1]].astype("<f4").tobytes()
        with pytest.raises(RasterError, match=words):
            parts_of(tmp_path, glb(told, data + body[len(data) :]))


@pytest.mark.parametrize("length", [0, 4, 12, 19, 40, -1])
def test_files_that_are_cut_short_end_in_words(tmp_path: Path, length: int) -> None:
    for data in (changed(lambda told: None), b3dm(changed(lambda told: None))):
        path = tmp_path / "a.glb"
        path.write_bytes(data[:length])
        with pytest.raises(RasterError) as told:
            read_mesh(path, where="mine.glb")
        assert told.value.where == "mine.glb"
        assert told.value.advice


def test_any_byte_may_be_another_one(tmp_path: Path) -> None:
    """Nothing but words, or a mesh, comes of it: no other error, and no vertex outside of the numbers."""
    rng = np.random.default_rng(7)
    right = changed(lambda told: None)
    refused = 0
    for _ in range(400):
        data = bytearray(right)
        for at in rng.integers(0, len(right), rng.integers(1, 4)):
            data[at] = rng.integers(0, 256)
        try:
            for part in parts_of(tmp_path, bytes(data)):
                assert np.isfinite(part.xyz).all()
                assert not len(part.faces) or part.faces.max() < len(part.xyz)
        except (RasterError, KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError):
            refused += 1  # the decoding process says that it is damaged
    assert refused > 100


def test_damage_that_is_no_format_error_is_said_by_the_decoder(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(changed(put("meshes", 0, "primitives", value=7)))
    with pytest.raises(RasterError, match=r"corrupt, cut short or no mesh"):
        read_mesh(path, where="a.glb")


def test_pictures_that_are_none_or_bombs(tmp_path: Path) -> None:
    bomb = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sIIBBBBB", 13, b"IHDR", 60_000, 60_000, 8, 2, 0, 0, 0) + b"\0" * 16
    whole = picture()
    for image, words in (
        (b"no picture", "damaged, or no JPEG"),
        (bomb, "picture in it"),
        (whole[:60], "picture in it"),
    ):
        path = tmp_path / "a.glb"
        path.write_bytes(changed(lambda told: None, image=image))
        with pytest.raises(RasterError, match=words):
            read_mesh(path, where="a.glb")


def of_tiles(tmp_path: Path, root: Json, **files: bytes) -> Tileset:
    told = {"asset": {"version": "1.1"}, "root": root}
    tile = {"a.glb": changed(lambda told: None)}
    path = packed(tmp_path / "a.zip", {"tileset.json": json.dumps(told).encode(), **tile, **files})
    return Tileset(Package(path, "tileset.json"))


@pytest.mark.parametrize(
    ("root", "words"),
    [
        ({"content": {"uri": "tileset.json"}}, "in a circle"),
        ({"content": {"uri": "b.json"}}, "not in the archive"),
        ({"content": {"uri": "http://a.example/a.glb"}}, "names a file elsewhere"),
        ({"content": {"uri": "//a.example/a.glb"}}, "names a file elsewhere"),
        ({"content": {"uri": "..%2f..%2fa.glb"}}, "outside of it"),
        ({"content": {"uri": "..\\a.glb"}}, "names a file elsewhere"),
        ({"content": {"uri": 7}}, "names no file"),
        ({"transform": [1.0] * 15}, "16 numbers"),
        ({"transform": [float("inf")] * 16}, "16 numbers"),
        ({"implicitTiling": {}}, "implicit tiling"),
        ({}, "None of its tiles"),
    ],
)
def test_what_is_wrong_in_a_tileset_is_said(tmp_path: Path, root: Json, words: str) -> None:
    with pytest.raises(RasterError, match=words) as told:
        of_tiles(tmp_path, root).chosen(100)
    assert told.value.advice


def test_trees_without_an_end_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tileset, "MOST_TILES", 50)
    deep: Json = {}
    for _ in range(70):
        deep = {"children": [deep]}
    for root in (deep, {"children": [{}] * 60}):
        with pytest.raises(RasterError, match="more than 50 tiles"):
            of_tiles(tmp_path, root)


def test_other_kinds_of_tiles_are_named(tmp_path: Path) -> None:
    for kind in ("pnts", "i3dm", "cmpt"):
        with pytest.raises(RasterError, match=f"tiles are {kind}"):
            of_tiles(tmp_path, {"content": {"uri": "b.pnts"}}, **{"b.pnts": kind.encode() + b"\0" * 40}).chosen(9)


def test_an_archive_is_not_unpacked_beyond_its_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = packed(tmp_path / "a.zip", {"a.glb": b"glTF" + b"\0" * 5_000_000})
    monkeypatch.setattr(package, "MOST_FILE_BYTES", 1_000_000)
    with pytest.raises(RasterError, match="more than is read"):
        Package(path, "a.glb").read("a.glb")
    monkeypatch.setattr(package, "MOST_FILE_BYTES", 10_000_000)
    monkeypatch.setattr(package, "MOST_BYTES", 8_000_000)
    again = Package(path, "a.glb")
    again.read("a.glb")
    with pytest.raises(RasterError, match="more than is read"):
        again.read("a.glb")


def test_a_tileset_that_is_read_names_the_operators_file_when_a_tile_is_missing(tmp_path: Path) -> None:
    files = sample(dsm_of())
    del files["3d_tiles/model/tiles/east.glb"]
    path = packed(tmp_path / "0123.zip", files)
    with pytest.raises(RasterError, match=r"east\.glb, which is not in the archive") as told:
        read_mesh(path, MeshNames("3d_tiles/model/tileset.json", None), where="survey.zip")
    assert told.value.where == "survey.zip"
    with zipfile.ZipFile(path) as archive:
        assert len(archive.namelist()) == 3
