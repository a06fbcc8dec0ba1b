"""Cubes as NumPy arrays (.npy), complex: samples last, before them antennas, chirps and frames where there are any."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import prod
from pathlib import Path

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from mapping.errors import RadarDataError
from mapping.geometry.arrays import C64, I64
from mapping.radar.radar_params import FmcwParams
from telemetry.sensors.adc.adc_file import AdcFile, AdcFrame, AnyFrame, dimensions, refuse_clipped, refuse_empty
from telemetry.sensors.adc.codes import Code, SampleCode, histogram, told

USUAL_PERIOD_S = 0.1
"""Arrays do not tell it."""
_CHUNK = 1 << 18
"""Numbers that are looked at in one go."""
_HEADERS = {(1, 0): npy_format.read_array_header_1_0, (2, 0): npy_format.read_array_header_2_0}


@dataclass(frozen=True, slots=True)
class _Layout:
    """What the file's own head says, and that its length agrees."""

    shape: tuple[int, int, int, int]
    """Frames, chirps, antennas, samples."""
    dtype: np.dtype[np.complexfloating]
    column_order: bool
    offset: int


def open_npy(
    path: Path,
    params: FmcwParams,
    *,
    exact: bool,
    period_s: float | None = None,
    samples_as: SampleCode = "auto",
) -> AdcFile:
    """``exact``: the array must fit ``params``; otherwise they are cut or stretched to it, with a note.

    Raises RadarDataError for other arrays, and OSError.
    """
    layout = _layout(path)
    fitting, notes = _fit(layout, params, path.name, exact=exact)
    code = _code(path, layout, samples_as)
    if code is not None:
        notes += (code.note or "Its samples were stored unsigned: 65536 was taken off those above 32767.",)
    step_s = period_s or USUAL_PERIOD_S

    def read(number: int) -> AdcFrame:
        stored = _frame(path, layout, number)
        cube = stored.astype(np.complex64) if code is None else _decoded(stored, code)
        refuse_clipped(cube, f"{path.name}, frame {number}")
        return AdcFrame(number * step_s, cube)

    every = AnyFrame(layout.shape[0], read)
    return AdcFile(path.name, fitting, step_s, notes, every.in_order, lambda: every)


def _layout(path: Path) -> _Layout:
    size = path.stat().st_size
    refuse_empty(path.name, size)
    with path.open("rb") as file:
        try:
            version = npy_format.read_magic(file)
            shape, column_order, dtype = _HEADERS[version](file)
        except (ValueError, KeyError, EOFError, SyntaxError) as error:
            raise RadarDataError(
                "This is no NumPy array.", where=path.name, advice="Save the cube with numpy.save."
            ) from error
        offset = file.tell()
    if not np.issubdtype(dtype, np.complexfloating):
        raise RadarDataError(
            f"Its numbers are {dtype}, not complex.", where=path.name, advice="Save I + 1j * Q as a complex array."
        )
    if not 2 <= len(shape) <= 4 or prod(shape) == 0:
        raise RadarDataError(
            f"It has the shape {dimensions(shape) or 'of a single number'}.",
            where=path.name,
            advice="Cubes are chirps x samples, chirps x antennas x samples, or frames of the latter.",
        )
    full = (1, shape[0], 1, shape[1]) if len(shape) == 2 else (1,) * (4 - len(shape)) + tuple(shape)
    _check_length(path.name, size, offset, full, dtype)
    return _Layout((full[0], full[1], full[2], full[3]), dtype, column_order, offset)


