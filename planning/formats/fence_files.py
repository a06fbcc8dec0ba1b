"""Files that hold a fence, rally points or both: told apart by their content, written by their name's end."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

from planning.basics.mav_cmd import FENCES, MavCmd
from planning.basics.plan_model import Firmware
from planning.errors import FormatError
from planning.fence.fence_model import Fence, RallyPoint
from planning.formats.detect import is_kml
from planning.formats.fence_items import fence_items, fence_of, rally_items, rally_of
from planning.formats.fence_plan import (
    CEILING,
    FLOOR,
    fence_json,
    height_or_none,
    heights_json,
    rally_json,
    read_fence_json,
    read_rally_json,
)
from planning.formats.fence_shapes import (
    fence_and_rally,
    read_geojson_shapes,
    read_kml_shapes,
    says_what,
    write_fence_geojson,
    write_fence_kml,
)
from planning.formats.geojson import features
from planning.formats.kml_reader import read_placemarks
from planning.formats.qgc_plan_reader import FIRMWARE_TYPE, QUADROTOR
from planning.formats.safe_text import clean_name, decode_text, load_json, said_once
from planning.formats.wpl import read_lists, write_lists

WRITTEN = (".plan", ".waypoints", ".txt", ".kml", ".geojson", ".json")


@dataclass(frozen=True, slots=True)
class FenceFile:
    fence: Fence
    rally: tuple[RallyPoint, ...]
    warnings: tuple[str, ...] = ()


def read_fence(name: str, data: bytes) -> FenceFile:
    """From `.plan`, WPL, KML, KMZ or GeoJSON. Raises FormatError, also when there is no fence and no rally point."""
    file, warnings = clean_name(name), []
    found = _read(name, data, warnings)
    if not found[0] and not found[1]:
        raise FormatError(
            "The file holds no fence and no rally points.",
            where=file,
            advice="Draw polygons or circles that say inclusion or exclusion.",
        )
    return FenceFile(*found, said_once(warnings))


def is_fence(name: str, data: bytes) -> bool:
    """Whether a file is there for its fence or its rally points: no mission, and no points to fly to."""
    if is_kml(data):
        return any(says_what(mark.kind, mark.name, mark.data) for mark in read_placemarks(name, data))
    text = decode_text(name, data).lstrip()
    if text.upper().startswith("QGC WPL"):
        return any(item.command in {*FENCES, MavCmd.NAV_RALLY_POINT} for item in read_lists(text, name)[0])
    if not text.startswith("{"):
        return False
    document = load_json(name, text)
    if isinstance(document, dict) and "fileType" in document:
        return False
    found = [(each["geometry"], each["properties"]) for each in features(document, clean_name(name))]
    return any(says_what(shape.get("type"), said.get("name"), said) for shape, said in found)


def write_fence(name: str, shapes: Fence, rally: Sequence[RallyPoint], *, firmware: Firmware = "ardupilot") -> str:
    """In the format that the name's end asks for. Raises FormatError for another end, or what it cannot hold."""
    end = PurePath(name).suffix.lower()
    if end == ".plan":
        return _plan(shapes, tuple(rally), firmware)
    if end in (".waypoints", ".txt"):
        return _wpl(shapes, tuple(rally), clean_name(name))
    if end in (".geojson", ".json"):
        return write_fence_geojson(shapes, rally)
    if end == ".kml":
        return write_fence_kml(shapes, rally)
    raise FormatError(
        f"No fence is written as {end or 'a file without an ending'!r}.",
        where=clean_name(name),
        advice=f"Name it {', '.join(WRITTEN[:-1])} or {WRITTEN[-1]}.",
    )


def _read(name: str, data: bytes, warnings: list[str]) -> tuple[Fence, tuple[RallyPoint, ...]]:
    file = clean_name(name)
    if is_kml(data):
        return fence_and_rally(read_kml_shapes(name, data), file, warnings)
    text = decode_text(name, data).lstrip()
    if text.upper().startswith("QGC WPL"):
        return _read_wpl(name, text, warnings)
    if not text.startswith("{"):
        raise FormatError(
            "This is no fence.", where=file, advice="Choose a .plan, .waypoints (QGC WPL 110), .kml or .geojson file."
        )
    document = load_json(name, text)
    if isinstance(document, dict) and "fileType" in document:
        if document.get("fileType") != "Plan":
            raise FormatError("This is no plan of QGroundControl.", where=f"{file}, $.fileType", advice="Save a .plan.")
        return read_fence_json(document, file, warnings), read_rally_json(document, file)
    return fence_and_rally(read_geojson_shapes(name, text), file, warnings)


def _read_wpl(name: str, text: str, warnings: list[str]) -> tuple[Fence, tuple[RallyPoint, ...]]:
    items, notes = read_lists(text, name)
    file = clean_name(name)
    shapes = [item for item in items if item.command in FENCES]
    made = fence_of(
        shapes,
        file,
        warnings,
        floor_rel_home_m=height_or_none(notes.get(FLOOR), FLOOR, file),
        ceiling_rel_home_m=height_or_none(notes.get(CEILING), CEILING, file),
    )
    return made, rally_of([item for item in items if item.command not in FENCES], file)


def _plan(shapes: Fence, rally: tuple[RallyPoint, ...], firmware: Firmware) -> str:
    """A plan without a mission, as QGroundControl saves one."""
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "Hedgehop",
        "mission": {
            "version": 2,
            "firmwareType": FIRMWARE_TYPE[firmware],
            "vehicleType": QUADROTOR,
            "plannedHomePosition": [None, None, None],
            "items": [],
        },
        "geoFence": fence_json(shapes),
        "rallyPoints": rally_json(rally),
        "hedgehop": heights_json(shapes),
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _wpl(shapes: Fence, rally: tuple[RallyPoint, ...], file: str) -> str:
    if (shapes.polygons or shapes.circles) and rally:
        raise FormatError(
            "A WPL file holds a fence or rally points, not both.", where=file, advice="Write a .plan, .kml or .geojson."
        )
    notes = [f"# {key}: {value:.10g}" for key, value in heights_json(shapes).items() if value is not None]
    return write_lists([*fence_items(shapes), *rally_items(rally, "px4")], notes)
