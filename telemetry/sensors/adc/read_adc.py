"""A file of raw samples as it is to be read: its radar, its configuration, and the chain that its frames go through."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mapping.errors import RadarDataError
from mapping.radar.chain import AWR1843_SETTINGS, POSITION2GO_SETTINGS, RadarChain, Spectra
from mapping.radar.detections import Detections
from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from telemetry.sensors.adc.adc_file import AdcFile, AdcFrame
from telemetry.sensors.adc.codes import SampleCode
from telemetry.sensors.adc.dca1000 import open_dca1000
from telemetry.sensors.adc.npy import open_npy
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.ti_mmwave.config import read_config
from telemetry.sensors.ti_mmwave.differences import differences
from telemetry.sensors.ti_mmwave.ti_config import TiConfig, fmcw_params

ENDINGS = (".npy", ".bin", ".csv")
AdcSensor = Literal["awr1843", "position2go"]
_USUAL = {"awr1843": (AWR1843, AWR1843_SETTINGS), "position2go": (POSITION2GO, POSITION2GO_SETTINGS)}


def open_adc(
    path: Path,
    sensor: FmcwParams,
    config: TiConfig | None,
    *,
    most: int | None = None,
    samples_as: SampleCode = "auto",
) -> AdcFile:
    """``sensor``: the radar's usual parameters, used where there is no configuration; ``most``: frames that matter;
    ``samples_as``: how 16-bit words stand for numbers, looked for unless it is said.

    Raises RadarDataError for files that are none, or do not fit; and OSError.
    """
    match path.suffix.lower():
        case ".npy" if config is not None:
            return open_npy(
                path, fmcw_params(config), exact=True, period_s=config.frame_period_s, samples_as=samples_as
            )
        case ".npy":
            return open_npy(path, sensor, exact=False, samples_as=samples_as)
        case ".bin" if config is not None:
            return open_dca1000(path, config, most=most, samples_as=samples_as)
        case ".bin":
            raise RadarDataError(
                "A DCA1000 capture does not tell its frames.",
                where=path.name,
                advice="Give the configuration that the radar ran with: --cfg FILE.",
            )
        case ".csv" if config is not None:
            raise RadarDataError("A .csv is of a Position2Go, which has no .cfg.", where=path.name)
        case ".csv":
            return open_oda(path, sensor)
        case ending:
            raise RadarDataError(
                f'"{ending}" is no format of raw samples.', where=path.name, advice="Give a .npy, .bin or .csv file."
            )


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
