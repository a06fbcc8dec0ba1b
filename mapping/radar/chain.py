"""The whole chain of one frame: range FFT, Doppler FFT, CASO- and CA-CFAR, direction of arrival.

Miccinesi 2022, fig. 7. Wessendorp 2021's chain is the same with two antennas and zero padding to 256 x 64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.errors import RadarDataError
from mapping.geometry.arrays import C64, F32, F64, Bools
from mapping.radar import cfar, doa, fft
from mapping.radar.cfar import Cfar
from mapping.radar.detections import Detections, between_cells, detections
from mapping.radar.fft import Window, envelope, own_peaks
from mapping.radar.radar_params import FmcwParams
from mapping.radar.targets import Gate, Polar, in_gate

TI_RANGE, TI_DOPPLER = Cfar(guard=4, training=8), Cfar(guard=2, training=4)
"""As in TI's usual configurations (cfarCfg)."""


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """How a frame is processed."""

    range_window: Window = "hann"
    doppler_window: Window = "hann"
    range_padding: int = 2
    """Zero padding: cells of the map per cell of resolution. Two equal targets close together need 2 or more."""
    doppler_padding: int = 1
    range_cfar: Cfar = TI_RANGE
    doppler_cfar: Cfar = TI_DOPPLER
    azimuth_size: int = 64
    """Cells of the FFT over the antennas."""
    second_azimuth: float = 0.5
    """Of the highest azimuth's power: what reaches it in the same cell is another target."""
    side_lobe_margin: float = 2.0
    """A peak not so many times as strong as a stronger one's side lobes there is taken for one of them."""
    most: int = 256
    """Peaks of a frame that are kept, the strongest."""
    nearest_m: float = 0.0
    farthest_m: float = float("inf")
    gate: Gate | None = None
    """Azimuths and elevations that are kept; None: all, for whoever reads them to choose."""


AWR1843_SETTINGS = ChainSettings()
POSITION2GO_SETTINGS = ChainSettings(range_padding=4, doppler_padding=4)
"""Padded as Wessendorp 2021's published node pads."""


@dataclass(frozen=True, slots=True, eq=False)
class Spectra:
    """What the two transforms make of a frame."""

    bins: C64
    """(Doppler, antennas, ranges), speed 0 first"""
    power: F32
    """(Doppler, ranges) mean over the antennas, speed 0 first"""
    range_m: F64
    """(ranges,) of each cell, for what does not move"""
    speed_m_s: F64
    """(Doppler,) of each cell, in the order of ``power``: positive speeds first, then negative"""

    @property
    def range_profile(self) -> F64:
        """(ranges,) power by range, all speeds"""
        return self.power.sum(axis=0, dtype=np.float64)

    @property
    def range_doppler(self) -> tuple[F64, F32]:
        """(Doppler,) speeds in ascending order, (Doppler, ranges) power"""
        return np.fft.fftshift(self.speed_m_s), np.fft.fftshift(self.power, axes=0)


