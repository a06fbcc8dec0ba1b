"""The ODA data set's radar.csv with its optitrack.csv as tracks against truth, for command line and console alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapping.radar.chain import POSITION2GO_SETTINGS, RadarChain
from mapping.radar.detections import Detections
from mapping.radar.radar_params import POSITION2GO
from telemetry.sensors.adc.adc_file import AnyFrame
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.optitrack import Forward, read_optitrack
from telemetry.simulation.scenarios.arena.against_truth import TruthComparison, compared

TOLD_EVERY = 10
"""Frames."""


@dataclass(frozen=True, slots=True)
class TracksWanted:
    """What the two files do not tell themselves."""

    poles_xz_m: tuple[tuple[float, float], ...]
    """Where each stood, in the capture's own x and z."""
    offset_s: float = 0.0
    """So long after the capture's first row the radar's first frame was."""
    forward: Forward = "x"


def tracks_against_truth(
    radar: Path, optitrack: Path, wanted: TracksWanted, report: Callable[[str, float | None], None]
) -> TruthComparison:
    """Both files are read through before the first frame is processed.

    Raises RadarDataError, ParameterError and OSError.
    """
    report("Reading", None)
    capture = read_optitrack(optitrack, forward=wanted.forward)
    frames = open_oda(radar, POSITION2GO).any_frame()
    places_en_m = np.array([(x_m, -z_m) for x_m, z_m in wanted.poles_xz_m])
    took_s: list[float] = []
    found = compared(_detected(frames, took_s, report), capture, places_en_m, offset_s=wanted.offset_s)
    found.frame_s = took_s
    return found


def _detected(
    frames: AnyFrame, took_s: list[float], report: Callable[[str, float | None], None]
) -> Iterator[tuple[float, Detections]]:
    """Each frame's time ends when the next one is asked for: then it has been followed as well."""
    chain = RadarChain(POSITION2GO, POSITION2GO_SETTINGS)
    for number, frame in enumerate(frames.in_order()):
        if number % TOLD_EVERY == 0:
            report(f"Frame {number} of {frames.count}", number / frames.count)
        began_s = time.perf_counter()
        yield frame.t_s, chain.process(frame.cube)
        took_s.append(time.perf_counter() - began_s)
