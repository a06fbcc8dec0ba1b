"""Which surface model of the library a recording was flown over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from server.schemas import PlaceDoc, TerrainDoc


@dataclass(frozen=True, slots=True)
class FlownOver:
    """What a recording tells about its surface model."""

    terrain_id: str = ""
    sha256: str = ""
    places: tuple[tuple[float, float], ...] = ()
    """(lat_deg, lon_deg) here and there on the track."""


def terrain_of(flown: FlownOver, terrains: Sequence[TerrainDoc]) -> TerrainDoc | None:
    """The very model, else the same file read again, else the finest one below the whole track."""
    for same in (
        [doc for doc in terrains if flown.terrain_id and doc.id == flown.terrain_id],
        [doc for doc in terrains if flown.sha256 and doc.sha256 == flown.sha256],
    ):
        if same:
            return same[0]
    below = [doc for doc in terrains if flown.places and all(covers(doc, *place) for place in flown.places)]
    return min(below, key=lambda doc: doc.resolution_m, default=None)


def covers(terrain: TerrainDoc, lat_deg: float, lon_deg: float) -> bool:
    """Inside the four corners, which stand clockwise from the north-west."""
    corners = terrain.corner_lat_lon_deg
    return all(_right_of(a, b, lat_deg, lon_deg) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))


def _right_of(a: PlaceDoc, b: PlaceDoc, lat_deg: float, lon_deg: float) -> bool:
    return (b.lon_deg - a.lon_deg) * (lat_deg - a.lat_deg) <= (b.lat_deg - a.lat_deg) * (lon_deg - a.lon_deg)
