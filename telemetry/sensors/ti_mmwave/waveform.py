"""A configuration as the processing chain wants it: waveform and virtual array."""

from __future__ import annotations

from mapping.errors import RadarDataError
from mapping.radar.params import FmcwParams
from telemetry.sensors.ti_mmwave.model import TiConfig

_TX_WAVELENGTHS = ((0.0, 0.0), (1.0, 0.5), (2.0, 0.0))
"""TX1, TX2, TX3 of an AWR1843BOOST, right and up (TI's antenna drawing). Receivers stand half a wavelength apart."""


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
