"""Reads the surface model of a command and says what is remarkable about it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from planning.dsm import Dsm
from planning.errors import RasterFormatError
from planning.geotiff import ReadReport, read_dsm_reported
from server.cli.output import end_progress, say
from server.stopwatch import READ_STEP, StepTimer


@dataclass(frozen=True, slots=True)
class ModelOptions:
    """How the file is to be understood."""

    crs: str | None = None
    z_scale: float | None = None
    vertical_datum: str | None = None
    remove_spikes: bool = False


def read_model(path: Path, timer: StepTimer, options: ModelOptions) -> tuple[Dsm, dict[str, object]]:
    """The surface model, and what was done to its heights, for the certificate's assumptions."""
    if path.is_dir():
        raise RasterFormatError("This is a directory.", where=str(path), advice="Give the file of the model itself.")
    timer(READ_STEP, 0.0)
    dsm, report = read_dsm_reported(
        path,
        crs=options.crs,
        z_scale=options.z_scale,
        vertical_datum=options.vertical_datum,
        remove_spikes=options.remove_spikes,
        progress=lambda stage, share: timer(READ_STEP, share),
    )
    end_progress()
    _say_remarks(report)
    return dsm, {"spikes_removed": len(report.spikes)} if report.spikes_removed else {}


def _say_remarks(report: ReadReport) -> None:
    for warning in report.warnings:
        say(f"Note: {warning}")
    fate = "removed" if report.spikes_removed else "kept as terrain, unless you --remove-spikes"
    for spike in report.spikes:
        say(
            f"Note: isolated {spike.kind} of {spike.height_m:.1f} m, {spike.size_m:.1f} m wide, "
            f"at {spike.lat_deg:.7f}, {spike.lon_deg:.7f}: {fate}."
        )
