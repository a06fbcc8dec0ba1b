"""``hedgehop traversability``: where ground can be driven on, what a radar clears of it, and where to land."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Option

from mapping.geometry.arrays import F32
from mapping.uwb import Cleared, Rule, UwbParams, in_words, of_rule
from planning.errors import ParameterError
from planning.ground.landing_sites import CAUTION, LandingSites
from planning.ground.traversable import (
    FINEST_M,
    TraversableGround,
    UwbScans,
    cleared_ground,
    site_places,
    sites_near,
    traversable_ground,
)
from planning.terrain.geotiff import write_dsm
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.files_in_out import check_directory, write_files
from server.cli.shared.output import answer, end_progress, progress
from server.cli.shared.terrain_given import read_model
from server.schemas.traversability_docs import LandingSitesBody
from server.work.clocks import StepTimer
from telemetry.perception.uwb_drive import read_scans

Layers = dict[str, F32]
_UWB, _SITES = UwbParams(), LandingSitesBody.model_fields

WORK_STEP, RADAR_STEP = "Working out slope and roughness", "Clearing foliage"


@command
def traversability(
    dsm: o.DsmFile,
    *,
    out: Annotated[Path, Option(metavar="DIR|FILE", help="A directory for all layers, or one .tif.")],
    uwb: Annotated[
        Path | None, Option(metavar="LOG", help="UWB radar log (.npz), or a recording (.mcap), that clears foliage.")
    ] = None,
    uwb_rule: Annotated[
        Rule, Option(help="paper: every cell at an echo's range is to blame for it; explained: ours.")
    ] = "explained",
    p_o: Annotated[float | None, Option(help=f"Most that an echo says; default: {_UWB.most_occupied:g}.")] = None,
    p_c2: Annotated[
        float | None, Option(help=f"1 minus the most that free space says; default: {_UWB.free_before:g}.")
    ] = None,
    p_c3: Annotated[float | None, Option(help="The same behind an echo; default: 0.1 above --p-c2.")] = None,
    c_th: Annotated[
        float | None, Option(help=f"Least of T_max - T_d (eq. 1); default: {_UWB.least_headroom:g}.")
    ] = None,
    nearest_m: Annotated[float | None, Option(help=f"R_min; default: {_UWB.nearest_m:g}.")] = None,
    farthest_m: Annotated[float | None, Option(help=f"R_max; default: {_UWB.farthest_m:g}.")] = None,
    prior: Annotated[
        float | None, Option(help=f"That an untraversable cell is an obstacle; default: {_UWB.prior:g}.")
    ] = None,
    near: Annotated[
        str | None, Option(metavar="LAT,LON", help="Find the five best landing sites near this point.")
    ] = None,
    rotor_span_m: Annotated[
        float, Option("--rotor-span-m", "--rotor-span", help="Across all rotors; sites keep twice as much away.")
    ] = _SITES["rotor_span_m"].default,
    radius_m: Annotated[float, Option(help="So far from the point sites are looked for.")] = _SITES["radius_m"].default,
    resolution_m: Annotated[
        float | None, Option(help=f"Of the map; default: {FINEST_M:g}, or the model's own if coarser.")
    ] = None,
    as_json: o.AsJson = False,
    how: Annotated[o.ModelOptions, Without("max_hole_m2")],
) -> None:
    """Work out where a surface model can be driven on, clear foliage with a radar log, and find landing sites.

    Sites come from the map before clearing: what a rover may drive through, a rotor may not touch. The exit code is 1
    when sites were asked for and there are none.
    """
    place = o.parse_place(near, "--near")
    params = of_rule(
        uwb_rule,
        most_occupied=p_o,
        free_before=p_c2,
        free_behind=p_c3,
        least_headroom=c_th,
        nearest_m=nearest_m,
        farthest_m=farthest_m,
        prior=prior,
    )
    _check_out(out)
    scans = None if uwb is None else read_scans(o.existing(uwb) or uwb, uwb.name)
    timer = StepTimer(progress)
    source, _ = read_model(dsm, timer, how)
    timer(WORK_STEP, None)
    ground = traversable_ground(source, resolution_m)
    timer(RADAR_STEP, None)
    cleared = None if scans is None else cleared_ground(ground, scans, params)
    found = None if place is None else sites_near(ground, place, rotor_span_m, radius_m)
    _write(out, ground, cleared, found)
    end_progress()
    summary = _summary(ground, scans, cleared, found)
    if cleared is not None:
        summary["uwb_rule"] = in_words(params)
    summary |= {"seconds": round(timer.seconds()["total"], 3)}
    answer(summary, _lines(summary, out), as_json=as_json)
    raise typer.Exit(FAILED if found is not None and not found.sites else DONE)


def _check_out(out: Path) -> None:
    if out.suffix and out.suffix.lower() not in (".tif", ".tiff"):
        raise ParameterError(f"{out.suffix} is no raster.", where="--out", advice="Give a directory or a .tif.")
    check_directory(out.parent if out.suffix else out)


def _layers(ground: TraversableGround, cleared: Cleared | None) -> Layers:
    """Of one file only the last is written: what is known best."""
    before = ground.map.value
    if cleared is None:
        return {"before": before}
    known = ground.map.known
    return {
        "before": before,
        "probability": np.where(known, cleared.probability, np.float32(np.nan)),
        "time_in_view": np.where(known, cleared.time_in_view_s, np.float32(np.nan)),
        "cleared": np.where(cleared.cleared, np.float32(0.0), before),
    }


def _write(out: Path, ground: TraversableGround, cleared: Cleared | None, found: LandingSites | None) -> None:
    layers = _layers(ground, cleared)
    if out.suffix:
        out.parent.mkdir(parents=True, exist_ok=True)
        _write_layer(out, ground, list(layers.values())[-1])
        return
    out.mkdir(parents=True, exist_ok=True)
    for name, layer in layers.items():
        _write_layer(out / f"{name}.tif", ground, layer)
    if found is not None:
        write_files(out, {"sites.geojson": json.dumps(_geojson(ground, found), indent=1) + "\n"})


def _write_layer(path: Path, ground: TraversableGround, layer: F32) -> None:
    write_dsm(path, replace(ground.dsm, elevation_m=layer.astype(np.float32), vertical_datum=None))


def _geojson(ground: TraversableGround, found: LandingSites) -> dict[str, Any]:
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [site["lon_deg"], site["lat_deg"]]},
            "properties": {key: value for key, value in site.items() if key not in ("lat_deg", "lon_deg")},
        }
        for site in _sites(ground, found)
    ]
    return {"type": "FeatureCollection", "features": features}


def _sites(ground: TraversableGround, found: LandingSites) -> list[dict[str, Any]]:
    return [
        {
            "rank": site.rank,
            "lat_deg": round(float(lat_deg), 8),
            "lon_deg": round(float(lon_deg), 8),
            "alt_dsm_m": round(float(alt_dsm_m), 2),
            "distance_m": round(site.distance_m, 1),
            "slope_deg": round(float(np.rad2deg(site.slope_rad)), 2),
            "roughness_m": round(site.roughness_m, 4),
            "obstacle_distance_m": round(site.obstacle_distance_m, 2),
            "reasons": list(site.reasons),
        }
        for site, (lat_deg, lon_deg, alt_dsm_m) in zip(found.sites, site_places(ground, found), strict=True)
    ]


def _summary(
    ground: TraversableGround, scans: UwbScans | None, cleared: Cleared | None, found: LandingSites | None
) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "resolution_m": ground.map.resolution_m,
        "cells": int(ground.map.known.sum()),
        "untraversable": int(ground.map.untraversable.sum()),
    }
    if scans is not None and cleared is not None:
        counts = {"seen": int(cleared.seen.sum()), "cleared": int(cleared.cleared.sum())}
        summary |= {"scans": len(scans.t_s), **counts}
    if found is not None:
        caution = CAUTION if found.sites else ""
        summary |= {"sites": _sites(ground, found), "no_site": found.no_site, "caution": caution}
    return summary


def _lines(summary: dict[str, Any], out: Path) -> list[str]:
    share = 100 * summary["untraversable"] / max(1, summary["cells"])
    lines = [f"{out.name}: {summary['cells']:,} cells of {summary['resolution_m']:.2f} m, {share:.1f} % untraversable"]
    if "scans" in summary:
        lines.append(
            f"  {summary['cleared']:,} of them cleared as soft vegetation by {summary['scans']:,} scans: "
            f"a rover may pass, a rotor may not touch ({summary['uwb_rule']})"
        )
    for site in summary.get("sites", ()):
        place = f"{site['lat_deg']:.7f}, {site['lon_deg']:.7f}"
        lines.append(f"  Landing site {site['rank']} at {place}: {'; '.join(site['reasons'])}")
    if summary.get("caution"):
        lines.append(f"  {summary['caution']}")
    if summary.get("no_site"):
        lines.append(f"  No landing site: {summary['no_site']}")
    return lines
