"""UWB radar logs as files: read with suspicion, written by simulated radars (docs/uwb.md describes the format)."""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64
from mapping.uwb.uwb_params import UwbGeometry
from planning.errors import FormatError
from planning.ground.traversable import UwbScans

FORMAT, VERSION = "hedgehop-uwb", 1
MOST_BYTES = 512 * 1024**2
"""Unpacked: half an hour of 256 bins at 100 Hz as float64 is less."""
MOST_BINS = 4096
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-4, 0.5
"""From scan to scan: a longer one is no time in view."""
_WGS84 = "Give WGS84 degrees."
ANGLES_DEG = (
    ("lat_deg", (-90.0, 90.0), _WGS84),
    ("lon_deg", (-180.0, 180.0), _WGS84),
    ("heading_deg", (-360.0, 720.0), "Give degrees clockwise from true north."),
)
PER_SCAN = ("t_s", "lat_deg", "lon_deg", "heading_deg")
ADVICE = "docs/uwb.md describes the file; numpy.savez_compressed writes one."

Arrays = dict[str, NDArray[Any]]


def read_uwb_log(source: bytes | Path, name: str = "UWB log") -> UwbScans:
    """A log from its bytes or its file. Raises FormatError with the field that is wrong; never runs what it holds."""
    fields = _unpacked(source if isinstance(source, Path) else io.BytesIO(source), name)
    _check_head(fields, name)
    intensity = _numbers(fields, "intensity", 2, name)
    scans = {field: _numbers(fields, field, 1, name) for field in PER_SCAN}
    _check_lengths(intensity, scans, name)
    geometry = UwbGeometry(
        intensity.shape[1],
        _scalar(fields, "bin_m", 0.30, name),
        _scalar(fields, "first_bin_m", 0.0, name),
        math.radians(_scalar(fields, "beamwidth_deg", 40.0, name)),
    )
    lat_lon_deg = np.column_stack([scans["lat_deg"], scans["lon_deg"]])
    return UwbScans(scans["t_s"], lat_lon_deg, np.deg2rad(scans["heading_deg"]), intensity, geometry)


def write_uwb_log(path: Path, scans: UwbScans) -> None:
    """A file from which ``read_uwb_log`` gets the same scans back."""
    np.savez_compressed(
        path,
        format=np.array(FORMAT),
        version=np.array(VERSION),
        t_s=scans.t_s,
        lat_deg=scans.lat_lon_deg[:, 0],
        lon_deg=scans.lat_lon_deg[:, 1],
        heading_deg=np.rad2deg(scans.heading_rad),
        intensity=scans.intensity,
        bin_m=np.array(scans.geometry.bin_m),
        first_bin_m=np.array(scans.geometry.first_bin_m),
        beamwidth_deg=np.array(math.degrees(scans.geometry.beamwidth_rad)),
    )


def _unpacked(source: Path | io.BytesIO, name: str) -> Arrays:
    try:
        with zipfile.ZipFile(source) as archive:
            entries = [entry for entry in archive.infolist() if entry.filename.endswith(".npy")]
            _check_size(sum(entry.file_size for entry in entries), name)
            return {entry.filename[: -len(".npy")]: _array(archive, entry, name) for entry in entries}
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, zlib.error) as error:
        raise FormatError(f"This is no UWB log: {error}.", where=name, advice=ADVICE) from None


def _check_size(size: int, name: str) -> None:
    if size > MOST_BYTES:
        what = f"The log unpacks to {size / 1024**2:,.0f} MB, more than {MOST_BYTES // 1024**2} MB."
        raise FormatError(what, where=name, advice="Split it, or keep its intensities as uint8.")


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str) -> NDArray[Any]:
    """Its header is believed only as far as the entry is long."""
    where = f"{name}: {entry.filename}"
    try:
        data = archive.read(entry)
        stream = io.BytesIO(data)
        version = np.lib.format.read_magic(stream)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(stream)
        if dtype.hasobject or math.prod(shape) * dtype.itemsize > len(data):
            raise ValueError("its header promises something else than it holds")
        stream.seek(0)
        return np.lib.format.read_array(stream, allow_pickle=False)
    except (ValueError, SyntaxError, TypeError, OverflowError) as error:
        raise FormatError(f"This array cannot be read: {error}.", where=where, advice=ADVICE) from None


