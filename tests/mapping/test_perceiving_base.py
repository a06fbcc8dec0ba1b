"""Which frames any perception takes, what it counts, how its state is said."""

import math

import numpy as np
import pytest

from mapping.perceiving.braking import Braking
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.perception import Perception
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.range_perception import RangePerception
from mapping.perceiving.vision_perception import VisionPerception
from mapping.sensor_frames import RadarFrame, RangeFrame
from tests.mapping.flights import Flight, flat_ground

MAST = np.array([[0.2, 30.2, 0.5]])


def scan(t: float, number: int, source: str = "a") -> RadarFrame:
    columns = ([[0.0, 20.0, 1.0]], [0.0], [40.0])
    return RadarFrame.of(*columns, t_mono_s=t, t_utc_s=0.0, number=number, source=source)


def flown() -> RadarPerception:
    radar = RadarPerception(Settings())
    flight = Flight(radar)
    for _ in range(20):
        flight.move()
    return radar


@pytest.mark.parametrize(
    ("t", "number", "reason"),
    [
        (math.nan, 2, "time not finite"),
        (103.0, 2, "from the future"),
        (99.0, 2, "too late"),
        (101.9, 1, "duplicate"),
        (101.7, 2, "out of order"),
        (102.0, 2, None),
    ],
)
def test_refused_frames_are_counted_by_reason(t: float, number: int, reason: str | None) -> None:
    radar = flown()
    assert radar.on_frame(scan(101.9, 1), 101.9).accepted
    result = radar.on_frame(scan(t, number), 102.0)
    assert result.accepted == (reason is None)
    assert radar.dropped == ({reason: 1} if reason else {})


def test_missing_numbers_are_lost_frames_and_another_source_counts_anew() -> None:
    radar = flown()
    for t, number, source in ((101.5, 7, "a"), (101.6, 10, "a"), (101.7, 3, "a"), (101.8, 900_000, "b")):
        assert radar.on_frame(scan(t, number, source), 102.0).accepted
    assert radar.lost_frames == 2


def test_a_frame_without_a_pose_is_dropped_and_said() -> None:
    radar = RadarPerception(Settings())
    radar.feed_position(100.0, (0, 0, 0))
    assert not radar.on_frame(scan(100.1, 1), 100.1).accepted
    radar.feed_attitude(100.0, 0, 0, 0)
    assert not radar.on_frame(scan(100.5, 2), 100.5).accepted
    assert radar.dropped == {"no attitude": 1, "position too far in time": 1}
    assert radar.map.voxel_count == 0


def test_states() -> None:
    radar = RadarPerception(Settings())
    assert radar.on_tick(99.0).state == "waiting"
    flight = Flight(radar)
    flight.move()
    assert flight.radar(MAST).state == "running"
    assert radar.on_tick(flight.t_s + 0.5).state == "running"
    late = radar.on_tick(flight.t_s + 3.0)
    assert late.state == "stale"
    assert "3 s" in late.text


def test_a_frame_that_comes_late_is_told_with_its_region_and_is_no_silence() -> None:
    radar = flown()
    result = radar.on_frame(scan(100.5, 1), 102.0)
    assert (result.accepted, result.state, result.text) == (True, "running", "")
    assert result.region is not None
    assert radar.on_tick(102.5).state == "running"
    silent = radar.on_tick(103.1)
    assert (silent.state, silent.text) == ("stale", "No radar frame for 1 s. Check the sensor.")


@pytest.mark.parametrize(("stops", "other"), [("position", "attitude"), ("attitude", "position")])
def test_what_the_vehicle_does_not_tell_any_more_is_said(stops: str, other: str) -> None:
    radar = RadarPerception(Settings())
    feed = {
        "position": lambda t: radar.feed_position(t, (0, 0, 10), (0, 0, 0)),
        "attitude": lambda t: radar.feed_attitude(t, 0, 0, 0),
    }
    for what in feed.values():
        what(102.0)
    for k in range(1, 14):
        feed[other](102.0 + 0.1 * k)
    result = radar.on_frame(scan(103.3, 1), 103.3)
    assert radar.dropped[f"{stops} too far in time"] == 1
    assert (result.state, result.text) == ("frozen", f"No {stops} from the vehicle: the radar map stands still.")
    feed[stops](103.4)
    assert radar.on_frame(scan(103.5, 2), 103.5).state == "running"


def test_without_gnss_the_map_is_frozen_and_says_so() -> None:
    flight = Flight(RadarPerception(Settings()))
    flight.move()
    flight.radar(MAST)
    revision = flight.perception.map.revision
    for _ in range(5):
        flight.move(has_fix=False)
        result = flight.radar(MAST + np.array([1.0, 2.0, 0.0]))
    result = flight.results[-1]
    assert result.state == "frozen"
    assert flight.perception.dropped["no GNSS position"] > 0
    assert "GNSS" in result.text
    assert flight.perception.map.revision == revision
    flight.move()
    assert flight.radar(MAST).state == "running"


def test_a_glitch_of_100_m_is_quarantined() -> None:
    flight = Flight(RadarPerception(Settings()))
    for _ in range(10):
        flight.move()
        flight.radar(MAST)
    flight.east_m = 100.0
    for _ in range(10):
        flight.move()
        result = flight.radar(MAST + np.array([100.0, 0.0, 0.0]))
    result = flight.results[-1]
    assert result.state == "frozen"
    assert "jumped" in result.text
    assert flight.perception.dropped["pose: position jumped"] == 10
    assert flight.perception.map.occupied()[:, 0].max() < 20
    flight.east_m = 0.0
    flight.move()
    assert flight.radar(MAST).accepted


