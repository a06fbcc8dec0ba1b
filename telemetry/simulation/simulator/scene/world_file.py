"""World files: what stands in a simulated world, as strict JSON (docs/worlds.md)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal, TypedDict, cast

from planning.errors import FormatError
from planning.formats.safe_text import MAX_BYTES, check_lat_lon, clean_name, decode_text, load_json
from telemetry.simulation.simulator.scene.fields import Fields
from telemetry.simulation.simulator.scene.motion import REPEATS, Motion, Pair, Repeat
from telemetry.simulation.simulator.scene.world_shapes import (
    MATERIALS,
    Above,
    AnyShape,
    Box,
    CornerReflector,
    Cylinder,
    Tree,
    wall,
)

FORMAT, VERSION = "hedgehop-world", 1
MOST_OBJECTS = 10_000
FAR_M = 20_000.0
_THIN_M, _LARGE_M = 0.01, 2_000.0
MOST_MOVING, MOST_POINTS = 100, 100
_SLOW_M_S, _FAST_M_S = 0.01, 100.0


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the world's east 0, north 0 is."""

    lat_deg: float
    lon_deg: float


@dataclass(frozen=True, slots=True)
class WorldFile:
    name: str
    origin: Origin | None
    """None: where the vehicle is switched on."""
    dsm: Path | None
    shapes: tuple[AnyShape, ...]


def read_world(path: Path) -> WorldFile:
    """Raises FormatError naming the place in the file."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FormatError(
                f"The file has more than {MAX_BYTES} bytes.", where=path.name, advice="Choose a world file."
            )
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(
            f"The world file cannot be read ({error.strerror}).", where=str(path), advice="Check its name."
        ) from error
    return parse_world(load_json(path.name, decode_text(path.name, data)), where=path.name, folder=path.parent)


def parse_world(data: object, *, where: str = "world", folder: Path | None = None) -> WorldFile:
    """A parsed JSON document. ``folder`` is what the surface model's name counts from."""
    fields = Fields(data, where)
    fields.word("format", (FORMAT,))
    if fields.number("version", 1, 1e6) != VERSION:
        raise FormatError(
            "The world file is of a newer version.", where=f"{where}.version", advice=f"Write version {VERSION}."
        )
    name = clean_name(fields.text("name", ""))
    origin = _origin(fields.raw("origin", None), f"{where}: origin")
    dsm = fields.raw("dsm", None)
    if dsm is not None and (not isinstance(dsm, str) or not dsm or "\x00" in dsm):
        raise FormatError("The name of a surface model belongs here.", where=f"{where}.dsm")
    objects = fields.raw("objects")
    fields.done()
    if not isinstance(objects, list) or len(objects) > MOST_OBJECTS:
        raise FormatError(f"A list of at most {MOST_OBJECTS} objects belongs here.", where=f"{where}.objects")
    shapes = tuple(_shape(item, f"{where}: objects[{i}]", i) for i, item in enumerate(objects))
    if sum(shape.motion is not None for shape in shapes) > MOST_MOVING:
        raise FormatError(f"At most {MOST_MOVING} objects may move.", where=f"{where}.objects")
    return WorldFile(name, origin, (folder or Path()) / dsm if dsm else None, shapes)


def _origin(value: object, where: str) -> Origin | None:
    if value is None:
        return None
    fields = Fields(value, where)
    lat_deg, lon_deg = fields.number("lat_deg", -1e4, 1e4), fields.number("lon_deg", -1e4, 1e4)
    fields.done()
    return Origin(*check_lat_lon(lat_deg, lon_deg, where))


def _shape(value: object, where: str, number: int) -> AnyShape:
    fields = Fields(value, where)
    kind = fields.word("type", _KINDS)
    name = clean_name(fields.text("name", "")) or f"{kind.replace('_', ' ')} {number}"
    shape = _KINDS[kind](fields, name)
    fields.done()
    return shape


class _Base(TypedDict):
    base_m: float
    above: Above


class _Standing(_Base):
    at_m: Pair
    motion: Motion | None


