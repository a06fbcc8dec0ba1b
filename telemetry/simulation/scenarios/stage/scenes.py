"""The places of the papers' field tests, as world files would describe them. The vehicle starts at 0, 0."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from telemetry.simulation.scenarios.stage.course import Course, Waypoint
from telemetry.simulation.scenarios.stage.world_objects import (
    Object,
    box,
    cylinder,
    reflector,
    tree,
    wall,
    world_document,
)
from telemetry.simulation.simulator.neu_frame import NeuFrame

VALLEY = NeuFrame(43.66, 11.45, 150.0)
"""Where the papers flew, or near it."""
NORTH, EAST, SOUTH, WEST = 0.0, math.pi / 2, math.pi, 3 * math.pi / 2


@dataclass(frozen=True, slots=True)
class Hill:
    """A rise of the ground, round, as high as ``height_m`` in its middle."""

    at_m: tuple[float, float]
    height_m: float
    width_m: float


@dataclass(frozen=True, slots=True)
class ScenarioScene:
    """What stands where, and the flight that looks at it."""

    document: dict[str, Any]
    course: Course
    hills: tuple[Hill, ...] = ()


REFLECTOR_AHEAD_M, REFLECTOR_HIGHER_M = 68.0, 3.0
LEVEL_FLIGHT_M = 2.0


def corner_reflector() -> ScenarioScene:
    """Miccinesi 2022, figs 10-11: a naval corner reflector on a small hill, lateral flight left and right."""
    post_m = 0.5
    place = (0.0, REFLECTOR_AHEAD_M)
    document = world_document("corner reflector", [reflector("reflector", place, post_m, 0.2)])
    low, high, near = LEVEL_FLIGHT_M, LEVEL_FLIGHT_M + 2.0, REFLECTOR_AHEAD_M - 30.0
    course = Course(
        (
            Waypoint((0.0, 0.0, low), 3.0, NORTH, loiter_s=4.0),
            Waypoint((0.0, near, low), 3.0, NORTH),
            Waypoint((-10.0, near, low), 2.0, NORTH),
            Waypoint((10.0, near, low), 2.0, NORTH),
            Waypoint((0.0, near, high), 2.0, NORTH),
            Waypoint((0.0, 0.0, high), 3.0, NORTH),
        ),
        takeoff_m=low,
        end="land",
    )
    return ScenarioScene(document, course, (Hill(place, REFLECTOR_HIGHER_M - post_m, 8.0),))


WOOD_FROM_M, WOOD_TO_M, WOOD_HALF_WIDTH_M = 60.0, 84.0, 32.0
TREE_SPACING_M = 4.5


def wood(seed: int) -> ScenarioScene:
    """Miccinesi 2022, fig. 16: towards a wood from 60 m, climbing, then along its edge; bushes before it."""
    random = np.random.default_rng(seed)
    objects: list[Object] = []
    for row, north in enumerate(np.arange(WOOD_FROM_M, WOOD_TO_M, TREE_SPACING_M)):
        for east in np.arange(-WOOD_HALF_WIDTH_M, WOOD_HALF_WIDTH_M + 0.1, TREE_SPACING_M):
            at = _moved((east + TREE_SPACING_M / 2 * (row % 2), north), random, 1.0)
            height_m = random.uniform(9.0, 15.0)
            objects.append(tree(f"tree {len(objects)}", at, height_m, random.uniform(1.6, 2.8), 0.25 * height_m))
    for _ in range(14):
        at = (float(random.uniform(-25.0, 25.0)), float(random.uniform(32.0, 55.0)))
        height_m = random.uniform(0.8, 1.8)
        objects.append(tree(f"bush {len(objects)}", at, height_m, random.uniform(0.5, 1.2), 0.1))
    close = WOOD_FROM_M - 18.0
    course = Course(
        (
            Waypoint((0.0, 0.0, 4.0), 3.0, NORTH, loiter_s=3.0),
            Waypoint((0.0, close / 2, 6.0), 3.0, NORTH),
            Waypoint((0.0, close, 8.0), 3.0, NORTH),
            Waypoint((-15.0, close, 8.0), 2.0, NORTH),
            Waypoint((15.0, close, 8.0), 2.0, NORTH),
            Waypoint((0.0, 0.0, 8.0), 4.0, NORTH),
        ),
        takeoff_m=4.0,
        end="land",
    )
    return ScenarioScene(world_document("wood", objects), course)


def ruined_building(seed: int) -> ScenarioScene:
    """Miccinesi 2022, figs 19-21: a roofless building scanned along its face, twice, and turned before at the end."""
    random = np.random.default_rng(seed)
    objects = [
        *_facade(random, 40.0),
        wall("left side", (-16.0, 40.0), (-16.0, 54.0), float(random.uniform(5.0, 8.0)), thickness_m=0.6),
        wall("right side", (16.0, 40.0), (16.0, 54.0), float(random.uniform(5.0, 8.0)), thickness_m=0.6),
        wall("back", (-16.0, 54.0), (16.0, 54.0), float(random.uniform(6.0, 9.0)), thickness_m=0.6),
        box("courtyard house", (-30.0, 33.0), (9.0, 6.0, 5.0), material="stone"),
        box("courtyard barn", (-32.0, 18.0), (7.0, 9.0, 4.5), heading_deg=12.0, material="stone"),
    ]
    objects = [o | {"material": "stone"} for o in objects]
    first, second, up = 18.0, 28.0, 3.5
    turn = tuple(Waypoint((17.0, first, up), 2.0, heading, loiter_s=4.0) for heading in (EAST, SOUTH, WEST, NORTH))
    course = Course(
        (
            Waypoint((-17.0, first, up), 3.0, NORTH),
            Waypoint((17.0, first, up), 2.0, NORTH),
            *turn,
            Waypoint((17.0, second, up + 1.5), 2.0, NORTH),
            Waypoint((-17.0, second, up + 1.5), 2.0, NORTH),
            Waypoint((0.0, 0.0, up + 1.5), 4.0, NORTH),
        ),
        takeoff_m=up,
        end="land",
    )
    return ScenarioScene(world_document("ruined building", objects), course)


def _facade(random: np.random.Generator, north: float) -> list[Object]:
    """Bays of a broken front wall, a gap for a door between them, pillars still standing."""
    objects: list[Object] = []
    for number, west in enumerate(np.arange(-16.0, 16.0, 4.0)):
        low, whole = (float(west), north), float(random.uniform(6.0, 9.5))
        if number == 4:
            objects.append(wall("lintel", low, (float(west) + 4.0, north), whole - 3.0, base_m=3.0, thickness_m=0.6))
        else:
            objects.append(wall(f"bay {number}", low, (float(west) + 4.0, north), whole, thickness_m=0.6))
        objects.append(cylinder(f"pillar {number}", (float(west), north - 0.5), 0.35, whole + 0.5))
    return objects


CASTLE_SPEED_M_S, CASTLE_CLIMB_M_S = 3.0, 1.5
CASTLE_HEIGHT_M, CASTLE_AHEAD_M = 6.0, 40.0
STEEPEST_DEG = 60.0


def castle_building(seed: int, *, ahead_m: float = CASTLE_AHEAD_M) -> ScenarioScene:
    """Bigazzi 2022, figs 11-12: straight into a building and back; its face is up to 60 degrees off square.

    ``ahead_m``: the middle of the face.
    """
    random = np.random.default_rng(seed)
    incidence_deg = float(random.uniform(-STEEPEST_DEG, STEEPEST_DEG))
    height_m, width_m, depth_m = random.uniform(9.0, 14.0), random.uniform(16.0, 26.0), random.uniform(8.0, 14.0)
    turn = math.radians(incidence_deg)
    # The middle of the face lies on the path, off its own middle by up to a quarter of its width.
    aside = random.uniform(-0.25, 0.25) * width_m
    middle = (
        aside * math.cos(turn) + depth_m / 2 * math.sin(turn),
        ahead_m - aside * math.sin(turn) + depth_m / 2 * math.cos(turn),
    )
    objects = [
        box(
            "building",
            (float(middle[0]), float(middle[1])),
            (float(width_m), float(depth_m), float(height_m)),
            heading_deg=incidence_deg,
            material="stone",
        ),
        cylinder("tower", (-34.0, 62.0), 3.0, 17.0, material="stone"),
    ]
    beyond = ahead_m + 30.0
    course = Course(
        (
            Waypoint((0.0, beyond, CASTLE_HEIGHT_M), CASTLE_SPEED_M_S),
            Waypoint((0.0, 0.0, CASTLE_HEIGHT_M), CASTLE_SPEED_M_S),
        ),
        takeoff_m=CASTLE_HEIGHT_M,
    )
    return ScenarioScene(world_document("castle building", objects), course)


def _moved(at: tuple[float, float], random: np.random.Generator, by_m: float) -> tuple[float, float]:
    east, north = random.uniform(-by_m, by_m, 2)
    return float(at[0] + east), float(at[1] + north)
