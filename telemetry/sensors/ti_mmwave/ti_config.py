"""What a radar's configuration makes of it: chirps, antennas, and how finely it tells ranges, speeds and angles."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.errors import RadarDataError
from mapping.radar.radar_params import LIGHT_M_S, FmcwParams
from telemetry.sensors.ti_mmwave.cfg_commands import Command

USABLE_RANGE = 0.8
"""Of the range at which the beat reaches the sample rate: TI's figure for the receiver's filter."""
_AZIMUTH_TX = (0, 2)
"""TX1 and TX3 stand in one row with the receivers on an AWR1843BOOST; TX2 is raised."""
_TX_WAVELENGTHS = ((0.0, 0.0), (1.0, 0.5), (2.0, 0.0))
"""TX1, TX2, TX3 of an AWR1843BOOST, right and up (TI's antenna drawing). Receivers stand half a wavelength apart."""


@dataclass(frozen=True, slots=True)
class TiConfig:
    """As sent to the radar, in SI units. One profile, one frame, time-division multiplex."""

    file: str
    commands: tuple[Command, ...]
    start_frequency_hz: float
    slope_hz_per_s: float
    idle_s: float
    adc_start_s: float
    ramp_end_s: float
    samples: int
    sample_rate_hz: float
    rx: tuple[int, ...]
    """Receivers in use, 0 is RX1."""
    tx_order: tuple[int, ...]
    """The transmitter of each chirp of a loop, 0 is TX1."""
    loops: int
    """Chirps of each transmitter in a frame."""
    frame_period_s: float
    is_complex: bool
    q_first: bool
    """Raw samples come as Q, I instead of I, Q."""
    sends_points: bool
    sends_side_information: bool
    removes_static: bool
    least_snr_db: float
    """Weaker than that nothing is a detection."""

    @property
    def bandwidth_hz(self) -> float:
        """Swept while samples are taken."""
        return self.slope_hz_per_s * self.samples / self.sample_rate_hz

    @property
    def range_cells(self) -> int:
        """Of the radar's own range FFT, which is as long as the next power of two; real samples give half of it."""
        length = 1 << (self.samples - 1).bit_length()
        return length if self.is_complex else length // 2

    @property
    def wavelength_m(self) -> float:
        """In the middle of the samples."""
        middle_s = self.adc_start_s + self.samples / self.sample_rate_hz / 2
        return LIGHT_M_S / (self.start_frequency_hz + self.slope_hz_per_s * middle_s)

    @property
    def chirp_interval_s(self) -> float:
        """From a transmitter's chirp to its next one."""
        return (self.idle_s + self.ramp_end_s) * len(self.tx_order)

    @property
    def range_cell_m(self) -> float:
        return LIGHT_M_S / (2 * self.bandwidth_hz)

    @property
    def farthest_m(self) -> float:
        return USABLE_RANGE * self.sample_rate_hz * LIGHT_M_S / (2 * self.slope_hz_per_s)

    @property
    def velocity_cell_m_s(self) -> float:
        return self.wavelength_m / (2 * self.loops * self.chirp_interval_s)

    @property
    def fastest_m_s(self) -> float:
        """Radial speeds beyond it come out wrong by twice this."""
        return self.wavelength_m / (4 * self.chirp_interval_s)

    @property
    def azimuth_antennas(self) -> int:
        return len(self.rx) * max(1, len(set(self.tx_order) & set(_AZIMUTH_TX)))

    @property
    def azimuth_cell_rad(self) -> float:
        """Two targets closer than this straight ahead are one: 2 / antennas, half a wavelength apart."""
        return 2 / self.azimuth_antennas

    @property
    def measures_elevation(self) -> bool:
        return 1 in self.tx_order and len(set(self.tx_order)) > 1


def fmcw_params(config: TiConfig) -> FmcwParams:
    """Virtual antennas in the order of the samples: each chirp of a loop, and in it each receiver.

    Raises RadarDataError for what the chain cannot process.
    """
    if not config.is_complex:
        raise RadarDataError("It records real samples.", where=config.file, advice="Set adcCfg to complex.")
    if len(set(config.tx_order)) != len(config.tx_order):
        raise RadarDataError(
            "A transmitter sends twice in a loop.", where=config.file, advice="Give each transmitter one chirp a loop."
        )
    if max(config.tx_order) >= len(_TX_WAVELENGTHS):
        raise RadarDataError(
            f"TX{max(config.tx_order) + 1} sends; an AWR1843 has three transmitters.", where=config.file
        )
    pairs = [(turn, tx, rx) for turn, tx in enumerate(config.tx_order) for rx in config.rx]
    return FmcwParams(
        start_frequency_hz=config.start_frequency_hz + config.slope_hz_per_s * config.adc_start_s,
        slope_hz_per_s=config.slope_hz_per_s,
        sample_rate_hz=config.sample_rate_hz,
        samples=config.samples,
        chirps=config.loops,
        chirp_interval_s=config.chirp_interval_s,
        antennas=tuple((_TX_WAVELENGTHS[tx][0] + 0.5 * rx, _TX_WAVELENGTHS[tx][1]) for _, tx, rx in pairs),
        tdm_order=tuple(turn for turn, _, _ in pairs),
    )
