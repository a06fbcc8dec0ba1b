"""The ODA data set's radar.csv (Wessendorp 2021): a row per frame, time in ns, then I and Q of two receivers.

Four equal blocks follow the time: real and imaginary part of receiver 1, then of receiver 2; in each the chirps come
one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapping.errors import RadarDataError
from mapping.radar.radar_params import FmcwParams
from telemetry.sensors.adc.adc_file import AdcFile, AdcFrame, AnyFrame, refuse_clipped, refuse_empty

RATE_HZ = 15.7
_BLOCKS = 4
_CAPTURE_COLUMNS = 8
"""Of the data set's optitrack.csv, which lies beside it."""
_LONGEST_S = 86_400.0
"""Of one recording: times farther apart are not in ns."""


def open_oda(path: Path, params: FmcwParams) -> AdcFile:
    """Rows are read and checked one by one. Raises RadarDataError for a radar without two receivers, and OSError."""
    refuse_empty(path.name, path.stat().st_size)
    if len(params.antennas) != 2:
        raise RadarDataError(
            f"It holds two receivers, and this radar has {len(params.antennas)} antennas.",
            where=path.name,
            advice="Use --sensor position2go.",
        )

    def frames() -> Iterator[AdcFrame]:
        first_ns: float | None = None
        for row in _rows(path, params):
            first_ns = row.t_ns if first_ns is None else first_ns
            yield _frame(row.line, row.number, first_ns, params, path.name)

    def any_frame() -> AnyFrame:
        rows = [(row.offset, row.number, row.t_ns) for row in _rows(path, params)]

        def read(number: int) -> AdcFrame:
            offset, line_number, _ = rows[number]
            with path.open("rb") as file:
                file.seek(offset)
                return _frame(file.readline(), line_number, rows[0][2], params, path.name)

        return AnyFrame(len(rows), read)

    return AdcFile(path.name, params, 1.0 / RATE_HZ, (), frames, any_frame)


@dataclass(frozen=True, slots=True)
class _Row:
    number: int
    """Of the line, from 1."""
    offset: int
    """Of its first byte."""
    t_ns: float
    line: bytes


def _rows(path: Path, params: FmcwParams) -> Iterator[_Row]:
    """The lines that hold frames, their lengths and times checked. Raises RadarDataError."""
    first_ns = last_ns = None
    offset = 0
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            begins_at, offset = offset, offset + len(line)
            text = _text(line)
            if not text.strip() or (number == 1 and _is_heading(text)):
                continue
            where = f"{path.name}, line {number}"
            t_ns = _number(_fields(text, params, where)[0], 1, where)
            first_ns = t_ns if first_ns is None else first_ns
            _check_time(t_ns, first_ns, last_ns, where)
            last_ns = t_ns
            yield _Row(number, begins_at, t_ns, line)
    if first_ns is None:
        raise RadarDataError("There is no frame in it.", where=path.name, advice="Record it again.")


def _frame(line: bytes, number: int, first_ns: float, params: FmcwParams, name: str) -> AdcFrame:
    where = f"{name}, line {number}"
    values = _values(_text(line), params, where)
    cube = _cube(values[1:], params)
    refuse_clipped(cube, where)
    return AdcFrame((float(values[0]) - first_ns) * 1e-9, cube)


def _text(line: bytes) -> str:
    return line.decode("utf-8-sig", errors="replace")


def _check_time(t_ns: float, first_ns: float, last_ns: float | None, where: str) -> None:
    """Raises RadarDataError."""
    if not math.isfinite(t_ns):
        what = f"The frame's time is {t_ns}."
    elif last_ns is not None and t_ns <= last_ns:
        what = f"The frame's time, {t_ns:.0f} ns, is not after the one before, {last_ns:.0f} ns."
    elif (t_ns - first_ns) * 1e-9 > _LONGEST_S:
        what = f"The frame's time, {t_ns:.4g} ns, is more than a day after the first frame's."
    else:
        return
    raise RadarDataError(what, where=where, advice="The first column holds nanoseconds that rise from row to row.")


def _is_heading(line: str) -> bool:
    try:
        float(line.split(",", 1)[0])
    except ValueError:
        return True
    return False


def _fields(line: str, params: FmcwParams, where: str) -> list[str]:
    """As many as a frame has. Raises RadarDataError."""
    fields = line.strip().rstrip(",").split(",")
    expected = 1 + _BLOCKS * params.chirps * params.samples
    if len(fields) != expected:
        raise RadarDataError(
            f"A row of {len(fields):,} values; a frame of {params.chirps} chirps x {params.samples} samples of two "
            f"receivers has {expected:,}.",
            where=where,
            advice="This looks like optitrack.csv: radar.csv comes first, optitrack.csv second."
            if len(fields) == _CAPTURE_COLUMNS
            else "The row was cut off, or the file comes from another radar.",
        )
    return fields


def _values(line: str, params: FmcwParams, where: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """(1 + 4 x chirps x samples,)"""
    fields = _fields(line, params, where)
    try:
        return np.array(fields, dtype=np.float64)
    except ValueError:
        for column, field in enumerate(fields, start=1):
            _number(field, column, where)
        raise


def _number(field: str, column: int, where: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise RadarDataError(
            f'Value {column} is "{field.strip()[:20]}".', where=where, advice="Only numbers may stand in it."
        ) from None


def _cube(
    values: np.ndarray[tuple[int], np.dtype[np.float64]], params: FmcwParams
) -> np.ndarray[tuple[int, int, int], np.dtype[np.complex64]]:
    blocks = values.reshape(2, 2, params.chirps, params.samples)
    cube = blocks[:, 0] + 1j * blocks[:, 1]
    return np.ascontiguousarray(cube.transpose(1, 0, 2), dtype=np.complex64)
