"""From peaks of the range-Doppler map to targets: places between cells, speed, range, direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import C64, F32, F64, I64, Bools
from mapping.radar import doa
from mapping.radar.radar_params import FmcwParams

CLEAR = 20.0
"""Times the noise's mean that a direction besides the strongest must have: noise alone comes to it once in e**20."""


@dataclass(frozen=True, slots=True, eq=False)
class Detections:
    """Targets of one frame in the radar's frame (x right, y forward, z up), the strongest first."""

    range_m: F64
    """(N,) at the middle of the frame"""
    radial_speed_m_s: F64
    """(N,) positive: moving away"""
    azimuth_rad: F64
    """(N,) positive to the right of the boresight; 0 where the radar has one antenna"""
    elevation_rad: F64
    """(N,) rough, to be used as a gate; 0 where all antennas are at one height"""
    snr_db: F64
    """(N,) above the noise of a cell, beside it in range"""
    cells: I64
    """(N, 2) of the map: Doppler, range"""

    def __len__(self) -> int:
        return len(self.range_m)

    @property
    def xyz_m(self) -> F64:
        """(N, 3)"""
        flat = self.range_m * np.cos(self.elevation_rad)
        return np.column_stack(
            [
                flat * np.sin(self.azimuth_rad),
                flat * np.cos(self.azimuth_rad),
                self.range_m * np.sin(self.elevation_rad),
            ]
        )

    def where(self, kept: Bools | I64) -> Detections:
        """Some of them, in this order."""
        return Detections(
            self.range_m[kept],
            self.radial_speed_m_s[kept],
            self.azimuth_rad[kept],
            self.elevation_rad[kept],
            self.snr_db[kept],
            self.cells[kept],
        )


def between_cells(power: F32, cells: I64) -> tuple[F64, F64]:
    """(Doppler, range) and (N, 2) peaks -> (N,) places in Doppler, from -half the ring, and (N,) in range, in cells.

    The top of the parabola through the logarithms of a peak and its neighbours.
    """
    size, ranges = power.shape
    d, c = cells.T
    here = _log(power[d, c])
    shift = doa.vertex(_log(power[(d - 1) % size, c]), here, _log(power[(d + 1) % size, c])) if size > 2 else 0.0
    inside = (c > 0) & (c < ranges - 1)
    beside = doa.vertex(_log(power[d, np.maximum(c - 1, 0)]), here, _log(power[d, np.minimum(c + 1, ranges - 1)]))
    return (d + shift + size / 2) % size - size / 2, c + np.where(inside, beside, 0.0)


def _log(power: F32) -> F64:
    return np.log(np.maximum(power.astype(np.float64), 1e-30))


def detections(
    snapshots: C64,
    cells: I64,
    doppler: F64,
    ranges: F64,
    noise: F64,
    *,
    params: FmcwParams,
    rows: doa.Rows,
    azimuth_size: int,
    second: float,
) -> Detections:
    """Peaks with their places in resolution cells (N,), what the antennas measured there (N, antennas), and the noise
    (N,) of an antenna. One peak may be several targets at different azimuths.
    """
    speed = doppler * params.velocity_resolution_m_s
    range_m = ranges * params.range_resolution_m - params.coupling_m_per_m_s * speed
    still = doa.without_doppler(snapshots, 2.0 * speed / params.wavelength_m, params)
    which, right = _directions(still, noise, rows, azimuth_size, second)
    up = doa.elevation_sine(still[which], right, rows)
    elevation = np.arcsin(up)
    azimuth = np.arcsin(np.clip(right / np.maximum(np.cos(elevation), 1e-6), -1.0, 1.0))
    snr = np.mean(snapshots.real**2 + snapshots.imag**2, axis=1) / np.maximum(noise, 1e-30)
    snr_db = 10.0 * np.log10(np.maximum(snr, 1e-30))
    return Detections(range_m[which], speed[which], azimuth, elevation, snr_db[which], cells[which])


def _directions(snapshots: C64, noise: F64, rows: doa.Rows, size: int, second: float) -> tuple[I64, F64]:
    every = np.arange(len(snapshots))
    if len(rows.row) == 1:
        return every, np.zeros(len(every))
    if len(rows.row) == 2:
        return every, doa.phase_direction(snapshots, rows)
    return doa.directions(doa.azimuth_spectrum(snapshots, rows, size), rows, second, CLEAR * len(rows.row) * noise)
