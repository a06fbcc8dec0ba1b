"""The camera's map: local, where its own path says, over ground that is laid under it."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import quaternions
from mapping.geometry.frames import heading_rotation
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.ground import ground_grid
from mapping.perceiving.vision_perception import VisionPerception, voxel_centres
from mapping.sensor_frames import CloudFrame, SlamPose, packed
from tests.mapping.flights import Flight, flat_ground


def pole(north_m: float, east_m: float = 0.1) -> np.ndarray:
    """From the ground, 5 m below the origin, to 3 m above it."""
    return np.array([[east_m, north_m, up] for up in np.arange(-4.9, 3.0, 0.2)])


def floor(around_north_m: float) -> np.ndarray:
    east, north = np.meshgrid(np.arange(-8, 8, 0.5), np.arange(4, 25, 0.5))
    return np.column_stack([east.ravel(), north.ravel() + around_north_m, np.full(east.size, -5.0)])


def flying(**settings: Any) -> Flight:
    flight = Flight(VisionPerception(Settings(depth_m=7.0, resolution_m=0.5, **settings)))
    flight.perception.set_ground(flat_ground())
    return flight


def slam_of(flight: Flight, *, turn: float, drift: np.ndarray) -> SlamPose:
    """SLAM in a frame of its own: turned by ``turn``, its origin elsewhere, wrong by ``drift``."""
    q = quaternions.from_attitude(turn, 0.0, 0.0)
    p = heading_rotation(turn) @ (flight.position + drift) + np.array([500.0, -70.0, 3.0])
    own = quaternions.product(q, quaternions.from_attitude(flight.heading_rad, flight.pitch_rad, 0.0))
    return SlamPose(flight.t_s, tuple(p.tolist()), tuple(own.tolist()))


@pytest.mark.parametrize("turn", [0.0, 1.0, -2.5])
def test_any_frame_of_slam_is_laid_over_the_vehicle_s_own(turn: float) -> None:
    flight = flying()
    for _ in range(5):
        flight.move(0.2)
        result = flight.camera(pole(12.0), slam=slam_of(flight, turn=turn, drift=np.zeros(3)))
    result = flight.results[-1]
    seen = flight.perception.map.occupied(explained=False)
    assert len(seen) >= 12
    np.testing.assert_allclose(seen[:, :2], [[0.25, 12.25]] * len(seen), atol=0.51)
    assert result.divergence_m == pytest.approx(0.0, abs=1e-6)


def test_known_ground_is_grey_and_a_pole_on_it_alarms() -> None:
    flight = flying()
    for _ in range(40):
        flight.move()
        flight.camera(np.vstack([pole(20.0), floor(flight.north_m)]))
    voxels = flight.perception.map
    assert len(voxels.occupied(explained=True)) > 200
    assert voxels.occupied(explained=False)[:, 2].min() > -4.5
    assert flight.begun() == ["obstacle"]
    first = next(r for r in flight.results if r.alerts)
    assert first.obstacles[0].distance_m == pytest.approx(7.0, abs=0.8)


def test_without_an_obstacle_nothing_alarms() -> None:
    flight = flying()
    flight.perception.set_line([[0, 0, 0], [0, 200, 0]])
    for _ in range(30):
        flight.move()
        flight.camera(floor(flight.north_m))
    assert not flight.begun()


def test_the_map_is_local() -> None:
    flight = flying()
    flight.move()
    flight.camera(pole(12.0))
    flight.move()
    flight.camera(pole(16.0))
    assert np.isnan(flight.perception.map.probability([[0.1, 12.0, 0.0]]))[0]


def test_of_a_thinned_cloud_one_point_occupies_a_voxel_and_thin_things_stay() -> None:
    full, thin = flying(), flying(cloud_voxel_m=0.25)
    once = np.vstack([pole(12.0), floor(0.0)])
    cloud = np.vstack([once, once + 0.01, once + 0.02, [[np.nan, 0.0, 0.0]]])
    points = []
    for flight in (full, thin):
        flight.move()
        points.append(flight.camera(cloud, voxel_m=0.0).points)
    assert points[1] < 0.6 * points[0]
    np.testing.assert_array_equal(
        np.unique(thin.perception.map.occupied(explained=False)[:, 2]),
        np.unique(full.perception.map.occupied(explained=False)[:, 2]),
    )
    assert thin.perception.dropped == full.perception.dropped == {"points: not finite": 1}


def test_drift_moves_the_map_but_neither_the_ground_nor_the_mission() -> None:
    """SLAM 6 m too high and 4 m aside: its own ground must still count as known, its poles as obstacles."""
    flight = flying()
    flight.perception.set_line([[0, 0, 0], [0, 200, 0]])
    drift = np.zeros(3)
    for k in range(80):
        flight.move()
        drift = np.array([4.0, 0.0, 6.0]) * k / 79
        things = np.vstack([floor(flight.north_m), pole(45.0) if k > 60 else np.empty((0, 3))])
        result = flight.camera(things, slam=slam_of(flight, turn=0.7, drift=drift))
        if k == 60:
            assert "obstacle" not in flight.begun()
    result = flight.results[-1]
    assert flight.begun().count("obstacle") == 1
    assert result.corridor_occupied
    assert result.divergence_m == pytest.approx(np.linalg.norm(drift), abs=0.1)
    np.testing.assert_allclose(flight.perception.offset_enu_m, drift, atol=0.6)
    seen = flight.perception.map.occupied(explained=False)
    assert seen[:, 0].mean() == pytest.approx(4.1, abs=0.6), "the camera's map stands where SLAM says"
    assert flight.begun().count("divergence") == 1


def test_divergence_ends_when_the_paths_meet_again() -> None:
    flight = flying()
    phases = []
    for k in range(60):
        flight.move()
        drift = np.array([8.0 if 10 < k < 40 else 0.0, 0.0, 0.0])
        phases += [
            e.phase for e in flight.camera(floor(flight.north_m), slam=slam_of(flight, turn=0.0, drift=drift)).alerts
        ]
    assert phases[0] == "begins"
    assert phases[-1] == "ends"
    assert phases.count("begins") == 1


def test_without_gnss_slam_carries_on() -> None:
    flight = flying()
    for k in range(50):
        flight.move(has_fix=k < 10)
        result = flight.camera(np.vstack([pole(18.0), floor(flight.north_m)]))
    result = flight.results[-1]
    assert result.state == "running"
    assert flight.begun() == ["obstacle"]


def test_a_lost_path_is_said_and_goes_on_without_gnss_where_it_ended() -> None:
    flight = flying()
    for _ in range(10):
        flight.move()
        flight.camera(floor(flight.north_m))
    flight.move(has_fix=False)
    lost = SlamPose(flight.t_s, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), "lost")
    result = flight.camera(floor(flight.north_m), slam=lost)
    assert result.state == "blind"
    assert flight.perception.dropped["the camera lost its way"] == 1
    flight.move(has_fix=False)
    result = flight.camera(floor(flight.north_m), slam=slam_of(flight, turn=2.0, drift=np.zeros(3)))
    assert result.accepted
    assert result.pose is not None
    np.testing.assert_allclose(result.pose.position_enu_m, flight.position, atol=1.0)


def test_darkness_is_said() -> None:
    flight = flying()
    flight.move()
    flight.camera(np.empty((0, 3)))
    flight.move()
    result = flight.camera(np.empty((0, 3)))
    assert result.state == "blind"
    assert "dark" in result.text


def test_before_any_path_of_the_camera_the_map_waits() -> None:
    vision = VisionPerception(Settings(depth_m=7.0, resolution_m=0.5))
    result = vision.on_frame(CloudFrame(1.0, 0.0, 1, "", packed(pole(5.0))), 1.0)
    assert result.state == "frozen"
    assert vision.dropped == {"camera: no position": 1}


@pytest.mark.parametrize("turn", [0.0, 1.3])
def test_without_a_first_fix_map_region_and_alerts_stand_in_slam_s_own_frame(turn: float) -> None:
    flight = flying()
    flight.perception.set_line([[0, 0, 0], [0, 200, 0]])
    for _ in range(40):
        flight.move(has_fix=False)
        result = flight.camera(
            np.vstack([pole(18.0), floor(flight.north_m)]), slam=slam_of(flight, turn=turn, drift=np.zeros(3))
        )
        assert result.accepted
        assert not result.placed
    result = flight.results[-1]
    assert len(flight.perception.map.occupied()) > 20
    assert flight.begun() == ["obstacle"]
    assert result.region is not None
    first = next(r for r in flight.results if r.alerts)
    assert first.obstacles[0].distance_m == pytest.approx(7.0, abs=0.8)
    assert abs(first.obstacles[0].off_nose_rad) < 0.2
    # The compass is told: bearings are true before any position is.
    assert first.obstacles[0].bearing_rad == pytest.approx(flight.heading_rad, abs=0.2)
    assert result.corridor_m == 0.0, "nobody knows where the mission lies in this frame"
    assert not len(flight.perception.map.occupied(explained=True)), "nor the ground"


def test_with_the_first_fix_what_was_found_goes_where_it_really_is() -> None:
    """No alert begins a second time, and none ends: the obstacle is the same one."""
    flight = flying()
    flight.speed_m_s = 0.0
    things = np.vstack([pole(6.0), floor(0.0)])
    for k in range(60):
        flight.move(has_fix=k > 30)
        result = flight.camera(things, slam=slam_of(flight, turn=2.0, drift=np.zeros(3)))
        assert result.placed == (k > 30)
    assert [e.phase for r in flight.results for e in r.alerts if e.phase != "goes_on"] == ["begins"]
    seen = flight.perception.map.occupied(explained=False)
    np.testing.assert_allclose(seen[:, :2], [[0.25, 6.25]] * len(seen), atol=0.51)
    assert len(flight.perception.map.occupied(explained=True)) > 100


def test_a_path_lost_before_the_first_fix_goes_on_where_it_ended() -> None:
    flight = flying()
    for _ in range(6):
        flight.move(has_fix=False)
        flight.camera(pole(18.0), slam=slam_of(flight, turn=0.4, drift=np.zeros(3)))
    before = flight.results[-1]
    flight.move(has_fix=False)
    flight.camera(pole(18.0), slam=SlamPose(flight.t_s, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), "lost"))
    flight.move(has_fix=False)
    after = flight.camera(pole(18.0), slam=slam_of(flight, turn=-2.0, drift=np.zeros(3)))
    assert before.pose is not None
    assert after.pose is not None
    np.testing.assert_allclose(after.pose.position_enu_m, before.pose.position_enu_m, atol=1.0)


def test_noise_along_the_line_of_sight_does_not_lift_a_hillside_off_the_ground() -> None:
    """At 30 m depth is good to 1.8 m: a wall that is known is seen up to 5 m in front of itself."""
    up = np.full((400, 400), -5.0, np.float32)
    up[:168] = 30.0
    flight = flying()
    flight.perception.set_ground(ground_grid(up, [[0.0, -1.0, 200.0], [1.0, 0.0, 200.0]]))
    flight.perception.set_line([[0, 0, 0], [0, 31, 0]])
    flight.speed_m_s = 0.0
    flight.perception.track.clear()
    flight.move()
    random = np.random.default_rng(3)
    way = random.uniform([-0.3, 1.0, -0.1], [0.3, 1.0, 0.2], (4000, 3))
    points = way * (32.0 + 0.002 * 32**2 * np.clip(random.normal(0, 1, (4000, 1)), -2.9, 2.9))
    flight.camera(points)
    assert len(flight.perception.map.occupied(explained=False)) == 0
    flight.move()
    flight.camera(way * 20.0)
    assert len(flight.perception.map.occupied(explained=False)) > 20, "12 m in front of it is something else"


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from([0.5, 1.0]))
def test_voxels_that_hold_enough_points(seed: int, fewest: int, resolution_m: float) -> None:
    points = np.random.default_rng(seed).normal(0, 1.5, (150, 3))
    keys, counts = np.unique(np.floor(points / resolution_m), axis=0, return_counts=True)
    expected = (keys[counts >= fewest] + 0.5) * resolution_m
    found = voxel_centres(points, resolution_m, fewest)
    np.testing.assert_allclose(found[np.lexsort(found.T[::-1])], expected[np.lexsort(expected.T[::-1])])


def test_a_single_point_is_no_voxel_unless_the_cloud_was_thinned() -> None:
    for voxel_m, count in ((0.0, 0), (0.25, 1)):
        flight = flying()
        flight.move()
        flight.camera(np.array([[0.0, 6.0, 0.0]]), voxel_m=voxel_m)
        assert flight.perception.map.occupied_count == count


anything = st.floats(width=32) | st.sampled_from([math.nan, math.inf, 1e30, 5.0, 10.0])


@settings(max_examples=25)
@given(
    st.lists(st.tuples(anything, anything, anything), max_size=12),
    st.tuples(*[anything] * 3),
    st.tuples(*[anything] * 4),
)
def test_garbage_never_raises(points: list[tuple[float, ...]], place: tuple, turn: tuple) -> None:
    flight = flying()
    for k in range(3):
        flight.move()
        flight.perception.feed_camera(SlamPose(flight.t_s, place, turn))  # type: ignore[attr-defined]
        cloud = CloudFrame(flight.t_s, 0.0, k, "", packed(np.array(points, np.float64)))
        before = flight.perception.dropped.total()
        result = flight.perception.on_frame(cloud, flight.t_s)  # type: ignore[attr-defined]
        assert result.accepted or flight.perception.dropped.total() > before
    assert flight.perception.map.occupied_count <= len(points)


def test_what_cannot_be_seen_any_more_stays_hidden_when_the_map_finds_its_place() -> None:
    """It came near before the first fix, and stands nearer now than the camera sees."""
    flight = flying()
    flight.speed_m_s = 0.0
    for k in range(40):
        flight.move(has_fix=k > 30)
        near = np.empty((0, 3)) if k > 20 else pole(5.0)
        drift = np.array([0.0, 4.8, 0.0]) * (k > 20)
        flight.camera(np.vstack([near, floor(8.0)]), slam=slam_of(flight, turn=2.0, drift=drift))
    before, after = flight.results[25], flight.results[-1]
    assert (before.placed, after.placed) == (False, True)
    assert before.region is not None
    assert after.region is not None
    assert before.region.hidden_m is not None
    assert after.region.hidden_m == pytest.approx(before.region.hidden_m, abs=0.8)
