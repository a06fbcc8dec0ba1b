"""Small point clouds in each format, and how a surface model comes of them, slowly."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import laspy
import lazrs
import numpy as np
import pye57
from pyproj import CRS

from mapping.geometry.arrays import F64, U8

UTM_EGM96 = "EPSG:32633+5773"
CORNER = np.array([500_000.0, 4_170_000.0, 1700.0])


def some_points(seed: int, count: int = 3000) -> tuple[F64, U8]:
    """(N, 3) points to the millimetre over some 30 x 20 m, in patches, and (N,) classes."""
    rng = np.random.default_rng(seed)
    xyz = rng.uniform((0, 0, 0), (30, 20, 9), (count, 3))
    xyz = xyz[(np.sin(xyz[:, 0]) > -0.6) | (xyz[:, 1] > 12)]
    classes = rng.choice([2, 5, 6, 7, 18], len(xyz), p=[0.5, 0.3, 0.1, 0.05, 0.05])
    return np.round(CORNER + xyz, 3), classes.astype(np.uint8)


def write_las(
    path: Path,
    xyz: F64,
    classes: U8,
    *,
    crs: str | None = UTM_EGM96,
    withheld: U8 | None = None,
    point_format: int = 6,
    geo_keys: dict[int, int] | None = None,
    near: F64 = CORNER,
) -> Path:
    """LAS or, by its name, LAZ; all points within 2000 km of ``near``."""
    header = laspy.LasHeader(point_format=point_format, version="1.4" if point_format >= 6 else "1.2")
    header.scales, header.offsets = np.full(3, 0.001), near
    if crs is not None:
        header.add_crs(CRS.from_user_input(crs))
    if geo_keys is not None:
        numbers = [1, 1, 0, len(geo_keys), *(word for key, value in geo_keys.items() for word in (key, 0, 1, value))]
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", np.array(numbers, "<u2").tobytes()))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = xyz.T
    cloud.classification = classes
    if withheld is not None:
        cloud.withheld = withheld
    cloud.write(str(path))
    return path


def write_copc(path: Path, xyz: F64, classes: U8) -> Path:
    """As Cloud Optimized Point Clouds are for whoever knows LAZ alone: parts of different lengths, in no order."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), CORNER
    header.add_crs(CRS.from_user_input(UTM_EGM96))
    plain = laspy.LasData(header)
    plain.x, plain.y, plain.z = xyz.T
    plain.classification = classes
    plain.write(str(path.with_suffix(".las")))
    packer: Any = lazrs  # compiled; its stubs lack the writer
    vlr = packer.LazVlr.new_for_compression(6, 0, True)
    with laspy.open(path.with_suffix(".las")) as file:
        rows, header = file.read(), file.header
    header.vlrs.append(laspy.VLR("copc", 1, "COPC info", bytes(160)))
    header.vlrs.append(laspy.VLR("laszip encoded", 22204, "", vlr.record_data()))
    raw = rows.points.array.tobytes()
    size = len(raw) // len(xyz)
    with path.open("w+b") as out:
        header.are_points_compressed = True
        header.update(rows.points)
        header.write_to(out)
        compressor = packer.LasZipCompressor(out, vlr)
        for first, end in pairwise((0, len(xyz) // 7, len(xyz) // 2, len(xyz))):
            compressor.compress_many(raw[first * size : end * size])
            if end < len(xyz):
                compressor.finish_current_chunk()
        compressor.done()
    return path


def write_e57(
    path: Path, scans: list[F64], *, poses: list[tuple[F64, F64]] | None = None, invalid: U8 | None = None
) -> Path:
    """``poses``: (4,) w, x, y, z and (3,) metres of each scan; ``invalid``: of each scan's points."""
    file = pye57.E57(str(path), mode="w")
    for number, xyz in enumerate(scans):
        data = {f"cartesian{axis}": np.ascontiguousarray(column) for axis, column in zip("XYZ", xyz.T, strict=True)}
        if invalid is not None:
            data["cartesianInvalidState"] = invalid.astype(np.int8)
        q_wxyz, t_m = poses[number] if poses else (np.array([1.0, 0, 0, 0]), np.zeros(3))
        file.write_scan_raw(data, rotation=q_wxyz, translation=t_m)
    file.close()
    return path


def write_ply(path: Path, xyz: F64, classes: U8 | None = None, *, order: str = "<", real: str = "f8") -> Path:
    """``order``: "<", ">" or "" for text."""
    word = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    fields = [("x", real), ("y", real), ("red", "u1"), ("z", real)] + (
        [("classification", "u1")] if classes is not None else []
    )
    names = {"f8": "double", "f4": "float", "u1": "uchar"}
    lines = [f"property {names[kind]} {name}" for name, kind in fields]
    head = "\n".join(
        ["ply", f"format {word} 1.0", "comment of a test", f"element vertex {len(xyz)}", *lines, "end_header", ""]
    )
    path.write_bytes(head.encode() + _rows(xyz, classes, fields, order))
    return path


def write_pcd(path: Path, xyz: F64, *, text: bool = False, **changed: str) -> Path:
    """``changed`` are lines of the header."""
    fields = [("x", "f8"), ("y", "f8"), ("red", "u1"), ("z", "f8")]
    lines = {
        "VERSION": "0.7", "FIELDS": "x y rgb z", "SIZE": "8 8 1 8", "TYPE": "F F U F", "COUNT": "1 1 1 1",
        "WIDTH": str(len(xyz)), "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": str(len(xyz)),
        "DATA": "ascii" if text else "binary", **changed,
    }  # fmt: skip
    head = "# .PCD v0.7\n" + "".join(f"{name} {value}\n" for name, value in lines.items())
    path.write_bytes(head.encode() + _rows(xyz, None, fields, "" if text else "<"))
    return path


def highest_slowly(xyz: F64, cell_m: float) -> dict[tuple[int, int], float]:
    """The highest point of each cell that has one, by the cell's place in the plane: (east, north) in cells."""
    cells: dict[tuple[int, int], float] = {}
    for x, y, z in xyz.tolist():
        place = math.floor(x / cell_m), math.ceil(y / cell_m) - 1
        cells[place] = max(z, cells.get(place, -math.inf))
    return cells


def _rows(xyz: F64, classes: U8 | None, fields: list[tuple[str, str]], order: str) -> bytes:
    rows: Any = np.zeros(len(xyz), [(name, (order or "<") + kind) for name, kind in fields])
    rows["x"], rows["y"], rows["z"] = xyz.T
    if classes is not None:
        rows["classification"] = classes
    if order:
        return rows.tobytes()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist()).encode()
