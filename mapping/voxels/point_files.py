"""Points as binary files: PLY, which every viewer opens, and PCD, which the Point Cloud Library and ROS open."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import ParameterError
from mapping.voxels.checks import checked_points

NAMES = {"<f8": "double", "<f4": "float", "|u1": "uchar"}


def ply(
    points_m: ArrayLike, *, rgb: ArrayLike | None = None, probability: ArrayLike | None = None, comment: str = ""
) -> bytes:
    """Vertices ``points_m`` (N, 3) as float64, with colours ``rgb`` (N, 3) uint8 and ``probability`` (N,) where given.

    Coordinates stay double: eastings of millions of metres keep their millimetres. Raises ParameterError where the
    lengths differ.
    """
    points = checked_points(points_m)
    columns = [(name, "<f8", points[:, i]) for i, name in enumerate("xyz")]
    if rgb is not None:
        colours = _of_length(np.asarray(rgb), (len(points), 3), "rgb")
        columns += [(name, "|u1", colours[:, i]) for i, name in enumerate(("red", "green", "blue"))]
    if probability is not None:
        columns.append(("probability", "<f4", _of_length(np.asarray(probability), (len(points),), "probability")))
    rows = np.empty(len(points), dtype=[(name, kind) for name, kind, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {line}" for line in comment.splitlines()),
        f"element vertex {len(points)}",
        *(f"property {NAMES[kind]} {name}" for name, kind, _ in columns),
        "end_header",
    ]
    return ("\n".join(header) + "\n").encode("ascii", "replace") + rows.tobytes()


def pcd(points_m: ArrayLike, *, probability: ArrayLike) -> bytes:
    """As binary PCD: ``points_m`` (N, 3), east, north, up of a map's origin, and ``probability`` (N,) of each.

    Both in 32 bits, as the library's own kinds of points are: at 10 km from the origin that is 1 mm. Raises
    ParameterError where the lengths differ.
    """
    points = checked_points(points_m)
    values = _of_length(np.asarray(probability), (len(points),), "probability")
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS x y z probability",
        "SIZE 4 4 4 4",
        "TYPE F F F F",
        "COUNT 1 1 1 1",
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(points)}",
        "DATA binary",
        "",
    ]
    return "\n".join(header).encode() + np.column_stack([points, values]).astype("<f4").tobytes()


def _of_length(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    if values.shape != shape:
        raise ParameterError(f"{values.shape} where {shape} belongs.", where=name)
    return values
