"""The simulated stereo camera's statistics, held against the table of the papers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.sensor_frames import rows
from telemetry.simulation.simulator.sensors import StereoModel, StereoSensor
from telemetry.simulation.simulator.sensors.body import of_truth, quaternion_wxyz, rotation_enu_body
from tests.telemetry.scenes import in_the_air, truth, world

SMALL = StereoModel(columns=96, rows=54, mount_m=0.0)
SHARP = dataclasses.replace(SMALL, mount_m=0.3, depth_sigma_per_m=0.0, loss=0.0, far_loss=0.0)


def wall(north: float, material: str = "stone") -> dict:
    return {"type": "wall", "from_m": [-90, north + 0.15], "to_m": [90, north + 0.15], "height_m": 120, "base_m": -60,
            "material": material}  # fmt: skip


@pytest.mark.parametrize("depth_m", [5.0, 15.0])
def test_depth_is_off_by_two_thousandths_of_its_square(depth_m: float) -> None:
    points = rows(StereoSensor(in_the_air(wall(depth_m)), seed=1).frame(truth()).xyz_m, 3)
    assert points[:, 1].mean() == pytest.approx(depth_m, abs=0.01 * depth_m)
    assert points[:, 1].std() == pytest.approx(0.002 * depth_m**2, rel=0.1)


def test_an_error_moves_a_point_along_its_ray() -> None:
    sensor = StereoSensor(in_the_air(wall(20.0)), seed=1, model=SMALL)
    points = rows(sensor.frame(truth()).xyz_m, 3).astype(float)
    for axis, count, angle in ((0, SMALL.columns, SMALL.width_rad), (2, SMALL.rows, SMALL.height_rad)):
        pixel = (points[:, axis] / points[:, 1] / np.tan(angle / 2) + 1) / 2 * count
        assert pixel % 1.0 == pytest.approx(0.5, abs=1e-4)


@settings(max_examples=10)
@given(st.floats(0, 360), st.floats(-15, 15), st.floats(-15, 15), st.floats(3, 20))
def test_without_noise_points_lie_on_what_is_there(heading, roll, pitch, up) -> None:
    scene = world(
        {"type": "box", "at_m": [3, 12], "size_m": [5, 4, 12], "heading_deg": 30},
        {"type": "cylinder", "at_m": [-8, -9], "radius_m": 2, "height_m": 25},
    )
    at = truth(up=up, heading_deg=heading, roll_deg=roll, pitch_deg=pitch)
    points = rows(StereoSensor(scene, seed=0, model=SHARP).frame(at).xyz_m, 3)
    enu = points @ of_truth(at).T + np.array(at.position_enu_m)
    assert len(points) > 10
    assert scene.surface_distance_m(enu).max() < 1e-3


def test_nothing_is_seen_beyond_forty_metres_nor_within_half_a_metre() -> None:
    seen = {depth: len(rows(StereoSensor(in_the_air(wall(depth)), seed=1, model=SMALL).frame(truth()).xyz_m, 3))
            for depth in (0.4, 10.0, 30.0, 41.0)}  # fmt: skip
    assert seen[0.4] == seen[41.0] == 0
    assert seen[10.0] > 1.5 * seen[30.0] > 0


def test_beyond_twenty_metres_points_are_lost_more_and_more() -> None:
    narrow = dataclasses.replace(SMALL, width_rad=0.2, height_rad=0.1)
    share = []
    for depth in (10.0, 20.0, 30.0, 39.5):
        sensor = StereoSensor(in_the_air(wall(depth)), seed=1, model=narrow)
        sensor.frame(truth())
        share.append(sensor.share_seen)
    assert share == pytest.approx([0.95, 0.95, 0.71, 0.48], abs=0.06)


def test_surfaces_without_texture_are_seen_in_patches() -> None:
    narrow = dataclasses.replace(SMALL, width_rad=1.0, height_rad=0.7, loss=0.0)
    share = {}
    for material in ("stone", "plaster", "glass"):
        sensor = StereoSensor(in_the_air(wall(12.0, material)), seed=1, model=narrow)
        sensor.frame(truth())
        share[material] = sensor.share_seen
    assert list(share.values()) == pytest.approx([0.97, 0.3, 0.1], abs=0.08)


def test_a_patch_without_texture_stays_without() -> None:
    scene, model = in_the_air(wall(8.0, "plaster")), dataclasses.replace(SHARP)
    sensor = StereoSensor(scene, seed=1, model=model)
    assert sensor.frame(truth()).xyz_m == sensor.frame(truth()).xyz_m


def test_on_the_ground_the_camera_sees_it() -> None:
    sensor = StereoSensor(world(), seed=1)
    assert sensor.share_seen == 1.0
    points = rows(sensor.frame(truth(up=0.0)).xyz_m, 3)
    assert sensor.share_seen > 0.2
    assert np.median(points[:, 2]) == pytest.approx(0.0, abs=0.01)


def test_in_the_dark_the_cloud_is_empty() -> None:
    sensor = StereoSensor(in_the_air(wall(8.0)), seed=1, dark=True)
    frame = sensor.frame(truth())
    assert frame.xyz_m == b""
    assert (frame.number, sensor.share_seen) == (1, 0.0)


def test_with_nothing_in_view_the_cloud_is_empty() -> None:
    assert StereoSensor(in_the_air(), seed=1, model=SMALL).frame(truth()).xyz_m == b""


def test_the_same_seed_gives_the_same_frames_and_another_gives_others() -> None:
    scene = world({"type": "tree", "at_m": [0, 15], "height_m": 9, "crown_radius_m": 3})

    def clouds(seed: int) -> list[bytes]:
        sensor = StereoSensor(scene, seed=seed, model=SMALL)
        return [sensor.frame(truth(up=4.0, t_s=t)).xyz_m for t in (0.0, 0.2)]

    assert clouds(3) == clouds(3)
    assert clouds(3) != clouds(4)
    assert clouds(3)[0] != clouds(3)[1]


def test_the_default_cloud_has_about_twenty_thousand_rays() -> None:
    assert 18_000 < StereoModel().columns * StereoModel().rows < 22_000


@given(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-7, 7))
def test_rotations_are_rotations_and_quaternions_are_theirs(roll, pitch, heading) -> None:
    turn = rotation_enu_body(roll, pitch, heading)
    assert np.allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    w, x, y, z = quaternion_wxyz(turn)
    p = np.array([0.3, -0.7, 0.2])
    q = np.array([x, y, z])
    assert w >= 0
    assert turn @ p == pytest.approx(p + 2 * np.cross(q, np.cross(q, p) + w * p), abs=1e-9)


def test_nose_up_and_right_wing_down_are_positive() -> None:
    assert rotation_enu_body(0, 0.1, 0)[2, 1] > 0
    assert rotation_enu_body(0.1, 0, 0)[2, 0] < 0
    assert rotation_enu_body(0, 0, np.pi / 2) @ [0, 1, 0] == pytest.approx([1, 0, 0], abs=1e-12)
