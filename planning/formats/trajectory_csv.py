"""The trajectory as Melita 2020 hands it on: one CSV row per sample."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mapping.geometry.arrays import F64
from mapping.version import __version__
from planning.basics.plan_model import Home, SampledPath, Timing
from planning.errors import FormatError
from planning.formats.safe_text import check_lat_lon, clean_name, decode_text, finite
from planning.terrain.vertical_datum import is_amsl

if TYPE_CHECKING:
    from planning.terrain.dsm import Dsm

COLUMNS = ("lat_deg", "lon_deg", "alt_rel_home_m", "alt_amsl_m", "speed_m_s", "time_to_next_s", "loiter_s")
_OPTIONAL = "alt_amsl_m"


@dataclass(frozen=True, slots=True)
class Trajectory:
    """What a trajectory CSV holds; all arrays have one entry per sample."""

    home: Home
    lat_lon_deg: F64
    """(N, 2) WGS84"""
    alt_rel_home_m: F64
    alt_amsl_m: F64
    """NaN throughout when the surface model's datum is not above mean sea level."""
    speed_m_s: F64
    time_to_next_s: F64
    """Flying time to the next sample, without loiter; 0 at the last."""
    loiter_s: F64
    version: str


def write_trajectory(path: SampledPath, timing: Timing, home: Home, dsm: Dsm) -> str:
    """Sampled path and timing -> CSV text; leading `# key: value` lines give home, datum and version.

    ``alt_amsl_m`` stays empty unless the datum of ``dsm`` is above mean sea level.
    """
    lat_lon_deg = dsm.lat_lon_from_xy(path.xy_m)
    rel_m, time_s = path.alt_dsm_m - home.alt_dsm_m, time_to_next(timing)
    amsl = [f"{z:.3f}" for z in path.alt_dsm_m] if is_amsl(dsm.vertical_datum) else [""] * len(rel_m)
    columns = (lat_lon_deg[:, 0], lat_lon_deg[:, 1], rel_m, amsl, timing.speed_m_s, time_s, timing.loiter_s)
    rows = (
        f"{lat:.9f},{lon:.9f},{rel:.3f},{a},{v:.4f},{t:.6f},{w:.6g}"
        for lat, lon, rel, a, v, t, w in zip(*columns, strict=True)
    )
    return "\n".join([*_header(home), ",".join(COLUMNS), *rows]) + "\n"


def time_to_next(timing: Timing) -> F64:
    """(N,) seconds of flight from leaving a sample to reaching the next, 0 at the last."""
    flown_s = np.diff(timing.t_s) - timing.loiter_s[1:]
    return np.append(np.maximum(flown_s, 0.0), 0.0)


def _header(home: Home) -> list[str]:
    alt = f"{home.alt_dsm_m:.4f}" if math.isfinite(home.alt_dsm_m) else "unknown"
    return [
        f"# product: Hedgehop {__version__}",
        f"# home_lat_deg: {home.lat_deg:.9f}",
        f"# home_lon_deg: {home.lon_deg:.9f}",
        f"# home_alt_dsm_m: {alt}",
        f"# vertical_datum: {clean_name(home.vertical_datum or 'unknown')}",
    ]


def read_trajectory(data: bytes | str, name: str = "trajectory.csv") -> Trajectory:
    """The trajectory that `write_trajectory` wrote. Raises FormatError with file and row."""
    file = clean_name(name)
    lines = decode_text(name, data).splitlines()
    notes = _notes(lines)
    rows = [(n, line) for n, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not rows or tuple(rows[0][1].split(",")) != COLUMNS:
        raise FormatError(
            f"The header should be {','.join(COLUMNS)}.", where=file, advice="Export the trajectory again."
        )
    values = np.array([_row(line, f"{file}, row {n}") for n, line in rows[1:]], dtype=np.float64).reshape(-1, 7)
    rel_m, amsl_m, speed_m_s, time_s, loiter_s = values[:, 2:].T
    version = notes.get("product", "").removeprefix("Hedgehop ")
    return Trajectory(_home(notes, file), values[:, :2], rel_m, amsl_m, speed_m_s, time_s, loiter_s, version)


def _notes(lines: list[str]) -> dict[str, str]:
    pairs = (line[1:].partition(":") for line in lines if line.startswith("#"))
    return {key.strip(): clean_name(value) for key, _, value in pairs}


def _row(line: str, where: str) -> list[float]:
    fields = line.split(",")
    if len(fields) != len(COLUMNS):
        raise FormatError(f"A row has {len(COLUMNS)} fields, this one {len(fields)}.", where=where)
    values = [
        math.nan if column == _OPTIONAL and not field else finite(field, column, where)
        for column, field in zip(COLUMNS, fields, strict=True)
    ]
    check_lat_lon(values[0], values[1], where)
    return values


def _home(notes: dict[str, str], file: str) -> Home:
    missing = [k for k in ("home_lat_deg", "home_lon_deg", "home_alt_dsm_m", "vertical_datum") if k not in notes]
    if missing:
        raise FormatError(f"The comment lines lack {', '.join(missing)}.", where=file, advice="Export it again.")
    alt, datum = notes["home_alt_dsm_m"], notes["vertical_datum"]
    lat, lon = (finite(notes[k], k, file) for k in ("home_lat_deg", "home_lon_deg"))
    alt_m = math.nan if alt == "unknown" else finite(alt, "home_alt_dsm_m", file)
    return Home(*check_lat_lon(lat, lon, file), alt_m, None if datum == "unknown" else datum)
