"""What the child process does with a mesh: tiles that fit are chosen, pictures made anew and small enough."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mapping.geometry.arrays import F64
from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.meshes.gltf import Gltf, Part, broken
from planning.terrain.meshes.package import Package
from planning.terrain.meshes.tileset import Tileset

Json = dict[str, Any]
Send = Callable[..., None]
Ask = Callable[[Json], Json]
_LARGEST_SIDE_PX, _LARGEST_SHOWN_PX = 16_384, 4096
_MOST_PICTURES = 1_000
_QUALITY = 85
_OFFSET_BYTES = 1000


def read_mesh(job: Json, send: Send, ask: Ask) -> None:
    """``job["xyz"]``: raw float64 (N, 3), z up; "uv" float32 (N, 2), "rgba" bytes (N, 4), "faces" uint32 (F, 3), one
    after the other by pictures; "pictures": JPEG files, likewise. What is asked for: "triangles" and "pixels" at most.
    """
    try:
        package = Package(Path(job["source"]), job["entry"])
        order = ask({})
        _write(package, job, order, send)
    except RasterError as error:
        kind = "too_large" if isinstance(error, RasterTooLargeError) else "format"
        send("error", kind=kind, what=error.what, advice=error.advice)


JOBS: dict[str, Callable[[Json, Send, Ask], None]] = {"read_mesh": read_mesh}


def _write(package: Package, job: Json, order: Json, send: Send) -> None:
    send("progress", stage="choose", share=0.0)
    chosen, is_coarser = [(np.eye(4), package.entry)], False
    if package.entry.lower().endswith(".json"):
        tileset = Tileset(package)
        chosen = tileset.chosen(order["triangles"])
        is_coarser = tileset.is_coarser
    groups: dict[tuple[str, int] | None, list[Part]] = {}
    triangles = vertices = others = 0
    files: dict[str, Gltf] = {}
    center = np.zeros(3)
    for number, (matrix, name) in enumerate(chosen):
        file = Gltf(package, name)
        center = file.center_m
        triangles, vertices, others = triangles + file.triangles, vertices + file.vertices, others + file.others
        if triangles > order["triangles"] or vertices > 3 * order["triangles"]:
            what = f"It has {triangles:,} triangles or more; {order['triangles']:,} are the most."
            raise RasterTooLargeError(what, advice="Export the mesh with fewer faces, or as 3D Tiles.")
        for part in file.parts():
            key = None if part.picture is None else (name, part.picture)
            groups.setdefault(key, []).append(_moved(part, matrix))
            if key is not None:
                files[name] = file
        send("progress", stage="mesh", share=(number + 1) / len(chosen))
    if not triangles:
        raise RasterFormatError("It has no triangle.", advice="Export the textured mesh.")
    pictures = {key: files[key[0]].picture(key[1]) for key in groups if key is not None}
    sizes, scale = _pictures(list(pictures.values()), job["pictures"], order["pixels"], send)
    rows = []
    numbers = {key: number for number, key in enumerate(pictures)}
    with ExitStack() as stack:
        xyz, uv, rgba, faces = (stack.enter_context(Path(job[k]).open("wb")) for k in ("xyz", "uv", "rgba", "faces"))
        for key, parts in groups.items():
            first = 0
            for part in parts:
                part.xyz.tofile(xyz)
                part.uv.tofile(uv)
                part.rgba.tofile(rgba)
                (part.faces + np.uint32(first)).tofile(faces)
                first += len(part.xyz)
            rows.append([first, sum(len(part.faces) for part in parts), -1 if key is None else numbers[key]])
    center_m = [0.0, 0.0, 0.0] if len(chosen) > 1 else center.tolist()
    send(
        "done", parts=rows, pictures=sizes, scale=scale, coarser=is_coarser, others=others, center=center_m,
        offset=_offset(package, job),
    )  # fmt: skip


def _moved(part: Part, matrix: F64) -> Part:
    xyz = part.xyz @ matrix[:3, :3].T + matrix[:3, 3]
    if not np.isfinite(xyz).all():
        raise broken("some of its places are no numbers")
    return Part(np.ascontiguousarray(xyz), part.uv, part.rgba, part.faces, part.picture)


def _pictures(found: list[bytes], target: str, most_px: int, send: Send) -> tuple[list[int], float]:
    """Their bytes as JPEG, one after the other, and how much smaller their sides have become."""
    if len(found) > _MOST_PICTURES:
        raise RasterTooLargeError(f"It has more than {_MOST_PICTURES:,} pictures.", advice="Export fewer, larger ones.")
    shapes = [_shape(each) for each in found]
    area = sum(width * height for width, height in shapes)
    scale, sizes = min(1.0, math.sqrt(most_px / max(1, area))), []
    with Path(target).open("wb") as out:
        for number, (data, shape) in enumerate(zip(found, shapes, strict=True)):
            wanted = min(scale, _LARGEST_SHOWN_PX / max(shape))
            jpeg = _jpeg(data, (max(1, int(shape[0] * wanted)), max(1, int(shape[1] * wanted))))
            sizes.append(out.write(jpeg))
            send("progress", stage="pictures", share=(number + 1) / len(found))
    return sizes, scale


def _opened(data: bytes) -> Image.Image:
    try:
        return Image.open(io.BytesIO(data), formats=("JPEG", "PNG", "WEBP"))
    except (OSError, ValueError, Image.DecompressionBombError):
        raise RasterFormatError(
            "A picture in it is damaged, or no JPEG, PNG or WebP.", advice="Export it with JPEG or PNG textures."
        ) from None


def _shape(data: bytes) -> tuple[int, int]:
    width, height = _opened(data).size
    if max(width, height) > _LARGEST_SIDE_PX:
        what = f"A picture in it has {width:,} x {height:,} pixels; {_LARGEST_SIDE_PX:,} along a side are the most."
        raise RasterTooLargeError(what, advice="Export it with smaller textures.")
    return width, height


def _jpeg(data: bytes, size: tuple[int, int]) -> bytes:
    image = _opened(data)
    try:
        image.draft("RGB", size)
        small = image.convert("RGB")
    except (OSError, ValueError, SyntaxError):
        raise RasterFormatError("A picture in it is damaged or cut short.", advice="Export it again.") from None
    if small.size != size:
        small = small.resize(size, Image.Resampling.BOX)
    out = io.BytesIO()
    small.save(out, "JPEG", quality=_QUALITY)
    return out.getvalue()


def _offset(package: Package, job: Json) -> str | None:
    if job["offset"] is None:
        return None
    return package.read(job["offset"])[:_OFFSET_BYTES].decode("ascii", "replace")
