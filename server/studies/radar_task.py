"""What the radar lane's worker does: opens files of raw samples and processes single frames of them.

Files are known by their paths, which never come to hold anything else (``server.library.radar_files``).
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64
from mapping.radar.chain import RadarChain, Spectra
from planning.errors import DescribedError
from server.errors import BadRequestError
from server.library.radar_files import RadarPaths
from server.schemas import RadarFileDoc, RadarFrame, RadarOpened, RadarReading, RadarTracksBody, RadarTracksDoc
from server.schemas.study_docs import RadarDetectionDoc, RadarMap, RadarParametersDoc
from server.studies.radar_facts import detection_rows, parameters
from server.studies.scenario_task import part_doc
from server.work.jobs import Progress
from telemetry.sensors.adc.adc_file import AnyFrame
from telemetry.sensors.adc.read_adc import HowRead, Reading, read_adc

SHOWN_DB = 60.0
"""Below the strongest cell of a map."""
MOST_CELLS = 1024
"""Along each axis of a map that is sent; of finer ones the strongest of neighbouring cells."""


@dataclass(frozen=True, slots=True)
class Stored:
    """A kept file with what it is called."""

    doc: RadarFileDoc
    paths: RadarPaths


@dataclass(frozen=True, slots=True, eq=False)
class _Open:
    reading: Reading
    frames: AnyFrame
    count: int


def open_file(stored: Stored, how: RadarReading, *, report: Progress) -> RadarOpened:
    """Reads it through. Raises RadarDataError in the operator's own file names."""
    report(f"Reading {stored.doc.name}", None)
    with _named(stored):
        found = _opened(stored.paths.samples, stored.paths.cfg, how.sensor, how.samples, how.most)
    facts = RadarParametersDoc(**parameters(found.reading.sensor, found.reading.file))
    notes = [_in_own_names(stored, note) for note in found.reading.notes]
    return RadarOpened(file=stored.doc, frames=found.count, parameters=facts, notes=notes)


def process_frame(stored: Stored, how: RadarReading, number: int, *, report: Progress) -> RadarFrame:
    """One frame's maps and detections. Raises RadarDataError, BadRequestError for a frame that is not there."""
    report(f"Frame {number}", None)
    with _named(stored):
        found = _opened(stored.paths.samples, stored.paths.cfg, how.sensor, how.samples, how.most)
        if not 0 <= number < found.count:
            what = f"There is no frame {number}: the file has {found.count}, counted from 0."
            raise BadRequestError(what, where=stored.doc.name, advice="Choose one of them.")
        frame = found.frames.read(number)
        spectra, detected = found.reading.processed(frame, number)
    chain = found.reading.chain
    return RadarFrame(
        number=number,
        t_s=frame.t_s,
        doppler=_doppler_map(spectra),
        azimuth=_azimuth_map(chain, spectra),
        detections=[RadarDetectionDoc(**row) for row in detection_rows(detected)],
    )


def follow_poles(stored: Stored, asked: RadarTracksBody, *, report: Progress) -> RadarTracksDoc:
    """Its tracks against what motion capture saw. Raises RadarDataError in the operator's own file names."""
    # Loaded only now: the simulated radar with its kernels comes along, which frames alone do not need.
    from server.studies.oda_tracks import TracksWanted, tracks_against_truth
    from telemetry.simulation.scenarios.arena.truth_figures import truth_part

    paths, doc = stored.paths, stored.doc
    assert paths.capture is not None
    poles = tuple((pole.x_m, pole.z_m) for pole in asked.poles)
    with _named(stored):
        wanted = TracksWanted(poles, asked.offset_s, asked.forward)
        found = tracks_against_truth(paths.samples, paths.capture, wanted, report)
    part = truth_part(found, f"{doc.name}, {found.frames} frames")
    return RadarTracksDoc(asked=asked, capture_name=doc.capture_name, part=part_doc(part))


@lru_cache(maxsize=2)
def _opened(samples: Path, cfg: Path | None, sensor: Any, samples_as: Any, most: int | None) -> _Open:
    reading = read_adc(samples, HowRead(sensor, samples_as, most), cfg)
    frames = reading.file.any_frame()
    return _Open(reading, frames, frames.count if most is None else min(frames.count, most))


def _doppler_map(spectra: Spectra) -> RadarMap:
    speed_m_s, power = spectra.range_doppler
    return _map(power, rows=speed_m_s, columns=spectra.range_m)


def _azimuth_map(chain: RadarChain, spectra: Spectra) -> RadarMap | None:
    if len(chain.rows.row) < 2:
        return None
    sine, power = chain.range_azimuth(spectra)
    return _map(power, rows=spectra.range_m, columns=sine)


def _map(power: NDArray[Any], *, rows: F64, columns: F64) -> RadarMap:
    power, rows = _pooled(power, rows)
    turned, columns = _pooled(power.T, columns)
    level_db = 10.0 * np.log10(np.maximum(turned.T, 1e-12))
    top_db = float(level_db.max())
    cells = np.clip(np.round((level_db - top_db + SHOWN_DB) * (255.0 / SHOWN_DB)), 0, 255).astype(np.uint8)
    return RadarMap(
        rows=cells.shape[0],
        columns=cells.shape[1],
        cells=base64.b64encode(cells.tobytes()).decode(),
        floor_db=top_db - SHOWN_DB,
        top_db=top_db,
        first_row=float(rows[0]),
        row_step=_step(rows),
        first_column=float(columns[0]),
        column_step=_step(columns),
    )


def _pooled(power: NDArray[Any], along: F64) -> tuple[NDArray[Any], F64]:
    """Neighbouring rows joined to their strongest until there are few enough, and where these lie."""
    joined = -(-len(along) // MOST_CELLS)
    if joined == 1:
        return power, along
    begins = np.arange(0, len(along), joined)
    step = float(along[1] - along[0])
    return np.maximum.reduceat(power, begins, axis=0), along[begins] + step * (joined - 1) / 2


def _step(along: F64) -> float:
    """1 where there is but one cell."""
    return float(along[1] - along[0]) if len(along) > 1 else 1.0


@contextmanager
def _named(stored: Stored) -> Iterator[None]:
    """Errors name the operator's files, not those that they are kept in."""
    try:
        yield
    except DescribedError as error:
        for part in ("what", "where", "advice"):
            setattr(error, part, _in_own_names(stored, getattr(error, part)))
        raise


def _in_own_names(stored: Stored, text: str) -> str:
    if stored.paths.cfg is not None:
        text = text.replace(stored.paths.cfg.name, stored.doc.cfg_name)
    if stored.paths.capture is not None:
        text = text.replace(stored.paths.capture.name, stored.doc.capture_name)
    return text.replace(stored.paths.samples.name, stored.doc.name)