def _check_length(name: str, size: int, offset: int, shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> None:
    expected = offset + prod(shape) * dtype.itemsize
    if size < expected:
        chirps = (size - offset) // (prod(shape[2:]) * dtype.itemsize)
        raise RadarDataError(
            f"It ends after {size:,} of {expected:,} bytes, in chirp {chirps % shape[1]} "
            f"of frame {chirps // shape[1]}.",
            where=name,
            advice="The file was cut off: copy or record it again.",
        )
    if size > expected:
        raise RadarDataError(
            f"{size - expected:,} bytes follow the {expected:,} that its head announces.",
            where=name,
            advice="Save the cube again with numpy.save.",
        )


def _frame(path: Path, layout: _Layout, number: int) -> NDArray[np.complexfloating]:
    """(chirps, antennas, samples), a copy."""
    if layout.column_order:
        whole = np.memmap(path, layout.dtype, "r", layout.offset, layout.shape, "F")
        return np.array(whole[number])
    size = prod(layout.shape[1:]) * layout.dtype.itemsize
    with path.open("rb") as file:
        file.seek(layout.offset + number * size)
        return np.frombuffer(file.read(size), layout.dtype).reshape(layout.shape[1:])


def _fit(layout: _Layout, params: FmcwParams, name: str, *, exact: bool) -> tuple[FmcwParams, tuple[str, ...]]:
    found = layout.shape[1:]
    if found == params.shape:
        return params, ()
    if exact:
        raise RadarDataError(
            f"Its frames are {dimensions(found)} (chirps x antennas x samples); by the configuration they would be "
            f"{dimensions(params.shape)}.",
            where=name,
            advice="Give the configuration that the radar ran with.",
        )
    chirps, antennas, samples = found
    turns = params.tdm_order
    usual = sorted({1, *(n for n in range(1, len(turns) + 1) if n == len(turns) or turns[n] != turns[n - 1])})
    if antennas not in usual:
        raise RadarDataError(
            f"It has {antennas} antennas (shape {dimensions(found)}: chirps x antennas x samples).",
            where=name,
            advice=f"This radar has {', '.join(map(str, usual[:-1]))} or {usual[-1]}; give its .cfg if it has one.",
        )
    if samples < 8:
        raise RadarDataError(f"A chirp has {samples} samples.", where=name, advice="The last axis holds the samples.")
    fitting = replace(
        params, chirps=chirps, samples=samples, antennas=params.antennas[:antennas], tdm_order=turns[:antennas]
    )
    note = (
        f"Its frames are {dimensions(found)} (chirps x antennas x samples), not {dimensions(params.shape)}: ranges and "
        "speeds hold only if its chirps were of the usual kind; give the configuration with --cfg."
    )
    return fitting, (note,)


def _code(path: Path, layout: _Layout, asked: SampleCode) -> Code | None:
    """How 16-bit words whose sign was lost stand for numbers; None: the numbers are what they are.

    Raises RadarDataError where words are no signal in any code, or the one that was asked for needs words.
    """
    counts = _words(path, layout)
    if counts is None:
        if asked == "offset-binary":
            raise RadarDataError(
                "Its samples are not whole numbers from 0 to 65535.",
                where=path.name,
                advice="Leave --samples out: the numbers are taken as they are.",
            )
        return None
    code = told(counts, asked, path.name)
    below = not counts[1 << 15 :].any()
    return None if code.zero is None and below else code


def _words(path: Path, layout: _Layout) -> I64 | None:
    """How often each whole number from 0 to 65535 occurs, if there are no others; what is no number says nothing.

    All frames are looked at until one proves the contrary: the first may be quiet.
    """
    numbers = np.memmap(path, layout.dtype, "r", layout.offset, (prod(layout.shape),))
    counts = np.zeros(1 << 16, np.int64)
    for begin in range(0, len(numbers), _CHUNK):
        piece = numbers[begin : begin + _CHUNK]
        parts = np.concatenate((piece.real, piece.imag))
        parts = parts[np.isfinite(parts)]
        if bool(((parts < 0) | (parts > 65535) | (parts != np.round(parts))).any()):
            return None
        counts += histogram(parts.astype(np.uint16))
    return counts


def _decoded(stored: NDArray[np.complexfloating], code: Code) -> C64:
    """What is no number stays none."""
    cube = np.empty(stored.shape, np.complex64)
    for ours, part in ((cube.real, stored.real), (cube.imag, stored.imag)):
        known = np.isfinite(part)
        ours[...] = np.where(known, code.numbers(np.where(known, part, 0).astype(np.uint16)), part)
    return cube
