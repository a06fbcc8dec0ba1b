"""Point clouds that are a table of numbers behind a header of words: PLY and PCD."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from mapping.geometry.arrays import F64, U8, U16
from planning.errors import RasterFormatError
from planning.terrain.clouds.cloud import CHUNK, Box, Chunk

_LONGEST_LINE, _MOST_LINES = 4096, 1000
_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_PCD_KINDS = {"F": "f", "I": "i", "U": "u"}
_THREE, _ONE = (("red", "green", "blue"), ("r", "g", "b")), ("rgb", "rgba")
_CLASSES = ("classification", "scalar_classification", "class")


@dataclass(frozen=True, slots=True)
class Table:
    """Where the numbers of a cloud lie in its file."""

    path: Path
    start: int
    """The first byte behind the header."""
    rows: int
    text: bool
    fields: np.dtype
    columns: tuple[int, ...]
    """Of x, y, z and, where there is one, the class: the numbers of a row of text, or the fields of a binary one."""
    colors: tuple[int, ...] = ()
    """The same of red, green and blue, or of one number of four bytes that holds them."""
    notes: tuple[str, ...] = ()
    bounds: Box | None = None
    crs_wkt: str | None = None
    unit: str | None = None
    """Three things that no such file tells."""

    @property
    def classified(self) -> bool:
        return len(self.columns) == 4

    @property
    def coarse(self) -> bool:
        """Whether places are kept in 32 bits, too few for coordinates of a map grid."""
        names = self.fields.names or ()
        return not self.text and any(self.fields[names[at]] == np.dtype("f4") for at in self.columns[:2])

    def chunks(self, *, colors: bool) -> Iterator[Chunk]:
        """RasterFormatError when there are fewer points than the header says."""
        with self.path.open("rb") as file:
            file.seek(self.start)
            for first in range(0, self.rows, CHUNK):
                count = min(CHUNK, self.rows - first)
                numbers, shades = (self._text if self.text else self._binary)(file, count)
                if len(numbers) < count:
                    raise RasterFormatError(
                        f"It ends after {first + len(numbers):,} of {self.rows:,} points.", advice="Copy it again."
                    )
                yield numbers[:, :3], _classes(numbers), _rgb(shades) if colors and self.colors else None

    def _text(self, file: BinaryIO, count: int) -> tuple[F64, list[np.ndarray]]:
        columns = (*self.columns, *self.colors)
        numbers = np.loadtxt(file, max_rows=count, usecols=columns, ndmin=2, comments=None)
        names = self.fields.names or ()
        with np.errstate(invalid="ignore", over="ignore"):
            shades = [
                shade.astype(self.fields[names[at]])
                for at, shade in zip(self.colors, numbers.T[len(self.columns) :], strict=True)
            ]
        return numbers[:, : len(self.columns)], shades

    def _binary(self, file: BinaryIO, count: int) -> tuple[F64, list[np.ndarray]]:
        data = file.read(count * self.fields.itemsize)
        whole = len(data) // self.fields.itemsize
        rows = np.frombuffer(data, self.fields, count=whole)
        names = self.fields.names or ()
        out = np.empty((whole, len(self.columns)))
        for to, at in enumerate(self.columns):
            out[:, to] = rows[names[at]]
        return out, [rows[names[at]] for at in self.colors]


def ply_table(path: Path) -> Table:
    """Turk's PLY: the vertices, which must come first and have no lists."""
    with path.open("rb") as file:
        lines = [words for words in _header(file, until="end_header") if words]
        start = file.tell()
    order = next((words[1] for words in lines if words[0] == "format" and len(words) > 1), "")
    if order not in _PLY_ORDERS:
        raise RasterFormatError(f'"{order}" is no format of PLY.', advice="Export it as binary PLY, or as LAZ.")
    elements = [at for at, words in enumerate(lines) if words[0] == "element"]
    if not elements or lines[elements[0]][1:2] != ["vertex"]:
        raise RasterFormatError("Its first element is not the vertices.", advice="Export the points alone.")
    vertex = lines[elements[0]]
    end = elements[1] if len(elements) > 1 else len(lines)
    properties = [words for words in lines[elements[0] + 1 : end] if words[0] == "property"]
    if any(len(words) != 3 or words[1] not in _PLY_TYPES for words in properties):
        raise RasterFormatError("Its vertices have lists or unknown types.", advice="Export the points alone.")
    names = [words[2] for words in properties]
    types = [_PLY_ORDERS[order] + _PLY_TYPES[words[1]] for words in properties]
    fields, columns = _fields(names, types, [1] * len(names))
    colors = _colors(names, fields)
    return Table(path, start, _count(vertex[2:3]), order == "ascii", fields, columns, colors)


