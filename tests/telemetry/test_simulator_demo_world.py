"""The demo's world against the demo's plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.arrays import F64
from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.missions.vehicle_profile import load_profile
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from telemetry.simulation.simulator.demo_world import demo_world, write_demo_world
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World

RTL_M = 60.0


@pytest.fixture(scope="module")
def flight() -> Plan:
    profile = replace(load_profile("generic-quad"), rtl_height_m=RTL_M)
    return plan_mission(demo_dsm(), PlanRequest(pois=demo_pois(), profile=profile))


@pytest.fixture(scope="module")
def scene(flight: Plan, tmp_path_factory: pytest.TempPathFactory) -> World:
    path = tmp_path_factory.mktemp("demo") / "world.json"
    write_demo_world(path)
    home = flight.mission.home
    return World.load(path, frame=NeuFrame(home.lat_deg, home.lon_deg, home.alt_dsm_m), dsm=demo_dsm())


@pytest.fixture(scope="module")
def line(flight: Plan, scene: World) -> F64:
    """(N, 3) the planned path in the world's frame."""
    lat_lon = demo_dsm().lat_lon_from_xy(np.asarray(flight.path.xy_m))
    places = [scene.frame.neu_from_geodetic(lat, lon, float(alt))
              for (lat, lon), alt in zip(lat_lon.tolist(), flight.path.alt_dsm_m, strict=True)]  # fmt: skip
    return np.array(places)[:, [1, 0, 2]]


def alone(scene: World, name: str) -> World:
    objects = [item for item in demo_world()["objects"] if item["name"] == name]  # type: ignore[union-attr,index]
    return World.parse({**demo_world(), "objects": objects}, frame=scene.frame, terrain=scene.terrain)


def test_it_is_the_same_every_time(tmp_path: Path) -> None:
    for name in ("a.json", "b.json"):
        write_demo_world(tmp_path / name)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_the_building_stands_four_to_six_metres_too_high_on_the_line(scene: World, line: F64) -> None:
    building = alone(scene, "New building")
    inside = line[building.distance_m(line) == 0]
    assert 4.0 < len(inside) * 0.1 < 12.0
    over = building.placed.rows[0, 4] - inside[:, 2]
    assert over.min() > 4.0
    assert over.max() < 6.0


@pytest.mark.parametrize(
    ("name", "least_m", "most_m"),
    [("Young tree 1", 5, 9), ("Young tree 2", 5, 9), ("Young tree 3", 5, 9), ("Crane", 40, 90), ("Crane jib", 40, 90)],
)
def test_everything_else_is_beside_the_line(scene: World, line: F64, name: str, least_m: float, most_m: float) -> None:
    assert least_m < alone(scene, name).distance_m(line).min() < most_m


def test_the_other_drone_never_comes_near_the_line_nor_into_the_region_that_is_searched(
    scene: World, line: F64
) -> None:
    drone = alone(scene, "Other drone")
    times = np.arange(0.0, 40.0, 0.5)
    nearest = [drone.at(t_s).distance_m(line).min() for t_s in times.tolist()]
    assert 7.0 < min(nearest) < 16.0
    ahead = np.diff(line[:, :2], axis=0)[::5]
    heading = np.arctan2(ahead[:, 0], ahead[:, 1])
    for t_s in times.tolist():
        offset = drone.at(t_s).placed.rows[0, 1:3] - line[:-1:5, :2]
        off_nose = np.abs((np.arctan2(offset[:, 0], offset[:, 1]) - heading + np.pi) % (2 * np.pi) - np.pi)
        assert not np.any((np.hypot(*offset.T) < 12.0) & (off_nose < np.radians(12)))


def test_the_other_drone_flies_at_the_vehicles_height_and_not_faster_than_the_radar_can_tell(
    scene: World, line: F64
) -> None:
    """Speeds over ground beyond 10.4 m/s fold back."""
    drone = alone(scene, "Other drone")
    assert np.hypot(*drone.at(1.0).placed.velocity_enu_m_s[0, :2]) == pytest.approx(6.0)
    gully = line[np.argmin(np.hypot(*(line[:, :2] - drone.at(10.0).placed.rows[0, 1:3]).T))]
    heights = [drone.at(t_s).placed.rows[0, 3:5].mean() for t_s in np.arange(0.0, 22.0, 1.0).tolist()]
    assert max(abs(height - gully[2]) for height in heights) < 12.0


def test_home_and_every_way_home_are_free(scene: World, line: F64) -> None:
    up = np.column_stack([np.zeros(120), np.zeros(120), np.linspace(0, RTL_M, 120)])
    assert scene.distance_m(up).min() > 20.0
    shares = np.linspace(0.0, 1.0, 60)[:, None]
    for start in line[::100]:
        way = np.column_stack([start[:2] * shares, np.full(60, RTL_M)])
        assert scene.distance_m(way).min() > 10.0


def test_none_of_it_is_on_the_surface_model(scene: World) -> None:
    tops = scene.placed.rows[:, [1, 2, 4]]
    assert all(top > scene.ground_up_m(east, north) + 1.0 for east, north, top in tops.tolist())