class RadarChain:
    """From samples to targets (Miccinesi 2022, fig. 7; Wessendorp 2021, III-A), one radar's frames one by one.

    All that depends on its parameters alone is worked out once. Not for several threads at once. Raises ParameterError
    for an array that stands on no grid, or a CFAR that does not fit.
    """

    def __init__(self, params: FmcwParams, settings: ChainSettings = AWR1843_SETTINGS) -> None:
        self.params, self.settings = params, settings
        self.rows = doa.rows_of(params)
        s, looks = settings, len(params.antennas)
        self._windows = fft.window(s.range_window, params.samples), fft.window(s.doppler_window, params.chirps)
        self._size = params.chirps * s.doppler_padding, params.samples * s.range_padding
        self._range_stage = cfar.range_stage(
            s.range_cfar, name=s.range_window, samples=params.samples, padding=s.range_padding, looks=looks
        )
        self._doppler_stage = cfar.doppler_stage(
            s.doppler_cfar, name=s.doppler_window, chirps=params.chirps, padding=s.doppler_padding, looks=looks
        )
        self._lobes = envelope(s.doppler_window, params.chirps), envelope(s.range_window, params.samples)
        # Wessendorp 2021, eq. 1, eq. 3
        self.range_m: F64 = np.arange(self._size[1], dtype=np.float64) * (params.range_resolution_m / s.range_padding)
        self.speed_m_s: F64 = np.fft.fftfreq(self._size[0]).astype(np.float64) * (2 * params.max_velocity_m_s)

    def process(self, cube: NDArray[np.complexfloating]) -> Detections:
        """A frame's samples (chirps, antennas, samples) -> its targets. Raises RadarDataError."""
        return self.detect(self.spectra(cube))

    def spectra(self, cube: NDArray[np.complexfloating]) -> Spectra:
        """Both transforms and the power. Raises RadarDataError."""
        self._check(cube)
        bins = fft.windowed(cube, *self._windows)
        bins = fft.doppler_fft(fft.range_fft(bins, self._size[1]), self._size[0])  # Miccinesi 2022, fig. 7
        power = _mean_power(bins)
        if not np.isfinite(power.sum()):
            raise RadarDataError(
                "Some of the samples are not numbers, or too large.",
                where="radar frame",
                advice="Leave this frame out.",
            )
        return Spectra(bins, power, self.range_m, self.speed_m_s)

    def detect(self, spectra: Spectra) -> Detections:
        """Both CFAR stages, peaks without side lobes, and their directions."""
        s, power = self.settings, spectra.power
        # Miccinesi 2022, fig. 7
        cells, noise = cfar.peaks(power, self._range_stage, self._doppler_stage, *self._range_cells())
        strength = power[cells[:, 0], cells[:, 1]].astype(np.float64)
        order = np.argsort(-strength, kind="stable")[: s.most]
        cells, noise, strength = cells[order], noise[order].astype(np.float64), strength[order]
        doppler, ranges = between_cells(power, cells)
        doppler, ranges = doppler / s.doppler_padding, ranges / s.range_padding
        own = own_peaks(strength, doppler, ranges, *self._lobes, s.side_lobe_margin)
        cells = cells[own]
        found = detections(
            spectra.bins[cells[:, 0], :, cells[:, 1]],
            cells,
            doppler[own],
            ranges[own],
            noise[own],
            params=self.params,
            rows=self.rows,
            azimuth_size=s.azimuth_size,
            second=s.second_azimuth,
        )
        return found.where(self._kept(found))

    def azimuth_spectra(self, spectra: Spectra, found: Detections) -> tuple[F64, F64]:
        """(size,) sine to the right, (N, size) power by direction of each detection's cell, freed of its Doppler."""
        snapshots = spectra.bins[found.cells[:, 0], :, found.cells[:, 1]]
        cycles_per_s = 2.0 * found.radial_speed_m_s / self.params.wavelength_m
        still = doa.without_doppler(snapshots, cycles_per_s, self.params)
        size = self.settings.azimuth_size
        return doa.azimuth_axis(self.rows, size), doa.azimuth_spectrum(still, self.rows, size)

    def range_azimuth(self, spectra: Spectra) -> tuple[F64, F64]:
        """(size,) sine to the right, ascending, (ranges, size) power of all speeds, each freed of its own Doppler."""
        ranges, size = len(spectra.range_m), self.settings.azimuth_size
        power = np.zeros((ranges, size))
        for bins, speed_m_s in zip(spectra.bins, spectra.speed_m_s, strict=True):
            cycles_per_s = np.full(ranges, 2.0 * speed_m_s / self.params.wavelength_m)
            still = doa.without_doppler(bins.T, cycles_per_s, self.params)
            power += doa.azimuth_spectrum(still, self.rows, size)
        return doa.azimuth_axis(self.rows, size), power

    def _range_cells(self) -> tuple[int, int]:
        """First and last + 1 that can hold a target that is kept."""
        first = np.searchsorted(self.range_m, self.settings.nearest_m - self._slack_m())
        last = np.searchsorted(self.range_m, self.settings.farthest_m + self._slack_m(), side="right")
        return int(first), int(last)

    def _slack_m(self) -> float:
        return self.params.range_resolution_m + self.params.coupling_m_per_m_s * self.params.max_velocity_m_s

    def _kept(self, found: Detections) -> Bools:
        s = self.settings
        kept = (found.range_m >= s.nearest_m) & (found.range_m <= s.farthest_m)
        if s.gate is not None:
            kept &= in_gate(Polar(found.range_m, found.azimuth_rad, found.elevation_rad), s.gate)
        return kept

    def _check(self, cube: NDArray[np.complexfloating]) -> None:
        if cube.shape != self.params.shape:
            chirps, antennas, samples = self.params.shape
            raise RadarDataError(
                f"A frame of {' x '.join(map(str, cube.shape))} samples; this radar's are {chirps} chirps x {antennas} "
                f"antennas x {samples} samples.",
                where="radar frame",
                advice="Check that the data and the configuration belong together, and that the file is whole.",
            )
        if not np.iscomplexobj(cube):
            raise RadarDataError(
                f"Samples of type {cube.dtype} are not complex.",
                where="radar frame",
                advice="Give I and Q as complex numbers.",
            )


@njit(cache=True, nogil=True)
def _mean_power(bins):
    power = np.zeros((bins.shape[0], bins.shape[2]), np.float32)
    share = np.float32(1.0) / np.float32(bins.shape[1])
    for d in range(bins.shape[0]):
        for a in range(bins.shape[1]):
            for r in range(bins.shape[2]):
                power[d, r] += share * (bins[d, a, r].real ** 2 + bins[d, a, r].imag ** 2)
    return power
