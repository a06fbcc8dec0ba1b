"""QGroundControl's `.plan` JSON: the reader, for plans by any ground station."""

from __future__ import annotations

import math
from typing import Any

from planning.basics.mav_cmd import MavFrame
from planning.basics.plan_model import Firmware, Home, Mission, MissionItem, Poi
from planning.errors import FormatError
from planning.formats.commands import POSITIONED, home_or_first_place, plain_frame
from planning.formats.fence_plan import read_fence_json, read_rally_json
from planning.formats.other_surface import surface_digest
from planning.formats.planned_for import read_planned_for
from planning.formats.safe_text import (
    check_count,
    check_lat_lon,
    check_loiter,
    clean_name,
    decode_text,
    finite,
    load_json,
    said_once,
)
from planning.formats.swapped import swapped_against_home

Json = dict[str, Any]


FIRMWARE_TYPE = {"ardupilot": 3, "px4": 12}
"""MAV_AUTOPILOT"""
QUADROTOR = 2
"""MAV_TYPE"""
ALTITUDE_MODE: dict[int, int] = {MavFrame.GLOBAL_RELATIVE_ALT: 1, MavFrame.GLOBAL: 2, MavFrame.GLOBAL_TERRAIN_ALT: 4}
"""MAV_FRAME -> QGroundControl's altitude mode: relative, absolute, terrain frame."""
COMPUTED_ABOVE_TERRAIN = 3
"""QGroundControl's altitude mode whose heights it turned into AMSL itself."""
DEFAULT_SPEED_M_S = 5.0


def read_plan(data: bytes | str, name: str = "mission.plan") -> Mission:
    """`.plan` text -> mission; survey and corridor items are replaced by the simple items they embed.

    The frame decides what an altitude means, not `AltitudeMode`, which writers set wrongly.
    Raises FormatError with the JSON path of what is wrong.
    """
    file = clean_name(name)
    plan = _object(load_json(name, decode_text(name, data)), file, "$")
    _check_version(plan, file)
    mission = _object(plan.get("mission"), file, "$.mission")
    _expect(mission.get("version") == 2, f"mission version {mission.get('version')!r}", "2", file, "$.mission.version")
    warnings: list[str] = []
    items = _items(mission.get("items"), file, warnings)
    raw_ours = plan.get("hedgehop")
    ours: Json = raw_ours if isinstance(raw_ours, dict) else {}
    home = _home(mission.get("plannedHomePosition"), ours, file)
    warnings += swapped_against_home(home, items)
    fence, rally = read_fence_json(plan, file, warnings), read_rally_json(plan, file)
    home = home_or_first_place(home, items, warnings)
    raw = ours.get("planned_for")
    planned = None if raw is None else read_planned_for(raw, _at(file, "$.hedgehop.planned_for"), warnings)
    firmware, speed = _firmware(mission), _speed(mission, ours)
    surface, called = surface_digest(ours.get("surface_model")), ours.get("surface_name")
    return Mission(
        home,
        tuple(items),
        firmware,
        _pois(ours, file),
        speed,
        said_once(warnings),
        planned,
        surface,
        clean_name(called) if isinstance(called, str) else "",
        fence,
        rally,
    )


def _at(file: str, path: str) -> str:
    return f"{file}, {path}"


def _object(value: object, file: str, path: str) -> Json:
    if isinstance(value, dict):
        return value
    what = "is missing" if value is None else f"should be an object, got {type(value).__name__}"
    raise FormatError(f"The plan's {path} {what}.", where=_at(file, path), advice="Export the plan again.")


def _list(value: object, file: str, path: str) -> list[Any]:
    if isinstance(value, list):
        return value
    what = "is missing" if value is None else f"should be a list, got {type(value).__name__}"
    raise FormatError(f"The plan's {path} {what}.", where=_at(file, path), advice="Export the plan again.")


def _expect(ok: bool, got: str, wanted: str, file: str, path: str) -> None:
    if not ok:
        raise FormatError(
            f"Got {clean_name(got)}, this reader knows {wanted}.",
            where=_at(file, path),
            advice="Save the plan again with a current QGroundControl.",
        )


def _check_version(plan: Json, file: str) -> None:
    _expect(plan.get("fileType") == "Plan", f"file type {plan.get('fileType')!r}", "'Plan'", file, "$.fileType")
    _expect(plan.get("version") == 1, f"plan version {plan.get('version')!r}", "1", file, "$.version")


def _items(value: object, file: str, warnings: list[str]) -> list[MissionItem]:
    items: list[MissionItem] = []
    for index, raw in enumerate(_list(value, file, "$.mission.items")):
        path = f"$.mission.items[{index}]"
        for simple, simple_path in _simple_items(_object(raw, file, path), file, path):
            check_count(len(items), "mission items", file)
            items.append(_item(simple, file, simple_path, warnings))
    return items


