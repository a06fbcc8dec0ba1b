"""Which of the two accepted formats a file is, from its first bytes: names and extensions prove nothing."""

from pathlib import Path

from planning.errors import RasterFormatError

_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_ASCII_GRID_KEYS = (b"ncols", b"nrows", b"xllcorner", b"xllcenter", b"yllcorner", b"yllcenter", b"cellsize", b"dx ")
_CLOUD, _OF_A_CLOUD = b"LASF", "Make a surface model of it: hedgehop cloud FILE --out dsm.tif"
_OTHERS = {
    b"<VRTDataset": "a GDAL virtual raster (VRT)",
    b"PK\x03\x04": "a ZIP archive",
    b"\x1f\x8b": "a gzip file",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    _CLOUD: "a LAS point cloud",
    b"\x89HDF": "an HDF5 file",
    b"<?xml": "an XML file",
    b"%PDF": "a PDF document",
}


def driver_of(path: Path) -> str:
    """GDAL's driver name, "GTiff" or "AAIGrid", for a file; RasterFormatError for any other."""
    try:
        if not path.is_file():
            raise RasterFormatError("There is no such file.", where=str(path), advice="Check the path.")
        with path.open("rb") as file:
            head = file.read(64)
    except OSError as error:
        raise RasterFormatError(f"Cannot read the file: {error.strerror}.", where=str(path)) from error
    if head.startswith(_TIFF):
        return "GTiff"
    text = head.lstrip().lower()
    if text.startswith(_ASCII_GRID_KEYS):
        return "AAIGrid"
    raise RasterFormatError(
        f"This is {_kind(head)}, not a GeoTIFF or an ESRI ASCII grid.",
        where=path.name,
        advice=_OF_A_CLOUD if head.startswith(_CLOUD) else "Export the surface model as GeoTIFF.",
    )


def is_virtual(path: Path) -> bool:
    """Whether a file is a virtual raster (VRT) of GDAL."""
    try:
        with path.open("rb") as file:
            head = file.read(512).lstrip()
    except OSError:
        return False  # whoever reads it says why it cannot be read
    return head.startswith(b"<VRTDataset") or (head.startswith(b"<?xml") and b"<VRTDataset" in head)


def _kind(head: bytes) -> str:
    if not head:
        return "an empty file"
    start = head.lstrip()
    return next((name for magic, name in _OTHERS.items() if start.startswith(magic)), "an unknown kind of file")
