"""The simulated radar's statistics, held against the table of the papers."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame, rows
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.world_shapes import WAVELENGTH_M
from telemetry.simulation.simulator.sensors import RadarModel, RadarSensor
from telemetry.simulation.simulator.sensors.body import of_truth
from telemetry.simulation.simulator.sensors.radar_cells import Scatterers, detect
from telemetry.topics.vehicle import SimTruth
from tests.telemetry.scenes import in_the_air, polar, truth, world

FINE = RadarModel(false_alarms=0.0, side_lobe_db=-200.0, mount_m=0.0)
"""Neither false alarms nor side lobes."""
COARSE_RAD = math.radians(20.0)
"""Between rays, where nothing but corner reflectors is there to be met."""
QUIET = RadarModel(false_alarms=0.0, mount_m=0.0, ray_step_rad=COARSE_RAD)
ALONE = dataclasses.replace(FINE, ray_step_rad=COARSE_RAD)


def edge_m(cross_section_m2: float) -> float:
    return (3 * WAVELENGTH_M**2 * cross_section_m2 / (4 * math.pi)) ** 0.25


def reflector(range_m: float, azimuth_deg: float, cross_section_m2: float, up: float = 10.0) -> dict[str, Any]:
    at = [range_m * math.sin(math.radians(azimuth_deg)), range_m * math.cos(math.radians(azimuth_deg))]
    return {"type": "corner_reflector", "at_m": at, "base_m": up, "edge_m": edge_m(cross_section_m2)}


def frames(scene: World, count: int, model: RadarModel, at: SimTruth | None = None, seed: int = 1) -> list[RadarFrame]:
    """Those with a target, of so many."""
    sensor = RadarSensor(scene, seed=seed, model=model)
    made = [sensor.frame(at or truth()) for _ in range(count)]
    return [frame for frame in made if frame.snr_db]


def test_a_square_metre_at_the_rated_range_is_seen_eight_times_of_ten() -> None:
    seen = frames(in_the_air(reflector(119.9, 0.0, 1.0)), 1000, ALONE)
    assert len(seen) / 1000 == pytest.approx(0.8, abs=0.05)
    assert ALONE.detection(ALONE.snr(np.array([1.0]), np.array([120.0]), np.zeros(1), np.zeros(1))) == pytest.approx(
        0.8
    )


@pytest.mark.parametrize(("range_m", "share"), [(60.0, 0.95), (20.0, 0.99)])
def test_nearer_things_are_seen_more_often(range_m: float, share: float) -> None:
    assert len(frames(in_the_air(reflector(range_m, 0.0, 1.0)), 300, ALONE)) / 300 >= share


def test_beside_the_axis_less_is_seen() -> None:
    count = [len(frames(in_the_air(reflector(100.0, azimuth, 1.0)), 200, ALONE)) for azimuth in (0.0, 25.0, 50.0)]
    assert count[0] > count[1] > count[2]
    assert not frames(in_the_air(reflector(30.0, 75.0, 50.0)), 20, ALONE)
    assert not frames(in_the_air(reflector(30.0, 180.0, 50.0)), 20, ALONE)


@pytest.mark.parametrize("azimuth_deg", [0.0, 40.0])
def test_errors_are_those_of_the_table(azimuth_deg: float) -> None:
    found = polar(frames(in_the_air(reflector(60.2, azimuth_deg, 28.0)), 800, ALONE))
    range_m, azimuth, elevation = found[:, 0], found[:, 1], found[:, 2]
    assert range_m % 0.5 == pytest.approx(0.25, abs=1e-4)
    assert range_m.mean() == pytest.approx(60.2, abs=0.05)
    assert range_m.std() == pytest.approx(math.hypot(0.15, 0.5 / math.sqrt(12)), abs=0.05)
    assert azimuth.mean() == pytest.approx(azimuth_deg, abs=0.15)
    assert azimuth.std() == pytest.approx(1.0 / math.cos(math.radians(azimuth_deg)), rel=0.1)
    assert elevation.mean() == pytest.approx(0.0, abs=0.6)
    assert elevation.std() == pytest.approx(7.0, rel=0.1)


def test_radial_speed_is_positive_away_and_in_cells() -> None:
    scene = in_the_air(reflector(40.0, 0.0, 28.0))
    for speed, expected in ((3.0, -3.1), (-3.0, 3.1), (12.0, 67 * 0.31 - 39 * 0.31)):
        found = polar(frames(scene, 20, ALONE, truth(velocity=(0.0, speed, 0.0))))
        assert found[:, 3] == pytest.approx(expected, abs=1e-4)


def test_false_alarms_come_once_in_two_frames_anywhere() -> None:
    seen = frames(in_the_air(), 2500, RadarModel(ray_step_rad=COARSE_RAD, mount_m=0.0))
    found = polar(seen)
    assert len(found) / 2500 == pytest.approx(0.5, abs=0.05)
    assert len(seen) / 2500 == pytest.approx(1 - math.exp(-0.5), abs=0.03)
    assert np.quantile(found[:, 0], [0.25, 0.5, 0.75]) == pytest.approx([30, 60, 90], abs=5)
    assert np.abs(found[:, 1]).max() < 66
    assert found[:, 3].std() == pytest.approx(20.5 / math.sqrt(12), rel=0.1)
    assert found[:, 4].min() > 11.3


def test_nothing_in_sight_gives_frames_that_are_empty_and_counted() -> None:
    sensor = RadarSensor(in_the_air(), seed=0, model=QUIET)
    seen = [sensor.frame(truth()) for _ in range(20)]
    assert [frame.number for frame in seen] == list(range(1, 21))
    assert {(frame.xyz_m, frame.radial_speed_m_s, frame.snr_db) for frame in seen} == {(b"", b"", b"")}


def test_side_lobes_are_ghosts_at_the_same_range() -> None:
    scene = in_the_air(reflector(68.0, 0.0, 28.0))
    found = polar(frames(scene, 1500, QUIET))
    ghosts = found[np.abs(found[:, 1]) > 10]
    assert 0.004 < len(ghosts) / 1500 < 0.03
    assert np.abs(np.abs(ghosts[:, 1]) - math.degrees(math.asin(0.357))).max() < 5
    assert np.abs(ghosts[:, 0] - 68.0).max() < 1.0
    assert not (np.abs(polar(frames(scene, 300, ALONE))[:, 1]) > 10).any()


def test_a_weak_neighbour_in_the_same_cell_is_hidden() -> None:
    two = Scatterers(*(np.array(values) for values in (
        [30.1, 30.2], [0.0, 0.6], [0.0, 0.0], [0.0, 0.0], [1e6, 1e6 * 10**-2.5])))  # fmt: skip
    random = np.random.default_rng(0)
    found = [detect(two, QUIET, random).scatterer.tolist() for _ in range(200)]
    assert sum(1 in picked for picked in found) < 20
    assert sum(0 in picked for picked in found) > 190


def test_a_wall_hides_what_is_behind_it() -> None:
    behind = reflector(30.0, 0.0, 28.0)
    wall = {"type": "wall", "from_m": [-30, 15], "to_m": [30, 15], "height_m": 30, "base_m": -5}
    found = polar(frames(in_the_air(behind, wall), 20, FINE))
    assert (found[np.abs(found[:, 1]) < 20, 0] < 18).all()
    assert polar(frames(in_the_air(behind), 20, ALONE))[:, 0] == pytest.approx(30, abs=1.0)


def test_all_echoes_of_a_wall_lie_on_it() -> None:
    wall = {"type": "wall", "from_m": [-30, 15], "to_m": [30, 15], "height_m": 30, "base_m": -5}
    scene = in_the_air(wall)
    exact = dataclasses.replace(FINE, mount_m=0.2, range_sigma_m=0.0, azimuth_sigma_rad=0.0, elevation_sigma_rad=0.0)
    at = truth(heading_deg=30, roll_deg=8, pitch_deg=-5, velocity=(1.0, 2.0, 0.0))
    points = np.concatenate([rows(f.xyz_m, 3) for f in frames(scene, 10, exact, at)])
    enu = points @ of_truth(at).T + np.array(at.position_enu_m)
    assert len(points) > 100
    assert scene.surface_distance_m(enu).max() < 0.26


def test_low_over_the_ground_the_ground_itself_echoes() -> None:
    low = polar(frames(world(), 10, FINE, truth(up=5.0, velocity=(0.0, 3.0, 0.0))))
    assert len(low) > 100
    assert not frames(world(), 10, FINE, truth(up=60.0, velocity=(0.0, 3.0, 0.0)))
    assert low[:, 0].min() > 5.0
    passing = (low[:, 2] >= 0) & (low[:, 2] <= 20)
    assert 0.01 < passing.mean() < 0.4


def test_a_thin_mast_is_seen_as_often_as_its_size_says() -> None:
    mast = {"type": "cylinder", "at_m": [0, 50], "radius_m": 0.1, "height_m": 20, "material": "metal"}
    found = polar(frames(in_the_air(mast), 60, ALONE))
    assert len(found) >= 50
    assert np.abs(found[:, 1]).mean() < 1.5


def test_the_same_seed_gives_the_same_frames_and_another_gives_others() -> None:
    scene = world({"type": "tree", "at_m": [0, 20], "height_m": 9, "crown_radius_m": 2})
    assert frames(scene, 5, RadarModel(), seed=3) == frames(scene, 5, RadarModel(), seed=3)
    assert frames(scene, 5, RadarModel(), seed=3) != frames(scene, 5, RadarModel(), seed=4)
