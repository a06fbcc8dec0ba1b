"""Opens a file of raw samples by its ending."""

from __future__ import annotations

from pathlib import Path

from mapping.errors import RadarDataError
from mapping.radar.params import FmcwParams
from telemetry.sensors.adc.adc_file import AdcFile
from telemetry.sensors.adc.codes import SampleCode
from telemetry.sensors.adc.dca1000 import open_dca1000
from telemetry.sensors.adc.npy import open_npy
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.ti_mmwave.ti_config import TiConfig, fmcw_params

ENDINGS = (".npy", ".bin", ".csv")


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
