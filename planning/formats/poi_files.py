"""Points of interest and survey polygons from whatever file a user has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Mission, MissionItem, Poi
from planning.errors import FormatError
from planning.formats import geojson
from planning.formats.commands import FLOWN_TO, has_position
from planning.formats.detect import read_mission
from planning.formats.kml import poi_from_placemark
from planning.formats.kml_reader import Placemark, read_placemarks
from planning.formats.poi_csv import read_pois_csv
from planning.formats.safe_text import check_count, check_loiter, clean_name, decode_text, load_json, said_once
from planning.formats.swapped import looks_swapped
from planning.terrain.dsm import SurfaceModel

__all__ = ["PoiFile", "Polygon", "looks_swapped", "read_pois", "warn_swapped"]

Polygon = tuple[tuple[float, float], ...]
"""Corners (lat_deg, lon_deg), the first not repeated."""


@dataclass(frozen=True, slots=True)
class PoiFile:
    """What was found in a file: points in their order, a survey polygon, remarks."""

    pois: tuple[Poi, ...]
    polygon: Polygon | None = None
    warnings: tuple[str, ...] = ()
    mission: Mission | None = None
    """That the points are of; it may say over which surface model it was planned."""


def read_pois(name: str, data: bytes) -> PoiFile:
    """POIs and polygon from CSV, GeoJSON, KML, KMZ, `.waypoints` or `.plan`, told by content.

    ``name`` is only shown in messages. Raises FormatError with row, feature or placemark, also when
    the file holds neither points nor a polygon.
    """
    found = _read(name, data)
    if not found.pois and found.polygon is None:
        raise FormatError(
            "The file holds no points and no polygon.", where=clean_name(name), advice="Choose another file."
        )
    check_count(len(found.pois), "points", clean_name(name))
    return found


def warn_swapped(pois: Sequence[Poi | MissionItem], dsm: SurfaceModel) -> tuple[str, ...]:
    """A warning when the places miss the surface model but would lie on it with latitude and longitude exchanged."""
    if not looks_swapped(pois, dsm):
        return ()
    first = next(p for p in pois if p.lat_deg or p.lon_deg)
    return (
        f"Latitude and longitude look swapped: {first.lat_deg:.5f}, {first.lon_deg:.5f} lies outside the surface "
        f"model, {first.lon_deg:.5f}, {first.lat_deg:.5f} on it. Exchange the two columns.",
    )


def _read(name: str, data: bytes) -> PoiFile:
    if data.startswith(b"PK"):
        return _from_placemarks(read_placemarks(name, data), clean_name(name))
    text = decode_text(name, data).lstrip()
    if text.startswith("<"):
        return _from_placemarks(read_placemarks(name, data), clean_name(name))
    if text.upper().startswith("QGC WPL"):
        return _from_mission(read_mission(name, data), clean_name(name))
    if text.startswith(("{", "[")):
        return _from_json(name, data, load_json(name, text))
    return PoiFile(read_pois_csv(name, data))


def _from_json(name: str, data: bytes, document: object) -> PoiFile:
    if isinstance(document, dict) and "fileType" in document:
        return _from_mission(read_mission(name, data), clean_name(name))
    file = clean_name(name)
    found = [_from_feature(f, f"{file}, feature {k}") for k, f in enumerate(geojson.features(document, file), start=1)]
    return _joined(found)


def _from_feature(feature: dict[str, Any], where: str) -> PoiFile:
    geometry, role = feature["geometry"], feature["properties"].get("role")
    kind, coordinates = geometry.get("type"), geometry["coordinates"]
    if role in ("path", "waypoint", "home"):  # our own export: its POIs are what the user chose
        return PoiFile(())
    if kind == "Point":
        return PoiFile((geojson.poi_from_feature(feature, where),))
    if kind in ("LineString", "MultiPoint"):
        return PoiFile(tuple(Poi(*geojson.lat_lon(c, where)) for c in coordinates))
    if kind == "Polygon" and coordinates and isinstance(coordinates[0], list):
        return PoiFile((), _ring([geojson.lat_lon(c, where) for c in coordinates[0]], where))
    return PoiFile((), None, (f"{where}: a {clean_name(kind)} was not read.",))


def _from_placemarks(marks: Sequence[Placemark], file: str) -> PoiFile:
    ours = any(mark.data.get("role") == "home" for mark in marks)
    if ours:
        marks = [mark for mark in marks if mark.data.get("role") == "poi"]
    return _joined([_from_placemark(mark, f"{file}, placemark {mark.name!r}") for mark in marks])


def _from_placemark(mark: Placemark, where: str) -> PoiFile:
    if mark.kind == "Point":
        return PoiFile((poi_from_placemark(mark, where),))
    places = [(lat, lon) for lat, lon, _ in mark.coordinates]
    if mark.kind == "Polygon":
        return PoiFile((), _ring(places, where))
    return PoiFile(tuple(Poi(lat, lon) for lat, lon in places))


def _from_mission(mission: Mission, file: str) -> PoiFile:
    if mission.pois:
        return PoiFile(mission.pois, None, mission.warnings, mission)
    pois = tuple(
        _poi_from_item(item, f"{file}, item {number}")
        for number, item in enumerate(mission.items, start=1)
        if item.command in FLOWN_TO and has_position(item)
    )
    return PoiFile(pois, None, mission.warnings, mission)


def _poi_from_item(item: MissionItem, where: str) -> Poi:
    hold_s = item.params[0] if item.command in (MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_TIME) else 0.0
    return Poi(item.lat_deg, item.lon_deg, "", check_loiter(0.0 if math.isnan(hold_s) else hold_s, where))


def _ring(corners: Sequence[tuple[float, float]], where: str) -> Polygon:
    open_ring = corners[:-1] if len(corners) > 1 and corners[0] == corners[-1] else corners
    if len(set(open_ring)) < 3:
        raise FormatError(f"A polygon needs three corners, this one has {len(set(open_ring))}.", where=where)
    return tuple(open_ring)


def _joined(found: Sequence[PoiFile]) -> PoiFile:
    polygons = [f.polygon for f in found if f.polygon is not None]
    warnings = [w for f in found for w in f.warnings]
    if len(polygons) > 1:
        warnings.append(f"The file holds {len(polygons)} polygons; the first was taken.")
    return PoiFile(tuple(p for f in found for p in f.pois), polygons[0] if polygons else None, said_once(warnings))
