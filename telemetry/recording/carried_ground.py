"""The surface model that was known in flight, carried in the recording itself: nobody else need have it."""

from __future__ import annotations

import io
import zipfile
import zlib

import numpy as np
from affine import Affine
from pyproj import CRS
from pyproj.exceptions import CRSError

from planning.errors import DescribedError
from planning.terrain.dsm import Dsm
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.reader import Recording

NAME, MEDIA_TYPE = "known_ground.npz", "application/x-npz"
MOST_BYTES = 2_000_000_000
"""Of heights: a file that says more of itself is not unpacked."""
_BESIDE = ("lowest_m", "seam", "rms_m", "place_m")
"""Of a surface model of several; others have none of them."""
_BROKEN = (ValueError, KeyError, OSError, EOFError, TypeError, zipfile.BadZipFile, zlib.error, CRSError, DescribedError)


def packed(dsm: Dsm) -> bytes:
    """The grid as it is, to the last bit. Raises RecordingError when it is too large to be carried."""
    beside = {name: value for name in _BESIDE if (value := getattr(dsm, name)) is not None}
    if not dsm.place_m:
        del beside["place_m"]
    if sum(array.nbytes for array in (dsm.elevation_m, dsm.lowest_m, dsm.seam) if array is not None) > MOST_BYTES:
        what = f"A surface model of {dsm.elevation_m.size:,} cells is too large for a recording."
        raise RecordingError(what, advice="Cut it to where the flight is, or leave the recording out.")
    out = io.BytesIO()
    np.savez_compressed(
        out,
        elevation_m=dsm.elevation_m,
        transform=np.array(dsm.transform[:6], dtype=np.float64),
        crs_wkt=np.array(dsm.crs.to_wkt()),
        vertical_datum=np.array(dsm.vertical_datum or ""),
        sha256=np.array(dsm.sha256),
        name=np.array(dsm.name),
        **beside,
    )
    return out.getvalue()


def carried_ground(recording: Recording) -> Dsm | None:
    """None when it carries none. Raises RecordingError when what it carries cannot be read."""
    data = recording.attachment(NAME)
    if data is None:
        return None
    try:
        return _unpacked(data)
    except _BROKEN as error:
        what = f"The surface model in the recording cannot be read ({error})."
        raise RecordingError(what, where=recording.name, advice="Give the surface model itself.") from error


def _unpacked(data: bytes) -> Dsm:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > MOST_BYTES + 1_000_000:
            raise ValueError("it is too large")
    with np.load(io.BytesIO(data), allow_pickle=False) as fields:
        return Dsm(
            elevation_m=fields["elevation_m"],
            transform=Affine(*(float(value) for value in fields["transform"])),
            crs=CRS.from_wkt(str(fields["crs_wkt"])),
            vertical_datum=str(fields["vertical_datum"]) or None,
            sha256=str(fields["sha256"]),
            name=str(fields["name"]) if "name" in fields else "",
            lowest_m=fields.get("lowest_m"),
            seam=fields.get("seam"),
            rms_m=float(fields["rms_m"]) if "rms_m" in fields else None,
            place_m=float(fields["place_m"]) if "place_m" in fields else 0.0,
        )
