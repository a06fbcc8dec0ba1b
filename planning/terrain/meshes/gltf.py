"""glTF 2.0 and the b3dm around it: triangles with their places, colours and pictures, every length looked at first.

Khronos glTF 2.0 specification; OGC 3D Tiles 1.1, annex on Batched 3D Model. What comes compressed is refused.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32, F64, U8, U32
from planning.errors import RasterFormatError, RasterTooLargeError
from planning.terrain.meshes.package import Package

Json = dict[str, Any]
MOST_VERTICES = 3_000_000
"""Of one file."""
_MOST_NODES, _DEEPEST = 20_000, 64
_GLB, _JSON, _BIN = b"glTF", 0x4E4F534A, 0x004E4942
_B3DM_HEADER = struct.Struct("<4sIIIIII")
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES = 4
_PLAIN = "Export it without compression: binary glTF (.glb) with JPEG or PNG textures. OpenDroneMap: --3d-tiles."
_COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
    "KHR_texture_basisu": "KTX2 (Basis Universal)",
}
_KNOWN = {"KHR_materials_unlit", "KHR_mesh_quantization", "CESIUM_RTC", "EXT_texture_webp"}
Z_UP_FROM_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Part:
    """Triangles under one picture."""

    xyz: F64
    """(N, 3) metres, z up, where the file puts them"""
    uv: F32
    """(N, 2) from the picture's upper left"""
    rgba: U8
    """(N, 4) linear factors of its colours"""
    faces: U32
    """(F, 3)"""
    picture: int | None
    """Of the file."""


def broken(why: str) -> RasterFormatError:
    return RasterFormatError(f"It is damaged: {why}.", advice="Export it again.")


