"""Textured meshes as photogrammetry writes them: binary glTF, b3dm, tilesets, and a surface model below them."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine
from PIL import Image
from pyproj import CRS

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, ecef_from_geodetic
from planning.terrain.dsm import Dsm

Json = dict[str, Any]
WEST_M, NORTH_M, SIZE_M = 500_000.0, 4_170_000.0, 60.0
GEOID_M = 41.3
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def height_m(x_m: F64, y_m: F64) -> F64:
    """Of the ground, a slope with a wave in it, above the sea."""
    return 200.0 + 0.1 * (x_m - WEST_M) + 2.0 * np.sin((y_m - NORTH_M) / 9.0)


def dsm_of(datum: str | None = "EGM96 height", *, above_m: float = 0.0) -> Dsm:
    """Half-metre cells."""
    at = (np.arange(int(2 * SIZE_M)) + 0.5) / 2
    x_m, y_m = np.meshgrid(WEST_M + at, NORTH_M - at)
    cells = (height_m(x_m, y_m) + above_m).astype(np.float32)
    return Dsm(cells, Affine(0.5, 0, WEST_M, 0, -0.5, NORTH_M), CRS.from_epsg(32633), datum, "")


def ground(step_m: float = 1.0, *, share: tuple[float, float] = (0.0, 1.0)) -> tuple[F64, np.ndarray, np.ndarray]:
    """(V, 3) projected places, (V, 2) uv and (F, 3) triangles of the ground; of a strip from west to east."""
    x = WEST_M + np.arange(share[0] * SIZE_M, share[1] * SIZE_M + step_m / 2, step_m)
    y = NORTH_M - np.arange(0.0, SIZE_M + step_m / 2, step_m)
    x_m, y_m = np.meshgrid(
        np.clip(x, WEST_M + 0.01, WEST_M + SIZE_M - 0.01), np.clip(y, NORTH_M - SIZE_M + 0.01, NORTH_M)
    )
    xyz = np.column_stack([x_m.ravel(), y_m.ravel(), height_m(x_m, y_m).ravel()])
    uv = np.column_stack([(xyz[:, 0] - WEST_M) / SIZE_M, (NORTH_M - xyz[:, 1]) / SIZE_M])
    index = np.arange(len(xyz)).reshape(x_m.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    return xyz, uv, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def picture(colors: tuple[tuple[int, int, int], ...] = ((255, 0, 0), (0, 0, 255)), size: int = 64) -> bytes:
    """As many upright stripes as there are colours, as PNG."""
    row = np.repeat(np.array(colors, np.uint8), size // len(colors), axis=0)
    out = io.BytesIO()
    Image.fromarray(np.repeat(row[None], size, axis=0)).save(out, "PNG")
    return out.getvalue()


def document(
    local: F64,
    uv: np.ndarray,
    faces: np.ndarray,
    *,
    image: bytes | None = None,
    changed: Mapping[str, Any] | None = None,
) -> tuple[Json, bytes]:
    """glTF of vertices that are z up, written y up as it must be; ``changed`` are parts of its text put otherwise."""
    image = picture() if image is None else image
    parts = [
        (local @ Z_UP).astype("<f4").tobytes(), uv.astype("<f4").tobytes(), faces.astype("<u4").tobytes(),
        image + b"\0" * (-len(image) % 4),
    ]  # fmt: skip
    views, at = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part)
    told: Json = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "count": len(local), "type": "VEC3",
                "min": (local @ Z_UP).min(axis=0).tolist(), "max": (local @ Z_UP).max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5126, "count": len(uv), "type": "VEC2"},
            {"bufferView": 2, "componentType": 5125, "count": int(faces.size), "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }  # fmt: skip
    return {**told, **(changed or {})}, b"".join(parts)


def glb(told: Json, body: bytes) -> bytes:
    head = json.dumps(told).encode()
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<II", len(head), 0x4E4F534A) + head + struct.pack("<II", len(body), 0x004E4942) + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def b3dm(inside: bytes, *, features: bytes = b'{"BATCH_LENGTH":0}  ') -> bytes:
    return (
        struct.pack("<4sIIIIII", b"b3dm", 1, 28 + len(features) + len(inside), len(features), 0, 0, 0)
        + features
        + inside
    )


def local_glb(zero_m: F64, step_m: float = 1.0, **how: Any) -> bytes:
    """The ground, counted from a zero of its project's."""
    xyz, uv, faces = ground(step_m)
    return glb(*document(xyz - zero_m, uv, faces, **how))


def earth_frame(dsm: Dsm) -> tuple[LocalFrame, F64]:
    """East, north, up around the ground's middle, on the ellipsoid; and (4, 4) to Earth-centred metres."""
    middle = np.array([[WEST_M + SIZE_M / 2, NORTH_M - SIZE_M / 2]])
    ((lat_deg, lon_deg),) = dsm.lat_lon_from_xy(middle).tolist()
    frame = LocalFrame(lat_deg, lon_deg, 0.0)
    lat, lon = np.radians([lat_deg, lon_deg])
    matrix = np.eye(4)
    matrix[:3, 0] = [-np.sin(lon), np.cos(lon), 0.0]
    matrix[:3, 1] = [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]
    matrix[:3, 2] = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
    matrix[:3, 3] = ecef_from_geodetic(lat_deg, lon_deg, 0.0)[0]
    return frame, matrix


def tile_glb(
    dsm: Dsm, step_m: float, *, share: tuple[float, float] = (0.0, 1.0), geoid_m: float = GEOID_M, size_px: int = 64
) -> bytes:
    """The ground at heights above the ellipsoid, in metres of the tileset's frame."""
    xyz, uv, faces = ground(step_m, share=share)
    lat_lon = dsm.lat_lon_from_xy(xyz[:, :2])
    frame, _ = earth_frame(dsm)
    return glb(
        *document(
            frame.to_tangent(lat_lon[:, 0], lat_lon[:, 1], xyz[:, 2] + geoid_m), uv, faces, image=picture(size=size_px)
        )
    )


def tileset(dsm: Dsm, *, size_px: int = 64, **changed: Any) -> dict[str, bytes]:
    """A coarse tile and two fine ones in its place, as OpenDroneMap lays them; files by name. ``size_px``: of a fine
    one's picture."""
    _, matrix = earth_frame(dsm)
    box = {"box": [0, 0, 0, 50, 0, 0, 0, 50, 0, 0, 0, 50]}
    root = {
        "boundingVolume": box, "geometricError": 20, "refine": "REPLACE", "transform": matrix.T.ravel().tolist(),
        "content": {"uri": "tiles/coarse.b3dm"},
        "children": [
            {"boundingVolume": box, "geometricError": 0, "content": {"uri": f"tiles/{name}.glb?v=1"}}
            for name in ("west", "east")
        ],
        **changed,
    }  # fmt: skip
    return {
        "3d_tiles/model/tileset.json": json.dumps(
            {"asset": {"version": "1.0"}, "geometricError": 99, "root": root}
        ).encode(),
        "3d_tiles/model/tiles/coarse.b3dm": b3dm(tile_glb(dsm, 10.0)),
        "3d_tiles/model/tiles/west.glb": tile_glb(dsm, 1.0, share=(0.0, 0.5), size_px=size_px),
        "3d_tiles/model/tiles/east.glb": tile_glb(dsm, 1.0, share=(0.5, 1.0), size_px=size_px),
    }


def packed(path: Path, files: Mapping[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path
