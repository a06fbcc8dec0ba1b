"""Latitude and longitude in the wrong order: published examples have them swapped, and tools copied it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np

from planning.basics.plan_model import Home, MissionItem
from planning.formats.commands import has_position
from planning.terrain.dsm import SurfaceModel

NEAR_DEG = 0.5
"""About 50 km: farther than any multicopter mission reaches from home."""


class _Place(Protocol):
    @property
    def lat_deg(self) -> float: ...
    @property
    def lon_deg(self) -> float: ...


def looks_swapped(places: Iterable[_Place], dsm: SurfaceModel) -> bool:
    """Whether no place lies on the surface model as given, but most would with latitude and longitude exchanged."""
    lat_lon = np.array([(p.lat_deg, p.lon_deg) for p in places], dtype=np.float64).reshape(-1, 2)
    lat_lon = lat_lon[lat_lon.any(axis=1)]  # 0, 0 in a mission item is no place
    if not len(lat_lon) or _on_model(lat_lon, dsm).any():
        return False
    return bool(_on_model(lat_lon[:, ::-1], dsm).mean() > 0.5)


def _on_model(lat_lon_deg: np.ndarray, dsm: SurfaceModel) -> np.ndarray:
    west, south, east, north = dsm.bounds_m
    x, y = dsm.xy_from_lat_lon(np.clip(lat_lon_deg, [-90, -180], [90, 180])).T
    return (x >= west) & (x <= east) & (y >= south) & (y <= north) & (np.abs(lat_lon_deg[:, 0]) <= 90)


def swapped_against_home(home: Home | None, items: Sequence[MissionItem]) -> list[str]:
    """A warning when the mission is far from its home as given but near with latitude and longitude exchanged."""
    places = [item for item in items if has_position(item)]
    if home is None or not places:
        return []
    given = sum(_near(home, p.lat_deg, p.lon_deg) for p in places)
    exchanged = sum(_near(home, p.lon_deg, p.lat_deg) for p in places)
    if given or not exchanged:
        return []
    return [
        f"Latitude and longitude look swapped: {exchanged} of {len(places)} places would lie near home "
        "if exchanged, none does as given."
    ]


def _near(home: Home, lat_deg: float, lon_deg: float) -> bool:
    lon_scale = max(0.01, math.cos(math.radians(home.lat_deg)))
    return abs(lat_deg - home.lat_deg) < NEAR_DEG and abs(lon_deg - home.lon_deg) * lon_scale < NEAR_DEG
