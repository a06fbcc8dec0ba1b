"""``hedgehop radar process``: raw samples of a radar to detections and figures."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

from mapping.radar.chain import Spectra
from mapping.radar.detections import Detections
from planning.errors import DescribedError
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, end_progress, progress, say_notes
from server.studies.radar_facts import detection_rows, parameters
from telemetry.sensors.adc.codes import SampleCode
from telemetry.sensors.adc.read_adc import AdcSensor, HowRead, Reading, read_adc
from telemetry.sensors.target_recording import write_targets

SHOWN = 10
"""Detections of the first frame, in the answer for people."""


class RadarOptionsError(DescribedError):
    """Options that do not go together."""

    code = "radar_options"


@dataclass(slots=True)
class Processed:
    """What became of a file."""

    keeps: bool
    """Whether all detections are wanted, or only the first frame's and how many there are."""
    frames: int = 0
    detections: int = 0
    seconds: float = 0.0
    kept: list[tuple[int, float, Detections]] = field(default_factory=list)
    """Number and time of each kept frame, and what was detected in it."""

    @property
    def per_frame_s(self) -> float:
        return self.seconds / max(self.frames, 1)

    def take(self, t_s: float, found: Detections) -> None:
        if self.keeps or not self.frames:
            self.kept.append((self.frames, t_s, found))
        self.frames, self.detections = self.frames + 1, self.detections + len(found)


@command
def process(
    file: Annotated[Path, Argument(metavar="FILE", help="Raw samples: .npy, .bin (DCA1000) or .csv (ODA).")],
    sensor: Annotated[
        AdcSensor | None, Option(help="Which radar; default: position2go for .csv, else awr1843.")
    ] = None,
    cfg: Annotated[Path | None, Option(metavar="CFG", help="The configuration that a TI radar ran with.")] = None,
    out: Annotated[Path | None, Option(metavar="FILE", help="Write the detections as a recording (.mcap).")] = None,
    plots: Annotated[Path | None, Option(metavar="DIR", help="Write figures of one frame.")] = None,
    plot_frame: Annotated[int, Option(min=0, help="Of which frame, counted from 0.")] = 0,
    most: Annotated[int | None, Option("--frames", metavar="N", min=1, help="Only the first N frames.")] = None,
    samples_as: Annotated[
        SampleCode, Option("--samples", help="How 16-bit samples stand for numbers; auto: by how they fill them.")
    ] = "auto",
    as_json: o.AsJson = False,
) -> None:
    """Turn raw samples into detections: range and Doppler FFT, CFAR, direction of arrival."""
    if out is not None and out.suffix.lower() != ".mcap":
        what = f"{out.suffix or 'No ending'} is no format of recordings."
        raise RadarOptionsError(what, where=out.name, advice="Choose .mcap.")
    reading = read_adc(file, HowRead(sensor, samples_as, most), cfg)
    say_notes(*reading.notes)
    done = Processed(keeps=as_json)
    _run(_detections(reading, done, most, plots, plot_frame), out, file, reading.sensor)
    end_progress()
    used = parameters(reading.sensor, reading.file)
    answer(_summary(done, used), _lines(file, done, used), as_json=as_json)


def _detections(
    reading: Reading, done: Processed, most: int | None, plots: Path | None, plot_frame: int
) -> Iterator[tuple[float, Detections]]:
    """Frame by frame; counts what it did, and draws the chosen frame once all have been read: until then nothing is
    written that an error would leave behind."""
    chosen: tuple[Spectra, Detections] | None = None
    for number, frame in enumerate(islice(reading.file.frames(), most)):
        if number == 0:
            reading.processed(frame, number)  # compiles, which is not the frame's time
        began_s = time.perf_counter()
        spectra, found = reading.processed(frame, number)
        done.seconds += time.perf_counter() - began_s
        done.take(frame.t_s, found)
        if plots is not None and number == plot_frame:
            chosen = spectra, found
        progress(f"Frame {number}", None)
        yield frame.t_s, found
    if plots is not None:
        _draw(plots, reading, chosen, plot_frame, done.frames)


def _draw(plots: Path, reading: Reading, chosen: tuple[Spectra, Detections] | None, number: int, frames: int) -> None:
    if chosen is None:
        what = f"Frame {number} is not in the file, which has {frames}."
        raise RadarOptionsError(what, where="--plot-frame", advice="Frames count from 0.")
    # Loaded only now: drawing is rarely asked for.
    from server.cli.plots.radar_plots import write_figures

    write_figures(plots, reading.chain, *chosen, f"{reading.file.name}, frame {number}")


def _run(frames: Iterator[tuple[float, Detections]], out: Path | None, file: Path, sensor: AdcSensor) -> None:
    if out is None:
        for _ in frames:
            continue
    else:
        write_targets(out, frames, t_utc_s=file.stat().st_mtime, source=sensor)


def _summary(done: Processed, used: dict[str, Any]) -> dict[str, Any]:
    return {
        "frames": done.frames,
        "detections": [
            {"frame": frame, "t_s": round(t_s, 6), **row}
            for frame, t_s, found in done.kept
            for row in detection_rows(found)
        ],
        "seconds_per_frame": round(done.per_frame_s, 6),
        "parameters": used,
    }


def _lines(file: Path, done: Processed, used: dict[str, Any]) -> list[str]:
    frames = "1 frame" if done.frames == 1 else f"{done.frames:,} frames"
    first = done.kept[0][2] if done.kept else None
    return [
        f"{file.name}: {done.detections:,} detections in {frames}, {1e3 * done.per_frame_s:.2f} ms per frame",
        f"  range cells {used['range_resolution_m']:.3g} m to {used['max_range_m']:.4g} m, speed cells "
        f"{used['velocity_resolution_m_s']:.3g} m/s to {used['max_velocity_m_s']:.3g} m/s",
        *(["  the strongest of the first frame:", *_table(first)] if first is not None and len(first) else []),
    ]


def _table(found: Detections) -> list[str]:
    order = np.argsort(-found.snr_db, kind="stable")[:SHOWN]
    return [
        f"    {found.range_m[k]:8.2f} m  {found.radial_speed_m_s[k]:+7.2f} m/s  azimuth "
        f"{np.degrees(found.azimuth_rad[k]):+6.1f} deg  {found.snr_db[k]:5.1f} dB"
        for k in order
    ]
