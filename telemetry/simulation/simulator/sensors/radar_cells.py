"""Which of a radar's cells are detected, and what each holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, I64
from telemetry.simulation.simulator.sensors.radar_model import RadarModel


@dataclass(frozen=True, slots=True)
class Scatterers:
    """Patches in the radar's own coordinates."""

    range_m: F64
    azimuth_rad: F64
    elevation_rad: F64
    speed_m_s: F64
    """Radial, positive: moving away."""
    snr: F64


@dataclass(frozen=True, slots=True)
class Found:
    scatterer: I64
    """(N,) the patch that speaks for the cell"""
    power: F64
    """(N,) over the mean noise, this frame's"""


def detect(patches: Scatterers, model: RadarModel, random: np.random.Generator) -> Found:
    """Cells above the threshold that outshine their neighbours in range and speed.

    A cell of range and speed has one direction per beam; the strongest is reported, and others that come near it
    (TI's peak grouping and multi-object beam forming). The patch that speaks for a beam is drawn by its share of
    the power: what an extended thing's glint wanders over.
    """
    if not len(patches.snr):
        return Found(np.empty(0, np.int64), np.empty(0))
    beam_of = _beam_of(patches, model)
    beams, of_beam = np.unique(beam_of, return_inverse=True)
    mean = np.bincount(of_beam, weights=patches.snr)
    power = (1.0 + mean) * random.standard_exponential(len(beams))
    cell = beams // model.beams
    best = _strongest(cell, power)
    shown = (power >= model.threshold) & (power >= best * 10 ** (model.second_peak_db / 10))
    shown &= best >= _neighbours(cell, best, model)
    picked = np.flatnonzero(shown)
    return Found(_drawn(picked, of_beam, patches.snr, random), power[picked])


def _beam_of(patches: Scatterers, model: RadarModel) -> I64:
    """A number per range cell, speed cell and beam, in this order of weight."""
    range_cell = np.floor(patches.range_m / model.range_cell_m).astype(np.int64)
    speed_cell = np.round(patches.speed_m_s / model.speed_cell_m_s).astype(np.int64) % model.speed_cells
    sine = np.sin(patches.azimuth_rad)
    beam = np.clip(np.floor((sine + 1.0) / 2 * model.beams), 0, model.beams - 1).astype(np.int64)
    return (range_cell * model.speed_cells + speed_cell) * model.beams + beam


def _strongest(cell: I64, power: F64) -> F64:
    """(N,) the strongest power in each one's cell."""
    best = np.zeros(cell.max() + 1)
    np.maximum.at(best, cell, power)
    return best[cell]


def _neighbours(cell: I64, best: F64, model: RadarModel) -> F64:
    """(N,) the strongest power in the cells next to each one's in range and in speed."""
    rows = int(cell.max()) // model.speed_cells + 1
    grid = np.zeros((rows + 2, model.speed_cells))
    row, column = cell // model.speed_cells + 1, cell % model.speed_cells
    grid[row, column] = best
    around = np.zeros_like(best)
    for up, along in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        around = np.maximum(around, grid[row + up, (column + along) % model.speed_cells])
    return around


def _drawn(picked: I64, of_beam: I64, snr: F64, random: np.random.Generator) -> I64:
    """For each picked beam one of its patches, as likely as its share of the power."""
    order = np.argsort(of_beam, kind="stable")
    edges = np.searchsorted(of_beam[order], np.arange(of_beam.max() + 2))
    total = np.concatenate([[0.0], np.cumsum(snr[order])])
    low, high = total[edges[picked]], total[edges[picked + 1]]
    at = np.searchsorted(total, low + (high - low) * random.random(len(picked)), side="right") - 1
    return order[np.clip(at, edges[picked], edges[picked + 1] - 1)]
