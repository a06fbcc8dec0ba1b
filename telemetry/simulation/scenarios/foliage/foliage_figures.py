"""One drive past obstacles and foliage, and what it cleared: true negatives and false negatives of Table III."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F32, U8, Bools
from mapping.traversability import Traversability, traversability_map
from mapping.uwb.clearing import Cleared, UwbClearing, UwbPose, clear
from mapping.uwb.uwb_params import UwbParams
from telemetry.simulation.scenarios.foliage.foliage_trials import CELL_M, PLACED, Site, disc_cells, elevation
from telemetry.simulation.simulator.sensors.uwb import UwbRadar
from telemetry.simulation.simulator.sensors.uwb_scene import Target, uwb_scene

PAPERS_RULE = UwbParams(explained_apart_m=math.inf)
BEFORE_M = 2.0
"""Foliage with a placed obstacle so near is before it; what lies on clear spots is further away."""


@dataclass(frozen=True, slots=True)
class Drive:
    """What was measured of a site; two drives over the same site and seed are alike."""

    site: Site
    elevation_m: F32
    map: Traversability
    obstacle: Bools
    """(rows, cols) Untraversable without any foliage there: "the obstacle locations and size without the foliage"."""
    poses: list[UwbPose]
    scans: U8


@dataclass(frozen=True, slots=True)
class Share:
    """Cells that were seen for more than 2 s, and how many of them were cleared."""

    cells: int
    cleared: int

    @property
    def rate(self) -> float:
        """NaN without any cells."""
        return self.cleared / self.cells if self.cells else float("nan")


@dataclass(frozen=True, slots=True)
class Rates:
    foliage: Share
    """All of it: its rate is the TNR."""
    on_clear_spots: Share
    """Of the foliage, without what lies before obstacles."""
    obstacles: Share
    """The things on the lawn and what stands around it: its rate is the FNR."""
    placed: dict[str, Share]
    """Each thing on the lawn alone."""


def driven(site: Site, poses: list[UwbPose], seed: int) -> Drive:
    """LIDAR map and radar scans of one drive."""
    elevation_m, bare_m = (
        elevation(one, np.random.default_rng((seed, 1))) for one in (site, replace(site, foliage=()))
    )
    radar = UwbRadar(uwb_scene(site.targets, site.foliage), seed)
    scans = np.array([radar.scan(pose.x_m, pose.y_m, pose.heading_rad) for pose in poses])
    obstacle = traversability_map(bare_m, CELL_M).untraversable
    return Drive(site, elevation_m, traversability_map(elevation_m, CELL_M), obstacle, poses, scans)


def cleared_by(drive: Drive, params: UwbParams | None = None) -> tuple[Cleared, UwbClearing]:
    half_m = drive.site.side_m / 2.0
    return clear(drive.map, drive.scans, drive.poses, params=params, west_m=-half_m, north_m=half_m)


def rates(drive: Drive, result: Cleared) -> Rates:
    """Labelled as the paper's were: on T_m, by where the obstacles stand and how large they are without foliage."""
    obstacle, foliage = labels(drive)
    near = {thing.name: _near(drive.site, thing) for thing in drive.site.targets if thing.name in PLACED}
    clear_spot = foliage & ~np.logical_or.reduce([np.zeros_like(foliage), *near.values()])
    placed = {name: _share(obstacle & cells, result) for name, cells in near.items()}
    return Rates(_share(foliage, result), _share(clear_spot, result), _share(obstacle, result), placed)


def labels(drive: Drive) -> tuple[Bools, Bools]:
    """Untraversable cells that are obstacles, and those that only foliage makes so."""
    blocked = drive.map.untraversable
    return blocked & drive.obstacle, blocked & ~drive.obstacle


def placed_cells(site: Site) -> Bools:
    """(rows, cols) At the things on the lawn and beside them."""
    near = [_near(site, thing) for thing in site.targets if thing.name in PLACED]
    return np.logical_or.reduce([np.zeros((round(site.side_m / CELL_M),) * 2, np.bool_), *near])


def _near(site: Site, thing: Target) -> Bools:
    cells = np.zeros((round(site.side_m / CELL_M),) * 2, np.bool_)
    part, covered = disc_cells(site, thing.xy_m, BEFORE_M)
    cells[part] = covered
    return cells


def _share(cells: Bools, result: Cleared) -> Share:
    seen = cells & result.seen
    return Share(int(seen.sum()), int((seen & result.cleared).sum()))


def seconds_per_scan(drive: Drive) -> float:
    """CPU time of the fusion alone, mean over the drive, as scans arrive one by one."""
    half_m = drive.site.side_m / 2.0
    live = UwbClearing(drive.map, west_m=-half_m, north_m=half_m)
    live.step(drive.scans[0], drive.poses[0])
    began_s = time.process_time()
    for scan, pose in zip(drive.scans[1:], drive.poses[1:], strict=True):
        live.step(scan, pose)
    return (time.process_time() - began_s) / (len(drive.poses) - 1)
