"""A mission that hugs the ground, random changes to it, and by brute force whether they are safe."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from planning.basics.plan_model import FlownLine, Home, Mission, MissionItem
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.clearance import certify
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm
from tests.planning.test_clearance import NORTH, PARAMS, WEST, dsm_of
from tests.reference import clearance as oracle


def hilly() -> np.ndarray:
    rng = np.random.default_rng(16)
    rows, cols = np.indices((60, 60))
    cells = 6.0 * np.sin(rows / 9.0) + 5.0 * np.cos(cols / 7.0) + rng.uniform(0.0, 0.4, (60, 60))
    cells[rng.integers(0, 60, 12), rng.integers(0, 60, 12)] += 8.0
    cells[3, 50] = np.nan
    return cells.astype(np.float32)


def hugging_mission(cells: np.ndarray) -> Mission:
    """A certified mission above the largest cell within 5 m of each waypoint; near home high enough to return level."""
    dsm = dsm_of(cells)
    places = [(12.5, 30.5), (20.5, 33.5), (28.5, 30.5), (36.5, 26.5), (40.5, 36.5), (34.5, 44.5)]
    home_m = float(cells[30, 12])
    items = [MissionItem(22, 3, alt_m=15.0), *(_waypoint(dsm, cells, x, y, home_m) for x, y in places)]
    items[2] = replace(items[2], alt_m=items[2].alt_m + 4.0)
    lat, lon = dsm.lat_lon_from_xy(np.array([[WEST + 12.5, NORTH - 30.5]]))[0]
    return Mission(Home(float(lat), float(lon), math.nan), (*items, MissionItem(20, 2)))


def hugging_params(dsm: Dsm, mission: Mission, cells: np.ndarray) -> ClearanceParams:
    """That demand 2 cm less than ``mission`` keeps, and let it return 2 cm higher than it must."""
    home_m = float(cells[30, 12])
    measured = replace(PARAMS, home_known_dsm_m=(home_m, home_m))
    scout = certify(dsm, flown_line(mission, dsm), measured)
    tight = replace(measured, required_clearance_m=scout.min_distance_m - 0.02)
    needed_m = certify(dsm, flown_line(mission, dsm), tight).rtl_height_needed_m
    return replace(tight, rtl_height_m=needed_m + 0.02)


def _waypoint(dsm: Dsm, cells: np.ndarray, x: float, y: float, home_m: float) -> MissionItem:
    lat, lon = dsm.lat_lon_from_xy(np.array([[WEST + x, NORTH - y]]))[0]
    around = cells[int(y) - 5 : int(y) + 6, int(x) - 5 : int(x) + 6]
    return MissionItem(16, 3, lat_deg=float(lat), lon_deg=float(lon), alt_m=float(around.max()) + 4.0 - home_m)


def mutated(mission: Mission, rng: np.random.Generator) -> Mission:
    """One to four waypoints moved by up to some 40 m sideways or up and down, dropped or repeated."""
    items = list(mission.items)
    for _ in range(rng.integers(1, 5)):
        k = int(rng.integers(1, len(items) - 1))
        kind = rng.integers(0, 4)
        if kind == 0 and len(items) > 4:
            del items[k]
        elif kind == 1:
            items.insert(k, items[int(rng.integers(1, len(items) - 1))])
        elif kind == 2:
            dlat, dlon = rng.normal(0.0, 10.0 ** rng.uniform(-6.0, -3.7), 2)
            items[k] = replace(items[k], lat_deg=items[k].lat_deg + dlat, lon_deg=items[k].lon_deg + dlon)
        else:
            items[k] = replace(items[k], alt_m=items[k].alt_m + float(rng.normal(0.0, 10.0 ** rng.uniform(-1.0, 1.3))))
    return replace(mission, items=tuple(items))


def is_safe(cells: np.ndarray, line: FlownLine, params: ClearanceParams) -> bool:
    """By brute force; sampling can only overlook, so the tolerance is that of rounding."""
    corner = np.array([WEST, NORTH, 0.0])
    points = (line.points_m - corner) * [1.0, -1.0, 1.0]
    for start, end in itertools.pairwise(points):
        places = oracle.sampled_segment(start, end, 2.0)
        if oracle.sampled_distance(cells, 1.0, places) < params.required_clearance_m - 1e-6:
            return False
    for start, end in itertools.pairwise(points):
        for place in oracle.sampled_segment(start, end, 6.0):
            asked = oracle.return_altitude(cells, 1.0, place, points[0, :2], params.required_clearance_m - 1e-6, 2.5)
            away_m = float(np.hypot(*(place[:2] - points[0, :2])))
            rise_m = min(params.rtl_height_m, away_m * (1.0 if away_m < 10.0 else 3.0))
            if asked > max(line.home_alt_dsm_m + rise_m, place[2]) + 1e-6:
                return False
    return True
