"""World files: what they hold, and what is refused with which words."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.errors import FormatError, ParameterError
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.motion import Motion
from telemetry.simulation.simulator.scene.world_file import parse_world, read_world
from telemetry.simulation.simulator.scene.world_shapes import Box, CornerReflector, Cylinder, Tree
from tests.telemetry.scenes import FRAME

DOCS = Path(__file__).resolve().parents[2] / "docs" / "worlds.md"
BOX = {"type": "box", "at_m": [1, 2], "size_m": [3, 4, 5]}
PATH = {"points_m": [[0, 0], [0, 30]], "speed_m_s": 4}


def document(*objects: Any, **more: Any) -> dict[str, Any]:
    return {"format": "hedgehop-world", "version": 1, "objects": list(objects), **more}


def moving(**path: Any) -> dict[str, Any]:
    return {"type": "box", "size_m": [1, 1, 1], "path": PATH | path}


def test_the_example_of_the_documentation_is_read() -> None:
    example = DOCS.read_text(encoding="utf-8").split("```json")[1].split("```")[0]
    world = parse_world(json.loads(example), folder=Path("/somewhere"))
    kinds = [type(shape) for shape in world.shapes]
    assert kinds == [Box, Box, Box, Cylinder, Tree, CornerReflector, Box]
    assert world.name == "Yard with a crane"
    assert world.dsm == Path("/somewhere/hillside.tif")
    assert world.shapes[2].name == "wall 2"
    assert world.shapes[-1].motion == Motion(((-30.0, 50.0), (40.0, 62.0)), 4.0)
    assert world.shapes[0].motion is None


def test_what_is_left_out_has_its_documented_value() -> None:
    tree, reflector = parse_world(
        document(
            {"type": "tree", "at_m": [0, 0], "height_m": 10, "crown_radius_m": 2},
            {"type": "corner_reflector", "at_m": [0, 68], "base_m": 3},
        )
    ).shapes
    assert isinstance(tree, Tree)
    assert isinstance(reflector, CornerReflector)
    assert (tree.crown_base_m, tree.trunk_radius_m, tree.leaf_path_m, tree.above) == (3.5, 0.15, 0.6, "ground")
    assert reflector.cross_section_m2 == pytest.approx(28, rel=0.01)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], "world: An object in braces belongs here, not a list of 0."),
        ({}, 'world: The field "format" is missing.'),
        ({"format": "other"}, 'world.format: One of hedgehop-world belongs here, not "other".'),
        (document(version=2), "world.version: The world file is of a newer version."),
        (document(colour="red"), 'world: There is no field "colour" here.'),
        (document(objects=3), "world.objects: A list of at most 10000 objects belongs here."),
        (document(5), "world: objects[0]: An object in braces belongs here, not 5."),
        (document({"type": "ball"}), "world: objects[0].type: One of box, wall, cylinder, tree, corner_reflector"),
        (document(BOX, {**BOX, "size_m": [3, 4]}), "world: objects[1].size_m: 3 numbers in brackets belong here"),
        (document({**BOX, "size_m": [3, 4, -4]}), "world: objects[0].size_m[2]: -4 is not between 0.01 and 2000."),
        (document({**BOX, "size_m": [3, 4, True]}), "world: objects[0].size_m[2]: A number belongs here, not True."),
        (document({**BOX, "at_m": [1e9, 0]}), "world: objects[0].at_m[0]: 1000000000.0 is not between"),
        (document({**BOX, "at_m": [10**400, 0]}), "a number of many digits"),
        (document({**BOX, "hight": 3}), 'world: objects[0]: There is no field "hight" here.'),
        (document({**BOX, "material": "cheese"}), 'world: objects[0].material: One of concrete, stone'),
        (document({**BOX, "above": "sea"}), "world: objects[0].above: One of ground, origin"),
        (
            document({"type": "wall", "from_m": [1, 1], "to_m": [1, 1], "height_m": 2}),
            "world: objects[0].to_m: The wall has no length.",
        ),
        (
            document({"type": "tree", "at_m": [0, 0], "height_m": 5, "crown_radius_m": 2, "crown_base_m": 6}),
            "world: objects[0].crown_base_m: 6 is not between 0 and 4.995.",
        ),
        (document({**BOX, "path": PATH}), "world: objects[0].at_m: What moves along a path stands at no place."),
        (document(moving(points_m=[[0, 0]])), "world: objects[0].path.points_m: 2 to 100 pairs of numbers belong here"),
        (document(moving(points_m=[[0, 0], [1]])), "objects[0].path.points_m[1]: 2 numbers in brackets belong here"),
        (document(moving(points_m=[[0, 0], [0, 1], [0, 1]])), "objects[0].path.points_m[2]: The point before is the"),
        (document(moving(speed_m_s=0)), "world: objects[0].path.speed_m_s: 0 is not between 0.01 and 100."),
        (document(moving(repeat="often")), "objects[0].path.repeat: One of back_and_forth, around, once belongs"),
        (document(moving(height_m=3)), 'world: objects[0].path: There is no field "height_m" here.'),
        (document(*[moving()] * 101), "world.objects: At most 100 objects may move."),
        (document(origin={"lat_deg": 120, "lon_deg": 5}), "world: origin: Latitude 120°, longitude 5°"),
        (document(origin={"lat_deg": 12}), 'world: origin: The field "lon_deg" is missing.'),
        (document(dsm=""), "world.dsm: The name of a surface model belongs here."),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_place(data: Any, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        parse_world(data)
    assert words in str(caught.value)


def test_a_file_is_named_in_its_errors(tmp_path: Path) -> None:
    path = tmp_path / "yard.json"
    with pytest.raises(FormatError, match="cannot be read"):
        read_world(path)
    path.write_text('{"format": "hedgehop-world", "version": NaN}', encoding="utf-8")
    with pytest.raises(FormatError, match=r"yard\.json: NaN is no JSON number"):
        read_world(path)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(FormatError, match=r"yard\.json: This is not valid JSON"):
        read_world(path)
    path.write_text(json.dumps(document({**BOX, "at_m": None})), encoding="utf-8")
    with pytest.raises(FormatError, match=r"yard\.json: objects\[0\]\.at_m: 2 numbers in brackets"):
        World.load(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["type", "at_m", "size_m", "height_m", "name", "objects"]), inner, max_size=4)
    ),
    max_leaves=8,
)


@given(JSON, st.sampled_from(["box", "wall", "cylinder", "tree", "corner_reflector"]))
def test_anything_is_read_or_refused_in_words(value: Any, kind: str) -> None:
    items = [value] if not isinstance(value, dict) else [{**value, "type": kind}]
    said: FormatError | None = None
    shapes = 0
    try:
        shapes = len(parse_world(document(*items)).shapes)
    except FormatError as error:
        said = error
    assert shapes == 1 if said is None else said.where.startswith("world") and said.what.endswith(".")


def test_the_origin_may_be_elsewhere_than_the_vehicle() -> None:
    lat, lon, _ = FRAME.geodetic_from_neu((100.0, -40.0, 0.0))
    world = World.parse(document(BOX, origin={"lat_deg": lat, "lon_deg": lon}), frame=FRAME)
    assert world.placed.rows[0, 1:3] == pytest.approx([-39.0, 102.0], abs=1e-6)
    own = World.parse(document(BOX, origin={"lat_deg": lat, "lon_deg": lon}))
    assert (own.frame.lat_deg, own.frame.lon_deg) == (lat, lon)
    assert np.array_equal(own.placed.rows[0, 1:3], [1.0, 2.0])


def test_a_world_of_another_place_is_refused() -> None:
    with pytest.raises(ParameterError, match="km from the vehicle's home"):
        World.parse(document(BOX, origin={"lat_deg": -37.0, "lon_deg": 175.0}), frame=FRAME)
