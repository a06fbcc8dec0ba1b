"""The plan as GeoJSON (RFC 7946): path, waypoints, POIs, home and a summary of the certificate."""

from __future__ import annotations

import json
from typing import Any

from mapping.version import __version__
from planning.basics.plan_model import Home, Mission, MissionItem, Poi, SampledPath, finite_or_none
from planning.errors import FormatError
from planning.formats.commands import has_position, home_altitude_note
from planning.formats.safe_text import check_lat_lon, check_loiter, clean_name, finite
from planning.terrain.dsm import Dsm

Json = dict[str, Any]


def write_geojson(path: SampledPath, mission: Mission, dsm: Dsm, *, summary: Json | None = None) -> str:
    """A FeatureCollection; positions are lon, lat without height. ``summary`` (JSON-able) joins the path's properties.

    RFC 7946 defines a third coordinate as height above the ellipsoid, which nobody here knows for sure:
    heights stand in properties that name their datum.
    """
    document = {
        "type": "FeatureCollection",
        "features": [
            _path(path, mission.home, dsm, summary or {}),
            *(_waypoint(item, k) for k, item in enumerate(mission.items) if has_position(item)),
            *(_poi(poi, k) for k, poi in enumerate(mission.pois)),
            _home(mission),
        ],
    }
    return json.dumps(document, allow_nan=False, ensure_ascii=False) + "\n"


def _feature(kind: str, coordinates: object, properties: Json) -> Json:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}


def _lon_lat(lat_deg: float, lon_deg: float) -> list[float]:
    return [round(float(lon_deg), 9), round(float(lat_deg), 9)]


def _path(path: SampledPath, home: Home, dsm: Dsm, summary: Json) -> Json:
    coordinates = [_lon_lat(lat, lon) for lat, lon in dsm.lat_lon_from_xy(path.xy_m)]
    heights = [finite_or_none(round(float(z), 3)) for z in path.alt_dsm_m - home.alt_dsm_m]
    return _feature("LineString", coordinates, {"role": "path", "alt_rel_home_m": heights, "summary": summary})


def _waypoint(item: MissionItem, index: int) -> Json:
    properties = {
        "role": "waypoint",
        "item": index,
        "command": item.command,
        "frame": item.frame,
        "params": [finite_or_none(p) for p in item.params],
        "alt_m": finite_or_none(item.alt_m),
        "autocontinue": item.autocontinue,
    }
    return _feature("Point", _lon_lat(item.lat_deg, item.lon_deg), properties)


def _poi(poi: Poi, index: int) -> Json:
    properties = {"role": "poi", "poi": index, "name": clean_name(poi.name), "loiter_s": poi.loiter_s}
    return _feature("Point", _lon_lat(poi.lat_deg, poi.lon_deg), properties)


def _home(mission: Mission) -> Json:
    home = mission.home
    properties = {
        "role": "home",
        "home_alt_dsm_m": finite_or_none(home.alt_dsm_m),
        "vertical_datum": home.vertical_datum,
        "surface_model": mission.surface_sha256 or None,
        "surface_name": clean_name(mission.surface_name) or None,
        "note": home_altitude_note(home),
        "version": __version__,
    }
    return _feature("Point", _lon_lat(home.lat_deg, home.lon_deg), properties)


def features(document: object, file: str) -> list[Json]:
    """The features of a GeoJSON document (a bare geometry counts as one), each with dict properties and geometry."""
    if not isinstance(document, dict) or not isinstance(document.get("type"), str):
        raise FormatError("This is no GeoJSON object.", where=file, advice="It needs a member 'type'.")
    if document["type"] != "FeatureCollection":
        raw = [document if document["type"] == "Feature" else {"geometry": document}]
    else:
        raw = document.get("features")
    if not isinstance(raw, list):
        raise FormatError("A FeatureCollection needs a list of features.", where=file)
    return [_checked(feature, f"{file}, feature {k}") for k, feature in enumerate(raw, start=1)]


def _checked(feature: object, where: str) -> Json:
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    if not isinstance(feature, dict) or not isinstance(geometry, dict):
        raise FormatError("The feature has no geometry.", where=where)
    if not isinstance(geometry.get("coordinates"), list):
        raise FormatError(f"The {clean_name(geometry.get('type'))} has no coordinates.", where=where)
    properties = feature.get("properties")
    return {"geometry": geometry, "properties": properties if isinstance(properties, dict) else {}}


def point(feature: Json, where: str) -> tuple[float, float]:
    """(lat_deg, lon_deg) of a Point feature."""
    return lat_lon(feature["geometry"]["coordinates"], where)


def lat_lon(position: object, where: str) -> tuple[float, float]:
    """A GeoJSON position [lon, lat, ...] -> (lat_deg, lon_deg)."""
    if not isinstance(position, list) or len(position) < 2:
        raise FormatError(f"A position is [lon, lat], got {clean_name(position)!r}.", where=where)
    return check_lat_lon(finite(position[1], "Latitude", where), finite(position[0], "Longitude", where), where)


def poi_from_feature(feature: Json, where: str) -> Poi:
    """A Point feature as POI, with its properties `name` and `loiter_s` if it has them."""
    properties = feature["properties"]
    loiter_s = check_loiter(finite(properties.get("loiter_s") or 0.0, "loiter_s", where), where)
    return Poi(*point(feature, where), clean_name(properties.get("name") or ""), loiter_s)
