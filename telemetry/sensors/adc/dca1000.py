"""Captures of TI's DCA1000 card (.bin) from an xWR18xx: 16-bit samples that two lanes send two by two."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapping.errors import RadarDataError
from mapping.geometry.arrays import C64, I64
from telemetry.sensors.adc.adc_file import AdcFile, AdcFrame, AnyFrame, refuse_clipped, refuse_empty
from telemetry.sensors.adc.codes import Code, SampleCode, histogram, told
from telemetry.sensors.ti_mmwave.ti_config import TiConfig, fmcw_params

SAMPLE_BYTES = 4
"""I and Q."""


def open_dca1000(path: Path, config: TiConfig, *, most: int | None = None, samples_as: SampleCode = "auto") -> AdcFile:
    """``most``: of a longer file only so many frames are looked at.

    A chirp holds all samples of its first receiver, then those of the next; in each, two I are followed by their two Q
    (or the other way round, by adcbufCfg). Raises RadarDataError, and OSError.
    """
    params = fmcw_params(config)
    _refuse_headers(config)
    chirps, antennas, samples = params.shape
    frame_bytes = chirps * antennas * samples * SAMPLE_BYTES
    size = path.stat().st_size
    refuse_empty(path.name, size)
    count, rest = divmod(size, frame_bytes)
    if most is not None and count >= most:
        count, rest = most, 0
    if rest:
        raise RadarDataError(
            f"It ends in the middle of frame {count}, {rest:,} bytes after its beginning at byte "
            f"{count * frame_bytes:,}: by {config.file} a frame has {frame_bytes:,} bytes "
            f"({chirps} chirps x {antennas} antennas x {samples} samples).",
            where=path.name,
            advice=_advice(count),
        )

    code = told(_counts(path, frame_bytes, count), samples_as, path.name)

    def read(number: int) -> AdcFrame:
        with path.open("rb") as file:
            file.seek(number * frame_bytes)
            cube = _cube(file.read(frame_bytes), code, config, params.shape)
        refuse_clipped(cube, f"{path.name}, frame {number}")
        return AdcFrame(number * config.frame_period_s, cube)

    every, notes = AnyFrame(count, read), (code.note,) if code.note else ()
    return AdcFile(path.name, params, config.frame_period_s, notes, every.in_order, lambda: every)


def _counts(path: Path, frame_bytes: int, frames: int) -> I64:
    """How often each word occurs in all frames: the first may be quiet."""
    counts = np.zeros(1 << 16, np.int64)
    with path.open("rb") as file:
        for _ in range(frames):
            counts += histogram(np.frombuffer(file.read(frame_bytes), "<u2"))
    return counts


def _cube(data: bytes, code: Code, config: TiConfig, shape: tuple[int, int, int]) -> C64:
    """Chirps of all transmitters in turn become virtual antennas."""
    lanes = code.numbers(np.frombuffer(data, "<u2")).reshape(-1, 2, 2)
    first, second = lanes[:, 0].ravel(), lanes[:, 1].ravel()
    real, imaginary = (second, first) if config.q_first else (first, second)
    cube = np.empty(len(real), np.complex64)
    cube.real, cube.imag = real, imaginary
    return cube.reshape(shape)


def _refuse_headers(config: TiConfig) -> None:
    for command in config.commands:
        if command.name == "lvdsStreamCfg" and command.whole(1, "the choice of headers") != 0:
            raise command.error("Captures with headers between the samples are not understood (lvdsStreamCfg).")


def _advice(whole_frames: int) -> str:
    if not whole_frames:
        return "Give the configuration that the radar ran with, or record again."
    return f"If the configuration is the right one, take the whole frames alone: --frames {whole_frames}."
