"""What a point cloud's file says about itself, and which format it is."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from planning.errors import RasterFormatError

_FORMATS = {b"LASF": "las", b"ply\n": "ply", b"ply\r": "ply", b"# .PCD": "pcd", b"VERSION": "pcd", b"ASTM-E57": "e57"}
_OTHERS = {
    b"II*\0": ("This is a TIFF.", "A surface model as GeoTIFF needs no conversion: plan on it as it is."),
    b"MM\0*": ("This is a TIFF.", "A surface model as GeoTIFF needs no conversion: plan on it as it is."),
    b"II+\0": ("This is a TIFF.", "A surface model as GeoTIFF needs no conversion: plan on it as it is."),
    b"PK\x03\x04": ("This is a ZIP archive.", "Unpack it first."),
    b"\x1f\x8b": ("This is a gzip file.", "Unpack it first."),
}


@dataclass(frozen=True, slots=True)
class CloudHeader:
    """Facts read without decoding a point."""

    points: int
    """As the file counts them."""
    crs_wkt: str | None
    unit: str | None
    """Of the heights, where the file gives them one of their own: "m", "ft", "us-ft"."""
    vertical_datum: str | None
    classified: bool
    """Whether each point may say what it is: ground, vegetation, noise."""
    notes: tuple[str, ...] = ()
    """What is remarkable about it."""

    @classmethod
    def from_json(cls, fields: dict[str, Any]) -> CloudHeader:
        """From the JSON object that the decoding process sends."""
        return cls(**{**fields, "notes": tuple(fields["notes"])})

    def as_json(self) -> dict[str, Any]:
        """The JSON object that ``from_json`` reads."""
        return asdict(self)


def cloud_format(path: Path) -> str:
    """ "las" (LAZ and COPC too), "ply", "pcd" or "e57", by the first bytes; RasterFormatError for any other file."""
    head = _head(path)
    if name := _format(head):
        return name
    for magic, (what, advice) in _OTHERS.items():
        if head.startswith(magic):
            raise RasterFormatError(what, where=path.name, advice=advice)
    what = "This is an empty file" if not head else "This is no point cloud that is known here"
    raise RasterFormatError(f"{what}.", where=path.name, advice="Give a LAS, LAZ, PLY, PCD or E57 file.")


def is_cloud(path: Path) -> bool:
    """By the first bytes. Raises RasterFormatError for a file that cannot be read."""
    return _format(_head(path)) is not None


def _format(head: bytes) -> str | None:
    return next((name for magic, name in _FORMATS.items() if head.startswith(magic)), None)


def _head(path: Path) -> bytes:
    try:
        if not path.is_file():
            raise RasterFormatError("There is no such file.", where=str(path), advice="Check the path.")
        with path.open("rb") as file:
            return file.read(64)
    except OSError as error:
        raise RasterFormatError(f"Cannot read the file: {error.strerror}.", where=str(path)) from error
