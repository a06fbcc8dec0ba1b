"""Fence and rally points in QGroundControl's `.plan`: the objects `geoFence` and `rallyPoints`.

QGroundControl knows no floor and no ceiling; they stand in our own object `hedgehop`. Its rally heights are above home.
"""

from __future__ import annotations

from typing import Any

from planning.errors import FormatError
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, RallyPoint, circle, fence, polygon
from planning.formats.fence_items import rally_point
from planning.formats.safe_text import check_count, check_lat_lon, clean_name, finite

Json = dict[str, Any]
VERSION = 2
FLOOR, CEILING = "fence_floor_rel_home_m", "fence_ceiling_rel_home_m"


def fence_json(shapes: Fence) -> Json:
    """`geoFence`"""
    return {
        "version": VERSION,
        "polygons": [
            {"version": 1, "inclusion": each.inclusion, "polygon": [list(c) for c in each.corners_lat_lon_deg]}
            for each in shapes.polygons
        ],
        "circles": [
            {
                "version": 1,
                "inclusion": each.inclusion,
                "circle": {"center": list(each.centre_lat_lon_deg), "radius": each.radius_m},
            }
            for each in shapes.circles
        ],
    }


def rally_json(rally: tuple[RallyPoint, ...]) -> Json:
    """`rallyPoints`"""
    return {"version": VERSION, "points": [[p.lat_deg, p.lon_deg, p.alt_rel_home_m] for p in rally]}


def heights_json(shapes: Fence) -> Json:
    """What of a fence stands in `hedgehop`."""
    return {FLOOR: shapes.floor_rel_home_m, CEILING: shapes.ceiling_rel_home_m} if shapes.has_heights else {}


def read_fence_json(plan: Json, file: str, warnings: list[str]) -> Fence:
    """Of a whole `.plan`. Raises FormatError with the JSON path: a fence that is only half read protects nobody."""
    raw, where = _section(plan, "geoFence", file), f"{file}, $.geoFence"
    _check_version(raw, where)
    polygons = [_polygon(each, f"{where}.polygons[{k}]") for k, each in enumerate(_list(raw, "polygons", where))]
    circles = [_circle(each, f"{where}.circles[{k}]") for k, each in enumerate(_list(raw, "circles", where))]
    if raw.get("breachReturn") is not None:
        warnings.append(f"{where}: The fence's breach return point was not read.")
    ours = plan.get("hedgehop")
    heights: Json = ours if isinstance(ours, dict) else {}
    return fence(
        polygons,
        circles,
        floor_rel_home_m=height_or_none(heights.get(FLOOR), FLOOR, file),
        ceiling_rel_home_m=height_or_none(heights.get(CEILING), CEILING, file),
        where=where,
    )


def read_rally_json(plan: Json, file: str) -> tuple[RallyPoint, ...]:
    """Of a whole `.plan`."""
    raw, where = _section(plan, "rallyPoints", file), f"{file}, $.rallyPoints"
    _check_version(raw, where)
    points = _list(raw, "points", where)
    return tuple(_rally_point(each, f"{where}.points[{k}]") for k, each in enumerate(points))


def height_or_none(value: object, what: str, where: str) -> float | None:
    return None if value is None else finite(value, what, where)


def _section(plan: Json, key: str, file: str) -> Json:
    raw = plan.get(key)
    if raw is None:
        return {}
    if not isinstance(raw, dict):
        raise FormatError(f"The plan's $.{key} should be an object.", where=f"{file}, $.{key}", advice="Save it again.")
    return raw


def _check_version(raw: Json, where: str) -> None:
    """An older spelling has other names: its shapes would be overlooked."""
    version = raw.get("version", VERSION)
    if version != VERSION:
        raise FormatError(
            f"Version {clean_name(version)} of it is not read, only {VERSION}.",
            where=where,
            advice="Save the plan again with a current QGroundControl.",
        )


def _list(raw: Json, key: str, where: str) -> list[Any]:
    value = raw.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise FormatError(f"{key} should be a list.", where=f"{where}.{key}", advice="Save the plan again.")
    check_count(len(value), key, where)
    return value


def _polygon(raw: object, where: str) -> FencePolygon:
    shape = _shape(raw, where)
    corners = [_place(each, f"{where}.polygon[{k}]") for k, each in enumerate(_list(shape, "polygon", where))]
    return polygon(corners, inclusion=_inclusion(shape, where), where=where)


def _circle(raw: object, where: str) -> FenceCircle:
    shape = _shape(raw, where)
    round_, here = _shape(shape.get("circle"), where), f"{where}.circle"
    lat_deg, lon_deg = _place(round_.get("center"), f"{here}.center")
    radius_m = finite(round_.get("radius"), "The radius", here)
    return circle(lat_deg, lon_deg, radius_m, inclusion=_inclusion(shape, where), where=where)


def _rally_point(raw: object, where: str) -> RallyPoint:
    if not isinstance(raw, list) or len(raw) < 3:
        raise FormatError(
            "A rally point is [latitude, longitude, height above home].", where=where, advice="Save the plan again."
        )
    return rally_point(*_place(raw, where), finite(raw[2], "The height", where), where)


def _shape(raw: object, where: str) -> Json:
    if not isinstance(raw, dict):
        raise FormatError("A shape of the fence should be an object.", where=where, advice="Save the plan again.")
    return raw


def _inclusion(shape: Json, where: str) -> bool:
    inclusion = shape.get("inclusion")
    if not isinstance(inclusion, bool):
        raise FormatError(
            "The shape does not say whether it is an inclusion.", where=where, advice='Give "inclusion": true or false.'
        )
    return inclusion


def _place(raw: object, where: str) -> tuple[float, float]:
    if not isinstance(raw, list) or len(raw) < 2:
        raise FormatError("A place is [latitude, longitude].", where=where, advice="Save the plan again.")
    return check_lat_lon(finite(raw[0], "Latitude", where), finite(raw[1], "Longitude", where), where)
