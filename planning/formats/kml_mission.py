"""Missions in KML and KMZ: lines with heights by any program, and DJI's waylines (WPML)."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Home, Mission, MissionItem
from planning.errors import FormatError
from planning.formats.commands import home_or_first_place
from planning.formats.kml import read_kml_track
from planning.formats.kml_reader import first, read_placemarks, read_xml, tag, text_of
from planning.formats.safe_text import check_count, check_lat_lon, clean_name, finite

NO_PARAMS = (0.0, 0.0, 0.0, 0.0)
WAYLINES = ".wpml"
HEIGHT_MODES = {
    "relativeToStartPoint": MavFrame.GLOBAL_RELATIVE_ALT,
    "EGM96": MavFrame.GLOBAL,
    "realTimeFollowSurface": MavFrame.GLOBAL_TERRAIN_ALT,
}
"""DJI's executeHeightMode. Heights above the ellipsoid (WGS84) are none that a mission item has."""
LINE_MODES = {"absolute": MavFrame.GLOBAL, "relativeToGround": MavFrame.GLOBAL_TERRAIN_ALT}
CURVED = "toPointAndPassWithContinuityCurvature"
NO_HEIGHTS = "The file holds no line with heights: there is nothing to judge."
PLAN_IT = "Plan a flight over its points with `hedgehop plan`, over its area with `hedgehop survey`."


def read_kml_mission(name: str, data: bytes) -> Mission:
    """The flight along a KML's line, or through DJI's waylines in a KMZ or a .wpml file.

    A KML line is flown from its first point to its last and back by a return; heights are above sea level
    (`absolute`) or above ground, those of our own export above home. Raises FormatError where the file holds no
    heights, or such as no mission item has.
    """
    root = read_xml(name, data, prefer=WAYLINES)
    if first(root, "executeHeight") is not None:
        return _dji(root, clean_name(name))
    marks = read_placemarks(name, data)
    if any("alt_rel_home_m" in mark.data for mark in marks):
        return _ours(name, data)
    lines = [mark for mark in marks if mark.kind == "LineString" and mark.altitude_mode in LINE_MODES]
    if not lines:
        raise FormatError(NO_HEIGHTS, where=clean_name(name), advice=PLAN_IT)
    warnings = ["A KML line says neither where it takes off nor how it ends: a return home was added."]
    if len(lines) > 1:
        warnings.append(f"The file holds {len(lines)} lines with heights; the first was taken.")
    frame = LINE_MODES[lines[0].altitude_mode]
    places = [_place(place, frame, clean_name(name)) for place in lines[0].coordinates]
    return _mission(None, [_takeoff(places[0]), *places, _end(MavCmd.NAV_RETURN_TO_LAUNCH)], warnings)


def _ours(name: str, data: bytes) -> Mission:
    track = read_kml_track(data, name)
    heights = zip(track.lat_lon_deg.tolist(), track.alt_rel_home_m.tolist(), strict=True)
    places = [
        MissionItem(MavCmd.NAV_WAYPOINT, MavFrame.GLOBAL_RELATIVE_ALT, NO_PARAMS, lat, lon, alt_m)
        for (lat, lon), alt_m in heights
    ]
    note = "This is the path as it was sampled; what is flown stands in mission.waypoints and mission.plan."
    return _mission(track.home, [_takeoff(places[0]), *places, _end(MavCmd.NAV_RETURN_TO_LAUNCH)], [note])


def _place(place: tuple[float, float, float], frame: int, file: str) -> MissionItem:
    lat_deg, lon_deg, alt_m = place
    if math.isnan(alt_m):
        raise FormatError("A point of the line has no height.", where=file, advice="Export it with heights.")
    return MissionItem(MavCmd.NAV_WAYPOINT, frame, NO_PARAMS, lat_deg, lon_deg, alt_m)


def _takeoff(first_place: MissionItem, least_m: float = -math.inf) -> MissionItem:
    alt_m = max(first_place.alt_m, least_m)
    return MissionItem(
        MavCmd.NAV_TAKEOFF, first_place.frame, NO_PARAMS, first_place.lat_deg, first_place.lon_deg, alt_m
    )


def _end(command: int) -> MissionItem:
    return MissionItem(command, MavFrame.MISSION, NO_PARAMS)


def _mission(home: Home | None, items: list[MissionItem], warnings: list[str]) -> Mission:
    said = list(warnings)
    return Mission(home_or_first_place(home, items, said), tuple(items), warnings=tuple(said))


def _dji(root: Element, file: str) -> Mission:
    """Waylines as DJI flies them "safely": up to the higher of security height and first waypoint, then there."""
    folders = [folder for folder in root.iter() if tag(folder) == "Folder"] or [root]
    frame = _height_frame(text_of(first(folders[0], "executeHeightMode")).strip(), file)
    marks = [mark for mark in folders[0].iter() if tag(mark) == "Placemark"]
    check_count(len(marks), "waypoints", file)
    if not marks:
        raise FormatError("The wayline has no waypoints.", where=file, advice="Export it again.")
    places = [_dji_place(mark, frame, f"{file}, waypoint {number}") for number, mark in enumerate(marks, start=1)]
    security = text_of(first(root, "takeOffSecurityHeight")).strip()
    relative = frame == MavFrame.GLOBAL_RELATIVE_ALT and security
    least_m = finite(security, "takeOffSecurityHeight", file) if relative else -math.inf
    warnings = [f"The file holds {len(folders)} waylines; the first was taken."] if len(folders) > 1 else []
    finish = text_of(first(root, "finishAction")).strip()
    return _mission(None, [_takeoff(places[0], least_m), *places, *_finish(finish, places[0], warnings)], warnings)


def _height_frame(mode: str, file: str) -> int:
    if mode not in HEIGHT_MODES:
        raise FormatError(
            f"Heights are given as {clean_name(mode) or 'nothing'!r}, which no mission item has.",
            where=file,
            advice="Export the wayline with heights above the take-off point.",
        )
    return HEIGHT_MODES[mode]


def _dji_place(mark: Element, frame: int, where: str) -> MissionItem:
    parts = text_of(first(mark, "coordinates")).split(",")
    if len(parts) < 2:
        raise FormatError("The waypoint has no coordinates.", where=where)
    lat_deg, lon_deg = check_lat_lon(finite(parts[1], "Latitude", where), finite(parts[0], "Longitude", where), where)
    alt_m = finite(text_of(first(mark, "executeHeight")), "executeHeight", where)
    straight = text_of(first(mark, "useStraightLine")).strip() != "0"
    curved = text_of(first(mark, "waypointTurnMode")).strip() == CURVED and not straight
    return MissionItem(
        MavCmd.NAV_SPLINE_WAYPOINT if curved else MavCmd.NAV_WAYPOINT, frame, NO_PARAMS, lat_deg, lon_deg, alt_m
    )


def _finish(action: str, first_place: MissionItem, warnings: list[str]) -> list[MissionItem]:
    if action == "goHome":
        return [_end(MavCmd.NAV_RETURN_TO_LAUNCH)]
    if action == "autoLand":
        return [_end(MavCmd.NAV_LAND)]
    if action == "gotoFirstWaypoint":
        return [first_place]
    warnings.append("The wayline ends in the air: what the vehicle does then is not judged.")
    return []
