"""``hedgehop terrain catalogue``: its models, the best first, and why others cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Argument, Option

from planning.errors import ParameterError
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel
from planning.terrain.geotiff import open_models_of
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.output import answer, end_progress, harmless, progress, say_notes
from server.work.clocks import READ_STEP, StepTimer

_SURFACE_OPTIONS = ("catalogue", "max_hole_m2", "remove_spikes", "z_scale")


@command
def catalogue(
    source: Annotated[
        Path, Argument(metavar="CATALOGUE", help="Folder of GeoTIFFs with STAC items beside them, or a STAC document.")
    ],
    *,
    at: Annotated[str | None, Option(metavar="LAT,LON", help="Say which model counts at this place.")] = None,
    as_json: o.AsJson = False,
    how: Annotated[o.ModelOptions, Without(*_SURFACE_OPTIONS)],
) -> None:
    """List the surface models of a catalogue, the best first, and say which cannot be used and why.

    Ends with 1 when any of them was left out.
    """
    place_deg = o.parse_place(at, "--at")
    timer = StepTimer(progress)
    found = open_models_of(
        source,
        crs=how.crs,
        vertical_datum=how.vertical_datum,
        progress=lambda stage, share: timer(READ_STEP, share),
    )
    here = None if place_deg is None else _here(found, place_deg)
    end_progress()
    say_notes(*found.warnings)
    summary = {
        "models": [_model_json(layer.model, layer.raise_m) for layer in found.layers],
        "left_out": [{"name": out.name, "why": out.why} for out in found.left_out],
        "crs": found.crs.name,
        "vertical_datum": found.vertical_datum,
        "resolution_m": found.resolution_m,
        **({} if here is None else {"here": here}),
    }
    answer(summary, _lines(found, here), as_json=as_json)
    raise typer.Exit(FAILED if found.left_out else DONE)


def _here(found: Catalogue, place_deg: tuple[float, float]) -> dict[str, Any]:
    """What counts at a place. ParameterError where no model knows it."""
    xy_m = found.xy_from_lat_lon(np.array([place_deg]))
    west, south, east, north = found.bounds_m
    inside = bool(((xy_m >= (west, south)) & (xy_m <= (east, north))).all())
    part = found.around(xy_m, 0.0) if inside else None
    height_m = float("nan") if part is None else float(part.elevation_at(xy_m)[0])
    if part is None or not np.isfinite(height_m):
        raise ParameterError(
            f"No model of the catalogue knows {place_deg[0]:.7f}, {place_deg[1]:.7f}.",
            where="--at",
            advice="Give a place inside one of them, the latitude first.",
        )
    shares, seam = found.shares_of(part)
    return {"model": shares[0].model.name, "words": shares[0].model.words, "height_m": height_m, "at_seam": seam > 0.0}


def _model_json(model: CatalogueModel, raise_m: float) -> dict[str, Any]:
    west, south, east, north = model.file.bounds_m
    return {
        "name": model.name,
        "file": model.file.name,
        "taken_utc": None if model.taken_utc is None else model.taken_utc.isoformat(),
        "resolution_m": model.resolution_m,
        "rms_m": model.rms_m,
        "rms_told": model.rms_told,
        "horizontal_m": model.horizontal_m,
        "raised_m": raise_m,
        "bounds_m": [west, south, east, north],
        "sha256": model.file.sha256,
    }


def _lines(found: Catalogue, here: dict[str, Any] | None) -> list[str]:
    lines = [
        f"{number}. {harmless(layer.model.words)}"
        + (f"; raised by {layer.raise_m:.2f} m" if layer.raise_m > 0.0 else "")
        for number, layer in enumerate(found.layers, start=1)
    ]
    lines.append(f"{found.crs.name}; vertical datum: {found.vertical_datum or 'nobody said'}")
    if here is not None:
        seam = ", at a seam: the higher of the models counts" if here["at_seam"] else ""
        lines.append(f"here: {harmless(here['words'])}; surface at {here['height_m']:.2f} m{seam}")
    return lines
