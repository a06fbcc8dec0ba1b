"""Reads the surface model of a command and says what is remarkable about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from mapping.geometry.arrays import F64
from planning.errors import FormatError, ParameterError
from planning.planner.part import needed_part
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.dsm import Dsm, SurfaceModel
from planning.terrain.geotiff import open_dsm, open_models_of, read_dsm_reported
from planning.terrain.rasters.header import RasterLimits
from planning.terrain.rasters.http_ranges import RemoteFile, is_address
from planning.terrain.spikes import Spike, find_spikes, remove_spikes
from server.cli.shared.options import ModelOptions
from server.cli.shared.output import end_progress, say_notes
from server.settings import load_settings
from server.work.clocks import READ_STEP, StepTimer

PART_PX = 64_000_000
"""Read at once at most where a model is worked out block by block: a quarter of a gigabyte."""


@dataclass(frozen=True, slots=True)
class OpenedModel:
    """A surface model that stays in its file where that is large."""

    model: SurfaceModel
    made: dict[str, object]
    """What was done to its heights, and what its SHA-256 is of, for the certificate's assumptions."""
    spikes_told: bool

    def say_part(self, part: Dsm) -> None:
        """Spikes of the part that was looked at, once it is known, and the models of a catalogue that it is of."""
        say_notes(*self.part_notes(part))

    def part_notes(self, part: Dsm) -> list[str]:
        """What ``say_part`` says."""
        shares = share_lines(self.model, part) if isinstance(self.model, Catalogue) else []
        return shares if self.spikes_told else [*shares, *_spike_lines(find_spikes(part), removed=False)]


def open_model(
    path: Path, timer: StepTimer, options: ModelOptions, *, quiet: bool = False, in_parts: bool = False
) -> OpenedModel:
    """Says what is remarkable about it, unless ``quiet``: others have said it.

    Where spikes are to be removed, all of it is read: they are told by size. ``in_parts``: one file or its tiles, of
    which never more is read at once than ``PART_PX``; where only more would tell what numbers mean it is refused.
    """
    say = (lambda *notes: None) if quiet else say_notes
    if options.remove_spikes:
        dsm, made = read_model(path, timer, options, say=say)
        return OpenedModel(dsm, made, spikes_told=True)
    timer(READ_STEP, 0.0)
    if is_catalogue(path, options):
        catalogue = open_models_of(path, **_how(options, timer))
        end_progress()
        say(*catalogue.warnings)
        return OpenedModel(catalogue, _made_of(catalogue), spikes_told=False)
    source = RemoteFile(str(path), load_settings().dsm_urls) if is_address(path) else path
    limits = RasterLimits(max_px=PART_PX) if in_parts else None
    model = open_dsm(source, limits=limits, **_how(options, timer))
    end_progress()
    say(*model.warnings)
    if model.report is not None and not quiet:
        say(*_spike_lines(find_spikes(model.whole()), removed=False))
    made: dict[str, object] = {"model_sha256_of": source.identified_by} if isinstance(source, RemoteFile) else {}
    return OpenedModel(model, made, spikes_told=model.report is not None)


@lru_cache(maxsize=1)
def same_model(path: Path, options: ModelOptions, sha256: str, *, in_parts: bool = False) -> OpenedModel:
    """As another process opened it and said so; kept. Raises FormatError where another file lies at that path."""
    opened = open_model(path, StepTimer(), options, quiet=True, in_parts=in_parts)
    if opened.model.sha256 != sha256:
        raise FormatError(
            "The surface model here is another one than on the machine that asks.",
            where=str(path),
            advice="Put the same file on every worker at the same path.",
        )
    return opened


def read_around(
    path: Path,
    timer: StepTimer,
    options: ModelOptions,
    places: Callable[[SurfaceModel], F64],
    required_clearance_m: float = 0.0,
) -> Dsm:
    """The part around the projected (N, 2) ``places`` of a flight; all of a small model."""
    opened = open_model(path, timer, options)
    part = needed_part(opened.model, places(opened.model), required_clearance_m)
    end_progress()
    opened.say_part(part)
    return part


def read_model(
    path: Path, timer: StepTimer, options: ModelOptions, *, say: Callable[..., None] = say_notes
) -> tuple[Dsm, dict[str, object]]:
    """All of a surface model, and what was done to its heights, for the certificate's assumptions."""
    if is_address(path):
        raise ParameterError(
            "This needs the model as a whole, which is not read from a server.",
            where=path.name,
            advice="Download the file, or do without it (--remove-spikes, traversability).",
        )
    timer(READ_STEP, 0.0)
    if is_catalogue(path, options):
        return _read_catalogue(path, timer, options, say)
    dsm, report = read_dsm_reported(path, remove_spikes=options.remove_spikes, **_how(options, timer))
    end_progress()
    say(*report.warnings, *_spike_lines(report.spikes, removed=report.spikes_removed))
    return dsm, {"spikes_removed": len(report.spikes)} if report.spikes_removed else {}


def is_catalogue(path: Path, options: ModelOptions) -> bool:
    """Whether several models are given: a STAC document, or what is said to be a catalogue. No address is one."""
    several = options.catalogue or path.suffix.lower() == ".json"
    if several and is_address(path):
        raise ParameterError(
            "A catalogue is read from this machine alone, not from a server.",
            where=path.name,
            advice="Download its folder and give that with --catalogue, or the address of one GeoTIFF without it.",
        )
    return several


def share_lines(catalogue: Catalogue, part: Dsm) -> list[str]:
    """Which models of a catalogue are the best in a part of it, in words."""
    shares, seam = catalogue.shares_of(part)
    lines = [f"here: {share.model.words}: the best of {share.share:.0%} of the part looked at." for share in shares]
    return [*lines, f"{seam:.0%} of it lies at seams: the higher of the models counts."] if seam else lines


def _read_catalogue(
    path: Path, timer: StepTimer, options: ModelOptions, say: Callable[..., None]
) -> tuple[Dsm, dict[str, object]]:
    catalogue = open_models_of(path, **_how(options, timer))
    dsm = catalogue.whole()
    end_progress()
    spikes, removed = find_spikes(dsm), options.remove_spikes
    say(*catalogue.warnings, *share_lines(catalogue, dsm), *_spike_lines(spikes, removed=removed))
    made = _made_of(catalogue) | catalogue.said_of_look | ({"spikes_removed": len(spikes)} if removed else {})
    return remove_spikes(dsm, spikes) if removed else dsm, made


def _made_of(catalogue: Catalogue) -> dict[str, object]:
    """For the certificate's assumptions."""
    return {
        "models": "; ".join(model.words for model in catalogue.models),
        "models_left_out": "; ".join(out.name for out in catalogue.left_out) or "none",
    }


def _how(options: ModelOptions, timer: StepTimer) -> dict[str, Any]:
    return {
        "crs": options.crs,
        "z_scale": options.z_scale,
        "vertical_datum": options.vertical_datum,
        "virtual": True,
        "progress": lambda stage, share: timer(READ_STEP, share),
    }


def _spike_lines(spikes: Sequence[Spike], *, removed: bool) -> list[str]:
    fate = "removed" if removed else "kept as terrain, unless you --remove-spikes"
    return [
        f"isolated {spike.kind} of {spike.height_m:.1f} m, {spike.size_m:.1f} m wide, "
        f"at {spike.lat_deg:.7f}, {spike.lon_deg:.7f}: {fate}."
        for spike in spikes
    ]
