"""A fence and rally points as the items of MAVLink's two lists, and back: for vehicles, and for WPL text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planning.basics.mav_cmd import AMSL_FRAMES, FENCE_CIRCLES, FENCE_POLYGONS, HOME_FRAMES, MavCmd, MavFrame
from planning.basics.plan_model import Firmware, MissionItem
from planning.errors import FormatError
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, RallyPoint, circle, fence, place, polygon
from planning.formats.safe_text import check_lat_lon

_INCLUSIONS = (MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION, MavCmd.NAV_FENCE_CIRCLE_INCLUSION)


def fence_items(shapes: Fence) -> tuple[MissionItem, ...]:
    """Floor and ceiling are no items: vehicles have parameters for them."""
    items = [_corner(each, corner) for each in shapes.polygons for corner in each.corners_lat_lon_deg]
    return (*items, *map(_circle_item, shapes.circles))


def rally_items(rally: Sequence[RallyPoint], firmware: Firmware) -> tuple[MissionItem, ...]:
    """ArduPilot keeps whole metres and cuts the rest off: it gets the next whole metre above."""

    def height_m(point: RallyPoint) -> float:
        return float(math.ceil(point.alt_rel_home_m)) if firmware == "ardupilot" else point.alt_rel_home_m

    still = (0.0, 0.0, 0.0, 0.0)
    return tuple(
        MissionItem(
            MavCmd.NAV_RALLY_POINT, MavFrame.GLOBAL_RELATIVE_ALT, still, point.lat_deg, point.lon_deg, height_m(point)
        )
        for point in rally
    )


def fence_of(
    items: Sequence[MissionItem],
    where: str,
    warnings: list[str],
    *,
    floor_rel_home_m: float | None = None,
    ceiling_rel_home_m: float | None = None,
) -> Fence:
    """Raises FormatError for polygons with missing corners and for shapes that enclose nothing.

    A return point is left out with a warning: where vehicles fly to then is not judged.
    """
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    at = 0
    while at < len(items):
        item, here = items[at], f"{where}, item {at + 1}"
        inclusion = item.command in _INCLUSIONS
        if item.command in FENCE_POLYGONS:
            corners = _corners(items, at, here)
            polygons.append(polygon([(c.lat_deg, c.lon_deg) for c in corners], inclusion=inclusion, where=here))
            at += len(corners)
            continue
        if item.command in FENCE_CIRCLES:
            centre = check_lat_lon(item.lat_deg, item.lon_deg, here)
            circles.append(circle(*centre, item.params[0], inclusion=inclusion, where=here))
        elif item.command == MavCmd.NAV_FENCE_RETURN_POINT:
            warnings.append(f"{here}: The fence's return point was not read.")
        else:
            raise FormatError(
                f"Command {item.command} is no part of a fence.", where=here, advice="Take the item out of the file."
            )
        at += 1
    return fence(
        polygons, circles, floor_rel_home_m=floor_rel_home_m, ceiling_rel_home_m=ceiling_rel_home_m, where=where
    )


def rally_of(items: Sequence[MissionItem], where: str) -> tuple[RallyPoint, ...]:
    """Raises FormatError for what is no rally point, or has a height that is not above home."""
    return tuple(_rally_point(item, f"{where}, item {number}") for number, item in enumerate(items, start=1))


def rally_point(lat_deg: float, lon_deg: float, alt_rel_home_m: float, where: str) -> RallyPoint:
    """Raises FormatError for what is no place or no height."""
    at = place(*check_lat_lon(lat_deg, lon_deg, where))
    if not math.isfinite(alt_rel_home_m):
        raise FormatError(
            f"The rally point's height is {alt_rel_home_m}.", where=where, advice="Give metres above home."
        )
    return RallyPoint(*at, alt_rel_home_m)


def _corner(shape: FencePolygon, corner: tuple[float, float]) -> MissionItem:
    inside, outside = MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION, MavCmd.NAV_FENCE_POLYGON_VERTEX_EXCLUSION
    count = float(len(shape.corners_lat_lon_deg))
    return MissionItem(inside if shape.inclusion else outside, MavFrame.GLOBAL, (count, 0.0, 0.0, 0.0), *corner)


def _circle_item(shape: FenceCircle) -> MissionItem:
    inside, outside = MavCmd.NAV_FENCE_CIRCLE_INCLUSION, MavCmd.NAV_FENCE_CIRCLE_EXCLUSION
    params = (shape.radius_m, 0.0, 0.0, 0.0)
    return MissionItem(inside if shape.inclusion else outside, MavFrame.GLOBAL, params, *shape.centre_lat_lon_deg)


def _corners(items: Sequence[MissionItem], at: int, where: str) -> Sequence[MissionItem]:
    """Of the polygon that begins at this item: each corner says how many there are."""
    first = items[at]
    count = first.params[0]
    run = items[at : at + int(count)] if math.isfinite(count) and count >= 1 else []
    if len(run) != count or any((c.command, c.params[0]) != (first.command, count) for c in run):
        raise FormatError(
            f"The polygon says that it has {count:g} corners, and {len(run)} follow that belong to it."
            if len(run) != count
            else f"The polygon says that it has {count:g} corners, but not all of them are its own.",
            where=where,
            advice="Save the fence again: it may be cut short.",
        )
    for number, corner in enumerate(run):
        check_lat_lon(corner.lat_deg, corner.lon_deg, f"{where}, corner {number + 1}")
    return run


def _rally_point(item: MissionItem, where: str) -> RallyPoint:
    if item.command != MavCmd.NAV_RALLY_POINT:
        raise FormatError(
            f"Command {item.command} is no rally point.", where=where, advice="Take the item out of the file."
        )
    if item.frame not in HOME_FRAMES:
        meant = "above mean sea level" if item.frame in AMSL_FRAMES else f"in frame {item.frame}"
        raise FormatError(
            f"The rally point's height is given {meant}.", where=where, advice="Give heights above home (frame 3)."
        )
    return rally_point(item.lat_deg, item.lon_deg, item.alt_m, where)
