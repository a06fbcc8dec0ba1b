"""``hedgehop traversability``: where ground can be driven on, what a radar clears of it, and where to land."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

import typer
from typer import Option

from mapping.uwb.uwb_params import Rule, UwbParams, in_words
from planning.errors import ParameterError
from planning.ground.landing_sites import CAUTION, LandingSites
from planning.ground.traversable import FINEST_M, cleared_ground, sites_near, traversable_ground
from server.cli.shared import options as o
from server.cli.shared.by_blocks import BlockOrder
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.files_in_out import check_directory, write_files
from server.cli.shared.output import answer, end_progress, progress
from server.cli.shared.terrain_given import read_model
from server.cli.terrain.map_in_blocks import file_in, map_by_blocks, refuse_beside_cluster
from server.schemas.traversability_docs import LandingSiteDoc, LandingSitesBody, LayerName, UwbRule
from server.traversability.landing_site_task import described
from server.traversability.maps import Maps, Radar
from server.traversability.task import write_layer
from server.work.clocks import StepTimer
from telemetry.perception.uwb_drive import read_scans

_UWB, _SITES = UwbParams(), LandingSitesBody.model_fields

WORK_STEP, RADAR_STEP = "Working out slope and roughness", "Clearing foliage"
_DIGITS = {
    "lat_deg": 8,
    "lon_deg": 8,
    "alt_dsm_m": 2,
    "distance_m": 1,
    "slope_deg": 2,
    "roughness_m": 4,
    "obstacle_distance_m": 2,
}


@dataclass(frozen=True, slots=True)
class UwbOptions:
    """As ``server.schemas.UwbRule``."""

    rule: Annotated[
        Rule, Option("--uwb-rule", help="paper: every cell at an echo's range is to blame for it; explained: ours.")
    ] = "explained"
    p_o: Annotated[float | None, Option(help=f"Most that an echo says; default: {_UWB.most_occupied:g}.")] = None
    p_c2: Annotated[
        float | None, Option(help=f"1 minus the most that free space says; default: {_UWB.free_before:g}.")
    ] = None
    p_c3: Annotated[float | None, Option(help="The same behind an echo; default: 0.1 above --p-c2.")] = None
    c_th: Annotated[float | None, Option(help=f"Least of T_max - T_d (eq. 1); default: {_UWB.least_headroom:g}.")] = (
        None
    )
    nearest_m: Annotated[float | None, Option(help=f"R_min; default: {_UWB.nearest_m:g}.")] = None
    farthest_m: Annotated[float | None, Option(help=f"R_max; default: {_UWB.farthest_m:g}.")] = None
    prior: Annotated[
        float | None, Option(help=f"That an untraversable cell is an obstacle; default: {_UWB.prior:g}.")
    ] = None


@command
def traversability(
    dsm: o.DsmFile,
    *,
    out: Annotated[Path, Option(metavar="DIR|FILE", help="A directory for all layers, or one .tif.")],
    uwb: Annotated[
        Path | None, Option(metavar="LOG", help="UWB radar log (.npz), or a recording (.mcap), that clears foliage.")
    ] = None,
    fused: UwbOptions,
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
    cluster: o.Cluster = None,
    as_json: o.AsJson = False,
    how: Annotated[o.ModelOptions, Without("max_hole_m2")],
) -> None:
    """Work out where a surface model can be driven on, clear foliage with a radar log, and find landing sites.

    Sites come from the map before clearing: what a rover may drive through, a rotor may not touch. The exit code is 1
    when sites were asked for and there are none. With --cluster the model may be larger than memory; the map is
    written in blocks to a new file, without a radar log and sites.
    """
    if cluster is not None:
        refuse_beside_cluster(uwb, near)
        _write_by_blocks(BlockOrder(dsm, how, out, cluster), resolution_m, as_json=as_json)
        return
    place = o.parse_place(near, "--near")
    params = UwbRule.model_construct(**asdict(fused)).params()
    _check_out(out)
    scans = None if uwb is None else read_scans(o.existing(uwb) or uwb, uwb.name)
    timer = StepTimer(progress)
    source, _ = read_model(dsm, timer, how)
    timer(WORK_STEP, None)
    ground = traversable_ground(source, resolution_m)
    timer(RADAR_STEP, None)
    radar = None
    if scans is not None and uwb is not None:
        radar = Radar(cleared_ground(ground, scans, params), uwb.name, len(scans.t_s), in_words(params), scans.left_out)
    found = None if place is None else sites_near(ground, place, rotor_span_m, radius_m)
    sites = [] if found is None else [_rounded(site) for site in described(ground, found)]
    _write(out, Maps(ground, radar), None if found is None else sites)
    end_progress()
    summary = _summary(Maps(ground, radar), found, sites) | {"seconds": round(timer.seconds()["total"], 3)}
    answer(summary, _lines(summary, out), as_json=as_json)
    raise typer.Exit(FAILED if found is not None and not found.sites else DONE)


def _write_by_blocks(order: BlockOrder, resolution_m: float | None, *, as_json: bool) -> None:
    _check_out(order.out)
    order_of_file = file_in(order, "before.tif")
    order_of_file.check()
    timer = StepTimer(progress)
    summary = map_by_blocks(order_of_file, resolution_m, WORK_STEP, timer)
    summary["seconds"] = round(timer.seconds()["total"], 3)
    answer(summary, _lines(summary, order.out), as_json=as_json)


def _check_out(out: Path) -> None:
    if out.suffix and out.suffix.lower() not in (".tif", ".tiff"):
        raise ParameterError(f"{out.suffix} is no raster.", where="--out", advice="Give a directory or a .tif.")
    check_directory(out.parent if out.suffix else out)


def _write(out: Path, maps: Maps, sites: list[dict[str, Any]] | None) -> None:
    """Of one file only what is known best is written."""
    if out.suffix:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_layer(out, maps, "cleared")
        return
    out.mkdir(parents=True, exist_ok=True)
    layers: tuple[LayerName, ...] = ("before",) if maps.radar is None else get_args(LayerName)
    for layer in layers:
        write_layer(out / f"{layer}.tif", maps, layer)
    if sites is not None:
        write_files(out, {"sites.geojson": json.dumps(_geojson(sites), indent=1) + "\n"})


def _geojson(sites: list[dict[str, Any]]) -> dict[str, Any]:
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [site["lon_deg"], site["lat_deg"]]},
            "properties": {key: value for key, value in site.items() if key not in ("lat_deg", "lon_deg")},
        }
        for site in sites
    ]
    return {"type": "FeatureCollection", "features": features}


def _rounded(site: LandingSiteDoc) -> dict[str, Any]:
    return {key: round(value, _DIGITS[key]) if key in _DIGITS else value for key, value in site.model_dump().items()}


def _summary(maps: Maps, found: LandingSites | None, sites: list[dict[str, Any]]) -> dict[str, Any]:
    ground, radar = maps.ground.map, maps.radar
    summary: dict[str, Any] = {
        "resolution_m": ground.resolution_m,
        "cells": int(ground.known.sum()),
        "untraversable": int(ground.untraversable.sum()),
    }
    if radar is not None:
        counts = {"seen": int(radar.maps.seen.sum()), "cleared": int(radar.maps.cleared.sum())}
        summary |= {"scans": radar.scans, **counts}
    if found is not None:
        summary |= {"sites": sites, "no_site": found.no_site, "caution": CAUTION if found.sites else ""}
    return summary if radar is None else summary | {"uwb_rule": radar.rule, "uwb_left_out": radar.left_out}


def _lines(summary: dict[str, Any], out: Path) -> list[str]:
    share = 100 * summary["untraversable"] / max(1, summary["cells"])
    lines = [f"{out.name}: {summary['cells']:,} cells of {summary['resolution_m']:.2f} m, {share:.1f} % untraversable"]
    if "scans" in summary:
        lines.append(
            f"  {summary['cleared']:,} of them cleared as soft vegetation by {summary['scans']:,} scans: "
            f"a rover may pass, a rotor may not touch ({summary['uwb_rule']})"
        )
        lines += [f"  {part}" for part in [summary["uwb_left_out"]] if part]
    for site in summary.get("sites", ()):
        place = f"{site['lat_deg']:.7f}, {site['lon_deg']:.7f}"
        lines.append(f"  Landing site {site['rank']} at {place}: {'; '.join(site['reasons'])}")
    if summary.get("caution"):
        lines.append(f"  {summary['caution']}")
    if summary.get("no_site"):
        lines.append(f"  No landing site: {summary['no_site']}")
    return lines