def pcd_table(path: Path) -> Table:
    """The Point Cloud Library's PCD, as text or binary."""
    with path.open("rb") as file:
        lines = {words[0]: words[1:] for words in _header(file, until="DATA") if words}
        start = file.tell()
    data = " ".join(lines.get("DATA", []))
    if data == "binary_compressed":
        raise RasterFormatError(
            "It is a compressed PCD, which is not read here.",
            advice="Write it plain: pcl_convert_pcd_ascii_binary in.pcd out.pcd 1",
        )
    if data not in ("ascii", "binary"):
        raise RasterFormatError(f'"{data}" is no kind of PCD data.', advice="Export it as binary PCD, or as LAZ.")
    names, sizes, kinds = lines.get("FIELDS", []), lines.get("SIZE", []), lines.get("TYPE", [])
    counts = [_count([word]) for word in lines.get("COUNT", ["1"] * len(names))]
    if not len(names) == len(sizes) == len(kinds) == len(counts) or not set(kinds) <= set(_PCD_KINDS):
        raise RasterFormatError("FIELDS, SIZE, TYPE and COUNT of its header do not fit each other.")
    if not set(sizes) <= {"1", "2", "4", "8"} or ("F", "1") in zip(kinds, sizes, strict=True):
        raise RasterFormatError(f"Its numbers have strange sizes: {' '.join(sizes)[:60]}.")
    types = [f"<{_PCD_KINDS[kind]}{size}" for kind, size in zip(kinds, sizes, strict=True)]
    fields, columns = _fields(names, types, counts)
    colors = _colors([name for name, count in zip(names, counts, strict=True) for _ in range(count)], fields)
    rows = _count(lines.get("POINTS", []))
    return Table(path, start, rows, data == "ascii", fields, columns, colors, _viewpoint(lines))


def _viewpoint(lines: dict[str, list[str]]) -> tuple[str, ...]:
    words = lines.get("VIEWPOINT", [])
    if not words or [word.rstrip("0").rstrip(".") or "0" for word in words] == ["0", "0", "0", "1", "0", "0", "0"]:
        return ()
    return ("Its points were taken as they are: the pose of the sensor that its header gives was not applied.",)


def _header(file: BinaryIO, *, until: str) -> Iterator[list[str]]:
    for _ in range(_MOST_LINES):
        line = file.readline(_LONGEST_LINE)
        words = line.decode("ascii", "replace").split()
        if not line.endswith(b"\n"):
            break
        yield words
        if words[:1] == [until]:
            return
    raise RasterFormatError(f"Its header has no line {until}.", advice="Export it again.")


def _fields(names: list[str], types: list[str], counts: list[int]) -> tuple[np.dtype, tuple[int, ...]]:
    """The fields under names of our own, for a file may name two alike, and which of them are meant."""
    spread = [(name, kind) for name, kind, count in zip(names, types, counts, strict=True) for _ in range(count)]
    lower = [name.lower() for name, _ in spread]
    if not {"x", "y", "z"} <= set(lower):
        raise RasterFormatError(f"Its points have no x, y and z, but: {', '.join(names)[:80]}.")
    classes = [name for name in _CLASSES if name in lower][:1]
    fields = np.dtype([(f"f{at}", kind) for at, (_, kind) in enumerate(spread)])
    return fields, tuple(lower.index(name) for name in ("x", "y", "z", *classes))


def _colors(names: list[str], fields: np.dtype) -> tuple[int, ...]:
    """Where whole numbers of one or two bytes are red, green and blue, or one field of four holds them; else ()."""
    lower = [name.lower() for name in names]
    choices = [(three, ("u1", "u2")) for three in _THREE] + [((one,), ("u4", "f4", "i4")) for one in _ONE]
    for wanted, kinds in choices:
        if set(wanted) <= set(lower):
            at = tuple(lower.index(name) for name in wanted)
            if all(fields[f"f{place}"].str[1:] in kinds for place in at):
                return at
    return ()


def _rgb(shades: list[np.ndarray]) -> U16:
    """(N, 3), of three fields or of one: 0x00RRGGBB, often called a real number."""
    if len(shades) == 3:
        return np.column_stack(shades).astype(np.uint16)
    packed = np.ascontiguousarray(shades[0]).view(np.dtype("u4").newbyteorder(shades[0].dtype.byteorder))
    return np.column_stack([(packed >> shift) & 255 for shift in (16, 8, 0)]).astype(np.uint16)


def _count(words: list[str]) -> int:
    if len(words) != 1 or not words[0].isdecimal() or len(words[0]) > 12:
        raise RasterFormatError(f'"{" ".join(words)[:40]}" is no count.', advice="Export it again.")
    return int(words[0])


def _classes(numbers: F64) -> U8 | None:
    if numbers.shape[1] < 4:
        return None
    with np.errstate(invalid="ignore"):
        return np.where((numbers[:, 3] >= 0) & (numbers[:, 3] <= 255), numbers[:, 3], 0).astype(np.uint8)
