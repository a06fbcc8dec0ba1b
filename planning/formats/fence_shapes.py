"""Fences and rally points as shapes of KML and GeoJSON, whoever drew them.

A polygon, or a point with a radius, is a fence if it says whether it is an inclusion or an exclusion: in the property
`fence`, or at the beginning of its name. A point with the property `alt_rel_home_m` and the role `rally` is a rally
point. Floor and ceiling may stand at any shape; they are the whole fence's.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from planning.errors import FormatError
from planning.fence.fence_model import Fence, LatLon, RallyPoint, circle, fence, polygon
from planning.formats import geojson
from planning.formats.fence_items import rally_point
from planning.formats.fence_plan import height_or_none
from planning.formats.kml_reader import read_placemarks
from planning.formats.safe_text import check_count, clean_name, finite, load_json

_KINDS = ("inclusion", "exclusion")
FLOOR, CEILING = "floor_rel_home_m", "ceiling_rel_home_m"


@dataclass(frozen=True, slots=True)
class Shape:
    """One drawn thing."""

    kind: str
    """Point or Polygon; others are no fences."""
    places: tuple[LatLon, ...]
    name: str
    properties: Mapping[str, object]
    where: str


def read_kml_shapes(name: str, data: bytes) -> list[Shape]:
    file = clean_name(name)
    return [
        Shape(
            mark.kind,
            tuple((lat, lon) for lat, lon, _ in mark.coordinates),
            mark.name,
            mark.data,
            f"{file}, placemark {mark.name!r}",
        )
        for mark in read_placemarks(name, data)
    ]


def read_geojson_shapes(name: str, text: str) -> list[Shape]:
    file = clean_name(name)
    found = geojson.features(load_json(name, text), file)
    check_count(len(found), "features", file)
    return [_feature_shape(feature, f"{file}, feature {k}") for k, feature in enumerate(found, start=1)]


def fence_and_rally(shapes: Sequence[Shape], file: str, warnings: list[str]) -> tuple[Fence, tuple[RallyPoint, ...]]:
    """What is neither is left out with a warning. Raises FormatError for a polygon that does not say what it is."""
    polygons, circles, rally = [], [], []
    for shape in shapes:
        where, properties = shape.where, shape.properties
        inclusion = _inclusion(shape)
        if properties.get("role") == "rally":
            height_m = finite(properties.get("alt_rel_home_m"), "alt_rel_home_m", where)
            rally.append(rally_point(*shape.places[0], height_m, where))
        elif shape.kind == "Polygon":
            if inclusion is None:
                raise FormatError(
                    "The polygon does not say whether it is an inclusion or an exclusion.",
                    where=where,
                    advice='Give it the property "fence", or a name that begins so.',
                )
            polygons.append(polygon(list(shape.places), inclusion=inclusion, where=where))
        elif shape.kind == "Point" and inclusion is not None:
            radius_m = finite(properties.get("radius_m"), "radius_m", where)
            circles.append(circle(*shape.places[0], radius_m, inclusion=inclusion, where=where))
        else:
            warnings.append(f"{where}: It is no fence and no rally point, and was not read.")
    low_m, high_m = (_height(shapes, key) for key in (FLOOR, CEILING))
    made = fence(polygons, circles, floor_rel_home_m=low_m, ceiling_rel_home_m=high_m, where=file)
    return made, tuple(rally)


def says_what(kind: object, name: object, properties: Mapping[str, object]) -> bool:
    """Whether a drawn thing says that it belongs to a fence, or is a rally point; a point does not by its name."""
    if properties.get("role") == "rally" or properties.get("fence") is not None:
        return True
    return kind == "Polygon" and str(name).lower().startswith(_KINDS)


def write_fence_geojson(shapes: Fence, rally: Sequence[RallyPoint]) -> str:
    features = [
        {
            "type": "Feature",
            "geometry": {"type": kind, "coordinates": [_ring(places)] if kind == "Polygon" else _ring(places)[0]},
            "properties": {"name": name, **properties},
        }
        for kind, places, name, properties in _drawn(shapes, rally)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False, indent=1) + "\n"


def write_fence_kml(shapes: Fence, rally: Sequence[RallyPoint]) -> str:
    marks = [_placemark(*drawn) for drawn in _drawn(shapes, rally)]
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document>'
    return "\n".join([head, "<name>Fence</name>", *marks, "</Document></kml>"]) + "\n"


def _drawn(shapes: Fence, rally: Sequence[RallyPoint]) -> Iterator[tuple[str, tuple[LatLon, ...], str, dict[str, Any]]]:
    """Kind, places, name and properties of each."""
    heights = {FLOOR: shapes.floor_rel_home_m, CEILING: shapes.ceiling_rel_home_m}
    given = {key: value for key, value in heights.items() if value is not None}
    for number, each in enumerate(shapes.polygons, start=1):
        kind = "inclusion" if each.inclusion else "exclusion"
        ring = (*each.corners_lat_lon_deg, each.corners_lat_lon_deg[0])
        yield "Polygon", ring, f"{kind} polygon {number}", {"fence": kind, **given}
    for number, each in enumerate(shapes.circles, start=1):
        kind = "inclusion" if each.inclusion else "exclusion"
        properties = {"fence": kind, "radius_m": each.radius_m, **given}
        yield "Point", (each.centre_lat_lon_deg,), f"{kind} circle {number}", properties
    for number, point in enumerate(rally, start=1):
        at = (point.lat_deg, point.lon_deg)
        yield "Point", (at,), f"rally point {number}", {"role": "rally", "alt_rel_home_m": point.alt_rel_home_m}


def _ring(places: Sequence[LatLon]) -> list[list[float]]:
    return [[lon, lat] for lat, lon in places]


def _placemark(kind: str, places: tuple[LatLon, ...], name: str, properties: dict[str, Any]) -> str:
    data = "".join(f"<Data name={quoteattr(k)}><value>{escape(str(v))}</value></Data>" for k, v in properties.items())
    coordinates = f"<coordinates>{' '.join(f'{lon:.7f},{lat:.7f}' for lat, lon in places)}</coordinates>"
    if kind == "Polygon":
        coordinates = f"<outerBoundaryIs><LinearRing>{coordinates}</LinearRing></outerBoundaryIs>"
    return (
        f"<Placemark><name>{escape(name)}</name><ExtendedData>{data}</ExtendedData>"
        f"<{kind}>{coordinates}</{kind}></Placemark>"
    )


def _feature_shape(feature: dict[str, Any], where: str) -> Shape:
    geometry, properties = feature["geometry"], feature["properties"]
    kind, coordinates = clean_name(geometry.get("type")), geometry["coordinates"]
    places: tuple[LatLon, ...] = ()
    if kind == "Point":
        places = (geojson.point(feature, where),)
    if kind == "Polygon":
        if len(coordinates) != 1 or not isinstance(coordinates[0], list):
            raise FormatError(
                "A fence's polygon is one ring without holes.", where=where, advice="Draw each hole as an exclusion."
            )
        places = tuple(geojson.lat_lon(each, where) for each in coordinates[0])
    return Shape(kind, places, clean_name(properties.get("name") or ""), properties, where)


def _inclusion(shape: Shape) -> bool | None:
    """None: the shape does not say."""
    said = shape.properties.get("fence")
    words = str(said if said is not None else shape.name).lower()
    if words.startswith(_KINDS):
        return words.startswith("inclusion")
    if said is not None:
        raise FormatError(
            f"The property fence is {clean_name(said)!r}.", where=shape.where, advice="Write inclusion or exclusion."
        )
    return None


def _height(shapes: Sequence[Shape], key: str) -> float | None:
    """Raises FormatError when two shapes give the fence two heights."""
    given = [(height_or_none(s.properties.get(key), key, s.where), s.where) for s in shapes]
    values = {value: where for value, where in given if value is not None}
    if len(values) > 1:
        raise FormatError(
            f"The shapes give {key} as {' and '.join(f'{v:g}' for v in sorted(values))}.",
            where=list(values.values())[-1],
            advice="A fence has one floor and one ceiling.",
        )
    return next(iter(values), None)
