"""A file of photogrammetry -> its textured mesh, decoded in a confined process; not yet on any surface model."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from secrets import token_hex
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32, F64, U8, U32
from planning.errors import RasterFormatError
from planning.terrain.rasters import sandbox
from planning.terrain.rasters.header import RasterLimits
from planning.terrain.rasters.memory_at_hand import watched
from planning.terrain.rasters.reading import Progress

LIMITS = RasterLimits(max_px=1, max_memory_bytes=3 * 2**30, header_s=60.0)
MOST_TRIANGLES = 500_000
MOST_TEXTURE_PX = 16 * 2**20
"""Of all pictures: a browser keeps four bytes of each pixel, and a third more for looking from afar."""
_DECODER = __name__.rpartition(".")[0]
_SMALLER = "Export the mesh with fewer faces and smaller textures, or as 3D Tiles."
_TILESET, _MESH = "tileset.json", (".glb", ".gltf")
_OFFSETS = ("odm_georeferencing/coords.txt", "_offset.xyz", "coords.txt")
_NO_MESH = ("pointcloud", "point_cloud", "__macosx")
_TOLD_SCALE = 0.99


@dataclass(frozen=True, slots=True)
class MeshNames:
    """Where in an archive a mesh begins, and what tells the place of its zero."""

    entry: str
    offset: str | None
    more: int = 0
    """Further meshes, which are left out."""


@dataclass(frozen=True, slots=True)
class MeshPart:
    """Triangles under one picture."""

    vertices: int
    faces: int
    picture: int | None


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles as the file places them; its parts one after the other."""

    xyz_m: F64
    """(V, 3) z up: Earth-centred (WGS 84), or from a zero that only its project knows"""
    uv: F32
    """(V, 2) from a picture's upper left, 0..1, beyond it the picture is repeated"""
    rgba: U8
    """(V, 4) linear factors of the colours"""
    faces: U32
    """(F, 3) into the vertices of their own part"""
    parts: tuple[MeshPart, ...]
    pictures: tuple[bytes, ...]
    """JPEG files of our own"""
    center_m: F64
    """(3,) that the file adds to its vertices; 0 where they come of several files"""
    offset: str | None
    """Text of the file that tells the place of its zero."""
    notes: tuple[str, ...]


def mesh_in(names: Iterable[str]) -> MeshNames | None:
    """Of the paths in an archive: a tileset rather than a file, the outermost; None where there is none."""
    found = [name for name in names if not _is_hidden(name)]
    tilesets = [name for name in found if PurePosixPath(name).name.lower() == _TILESET]
    files = [name for name in found if name.lower().endswith(_MESH)]
    if tilesets:
        folder = [f"{PurePosixPath(name).parent}/" for name in tilesets]
        inside = [name for name in tilesets if sum(name.startswith(each) or each == "./" for each in folder) > 1]
        files = [name for name in tilesets if name not in inside] or tilesets[:1]
    if not files:
        return None
    files.sort(key=lambda name: ("_geo" not in name.lower(), name.count("/"), name))
    offsets = [name for end in _OFFSETS for name in found if name.lower().endswith(end)]
    return MeshNames(files[0], next(iter(offsets), None), len(files) - 1)


def is_mesh(path: Path) -> bool:
    """Whether a file that is no archive is binary glTF, or glTF as text, by its first bytes."""
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise RasterFormatError(f"Cannot read the file: {error.strerror}.", where=path.name) from error
    return head.startswith((b"glTF", b"b3dm")) or (head.lstrip().startswith(b"{") and b'"asset"' in head)


def read_mesh(path: Path, names: MeshNames | None = None, *, where: str, progress: Progress | None = None) -> Mesh:
    """A .glb, .gltf or b3dm file, or that which ``names`` tells of a ZIP archive. Raises a RasterError."""
    with sandbox.private_directory() as directory:
        files = {name: directory / token_hex(8) for name in ("xyz", "uv", "rgba", "faces", "pictures")}
        link = directory / token_hex(8)
        link.symlink_to(path.resolve())
        job = {
            "job": "read_mesh", "decoder": _DECODER, "source": str(link), "entry": names and names.entry,
            "offset": names and names.offset, **{name: str(file) for name, file in files.items()},
        }  # fmt: skip
        found = sandbox.run_job(
            job, directory=directory, limits=LIMITS, where=where, progress=watched(progress, where=where),
            on_header=lambda _: {"triangles": MOST_TRIANGLES, "pixels": MOST_TEXTURE_PX}, smaller=_SMALLER,
        )  # fmt: skip
        try:
            return _mesh(files, found, names)
        except (ValueError, KeyError, TypeError) as error:
            # A decoder that was taken over by its file: what it says does not fit what it wrote.
            raise RasterFormatError("The decoder's answer does not fit.", where=where, advice=_SMALLER) from error


def _mesh(files: dict[str, Path], found: dict[str, Any], names: MeshNames | None) -> Mesh:
    """Raises ValueError where lengths do not fit."""
    xyz_m = np.fromfile(files["xyz"], np.float64).reshape(-1, 3)
    uv = np.fromfile(files["uv"], np.float32).reshape(-1, 2)
    rgba = np.fromfile(files["rgba"], np.uint8).reshape(-1, 4)
    faces = np.fromfile(files["faces"], np.uint32).reshape(-1, 3)
    data, pictures, at = files["pictures"].read_bytes(), [], 0
    for size in found["pictures"]:
        pictures.append(data[at : at + size])
        at += size
    parts = tuple(MeshPart(int(v), int(f), None if p < 0 else int(p)) for v, f, p in found["parts"])
    if not len(xyz_m) == len(uv) == len(rgba) == sum(part.vertices for part in parts):
        raise ValueError("vertices")
    center_m = np.array(found["center"], np.float64)
    if center_m.shape != (3,) or not np.isfinite(center_m).all():
        raise ValueError("center")
    first = 0
    for part in parts:
        inside = faces[first : first + part.faces]
        if len(inside) != part.faces or (part.picture is not None and part.picture >= len(pictures)):
            raise ValueError("parts")
        if len(inside) and int(inside.max()) >= part.vertices:
            raise ValueError("faces")
        first += part.faces
    if first != len(faces) or first > MOST_TRIANGLES or at != len(data) or not np.isfinite(xyz_m).all():
        raise ValueError("lengths")
    return Mesh(xyz_m, uv, rgba, faces, parts, tuple(pictures), center_m, found["offset"], tuple(_notes(found, names)))


def _notes(found: dict[str, Any], names: MeshNames | None) -> list[str]:
    notes = []
    if found["coarser"]:
        notes.append(f"Of the mesh a coarser level is drawn, so that it has at most {MOST_TRIANGLES:,} triangles.")
    if found["scale"] < _TOLD_SCALE and math.isfinite(found["scale"]):
        notes.append(f"The pictures of the mesh are drawn at {found['scale']:.0%} of their size.")
    if found["others"]:
        notes.append("Lines and points in the mesh are left out.")
    if names is not None and names.more:
        notes.append(f"Further meshes in the archive are left out: {names.more}.")
    return notes


def _is_hidden(name: str) -> bool:
    parts = PurePosixPath(name.lower()).parts
    return any(part.startswith(".") or part in _NO_MESH for part in parts)
