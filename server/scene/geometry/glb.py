"""Writes textured meshes as binary glTF 2.0, unlit: their colours are the legend's, or the pictures', whatever the
light."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

from mapping.geometry.arrays import F32, U8
from planning.terrain.meshes.mesh_file import Mesh as PartedMesh
from server.scene.geometry.mesh import Mesh

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _UINT, _BYTE = 5126, 5125, 5121
_CLAMP, _REPEAT, _LINEAR, _MIPMAP = 33071, 10497, 9729, 9987


def textured_glb(mesh: Mesh, texture: U8) -> bytes:
    """``texture`` is (th, tw, 3) sRGB; row 0 lies at v = 0."""
    parts = [
        np.ascontiguousarray(mesh.vertices, dtype="<f4").tobytes(),
        np.ascontiguousarray(mesh.uv, dtype="<f4").tobytes(),
        np.ascontiguousarray(mesh.faces, dtype="<u4").tobytes(),
        _jpeg(texture),
    ]
    views, body = _packed(parts)
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [_unlit({"baseColorTexture": {"index": 0}})],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": _CLAMP, "wrapT": _CLAMP, "magFilter": _LINEAR, "minFilter": _MIPMAP}],
        "images": [{"bufferView": 3, "mimeType": "image/jpeg"}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": _FLOAT,
                "count": len(mesh.vertices),
                "type": "VEC3",
                "min": mesh.vertices.min(axis=0).tolist(),
                "max": mesh.vertices.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": _FLOAT, "count": len(mesh.uv), "type": "VEC2"},
            {"bufferView": 2, "componentType": _UINT, "count": mesh.faces.size, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
    }
    return _container(json.dumps(document).encode(), body)


def parted_glb(mesh: PartedMesh, places: F32) -> bytes:
    """A mesh of several pictures, its vertices at ``places`` (V, 3) instead of its own."""
    blobs: list[bytes] = []
    accessors: list[dict[str, Any]] = []
    primitives: list[dict[str, Any]] = []

    def accessor(data: bytes, component: int, kind: str, count: int, **more: Any) -> int:
        told = {"bufferView": len(blobs), "componentType": component, "count": count, "type": kind, **more}
        blobs.append(data)
        accessors.append(told)
        return len(accessors) - 1

    vertex = face = 0
    repeated: set[int | None] = set()
    for part in mesh.parts:
        own = slice(vertex, vertex + part.vertices)
        faces = np.ascontiguousarray(mesh.faces[face : face + part.faces], dtype="<u4")
        vertex, face = vertex + part.vertices, face + part.faces
        if not len(faces):
            continue
        xyz = np.ascontiguousarray(places[own], dtype="<f4")
        bounds = {"min": xyz.min(axis=0).tolist(), "max": xyz.max(axis=0).tolist()}
        named = {
            "POSITION": accessor(xyz.tobytes(), _FLOAT, "VEC3", len(xyz), **bounds),
            "TEXCOORD_0": accessor(mesh.uv[own].astype("<f4").tobytes(), _FLOAT, "VEC2", len(xyz)),
            "COLOR_0": accessor(mesh.rgba[own].tobytes(), _BYTE, "VEC4", len(xyz), normalized=True),
        }
        indices = accessor(faces.tobytes(), _UINT, "SCALAR", faces.size)
        if mesh.uv[own].size and not 0.0 <= mesh.uv[own].min() <= mesh.uv[own].max() <= 1.0:
            repeated.add(part.picture)
        material = len(mesh.pictures) if part.picture is None else part.picture
        primitives.append({"attributes": named, "indices": indices, "material": material})
    first_picture = len(blobs)
    views, body = _packed([*blobs, *mesh.pictures])
    materials = [_unlit({"baseColorTexture": {"index": number}}) for number in range(len(mesh.pictures))]
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [*materials, _unlit({})],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
    }
    if mesh.pictures:
        document |= {
            # One that is not repeated is not mixed with its opposite edge either.
            "textures": [
                {"source": number, "sampler": int(number in repeated)} for number in range(len(mesh.pictures))
            ],
            "samplers": [
                {"wrapS": wrap, "wrapT": wrap, "magFilter": _LINEAR, "minFilter": _MIPMAP} for wrap in (_CLAMP, _REPEAT)
            ],
            "images": [
                {"bufferView": first_picture + number, "mimeType": "image/jpeg"} for number in range(len(mesh.pictures))
            ],
        }
    return _container(json.dumps(document).encode(), body)


def _unlit(surface: dict[str, Any]) -> dict[str, Any]:
    return {
        "pbrMetallicRoughness": {**surface, "metallicFactor": 0.0},
        "extensions": {"KHR_materials_unlit": {}},
        "doubleSided": True,
        "alphaMode": "OPAQUE",
    }


def _jpeg(texture: U8) -> bytes:
    out = BytesIO()
    Image.fromarray(texture).save(out, "JPEG", quality=88, subsampling=0)
    return out.getvalue()


def _padded(data: bytes, fill: bytes = b"\0") -> bytes:
    return data + fill * (-len(data) % 4)


def _packed(parts: Sequence[bytes]) -> tuple[list[dict[str, int]], bytes]:
    views, body = [], bytearray()
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": len(part)})
        body += _padded(part)
    return views, bytes(body)


def _container(head: bytes, body: bytes) -> bytes:
    head = _padded(head, b" ")
    chunks = struct.pack("<II", len(head), _JSON) + head + struct.pack("<II", len(body), _BIN) + body
    return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks
