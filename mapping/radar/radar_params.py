"""What an FMCW radar sends and where its antennas are: all that the processing needs to know of a sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.errors import ParameterError
from mapping.geometry.arrays import F64

LIGHT_M_S = 299_792_458.0
OBJECT_SPEED_CELLS, OBJECT_SPEED_CELL_M_S = 67, 0.31
"""Of an AWR1843's own object list: speeds that differ by all of its cells look the same."""


@dataclass(frozen=True, slots=True)
class FmcwParams:
    """A radar's waveform and virtual array; cubes of its samples are (chirps, antennas, samples), complex.

    Signs: an echo from range R has the phase ``+4 pi R / wavelength`` and a positive beat frequency. So what moves
    away turns the phase forward from chirp to chirp (Wessendorp 2021, eq. 3), and an antenna nearer to the target by
    ``s`` wavelengths of way sees the phase ``-2 pi s``.
    """

    start_frequency_hz: float
    """Where sampling begins."""
    slope_hz_per_s: float
    sample_rate_hz: float
    """Of complex samples."""
    samples: int
    """Of one chirp."""
    chirps: int
    """Of each transmitter in a frame."""
    chirp_interval_s: float
    """From one chirp of a transmitter to its next: with transmitters in turn (TDM), a whole round."""
    antennas: tuple[tuple[float, float], ...]
    """Of the virtual array: (right, up) in wavelengths, as the radar looks; the sum of transmitter and receiver."""
    tdm_order: tuple[int, ...] = ()
    """For each virtual antenna the turn, from 0, in which its transmitter sends; empty: all send at once."""

    def __post_init__(self) -> None:
        if not self.tdm_order:
            object.__setattr__(self, "tdm_order", (0,) * len(self.antennas))
        _check(self)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Of one frame's cube."""
        return self.chirps, len(self.antennas), self.samples

    @property
    def turns(self) -> int:
        """Transmitters that send one after the other."""
        return max(self.tdm_order) + 1

    @property
    def offset_s(self) -> F64:
        """(antennas,) how long after the round's beginning each virtual antenna's chirp is sent."""
        return np.array(self.tdm_order) * (self.chirp_interval_s / self.turns)

    @property
    def position_wavelengths(self) -> F64:
        """(antennas, 2) right and up"""
        return np.array(self.antennas, np.float64)

    @property
    def bandwidth_hz(self) -> float:
        """Swept while samples are taken."""
        return self.slope_hz_per_s * self.samples / self.sample_rate_hz

    @property
    def wavelength_m(self) -> float:
        """At the middle of the sweep."""
        return LIGHT_M_S / (self.start_frequency_hz + self.bandwidth_hz / 2)

    @property
    def range_resolution_m(self) -> float:
        """Width of a range cell, c / 2B."""
        return LIGHT_M_S / (2 * self.bandwidth_hz)  # Wessendorp 2021, eq. 1

    @property
    def max_range_m(self) -> float:
        """Beyond this an echo comes out as many metres too near."""
        return self.range_resolution_m * self.samples

    @property
    def max_velocity_m_s(self) -> float:
        """What moves faster than this, either way, comes out with the wrong speed and, with transmitters in turn, in
        the wrong direction: whole turns of the phase between chirps cannot be told from none.
        """
        return self.wavelength_m / (4 * self.chirp_interval_s)  # Wessendorp 2021, eq. 3

    @property
    def velocity_resolution_m_s(self) -> float:
        return 2 * self.max_velocity_m_s / self.chirps

    @property
    def coupling_m_per_m_s(self) -> float:
        """By how much too far a target comes out for each m/s of its speed: Doppler adds to the beat frequency."""
        return LIGHT_M_S / (self.wavelength_m * self.slope_hz_per_s)


def _check(p: FmcwParams) -> None:
    numbers = ("start_frequency_hz", "slope_hz_per_s", "sample_rate_hz", "chirp_interval_s")
    for name in numbers:
        if not (np.isfinite(getattr(p, name)) and getattr(p, name) > 0):
            raise ParameterError(f"{name} is {getattr(p, name)}.", where="radar", advice="Give a positive number.")
    if p.samples < 2 or p.chirps < 1:
        raise ParameterError(
            f"{p.samples} samples and {p.chirps} chirps are too few.", where="radar", advice="Give 2 and 1 or more."
        )
    if not p.antennas or len(p.tdm_order) != len(p.antennas) or min(p.tdm_order) < 0:
        raise ParameterError(
            f"{len(p.antennas)} antennas with {len(p.tdm_order)} turns of their transmitters.",
            where="radar",
            advice="Give at least one antenna, and for each the turn of its transmitter, from 0.",
        )


def _row(first: float, up: float) -> tuple[tuple[float, float], ...]:
    return tuple((first + 0.5 * k, up) for k in range(4))


AWR1843 = FmcwParams(
    start_frequency_hz=77e9,
    slope_hz_per_s=LIGHT_M_S / (2 * 0.5) / 25.6e-6,
    sample_rate_hz=10e6,
    samples=256,
    chirps=64,
    chirp_interval_s=LIGHT_M_S / 77.15e9 / (4 * 10.4),
    antennas=_row(0.0, 0.0) + _row(2.0, 0.0) + _row(1.0, 0.5),
    tdm_order=(0,) * 4 + (1,) * 4 + (2,) * 4,
)
"""TI AWR1843BOOST as Miccinesi 2022 used it: 0.5 m, to 120 m and a little more; +-10.4 m/s, 64 chirps of each of three
transmitters (0.325 m/s).

The virtual array is that of TI's antenna drawing. Four receivers stand side by side, half a wavelength apart. TX1 and
TX3 stand at one height, two wavelengths apart: four receivers seen from each make one row of eight. TX2 stands one
wavelength to the side of TX1, midway between the two, and half a wavelength higher: four more antennas in a second row
above the middle of the first. Channels are in the order of TI's usual configurations: TX1, TX3, TX2.
"""

POSITION2GO = FmcwParams(
    start_frequency_hz=24.0e9,
    slope_hz_per_s=200e6 / 300e-6,
    sample_rate_hz=64 / 300e-6,
    samples=64,
    chirps=16,
    chirp_interval_s=500e-6,
    antennas=((0.0, 0.0), (0.5, 0.0)),
)
"""Infineon Position2Go as Wessendorp 2021 used it: 200 MHz in 300 us (0.75 m), a chirp every 500 us (+-6.2 m/s), two
receivers half a wavelength apart.

The rate of 426,666 Hz that its data set states would end a chirp of 64 samples halfway; the range cells that are
published with it say that the 64 samples span the chirp, and so say we.
"""