class Gltf:
    """One file. ``triangles`` is known before anything is decoded. Raises RasterFormatError, RasterTooLargeError."""

    def __init__(self, package: Package, name: str) -> None:
        self._package, self._name = package, name
        data, rtc = _unwrapped(package.read(name))
        self._body: bytes | None = None
        self._json = self._opened(data)
        self._check_extensions()
        center = self._json.get("extensions", {}).get("CESIUM_RTC", {}).get("center", rtc)
        self.center_m = np.array(center, dtype=np.float64)
        if self.center_m.shape != (3,) or not np.isfinite(self.center_m).all():
            raise broken("its centre is no three numbers")
        self._buffers: dict[int, bytes] = {}
        self._placed = list(self._nodes())
        self.others = sum(not _is_triangles(each) for _, each in self._placed)
        """Lines and points, which are left out."""
        self.triangles = sum(self._count(each) // 3 for _, each in self._placed if _is_triangles(each))
        self.vertices = sum(
            _whole(self._item("accessors", each["attributes"]["POSITION"])["count"])
            for _, each in self._placed if _is_triangles(each)
        )  # fmt: skip

    def parts(self) -> Iterator[Part]:
        if self.vertices > MOST_VERTICES:
            what = f"It has {self.vertices:,} vertices; {MOST_VERTICES:,} are the most."
            raise RasterTooLargeError(what, advice="Export the mesh with fewer faces, or as 3D Tiles.")
        for matrix, primitive in self._placed:
            if _is_triangles(primitive):
                yield self._part(matrix, primitive)

    def picture(self, index: int) -> bytes:
        image = self._item("images", index)
        if "bufferView" in image:
            return self._view(image["bufferView"])
        return self._package.follow(self._name, image.get("uri"))

    def _opened(self, data: bytes) -> Json:
        if not data.startswith(_GLB):
            return _object(data)
        if len(data) < 20:
            raise broken("it ends within its header")
        version, length, size, kind = struct.unpack_from("<IIII", data, 4)
        if version != 2:
            raise RasterFormatError(f"It is glTF {version}; glTF 2.0 is read.", advice="Export it as glTF 2.0.")
        if length > len(data) or kind != _JSON or 20 + size > length:
            raise broken(f"it says {length:,} bytes and has {len(data):,}")
        at = 20 + size
        if at + 8 <= length:
            size_bin, kind = struct.unpack_from("<II", data, at)
            if kind == _BIN:
                if at + 8 + size_bin > length:
                    raise broken("its data are cut short")
                self._body = data[at + 8 : at + 8 + size_bin]
        return _object(data[20 : 20 + size])

    def _check_extensions(self) -> None:
        if str(self._json.get("asset", {}).get("version", "")).split(".")[0] != "2":
            raise RasterFormatError("It is no glTF 2.0.", advice="Export it as glTF 2.0.")
        needed = [str(each) for each in self._json.get("extensionsRequired", [])]
        for name in needed:
            if name in _COMPRESSED:
                raise RasterFormatError(f"It is compressed by {_COMPRESSED[name]}, which is not read.", advice=_PLAIN)
            if name not in _KNOWN:
                raise RasterFormatError(f"It needs the extension {name[:60]}, which is not read.", advice=_PLAIN)

    def _nodes(self) -> Iterator[tuple[F64, Json]]:
        """(4, 4) and primitive, for each time that one is drawn."""
        scenes = self._json.get("scenes")
        if scenes:
            roots = self._item("scenes", self._json.get("scene", 0)).get("nodes", [])
        else:
            roots = range(len(self._json.get("nodes", [])))
        todo = [(index, np.eye(4), 0) for index in roots]
        seen: set[int] = set()
        while todo:
            index, above, depth = todo.pop()
            node = self._item("nodes", index)
            if index in seen or depth > _DEEPEST:
                raise broken("its nodes hang in a circle")
            seen.add(index)
            if len(seen) > _MOST_NODES:
                raise RasterTooLargeError(f"It has more than {_MOST_NODES:,} nodes.", advice="Join its parts.")
            matrix = above @ _matrix(node)
            if "mesh" in node:
                yield from ((matrix, each) for each in self._item("meshes", node["mesh"])["primitives"])
            todo += [(child, matrix, depth + 1) for child in node.get("children", [])]

    def _count(self, primitive: Json) -> int:
        index = primitive.get("indices", primitive["attributes"]["POSITION"])
        return _whole(self._item("accessors", index)["count"])

    def _part(self, matrix: F64, primitive: Json) -> Part:
        named = primitive["attributes"]
        places = self._numbers(named["POSITION"], 3)
        if not np.isfinite(places).all():
            raise broken("some of its places are no numbers")
        xyz = (places @ matrix[:3, :3].T + matrix[:3, 3]) @ Z_UP_FROM_Y_UP.T + self.center_m
        if not np.isfinite(xyz).all():
            raise broken("some of its places are no numbers")
        faces = self._faces(primitive, len(xyz))
        material = self._item("materials", primitive["material"]) if "material" in primitive else {}
        surface = material.get("pbrMetallicRoughness", {})
        texture = surface.get("baseColorTexture")
        if texture is not None and "KHR_texture_transform" in texture.get("extensions", {}):
            raise RasterFormatError("Its pictures are moved (KHR_texture_transform), which is not read.", advice=_PLAIN)
        uv, picture = np.zeros((len(xyz), 2), np.float32), None
        key = "" if texture is None else f"TEXCOORD_{_whole(texture.get('texCoord', 0))}"
        if texture is not None and key in named:
            uv, picture = self._numbers(named[key], 2).astype(np.float32), self._picture_of(texture["index"])
            if len(uv) != len(xyz) or not np.isfinite(uv).all():
                raise broken("its places in pictures do not fit")
        return Part(xyz, uv, self._colors(named, surface, len(xyz)), faces, picture)

    def _faces(self, primitive: Json, vertices: int) -> U32:
        if "indices" in primitive:
            found = self._accessor(primitive["indices"], 1)[:, 0]
            if found.dtype.kind != "u":
                raise broken("its triangles are numbered by fractions")
        else:
            found = np.arange(vertices)
        if len(found) and int(found.max()) >= vertices:
            raise broken(f"a triangle names vertex {int(found.max()):,} of {vertices:,}")
        return found[: len(found) // 3 * 3].reshape(-1, 3).astype(np.uint32)

    def _colors(self, named: Json, surface: Json, vertices: int) -> U8:
        factor = np.array(surface.get("baseColorFactor", (1, 1, 1, 1)), np.float64)
        if factor.shape != (4,):
            raise broken("a colour is no four numbers")
        rgba = np.tile(np.nan_to_num(factor), (vertices, 1))
        if "COLOR_0" in named:
            own = self._numbers(named["COLOR_0"], None)
            if own.shape not in ((vertices, 3), (vertices, 4)):
                raise broken("its colours do not fit its vertices")
            rgba[:, :3] *= np.nan_to_num(own[:, :3])
        rgba[:, 3] = 1.0
        return np.round(np.clip(rgba, 0.0, 1.0) * 255).astype(np.uint8)

    def _picture_of(self, texture: int) -> int:
        found = self._item("textures", texture)
        extensions = found.get("extensions", {})
        source = extensions.get("EXT_texture_webp", {}).get("source", found.get("source"))
        if source is None:
            names = ", ".join(_COMPRESSED.get(str(each), str(each)[:40]) for each in extensions) or "nothing"
            raise RasterFormatError(f"A picture comes as {names}, which is not read.", advice=_PLAIN)
        return _whole(source)

    def _numbers(self, index: int, width: int | None) -> F64:
        found = self._accessor(index, width)
        scaled = found.dtype.kind != "f" and self._item("accessors", index).get("normalized", False)
        return found.astype(np.float64) / (np.iinfo(found.dtype).max if scaled else 1.0)

    def _accessor(self, index: int, width: int | None) -> np.ndarray:
        """(N, width), or of any width; within its view, which lies within its buffer."""
        told = self._item("accessors", index)
        if "bufferView" not in told or "sparse" in told:
            raise RasterFormatError("It keeps numbers sparsely, which is not read.", advice=_PLAIN)
        dtype, columns, count = np.dtype(_TYPES[told["componentType"]]), _WIDTHS[told["type"]], _whole(told["count"])
        if width not in (None, columns):
            raise broken(f"{told['type']} stands where {width} numbers belong")
        data, size = self._view(told["bufferView"]), dtype.itemsize * columns
        stride = _whole(self._item("bufferViews", told["bufferView"]).get("byteStride", size)) or size
        offset = _whole(told.get("byteOffset", 0))
        if stride < size or offset + max(0, count - 1) * stride + size > len(data):
            raise broken(f"it says {count:,} numbers where there are fewer")
        return np.ndarray((count, columns), dtype, data, offset, (stride, dtype.itemsize))

    def _view(self, index: int) -> bytes:
        told = self._item("bufferViews", index)
        if _COMPRESSED.keys() & told.get("extensions", {}).keys():
            raise RasterFormatError("It is compressed by meshopt, which is not read.", advice=_PLAIN)
        data, start, length = self._buffer(told["buffer"]), _whole(told.get("byteOffset", 0)), told["byteLength"]
        if start + _whole(length) > len(data):
            raise broken("a part of it lies behind its end")
        return data[start : start + length]

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            told = self._item("buffers", index)
            data = self._package.follow(self._name, told["uri"]) if "uri" in told else self._body
            if data is None or _whole(told["byteLength"]) > len(data):
                raise broken("its data are cut short")
            self._buffers[index] = data
        return self._buffers[index]

    def _item(self, kind: str, index: object) -> Json:
        found, at = self._json.get(kind, []), _whole(index)
        if not isinstance(found, list) or at >= len(found) or not isinstance(found[at], dict):
            raise broken(f"there is no {at} among its {kind}")
        return found[at]


def _is_triangles(primitive: Json) -> bool:
    mode = primitive.get("mode", _TRIANGLES)
    if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
        raise RasterFormatError("It is compressed by Draco, which is not read.", advice=_PLAIN)
    if mode in (5, 6):
        raise RasterFormatError("Its triangles come as strips or fans, which are not read.", advice=_PLAIN)
    return mode == _TRIANGLES


def _whole(value: object) -> int:
    if not isinstance(value, int) or not 0 <= value < 2**40:
        raise broken(f"{str(value)[:40]} stands where a number from 0 belongs")
    return value


def _object(data: bytes) -> Json:
    found = json.loads(data)
    if not isinstance(found, dict):
        raise broken("its text is no object")
    return found


def _unwrapped(data: bytes) -> tuple[bytes, Any]:
    """What lies in a b3dm, and its centre; other files as they are."""
    kind = data[:4]
    if kind in (b"pnts", b"i3dm", b"cmpt", b"subt"):
        what = f"Its tiles are {kind.decode()}: points, copies or parts, which are no mesh."
        raise RasterFormatError(what, advice="Give the tileset of the textured mesh (b3dm or glb tiles).")
    if kind != b"b3dm":
        return data, (0.0, 0.0, 0.0)
    if len(data) < _B3DM_HEADER.size:
        raise broken("a tile ends within its header")
    _, version, length, *tables = _B3DM_HEADER.unpack_from(data)
    start = _B3DM_HEADER.size + sum(tables)
    if version != 1 or length > len(data) or start + 12 > length or data[start : start + 4] != _GLB:
        raise broken("a tile's lengths do not fit")
    features = _object(data[28 : 28 + tables[0]].rstrip(b" \0") or b"{}")
    return data[start:length], features.get("RTC_CENTER", (0.0, 0.0, 0.0))


def _matrix(node: Json) -> F64:
    """glTF 2.0, 3.5.2: columns first; else translation * rotation * scale."""
    if "matrix" in node:
        return _finite(node["matrix"], 16).reshape(4, 4).T
    out = np.eye(4)
    x, y, z, w = _finite(node.get("rotation", (0, 0, 0, 1)), 4)
    length = float(np.hypot(np.hypot(x, y), np.hypot(z, w)))
    if not length > 0.0:
        raise broken("a rotation is none")
    x, y, z, w = (each / length for each in (x, y, z, w))
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, :3] *= _finite(node.get("scale", (1, 1, 1)), 3)
    out[:3, 3] = _finite(node.get("translation", (0, 0, 0)), 3)
    return out


def _finite(numbers: Any, count: int) -> F64:
    found = np.array(numbers, dtype=np.float64)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise broken(f"{count} numbers are missing")
    return found


def matrix_of_tile(numbers: Any) -> F64:
    """(4, 4) of a tileset's ``transform``, columns first."""
    return _finite(numbers, 16).reshape(4, 4).T
