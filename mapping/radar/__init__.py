"""FMCW radar, from samples to targets: range and Doppler FFT, CFAR, direction of arrival (Miccinesi 2022, fig. 7)."""

from mapping.radar.cfar import Cfar
from mapping.radar.chain import AWR1843_SETTINGS, POSITION2GO_SETTINGS, ChainSettings, RadarChain, Spectra
from mapping.radar.detections import Detections
from mapping.radar.params import AWR1843, POSITION2GO, FmcwParams

__all__ = [
    "AWR1843",
    "AWR1843_SETTINGS",
    "POSITION2GO",
    "POSITION2GO_SETTINGS",
    "Cfar",
    "ChainSettings",
    "Detections",
    "FmcwParams",
    "RadarChain",
    "Spectra",
]
