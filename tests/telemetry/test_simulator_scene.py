"""What rays meet in a simulated world, and how far things are, against containment and other formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from planning.terrain.raycast import raycast
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import SceneTerrain
from telemetry.simulation.simulator.scene.ray_bundle import GROUND, NOTHING
from tests.reference.surface_samples import sample
from tests.seeds import seeds
from tests.telemetry.scenes import in_the_air, world

metres = st.floats(-20.0, 20.0)
sizes = st.floats(0.2, 12.0)
SHAPES = {
    "box": lambda a, b, h, turn: {"type": "box", "size_m": [2 * a, 2 * b, h], "heading_deg": turn},
    "cylinder": lambda a, b, h, turn: {"type": "cylinder", "radius_m": a, "height_m": h},
}
INSIDE = {
    "box": lambda x, y, a, b: (abs(x) <= a) & (abs(y) <= b),
    "cylinder": lambda x, y, a, b: x * x + y * y <= a * a,
}


def cast(scene, origin, direction, *, most_m: float = 200.0, luck: float = 0.5):
    direction = np.array([direction], dtype=float)
    direction /= np.linalg.norm(direction)
    origin = np.array(origin, dtype=float)
    near = scene.ahead(origin, direction[0], within_m=most_m, half_angle_rad=math.pi)
    hits = scene.cast(origin, direction, np.array([luck]), most_m=most_m, near=near)
    return float(hits.distance_m[0]), int(hits.what[0])


@pytest.mark.parametrize("kind", list(SHAPES))
@settings(max_examples=60)
@given(a=sizes, b=sizes, height=sizes, turn=st.floats(-180, 180), start=st.tuples(metres, metres, metres),
       end=st.tuples(metres, metres, metres))  # fmt: skip
def test_a_ray_stops_where_it_first_is_inside(kind, a, b, height, turn, start, end) -> None:
    scene = in_the_air({**SHAPES[kind](a, b, height, turn), "at_m": [0, 0], "base_m": -3.0})
    direction = np.array(end) - np.array(start)
    length = np.linalg.norm(direction)
    if length < 1.0:
        return
    distance, what = cast(scene, start, direction, most_m=float(length))
    at = np.linspace(0.0, 1.0, 4001)
    p = np.array(start) + at[:, None] * direction
    t = math.radians(turn)
    x, y = p[:, 0] * math.cos(t) - p[:, 1] * math.sin(t), p[:, 0] * math.sin(t) + p[:, 1] * math.cos(t)
    inside = INSIDE[kind](x, y, a, b) & (p[:, 2] >= -3.0) & (p[:, 2] <= height - 3.0)
    if inside.any():
        first = at[np.argmax(inside)] * length
        assert what == 0
        assert first - length / 4000 - 1e-6 <= distance <= first + 1e-6
    elif what == 0:  # a corner that is cut between two samples
        hit = np.array(start) + distance * direction / length
        assert abs(float(scene.distance_m(hit[None])[0])) < 1e-6


@given(st.floats(0.5, 8.0), st.floats(1.0, 8.0), st.floats(0, 2 * math.pi), st.floats(-1.2, 1.2))
def test_a_solid_crown_is_met_on_its_ellipsoid(radius, height, around, upwards) -> None:
    tree = {"type": "tree", "at_m": [0, 0], "height_m": 2 * height, "crown_base_m": 0.0, "crown_radius_m": radius}
    scene = in_the_air({**tree, "leaf_path_m": 0, "trunk_radius_m": 0.01})
    outwards = np.array([math.cos(upwards) * math.sin(around), math.cos(upwards) * math.cos(around), math.sin(upwards)])
    middle = np.array([0.0, 0.0, height])
    distance, _ = cast(scene, middle + 60 * outwards, -outwards)
    scale = math.sqrt((math.cos(upwards) / radius) ** 2 + (math.sin(upwards) / height) ** 2)
    assert distance == pytest.approx(60 - 1 / scale, abs=0.02)


def test_rays_get_into_leaves_as_far_as_luck_has_it() -> None:
    scene = in_the_air(
        {"type": "tree", "at_m": [0, 20], "height_m": 10, "crown_base_m": 2, "crown_radius_m": 3, "leaf_path_m": 1},
        {"type": "wall", "from_m": [-9, 40], "to_m": [9, 40], "height_m": 20},
    )
    assert cast(scene, (0.5, 0, 6), (0, 1, 0), luck=math.exp(-2))[0] == pytest.approx(
        20 - 3 * math.sqrt(1 - (0.5 / 3) ** 2) + 2, abs=1e-9
    )
    past, what = cast(scene, (0.5, 0, 6), (0, 1, 0), luck=1e-9)
    assert past == pytest.approx(39.85)
    assert scene.shapes[scene.placed.owner[what]].name == "wall 1"


def test_what_is_too_far_or_in_no_way_is_not_met() -> None:
    scene = in_the_air({"type": "cylinder", "at_m": [0, 30], "radius_m": 1, "height_m": 20})
    assert cast(scene, (0, 0, 5), (0, 1, 0)) == (29.0, 0)
    assert cast(scene, (0, 0, 5), (0, 1, 0), most_m=28.9) == (math.inf, NOTHING)
    assert cast(scene, (0, 0, 5), (0, -1, 0)) == (math.inf, NOTHING)


def hill(seed: int, rows: int = 40, columns: int = 55) -> tuple[Dsm, SceneTerrain]:
    """A rough surface with unknown cells, whose frame is its own grid with the south-west corner at 0, 0."""
    random = np.random.default_rng(seed)
    elevation = random.uniform(0, 6, (rows, columns)).astype(np.float32)
    elevation[random.random((rows, columns)) < 0.05] = np.nan
    size = 1.5
    dsm = Dsm(elevation, Affine(size, 0, 0, 0, -size, rows * size), CRS.from_epsg(32633), None, "")
    to_cells = np.array([[1 / size, 0, 0], [0, -1 / size, rows]])
    return dsm, SceneTerrain(elevation, to_cells, -2.0)


@settings(max_examples=60)
@given(st.integers(0, 3), st.tuples(st.floats(-20, 100), st.floats(-20, 80), st.floats(-1, 12)),
       st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.6, 0.6)))  # fmt: skip
def test_the_ground_is_met_where_the_planning_floor_meets_it(seed, origin, direction) -> None:
    dsm, terrain = hill(seed)
    direction = np.array(direction)
    if np.linalg.norm(direction) < 0.1:
        return
    direction /= np.linalg.norm(direction)
    expected = raycast(dsm, np.array(origin), direction, floor_alt_dsm_m=-2.0)
    found, what = cast(world(terrain=terrain), origin, direction, most_m=500.0)
    if expected is None or expected.distance > 500.0:
        assert what == NOTHING
    else:
        assert what == GROUND
        assert found == pytest.approx(expected.distance, abs=1e-5)


@seeds(4)
def test_of_many_things_the_first_on_its_way_is_met(seed: int) -> None:
    random = np.random.default_rng(seed)
    _, terrain = hill(seed)
    shapes = [
        {"type": "tree", "at_m": at, "height_m": 9, "crown_base_m": 2, "crown_radius_m": 2.5, "leaf_path_m": 1}
        if k % 2
        else {"type": "box", "at_m": at, "size_m": [4, 2, 6], "heading_deg": 9 * k}
        for k, at in enumerate(random.uniform(0, 55, (40, 2)).tolist())
    ]
    scene = world(*shapes, terrain=terrain)
    origin, luck = np.array([27.0, 27.0, 7.0]), random.uniform(0.01, 0.99, 800)
    rays = random.standard_normal((800, 3)) * (1.0, 1.0, 0.2)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    near = scene.ahead(origin, np.array([0.0, 1.0, 0.0]), within_m=200.0, half_angle_rad=math.pi)
    together = scene.cast(origin, rays, luck, most_m=200.0, near=near)
    alone = [scene.cast(origin, rays, luck, most_m=200.0, near=near[k : k + 1]) for k in range(len(near))]
    np.testing.assert_array_equal(together.distance_m, np.min([hits.distance_m for hits in alone], axis=0))
    for hits in alone:
        first = (hits.distance_m == together.distance_m) & (hits.what >= 0)
        np.testing.assert_array_equal(together.what[first], hits.what[first])
    assert {int(what) for what in together.what} > {GROUND, NOTHING}


def test_a_surface_model_lies_in_the_frame_as_its_coordinates_say(shared_data) -> None:
    from planning.terrain.geotiff import read_dsm

    dsm = read_dsm(next((shared_data / "dsm" / "coromandel").glob("*.tif")))
    west, south, east, north = dsm.bounds_m
    lat, lon = dsm.lat_lon_from_xy(np.array([[(west + east) / 2, (south + north) / 2]]))[0]
    frame = NeuFrame(float(lat), float(lon), 800.0)
    terrain = SceneTerrain.from_dsm(dsm, frame)
    random = np.random.default_rng(0)
    places = random.uniform(-50, 50, (200, 2))
    geodetic = np.array([frame.geodetic_from_neu((n, e, 0.0))[:2] for e, n in places])
    rows, columns = dsm.fractional_cell(dsm.xy_from_lat_lon(geodetic))
    found = terrain.to_cells @ np.column_stack([places, np.ones(200)]).T
    assert np.abs(found - [columns, rows]).max() * dsm.resolution_m < 0.01
    assert terrain.up_m(0.0, 0.0) == 0.0


def test_a_home_beside_the_surface_model_is_refused() -> None:
    dsm, _ = hill(0)
    with pytest.raises(ParameterError, match="knows no height at"):
        SceneTerrain.from_dsm(dsm, NeuFrame(10.0, 10.0, 0.0))


@settings(max_examples=25)
@given(st.lists(st.tuples(metres, metres, metres), min_size=1, max_size=5), st.floats(-180, 180))
def test_distances_are_those_to_the_nearest_sample_of_the_surfaces(points, turn) -> None:
    scene = in_the_air(
        {"type": "box", "at_m": [4, 0], "size_m": [3, 6, 5], "heading_deg": turn},
        {"type": "cylinder", "at_m": [-5, 2], "radius_m": 1.5, "height_m": 4, "base_m": -2},
    )
    samples = sample(scene.placed.rows, 0.15, np.random.default_rng(0))
    # Samples leave out undersides: look from above them only.
    p = np.array([(x, y, abs(z)) for x, y, z in points])
    nearest = np.linalg.norm(p[:, None] - samples[None], axis=2).min(axis=1)
    outside = scene.distance_m(p) > 0
    assert np.allclose(scene.distance_m(p)[outside], nearest[outside], atol=0.6)
    assert (scene.distance_m(p)[outside] <= nearest[outside] + 1e-6).all()
    assert np.abs(scene.surface_distance_m(samples)).max() < 1e-6


def test_the_ground_counts_for_surfaces_and_not_for_distances() -> None:
    empty = world()
    assert np.isinf(empty.distance_m(np.array([[0.0, 0.0, 3.0]]))).all()
    assert empty.surface_distance_m(np.array([[0.0, 0.0, 3.0], [5.0, 5.0, -1.0]])) == pytest.approx([3.0, 1.0])


def test_on_a_slope_things_reach_down_to_the_ground() -> None:
    up = np.repeat(np.arange(40, dtype=np.float32)[:, None], 40, axis=1)
    slope = SceneTerrain(up, np.array([[1.0, 0.0, 20.0], [0.0, -1.0, 20.0]]), 0.0)
    scene = world(
        {"type": "box", "at_m": [0.5, 0.5], "size_m": [4, 4, 10]},
        {"type": "box", "at_m": [0.5, 0.5], "size_m": [4, 4, 1], "base_m": 20},
        {"type": "box", "at_m": [0.5, 0.5], "size_m": [4, 4, 1], "base_m": 20, "above": "origin"},
        terrain=slope,
    )
    low, high = scene.placed.rows[:, 3], scene.placed.rows[:, 4]
    assert high == pytest.approx([29.0, 40.0, 21.0])
    assert low[0] <= 17.0
    assert low[1:] == pytest.approx([39.0, 20.0])


def test_only_what_is_near_and_ahead_is_looked_at_nearest_first() -> None:
    scene = in_the_air(
        *({"type": "cylinder", "at_m": [e, n], "radius_m": 1, "height_m": 10} for e, n in
          [(0, 60), (0, 20), (0, -20), (20, 0), (0, 200)])
    )  # fmt: skip
    ahead = scene.ahead(np.zeros(3), np.array([0.0, 1.0, 0.0]), within_m=120.0, half_angle_rad=math.radians(60))
    assert ahead.tolist() == [1, 0]


def test_touching_and_standing() -> None:
    scene = world({"type": "box", "name": "Shed", "at_m": [0, 10], "size_m": [4, 4, 3]},
                  {"type": "tree", "name": "Oak", "at_m": [20, 0], "height_m": 9, "crown_radius_m": 3})  # fmt: skip
    assert scene.touching((0.0, 7.75, 1.0), 0.3) == "Shed"
    assert scene.touching((0.0, 7.65, 1.0), 0.3) is None
    assert scene.touching((17.2, 0.0, 6.0), 0.3) == "Oak"
    assert scene.top_under_m((0.0, 10.0, 3.5)) == 3.0
    assert scene.top_under_m((0.0, 10.0, 2.5)) == -math.inf
    assert scene.top_under_m((22.0, 0.0, 20.0)) == -math.inf