def _base(fields: Fields) -> _Base:
    above = cast(Literal["ground", "origin"], fields.word("above", ("ground", "origin"), "ground"))
    return {"base_m": fields.number("base_m", -FAR_M, FAR_M, 0.0), "above": above}


def _standing(fields: Fields) -> _Standing:
    """At a place, or on a path whose first point it is."""
    path = fields.raw("path", None)
    if path is None:
        at_m, motion = _place(fields), None
    elif fields.raw("at_m", None) is not None:
        raise FormatError(
            "What moves along a path stands at no place.", where=f"{fields.where}.at_m", advice="Leave it out."
        )
    else:
        motion = _motion(path, f"{fields.where}.path")
        at_m = motion.points_m[0]
    return {"at_m": at_m, "motion": motion, **_base(fields)}


def _motion(value: object, where: str) -> Motion:
    fields = Fields(value, where)
    points = fields.pairs("points_m", MOST_POINTS, -FAR_M, FAR_M)
    for i, (one, other) in enumerate(pairwise(points), 1):
        if math.dist(one, other) < _THIN_M:
            raise FormatError("The point before is the same.", where=f"{where}.points_m[{i}]", advice="Leave it out.")
    motion = Motion(
        points,
        fields.number("speed_m_s", _SLOW_M_S, _FAST_M_S),
        cast(Repeat, fields.word("repeat", REPEATS, REPEATS[0])),
        fields.number("after_s", 0.0, 1e6, 0.0),
    )
    fields.done()
    return motion


def _place(fields: Fields, name: str = "at_m") -> tuple[float, float]:
    return fields.pair(name, -FAR_M, FAR_M)


def _size(fields: Fields, name: str, default: object = None) -> float:
    return fields.number(name, _THIN_M, _LARGE_M, *(() if default is None else (default,)))


def _material(fields: Fields) -> str:
    return fields.word("material", MATERIALS, "concrete")


def _box(fields: Fields, name: str) -> Box:
    standing = _standing(fields)
    (width_m, depth_m, height_m) = fields.numbers("size_m", 3, _THIN_M, _LARGE_M)
    return Box(
        name=name,
        **standing,
        size_m=(width_m, depth_m, height_m),
        heading_rad=math.radians(fields.number("heading_deg", -360.0, 360.0, 0.0)),
        material=_material(fields),
    )


def _wall(fields: Fields, name: str) -> Box:
    base, start_m, end_m = _base(fields), _place(fields, "from_m"), _place(fields, "to_m")
    if math.dist(start_m, end_m) < _THIN_M:
        raise FormatError("The wall has no length.", where=f"{fields.where}.to_m", advice="Give another end.")
    return wall(
        name,
        start_m,
        end_m,
        height_m=_size(fields, "height_m"),
        thickness_m=_size(fields, "thickness_m", 0.3),
        material=_material(fields),
        **base,
    )


def _cylinder(fields: Fields, name: str) -> Cylinder:
    return Cylinder(
        name=name,
        **_standing(fields),
        radius_m=_size(fields, "radius_m"),
        height_m=_size(fields, "height_m"),
        material=_material(fields),
    )


def _tree(fields: Fields, name: str) -> Tree:
    standing, height_m = _standing(fields), _size(fields, "height_m")
    return Tree(
        name=name,
        **standing,
        height_m=height_m,
        crown_radius_m=_size(fields, "crown_radius_m"),
        crown_base_m=fields.number("crown_base_m", 0.0, height_m - _THIN_M / 2, 0.35 * height_m),
        trunk_radius_m=_size(fields, "trunk_radius_m", 0.15),
        leaf_path_m=fields.number("leaf_path_m", 0.0, 100.0, 0.6),
    )


def _reflector(fields: Fields, name: str) -> CornerReflector:
    return CornerReflector(
        name=name,
        **_standing(fields),
        edge_m=fields.number("edge_m", _THIN_M, 2.0, 0.1),
    )


_KINDS: dict[str, Callable[[Fields, str], AnyShape]] = {
    "box": _box,
    "wall": _wall,
    "cylinder": _cylinder,
    "tree": _tree,
    "corner_reflector": _reflector,
}
