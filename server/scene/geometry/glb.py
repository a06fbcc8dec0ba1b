"""Writes a textured mesh as binary glTF 2.0, unlit: its colours are the legend's, whatever the light."""

from __future__ import annotations

import json
import struct
from io import BytesIO

import numpy as np
from PIL import Image

from mapping.geometry.arrays import U8
from server.scene.geometry.mesh import Mesh

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _UINT = 5126, 5125
_CLAMP, _LINEAR, _MIPMAP = 33071, 9729, 9987


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
        "materials": [
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0},
                "extensions": {"KHR_materials_unlit": {}},
                "doubleSided": True,
                "alphaMode": "OPAQUE",
            }
        ],
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


def _jpeg(texture: U8) -> bytes:
    out = BytesIO()
    Image.fromarray(texture).save(out, "JPEG", quality=88, subsampling=0)
    return out.getvalue()


def _padded(data: bytes, fill: bytes = b"\0") -> bytes:
    return data + fill * (-len(data) % 4)


def _packed(parts: list[bytes]) -> tuple[list[dict[str, int]], bytes]:
    views, body = [], b""
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": len(part)})
        body += _padded(part)
    return views, body


def _container(head: bytes, body: bytes) -> bytes:
    head = _padded(head, b" ")
    chunks = struct.pack("<II", len(head), _JSON) + head + struct.pack("<II", len(body), _BIN) + body
    return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks
