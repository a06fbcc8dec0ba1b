"""A file of raw samples as it is to be read: its radar, its configuration, and the chain that its frames go through."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mapping.errors import RadarDataError
from mapping.radar.chain import AWR1843_SETTINGS, POSITION2GO_SETTINGS, RadarChain, Spectra
from mapping.radar.detections import Detections
from mapping.radar.params import AWR1843, POSITION2GO
from telemetry.sensors.adc.adc_file import AdcFile, AdcFrame
from telemetry.sensors.adc.codes import SampleCode
from telemetry.sensors.adc.opening import open_adc
from telemetry.sensors.ti_mmwave.config import read_config
from telemetry.sensors.ti_mmwave.differences import differences

AdcSensor = Literal["awr1843", "position2go"]
_USUAL = {"awr1843": (AWR1843, AWR1843_SETTINGS), "position2go": (POSITION2GO, POSITION2GO_SETTINGS)}


@dataclass(frozen=True, slots=True)
class HowRead:
    """What a file does not tell itself."""

    sensor: AdcSensor | None = None
    """None: a Position2Go's for .csv, else an AWR1843's."""
    samples_as: SampleCode = "auto"
    most: int | None = None
    """Only so many frames are looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    sensor: AdcSensor
    file: AdcFile
    chain: RadarChain
    notes: tuple[str, ...]
    """What was assumed, put right, or differs from what the obstacle map counts on."""

    def processed(self, frame: AdcFrame, number: int) -> tuple[Spectra, Detections]:
        """Raises RadarDataError with the file's name and the frame's number."""
        try:
            spectra = self.chain.spectra(frame.cube)
            return spectra, self.chain.detect(spectra)
        except RadarDataError as error:
            where = f"{self.file.name}, frame {number}"
            raise RadarDataError(error.what, where=where, advice=error.advice) from error


def read_adc(path: Path, how: HowRead, cfg: Path | None) -> Reading:
    """``cfg``: the configuration that a TI radar ran with. Raises RadarDataError, and OSError."""
    sensor: AdcSensor = how.sensor or ("position2go" if path.suffix.lower() == ".csv" else "awr1843")
    if cfg is not None and sensor != "awr1843":
        raise RadarDataError("A Position2Go has no .cfg.", where=cfg.name, advice="Leave out --cfg or the sensor.")
    config = read_config(cfg) if cfg is not None else None
    usual, settings = _USUAL[sensor]
    file = open_adc(path, usual, config, most=how.most, samples_as=how.samples_as)
    notes = (*file.notes, *(differences(config) if config is not None else ()))
    return Reading(sensor, file, RadarChain(file.params, settings), notes)
