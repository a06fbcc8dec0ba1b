"""The simulated radar from its samples on: what the chain makes of small worlds."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.world_shapes import WAVELENGTH_M
from telemetry.simulation.simulator.sensors import RadarSensor, radar_sensor
from telemetry.simulation.simulator.sensors.iq import IqRadarSensor, noise
from telemetry.simulation.simulator.sensors.iq_model import AWR1843_IQ, POSITION2GO_IQ, IqModel
from telemetry.topics.vehicle import SimTruth
from tests.telemetry.scenes import in_the_air, polar, truth, world

COARSE_RAD = math.radians(20.0)
"""Between rays, where nothing but corner reflectors is there to be met."""


def quick(model: IqModel, **beam: Any) -> IqModel:
    return dataclasses.replace(
        model, beam=dataclasses.replace(model.beam, **({"ray_step_rad": COARSE_RAD, "mount_m": 0.0} | beam))
    )


def reflector(range_m: float, azimuth_deg: float, cross_section_m2: float = 28.0, up: float = 10.0) -> dict[str, Any]:
    at = [range_m * math.sin(math.radians(azimuth_deg)), range_m * math.cos(math.radians(azimuth_deg))]
    edge_m = (3 * WAVELENGTH_M**2 * cross_section_m2 / (4 * math.pi)) ** 0.25
    return {"type": "corner_reflector", "at_m": at, "base_m": up, "edge_m": edge_m}


def looks(scene: World, count: int, model: IqModel | None = None, at: SimTruth | None = None) -> list[RadarFrame]:
    sensor = IqRadarSensor(scene, seed=1, model=model or quick(AWR1843_IQ))
    return [sensor.frame(at or truth()) for _ in range(count)]


def near(found: np.ndarray, range_m: float) -> np.ndarray:
    return found[np.abs(found[:, 0] - range_m) < 1.0]


@pytest.mark.parametrize(("range_m", "azimuth_deg"), [(12.3, 0.0), (40.1, 35.0), (70.6, -35.0)])
def test_a_reflector_is_found_where_it_is(range_m: float, azimuth_deg: float) -> None:
    found = near(polar(looks(in_the_air(reflector(range_m, azimuth_deg)), 12)), range_m)
    assert len(found) >= 11
    strong = found[found[:, 4] > 15.0]
    assert np.abs(strong[:, 0] - range_m).max() < 0.1
    assert np.sqrt(np.mean((strong[:, 1] - azimuth_deg) ** 2)) < 1.0
    assert np.abs(strong[:, 2]).max() < 10.0


@pytest.mark.parametrize("speed_m_s", [4.0, -4.0, 9.5])
def test_radial_speed_is_positive_away_and_places_hold_while_flying(speed_m_s: float) -> None:
    scene = in_the_air(reflector(40.0, 20.0))
    found = near(polar(looks(scene, 8, at=truth(velocity=(0.0, speed_m_s, 0.0)))), 40.0)
    assert found[:, 3] == pytest.approx(-speed_m_s * math.cos(math.radians(20.0)), abs=0.1)
    assert found[:, 0] == pytest.approx(40.0, abs=0.1)
    assert found[:, 1] == pytest.approx(20.0, abs=2.0)


def test_what_moves_by_itself_has_a_speed_of_its_own() -> None:
    path = {"points_m": [[0.0, 40.0], [0.0, 10.0]], "speed_m_s": 3.0}
    ball = {"type": "cylinder", "path": path, "base_m": 9.0, "radius_m": 0.5, "height_m": 2.0, "material": "metal"}
    at = truth(t_s=2.0, velocity=(0.0, 4.0, 0.0))
    found = near(polar(looks(in_the_air(ball), 12, AWR1843_IQ, at)), 33.7)
    assert len(found) >= 8
    assert np.median(found[:, 3]) == pytest.approx(-7.0, abs=0.1)
    assert np.median(found[:, 0]) == pytest.approx(33.7, abs=0.5)


def test_speeds_beyond_the_ambiguity_fold_back() -> None:
    found = near(polar(looks(in_the_air(reflector(40.0, 0.0)), 6, at=truth(velocity=(0.0, 13.0, 0.0)))), 40.0)
    assert np.median(found[:, 3]) == pytest.approx(2 * AWR1843_IQ.params.max_velocity_m_s - 13.0, abs=0.1)


@pytest.mark.parametrize("at", [truth(heading_deg=90.0), truth(pitch_deg=10.0), truth(roll_deg=20.0)])
def test_targets_are_told_in_the_bodys_frame(at: SimTruth) -> None:
    east, north = (30.0, 0.0) if at.heading_rad else (0.0, 30.0)
    scene = in_the_air({**reflector(30.0, 0.0), "at_m": [east, north]})
    found = near(polar(looks(scene, 10, at=at)), 30.0)
    assert np.median(found[:, 1]) == pytest.approx(0.0, abs=1.0)
    assert np.median(found[:, 2]) == pytest.approx(-math.degrees(at.pitch_rad), abs=3.0)


def test_strengths_are_those_of_the_simulated_radar_without_samples() -> None:
    """What tells ground from obstacles reads them against the same square metre at 120 m."""
    scene = in_the_air(reflector(100.0, 0.0, 1.0))
    found = near(polar(looks(scene, 60)), 100.0)
    beam = AWR1843_IQ.beam
    expected = 10 * math.log10(beam.rated_snr * (120.0 / 100.0) ** 4)
    assert len(found) >= 54
    assert 10 * math.log10(np.mean(10 ** (found[:, 4] / 10))) == pytest.approx(expected, abs=2.5)


def test_noise_alone_is_seldom_a_target() -> None:
    frames = looks(in_the_air(), 40)
    assert sum(len(frame.snr_db) // 4 for frame in frames) < 40
    assert not all(frame.snr_db for frame in frames)
    assert [frame.number for frame in frames] == list(range(1, 41))


def test_noise_is_white_and_of_variance_one() -> None:
    made = noise((16, 12, 256), np.random.default_rng(0))
    assert made.shape == (16, 12, 256)
    assert np.mean(np.abs(made) ** 2) == pytest.approx(1.0, abs=0.02)
    assert abs(np.mean(made**2)) < 0.02
    assert abs(np.mean(made[:, :, 1:] * made[:, :, :-1].conj())) < 0.02


def test_the_same_seed_gives_the_same_frames() -> None:
    scene = world({"type": "wall", "from_m": [-8, 25], "to_m": [8, 25], "height_m": 20, "material": "concrete"})
    runs = [[IqRadarSensor(scene, seed=seed).frame(truth()) for _ in range(1)] for seed in (3, 3, 4)]
    assert runs[0] == runs[1] != runs[2]


def test_a_wall_is_seen_where_it_stands() -> None:
    scene = world({"type": "wall", "from_m": [-8, 25], "to_m": [8, 25], "height_m": 20, "material": "concrete"})
    found = polar(looks(scene, 4, AWR1843_IQ))
    best = found[found[:, 4] >= found[:, 4].max() - 10.0]
    assert best[:, 0] * np.cos(np.radians(best[:, 1])) == pytest.approx(24.85, abs=1.0)


def test_what_is_too_much_for_a_frame_is_left_out_from_the_weakest() -> None:
    scene = in_the_air(reflector(30.0, 0.0), reflector(60.0, 10.0, 1.0))
    model = dataclasses.replace(quick(AWR1843_IQ), most_echoes=1)
    sensor = IqRadarSensor(scene, seed=1, model=model)
    found = polar([sensor.frame(truth()) for _ in range(8)])
    assert len(near(found, 30.0)) > len(near(found, 60.0))


def test_a_position2go_sees_near_things_below_its_raised_boresight() -> None:
    model = quick(POSITION2GO_IQ)
    up = 10.0 + 8.0 * math.tan(model.tilt_rad)
    found = near(polar(looks(in_the_air(reflector(8.0, 10.0, 1.0, up)), 20, model)), 8.0 / math.cos(model.tilt_rad))
    assert len(found) >= 16
    assert np.median(found[:, 0]) == pytest.approx(8.0 / math.cos(model.tilt_rad), abs=0.15)
    assert np.median(found[:, 1]) == pytest.approx(10.0, abs=2.0)
    assert found[:, 2] == pytest.approx(10.0, abs=0.5)


@pytest.mark.parametrize(("kind", "made"), [("model", RadarSensor), ("iq", IqRadarSensor)])
def test_both_kinds_are_to_be_had(kind: Any, made: type) -> None:
    assert isinstance(radar_sensor(kind, in_the_air(), seed=0), made)
