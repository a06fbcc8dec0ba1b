"""Shapes that move: where they are when, what sensors and the vehicle make of it."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.sensor_frames import rows
from telemetry.simulation.simulator.scene import SceneTerrain, World
from telemetry.simulation.simulator.scene.motion import REPEATS, Motion, Repeat
from telemetry.simulation.simulator.sensors import RadarModel, RadarSensor, StereoModel, StereoSensor
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from tests.telemetry.scenes import FRAME, in_the_air, truth, world

QUIET = RadarModel(false_alarms=0.0, side_lobe_db=-200.0, mount_m=0.0)
CORNERS = ((0.0, 0.0), (30.0, 0.0), (30.0, 40.0))


def drone(points: list[list[float]], speed_m_s: float, **path: Any) -> dict[str, Any]:
    return {
        "type": "box",
        "name": "Drone",
        "path": {"points_m": points, "speed_m_s": speed_m_s, **path},
        "base_m": 9.5,
        "size_m": [1, 1, 1],
        "material": "metal",
    }


@pytest.mark.parametrize(
    ("repeat", "t_s", "place", "velocity"),
    [
        ("back_and_forth", 3.0, (30.0, 0.0), (0.0, 10.0)),
        ("back_and_forth", 8.0, (30.0, 30.0), (0.0, -10.0)),
        ("back_and_forth", 14.5, (5.0, 0.0), (10.0, 0.0)),
        ("around", 9.5, (15.0, 20.0), (-6.0, -8.0)),
        ("around", 12.5, (5.0, 0.0), (10.0, 0.0)),
        ("once", 6.0, (30.0, 30.0), (0.0, 10.0)),
        ("once", 99.0, (30.0, 40.0), (0.0, 0.0)),
    ],
)
def test_it_goes_along_its_way(
    repeat: Repeat, t_s: float, place: tuple[float, float], velocity: tuple[float, float]
) -> None:
    at, going = Motion(CORNERS, 10.0, repeat).at(t_s)
    assert at == pytest.approx(place)
    assert going == pytest.approx(velocity)
    later, _ = Motion(CORNERS, 10.0, repeat, after_s=7.0).at(t_s + 7.0)
    assert later == pytest.approx(place)


def test_before_its_time_it_stands_at_the_first_point() -> None:
    assert Motion(CORNERS, 10.0, after_s=5.0).at(4.9) == ((0.0, 0.0), (0.0, 0.0))


@given(
    st.lists(st.tuples(st.integers(-500, 500), st.integers(-500, 500)), min_size=2, max_size=8),
    st.floats(0.01, 100.0),
    st.sampled_from(REPEATS),
    st.floats(0.0, 1e4),
    st.floats(0.0, 1.0),
)
def test_it_never_goes_faster_than_it_may_nor_leaves_its_way(
    points: list[tuple[int, int]], speed: float, repeat: Repeat, t_s: float, dt_s: float
) -> None:
    way = [p for i, p in enumerate(points) if i == 0 or p != points[i - 1]]
    if len(way) < 2:
        way.append((way[0][0] + 1, way[0][1]))
    motion = Motion(tuple((float(e), float(n)) for e, n in way), speed, repeat)
    (one, going), (other, _) = motion.at(t_s), motion.at(t_s + dt_s)
    assert math.dist(one, other) <= speed * dt_s + 1e-6
    assert math.hypot(*going) == pytest.approx(speed) or (repeat == "once" and going == (0.0, 0.0))
    assert min(e for e, _ in way) - 1e-6 <= one[0] <= max(e for e, _ in way) + 1e-6
    assert min(n for _, n in way) - 1e-6 <= one[1] <= max(n for _, n in way) + 1e-6


def test_a_world_shows_each_time_as_it_is_then() -> None:
    scene = world(drone([[0, 20], [0, 60]], 4.0), {"type": "cylinder", "at_m": [9, 9], "radius_m": 1, "height_m": 5})
    then = scene.at(5.0)
    assert then.placed.rows[0, 1:3].tolist() == [0.0, 40.0]
    assert then.placed.rows[1].tolist() == scene.placed.rows[1].tolist()
    assert then.placed.velocity_enu_m_s.tolist() == [[0.0, 4.0, 0.0], [0.0, 0.0, 0.0]]
    assert then.distance_m(np.array([[0.0, 40.0, 10.0]]))[0] == 0.0
    assert scene.distance_m(np.array([[0.0, 40.0, 10.0]]))[0] == pytest.approx(19.5)
    assert scene.at(0.0).placed.rows[0, 2] == 20.0
    still = world({"type": "cylinder", "at_m": [9, 9], "radius_m": 1, "height_m": 5})
    assert still.at(5.0) is still


def test_what_counts_from_the_ground_follows_it() -> None:
    slope = np.tile(np.linspace(0.0, 100.0, 101, dtype=np.float32)[::-1, None], (1, 101))
    up_a_metre_per_metre = SceneTerrain(slope, np.array([[1.0, 0.0, 50.5], [0.0, -1.0, 100.5]]), -1.0)
    item = drone([[0, 10], [0, 50]], 1.0)
    scene = World.parse(
        {"format": "hedgehop-world", "version": 1, "objects": [item]}, frame=FRAME, terrain=up_a_metre_per_metre
    )
    low = [float(scene.at(t_s).placed.rows[0, 3]) for t_s in (0.0, 20.0)]
    assert low[1] - low[0] == pytest.approx(20.0, abs=1.5)


def test_the_radar_sees_it_where_it_is_and_its_speed_with_its_own() -> None:
    scene = in_the_air(drone([[0, 60], [0, 20]], 6.0, after_s=1.0))
    sensor = RadarSensor(scene, seed=3, model=QUIET)
    found = [sensor.frame(truth(velocity=(0.0, 2.0, 0.0), t_s=3.0)) for _ in range(40)]
    seen = [f for f in found if f is not None]
    assert len(seen) > 20
    xyz = np.concatenate([rows(f.xyz_m, 3) for f in seen])
    speed = np.concatenate([rows(f.radial_speed_m_s, 1)[:, 0] for f in seen])
    assert np.median(np.linalg.norm(xyz, axis=1)) == pytest.approx(47.5, abs=0.8)
    assert np.median(speed) == pytest.approx(-8.0, abs=0.4)


def test_the_camera_sees_it_where_it_is() -> None:
    scene = in_the_air(drone([[0, 30], [0, 10]], 5.0))
    sensor = StereoSensor(scene, seed=1, model=dataclasses.replace(StereoModel(), depth_sigma_per_m=0.0))
    away = [np.median(rows(sensor.frame(truth(t_s=t_s)).xyz_m, 3)[:, 1]) for t_s in (1.0, 3.0)]
    assert away == pytest.approx([24.5, 14.5], abs=0.1)


def test_it_flies_into_a_vehicle_that_hovers() -> None:
    scene = world(drone([[0, 40], [0, -40]], 4.0, after_s=10.0))
    vehicle = SimulatedVehicle(FRAME, ground=scene.ground, obstacles=scene, gnss="perfect", boot_s=0.5)
    vehicle.advance(1.0)
    pilot = vehicle.autopilot
    assert (pilot.set_mode("GUIDED"), pilot.arm(), pilot.take_off(10.0)) == ("accepted",) * 3
    vehicle.advance(14.0)
    assert vehicle.hit is None
    vehicle.advance(12.0)
    assert vehicle.hit == "Drone"