def test_on_the_ground_nothing_alarms() -> None:
    flight = Flight(RadarPerception(Settings()), speed_m_s=0.0)
    flight.perception.set_flying(False)
    for _ in range(5):
        flight.move()
        result = flight.radar(MAST * np.array([1, 0.2, 1]))
    result = flight.results[-1]
    assert result.obstacles
    assert not flight.begun()
    flight.perception.set_flying(True)
    flight.move()
    assert flight.radar(MAST * np.array([1, 0.2, 1])).alerts


def test_the_corridor_sees_along_the_mission_where_the_sector_does_not() -> None:
    line = [[0.0, 0.0, 0.0], [0.0, 12.0, 0.0], [30.0, 12.0, 0.0]]
    around_the_corner = np.array([[8.0, 12.5, 0.5]])
    flight = Flight(RadarPerception(Settings()))
    flight.perception.set_line(line)
    for _ in range(10):
        flight.move()
        result = flight.radar(around_the_corner)
    result = flight.results[-1]
    assert result.region is not None
    assert not result.region.occupied
    assert result.corridor_occupied
    assert result.corridor_m == pytest.approx(Braking().distance_m(4.0) + 5 * 4.0 + 0.5)
    assert [o.region for o in result.obstacles] == ["corridor"]
    flight.perception.set_line(None)
    flight.move()
    assert not flight.radar(around_the_corner).corridor_occupied


def test_bare_papers_believe_everything_and_have_no_corridor() -> None:
    flight = Flight(RadarPerception(Settings(paper_bare=True)))
    flight.perception.set_ground(flat_ground())
    flight.perception.set_line([[0, 0, 0], [0, 100, 0]])
    flight.move()
    result = flight.radar(np.array([[0.0, 8.0, 0.5]]), 12.0)
    assert result.region is not None
    assert result.region.occupied
    assert result.corridor_m == 0.0
    assert flight.begun() == ["obstacle"]


def test_another_resolution_begins_the_map_anew_and_other_regions_do_not() -> None:
    flight = Flight(RadarPerception(Settings()))
    flight.move()
    flight.radar(MAST)
    flight.perception.set_settings(Settings(depth_m=40.0))
    assert flight.perception.map.voxel_count == 1
    flight.move()
    result = flight.radar(MAST)
    assert result.region is not None
    assert result.region.occupied
    flight.perception.set_settings(Settings(depth_m=40.0, resolution_m=0.5))
    assert flight.perception.map.voxel_count == 0
    assert flight.perception.map.resolution_m == 0.5


def test_clearing_forgets_the_map_and_what_was_believed() -> None:
    flight = Flight(RadarPerception(Settings()))
    for _ in range(3):
        flight.move()
        flight.radar(MAST)
    assert len(flight.perception.map.occupied(explained=False))
    flight.perception.clear()
    assert flight.perception.map.voxel_count == 0
    flight.move()
    flight.radar(np.empty((0, 3)))
    assert not len(flight.perception.map.occupied(explained=False))


def test_the_polar_display_shows_what_is_around() -> None:
    flight = Flight(RadarPerception(Settings()))
    flight.move()
    flight.radar(MAST)
    flight.move(0.3)
    result = flight.radar(MAST)
    assert len(result.sweep_m) == 72
    assert result.sweep_m[0] == pytest.approx(30.5 - flight.north_m, abs=0.6)
    assert all(away is None for away in result.sweep_m[2:71])


@pytest.mark.parametrize("perception", [RadarPerception, VisionPerception, RangePerception])
def test_sensors_share_nothing(perception: type[Perception]) -> None:
    a, b = perception(Settings()), perception(Settings())
    a.feed_position(1.0, (1, 2, 3))
    a.dropped["x"] += 1
    assert b.track.position_t_mono_s is None
    assert not b.dropped
    assert a.map is not b.map


def test_ranges_become_voxels_in_their_directions() -> None:
    ranges = RangePerception(Settings(depth_m=7.0, resolution_m=0.5))
    flight = Flight(ranges, heading_rad=math.pi / 2)
    ranges.set_ground(flat_ground())
    flight.move()
    p = flight.position
    bearing, elevation = (0.0, math.pi / 2, 0.0, 0.0, 0.0), (0.0, 0.0, -math.pi / 2, 0.0, 0.0)
    away = (5.0, 6.0, 5.0, math.nan, 1e6)
    scan = RangeFrame(flight.t_s, 0.0, 1, "", bearing, elevation, away, (0.0, 0.1), 0.1, 0.2, 30.0)
    result = ranges.on_frame(scan, flight.t_s)
    probability = ranges.map.probability(p + np.array([[5.0, 0, 0], [0, -6.0, 0], [0, 0, -5.0]]))
    assert (probability > 0.5).all()
    np.testing.assert_array_equal(ranges.map.explained(p + np.array([[5.0, 0, 0], [0, 0, -5.0]])), [False, True])
    assert ranges.dropped == {"points: not finite": 1, "points: absurd range": 1}
    assert result.region is not None
    assert result.region.occupied
