"""A small path, mission and surface model that the format and report tests share."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import Home, Mission, MissionItem, Poi, SampledPath, Timing
from planning.terrain.dsm import Dsm

HOSTILE = "<script>alert(1)</script>&\"'\u202e\x00\x1b]]>, line\nbreak"


def make_dsm(datum: str | None = "EGM96 height", size_px: int = 60) -> Dsm:
    rows, cols = np.mgrid[0:size_px, 0:size_px]
    heights = (500 + 5 * np.sin(cols / 9) + rows / 10).astype(np.float32)
    heights[5:9, 5:9] = np.nan
    transform = Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 5_200_000.0)
    return Dsm(heights, transform, CRS.from_epsg(32633), datum, "ab" * 32)


def make_path(dsm: Dsm, samples: int = 201) -> SampledPath:
    west, south, east, north = dsm.bounds_m
    along = np.linspace(0.2, 0.8, samples)
    xy = np.column_stack([west + along * (east - west), south + along * (north - south)])
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    ground = dsm.elevation_at(xy)
    vertex = np.array([0, samples // 2, samples - 1])
    return SampledPath(xy, s_m, ground + 6, ground, ground + 7, vertex, (0, 1, 2))


def make_timing(path: SampledPath, speed_m_s: float = 3.0) -> Timing:
    loiter_s = np.zeros(len(path.s_m))
    loiter_s[path.vertex[1]] = 2.5
    return Timing(path.s_m / speed_m_s + np.cumsum(loiter_s), np.full(len(path.s_m), speed_m_s), loiter_s)


def make_mission(dsm: Dsm, path: SampledPath, names: tuple[str, ...] = ("P1", "P2", "P3")) -> Mission:
    lat_lon = dsm.lat_lon_from_xy(path.xy_m[path.vertex])
    places = [(float(lat), float(lon)) for lat, lon in lat_lon]
    pois = tuple(Poi(lat, lon, name, 2.0) for (lat, lon), name in zip(places, names, strict=True))
    home_alt = float(path.ground_alt_dsm_m[0])
    home = Home(*places[0], home_alt, dsm.vertical_datum)
    up = [math.ceil(z * 100) / 100 for z in (path.alt_dsm_m[path.vertex] - home_alt)]
    takeoff = MissionItem(22, 3, (0.0, 0.0, 0.0, 0.0), *places[0], up[0])
    speed = MissionItem(178, 2, (1.0, 3.0, -1.0, 0.0))
    waypoints = [MissionItem(16, 3, (1.5, 0.0, 0.0, 0.0), *ll, z) for ll, z in zip(places, up, strict=True)]
    return Mission(home, (takeoff, speed, *waypoints, MissionItem(20, 2)), "ardupilot", pois, 3.0)


def write_pois_csv(pois: Sequence[Poi]) -> str:
    """POIs -> CSV text with header, 9 decimals of latitude and longitude."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("lat_deg", "lon_deg", "name", "loiter_s"))
    for poi in pois:
        writer.writerow([f"{poi.lat_deg:.9f}", f"{poi.lon_deg:.9f}", poi.name, f"{poi.loiter_s:g}"])
    return out.getvalue()


def geojson_by_role(text: str) -> dict[str, list[dict[str, Any]]]:
    """Features of our own GeoJSON: path, waypoint, poi, home."""
    by_role: dict[str, list[dict[str, Any]]] = {}
    for feature in json.loads(text)["features"]:
        by_role.setdefault(feature["properties"]["role"], []).append(feature)
    return by_role