def _simple_items(raw: Json, file: str, path: str) -> list[tuple[Json, str]]:
    """The item itself, or what a complex item embeds."""
    if raw.get("type", "SimpleItem") == "SimpleItem":
        return [(raw, path)]
    transects = raw.get("TransectStyleComplexItem")
    embedded = transects.get("Items") if isinstance(transects, dict) else None
    if not isinstance(embedded, list) or not embedded:
        kind = clean_name(raw.get("complexItemType", raw.get("type")))
        raise FormatError(
            f"The complex item {kind!r} does not embed its waypoints.",
            where=_at(file, path),
            advice="Only its author can compute them: in QGroundControl upload it, download it and save that.",
        )
    path = f"{path}.TransectStyleComplexItem.Items"
    return [(_object(item, file, f"{path}[{k}]"), f"{path}[{k}]") for k, item in enumerate(embedded)]


def _item(raw: Json, file: str, path: str, warnings: list[str]) -> MissionItem:
    where = _at(file, path)
    command, frame = _whole(raw.get("command"), "command", where), _whole(raw.get("frame"), "frame", where)
    frame = plain_frame(frame)
    params = _list(raw.get("params"), file, f"{path}.params")
    if len(params) != 7:
        raise FormatError(f"An item has 7 params, this one {len(params)}.", where=f"{where}.params")
    p1, p2, p3, p4, lat, lon, alt = (
        math.nan if p is None else finite(p, f"params[{k}]", where) for k, p in enumerate(params)
    )
    if command not in POSITIONED:
        lat, lon, alt = (0.0 if math.isnan(v) else v for v in (lat, lon, alt))
    else:
        lat, lon, alt = _place(lat, lon, alt, where)
        _warn_mode(raw.get("AltitudeMode"), frame, where, warnings)
    return MissionItem(command, frame, (p1, p2, p3, p4), lat, lon, alt, raw.get("autoContinue") is not False)


def _whole(value: object, what: str, where: str) -> int:
    number = finite(value, f"The {what}", where)
    if number != int(number) or not 0 <= number <= 65535:
        raise FormatError(f"The {what} should be a whole number up to 65535, got {number:g}.", where=where)
    return int(number)


def _place(lat: float, lon: float, alt: float, where: str) -> tuple[float, float, float]:
    """Null latitude and longitude mean "where the vehicle is" (0, 0); a null altitude means nothing."""
    if math.isnan(alt):
        raise FormatError("The item has a position but no altitude.", where=where, advice="Set its altitude.")
    if math.isnan(lat) != math.isnan(lon):
        raise FormatError("Only one of latitude and longitude is given.", where=where, advice="Give both.")
    return (0.0, 0.0, alt) if math.isnan(lat) else (*check_lat_lon(lat, lon, where), alt)


def _warn_mode(mode: object, frame: int, where: str, warnings: list[str]) -> None:
    believable = {None, 0, ALTITUDE_MODE.get(frame), COMPUTED_ABOVE_TERRAIN if frame == 0 else None}
    if isinstance(mode, int) and mode not in believable:
        warnings.append(f"{where}: AltitudeMode {mode} contradicts frame {frame}; the frame was taken.")


def _home(value: object, ours: Json, file: str) -> Home | None:
    if value is None:
        return None
    where = _at(file, "$.mission.plannedHomePosition")
    place = _list(value, file, "$.mission.plannedHomePosition")
    if len(place) < 2:
        raise FormatError("Home needs latitude and longitude.", where=where)
    if place[0] is None or place[1] is None:
        return None
    lat, lon = check_lat_lon(finite(place[0], "Latitude", where), finite(place[1], "Longitude", where), where)
    alt = ours.get("home_alt_dsm_m") if "home_alt_dsm_m" in ours else place[2] if len(place) > 2 else None
    datum = ours.get("vertical_datum")
    alt_m = math.nan if alt is None else finite(alt, "The home altitude", where)
    return Home(lat, lon, alt_m, clean_name(datum) if isinstance(datum, str) else None)


def _firmware(mission: Json) -> Firmware:
    return "px4" if mission.get("firmwareType") == FIRMWARE_TYPE["px4"] else "ardupilot"


def _pois(ours: Json, file: str) -> tuple[Poi, ...]:
    raw = ours.get("pois", [])
    return tuple(
        _poi(_object(p, file, f"$.hedgehop.pois[{k}]"), _at(file, f"$.hedgehop.pois[{k}]"))
        for k, p in enumerate(_list(raw, file, "$.hedgehop.pois"))
    )


def _poi(raw: Json, where: str) -> Poi:
    lat, lon = finite(raw.get("lat_deg"), "lat_deg", where), finite(raw.get("lon_deg"), "lon_deg", where)
    loiter_s = check_loiter(finite(raw.get("loiter_s", 0.0), "loiter_s", where), where)
    return Poi(*check_lat_lon(lat, lon, where), clean_name(raw.get("name", "")), loiter_s)


def _speed(mission: Json, ours: Json) -> float | None:
    """A multicopter flies at the hover speed; our own plans tell whether one was set at all."""
    value = ours.get("cruise_speed_m_s") if "cruise_speed_m_s" in ours else mission.get("hoverSpeed")
    return None if value is None else finite(value, "hoverSpeed", "$.mission.hoverSpeed")