def _check_head(fields: Arrays, name: str) -> None:
    kind, version = fields.get("format"), fields.get("version")
    if kind is None or kind.size != 1 or str(kind.item()) != FORMAT:
        raise FormatError(f'This is no UWB log: "format" is not "{FORMAT}".', where=name, advice=ADVICE)
    if version is None or version.size != 1 or str(version.item()) != str(VERSION):
        raise FormatError(f'"version" is not {VERSION}.', where=name, advice="Use a newer Hedgehop, or write it anew.")
    missing = [field for field in (*PER_SCAN, "intensity") if field not in fields]
    if missing:
        raise FormatError(f"The log has no {', '.join(missing)}.", where=name, advice=ADVICE)


def _numbers(fields: Arrays, field: str, dimensions: int, name: str) -> NDArray[Any]:
    array = fields[field]
    if array.ndim != dimensions or array.size == 0 or array.dtype.kind not in "iuf":
        what = f"An array of {array.dtype} with shape {array.shape} stands where {dimensions}-D numbers are expected."
        raise FormatError(what, where=f"{name}: {field}", advice=ADVICE)
    if not np.isfinite(array).all():
        at = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise FormatError(
            f"The number at {at} is not finite.", where=f"{name}: {field}", advice="Leave such scans out."
        )
    return array if dimensions == 2 else array.astype(np.float64)


def _check_lengths(intensity: NDArray[Any], scans: Arrays, name: str) -> None:
    for field, array in scans.items():
        if len(array) != len(intensity):
            what = f"{len(array)} values for {len(intensity)} scans."
            raise FormatError(what, where=f"{name}: {field}", advice="Give one for every scan.")
    if intensity.shape[1] > MOST_BINS:
        raise FormatError(f"{intensity.shape[1]} range bins, {MOST_BINS} are the most.", where=f"{name}: intensity")
    if (np.diff(scans["t_s"]) < 0).any():
        at = int(np.argmax(np.diff(scans["t_s"]) < 0)) + 1
        raise FormatError(f"The time of scan {at} is before the one of its predecessor.", where=f"{name}: t_s")
    _check_times(scans["t_s"], name)
    for field, (least, most), advice in ANGLES_DEG:
        wrong = scans[field][(scans[field] < least) | (scans[field] > most)]
        if len(wrong):
            raise FormatError(f"{wrong[0]:g} is no such angle.", where=f"{name}: {field}", advice=advice)


def _check_times(t_s: F64, name: str) -> None:
    """What a cell is worth is told by the time that it was in view: in another unit all figures would be wrong."""
    where, steps_s = f"{name}: t_s", np.diff(t_s)
    steps_s = steps_s[steps_s > 0]
    if len(t_s) < 2:
        return
    if not len(steps_s):
        raise FormatError("No time passes: all scans have the same.", where=where, advice="Give each its own, in s.")
    usual_s = float(np.median(steps_s))
    if not SHORTEST_STEP_S <= usual_s <= LONGEST_STEP_S:
        raise FormatError(
            f"Scans usually follow each other after {usual_s:g} s; {SHORTEST_STEP_S:g} to {LONGEST_STEP_S:g} s can be.",
            where=where,
            advice="Give the times in seconds, not in milliseconds or ticks.",
        )


def _scalar(fields: Arrays, field: str, otherwise: float, name: str) -> float:
    array = fields.get(field)
    if array is None:
        return otherwise
    if array.size != 1 or array.dtype.kind not in "iuf" or not math.isfinite(float(array.item())):
        raise FormatError("One finite number is expected.", where=f"{name}: {field}", advice=ADVICE)
    return float(array.item())
