"""What sensors say about the region ahead, put together."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from telemetry.flight.avoidance.regions import CLEAR_FRAMES, Regions, sees_enough_for
from telemetry.topics.obstacles import PerceptionSettings, PerceptionStatus, Region, Sensor
from tests.telemetry.avoiding_bench import seen_at

ROI = Region((0.0, 0.0, 0.0), 0.0, 7.0, 0.4, 2.0, occupied=False)


def status(t_s: float, **changes: Any) -> PerceptionStatus:
    plain = PerceptionStatus("vision", "running", "", t_s, 0.0, t_s, region=ROI)
    return replace(plain, **changes)


def of(*said: PerceptionStatus) -> Regions:
    regions = Regions(PerceptionSettings())
    for each in said:
        regions.take(each, each.t_mono_s)
    return regions


def test_a_frame_counts_for_half_a_second_and_only_of_a_sensor_that_works() -> None:
    regions = of(status(10.0), status(10.0, sensor="radar", state="frozen"))
    assert regions.counted(10.4) == ("vision",)
    assert regions.counted(10.6) == ()
    assert regions.oldest(frozenset({"vision"}), 10.4) is None
    old = regions.oldest(frozenset({"vision", "radar"}), 10.4)
    assert old is not None
    assert old.sensor == "radar"


def test_what_is_in_the_region_is_in_the_way_until_several_fresh_frames_are_clear() -> None:
    regions = of(status(1.0, obstacles=(seen_at(5.0),)))
    vision: frozenset[Sensor] = frozenset({"vision"})
    assert [sight.distance_m for sight in regions.occupied(1.1)] == [5.0]
    for k in range(1, CLEAR_FRAMES + 1):
        assert not regions.is_clear(vision, 1.0 + 0.1 * k)
        regions.take(status(1.0 + 0.1 * k), 1.0 + 0.1 * k)
        regions.take(status(1.0 + 0.1 * k), 1.0 + 0.1 * k)  # the same frame, told again
    assert regions.is_clear(vision, 1.4)
    assert not regions.is_clear(vision, 2.4)


def test_a_region_that_is_occupied_without_a_cluster_counts_too() -> None:
    regions = of(status(1.0, region=replace(ROI, occupied=True)))
    assert [sight.distance_m for sight in regions.occupied(1.1)] == [7.0]


def test_in_the_corridor_only_what_is_near_and_not_below_is_in_the_way() -> None:
    far, low, near = (
        seen_at(9.0, region="corridor"),
        seen_at(3.0, region="corridor", height_difference_m=-1.5),
        seen_at(6.0, region="corridor", height_difference_m=0.2),
    )
    assert of(status(1.0, obstacles=(low, far))).occupied(1.0) == ()
    assert [s.distance_m for s in of(status(1.0, obstacles=(low, near, far))).occupied(1.0)] == [6.0]


def test_late_frames_change_nothing_and_nearest_sights_come_first() -> None:
    regions = of(
        status(2.0, obstacles=(seen_at(5.0),)),
        status(1.0),
        status(2.0, sensor="radar", region=replace(ROI, depth_m=10.0), obstacles=(seen_at(4.0),)),
    )
    assert [(sight.sensor, sight.distance_m) for sight in regions.occupied(2.1)] == [("radar", 4.0), ("vision", 5.0)]
    assert regions.sights["radar"].depth_m == PerceptionSettings().radar_depth_m == 10.0
    assert regions.seen_by(2.1) == {"radar", "vision"}


def test_who_does_not_look_ahead_says_nothing_about_what_is_there() -> None:
    """Such as a range finder that looks down."""
    assert of(status(1.0, sensor="ranges", region=None, obstacles=(seen_at(4.0),))).counted(1.0) == ()


def hidden(t_s: float, **changes: Any) -> PerceptionStatus:
    return status(t_s, region=replace(ROI, nearest_m=1.5, hidden_m=0.6), **changes)


def test_what_cannot_be_seen_is_not_clear_however_many_frames_show_nothing() -> None:
    vision: frozenset[Sensor] = frozenset({"vision"})
    regions = of(*(hidden(1.0 + 0.1 * k, frames=k) for k in range(20)))
    assert not regions.is_clear(vision, 2.9)
    assert not regions.is_clear(frozenset(), 2.9)
    assert regions.nearest_m(vision, 2.9) == 0.6
    for k in range(20, 20 + CLEAR_FRAMES):
        regions.take(status(1.0 + 0.1 * k, frames=k), 1.0 + 0.1 * k)
    assert regions.is_clear(vision, 3.2)


def test_where_nobody_looks_nothing_is_clear() -> None:
    assert not of().is_clear(frozenset(), 1.0)
    assert not of(*(status(1.0 + 0.1 * k) for k in range(5))).is_clear(frozenset(), 3.0)


def test_a_map_that_began_anew_has_forgotten_what_stood_there() -> None:
    vision: frozenset[Sensor] = frozenset({"vision"})
    regions = of(status(1.0, obstacles=(seen_at(5.0),), frames=50))
    regions.rely()
    for k in range(5):
        regions.take(status(1.1 + 0.1 * k, frames=k), 1.1 + 0.1 * k)
    assert not regions.is_clear(vision, 1.5)
    assert regions.hidden(vision, 1.5) is not None


def test_how_fast_it_may_be_follows_from_what_each_sensor_sees_and_how_late() -> None:
    slow = of(*(status(1.0 + 0.2 * k, latency_s=0.1) for k in range(5)))
    slowest = slow.slowest(1.8)
    assert slowest is not None
    sight, speed_m_s = slowest
    assert sight.period_s == pytest.approx(0.2)
    assert 2.5 < speed_m_s < 2.8  # 7 m less hull, error and half a voxel; half a second
    late = of(*(status(1.0 + 0.2 * k, latency_s=0.5) for k in range(5))).slowest(1.8)
    assert late is not None
    assert late[1] < speed_m_s - 0.2


def test_a_late_frame_shows_what_is_in_the_way_and_nothing_to_be_clear() -> None:
    regions, vision = Regions(PerceptionSettings()), frozenset[Sensor]({"vision"})
    regions.take(status(1.0, obstacles=(seen_at(5.0),)), 1.9)
    assert regions.counted(1.9) == ()
    assert regions.seen_by(1.9) == regions.seen_by(2.8) == vision
    assert regions.silent(vision, 1.9) is not None
    in_time, late = of(status(1.0)).slowest(1.0), regions.slowest(1.9)
    assert in_time is not None
    assert late is not None
    assert late[1] < in_time[1] - 0.5
    assert regions.seen_by(3.0) == frozenset(), "nothing has come for a second"
    for k in range(1, 10):
        regions.take(status(1.0 + 0.1 * k), 1.9 + 0.1 * k)
    assert regions.seen_by(2.8) == frozenset(), "a newer frame does not show it"
    assert not regions.is_clear(vision, 2.8)
    assert (regions.slowest(3.9), regions.eyes(3.9)) == (None, [])
    regions.take(status(4.0, obstacles=(seen_at(5.0),)), 6.1)
    assert regions.eyes(6.1) == [], "nobody knows what stands there now"


def test_one_late_frame_is_a_hiccup_and_two_count_for_a_while() -> None:
    def slowest(*came_after_s: float) -> tuple[bool, float]:
        regions = Regions(PerceptionSettings())
        for k, late_s in enumerate(came_after_s):
            regions.take(status(1.0 + 0.2 * k, latency_s=0.1), 1.0 + 0.2 * k + late_s)
        now_s = 1.0 + 0.2 * (len(came_after_s) - 1) + came_after_s[-1]
        (sight,) = regions.eyes(now_s)
        found = regions.slowest(now_s)
        assert found is not None
        return sight.is_late, found[1]

    usual, once = slowest(*[0.1] * 20), slowest(*[0.1] * 18, 0.9, 0.1)
    assert once == usual
    assert slowest(*[0.1] * 19, 0.9)[0], "that one shows nothing to be clear"
    twice = slowest(*[0.1] * 17, 0.9, 0.9, 0.1)
    assert twice[0]
    assert twice[1] < usual[1] - 0.5
    assert slowest(*[0.1] * 5, 0.9, 0.9, *[0.1] * 19) == usual
    assert slowest(*[0.45] * 20)[1] < usual[1] - 0.2, "slower than its node alone knows"


def test_what_is_told_of_a_refused_frame_says_nothing_about_the_region() -> None:
    regions = of(status(1.0, obstacles=(seen_at(5.0),)))
    for t_s in (1.1, 1.2, 1.3, 1.0, 50.0):  # the last one says that it is from the future
        regions.take(status(t_s, region=None), 1.3)
    assert [sight.distance_m for sight in regions.occupied(1.4)] == [5.0]
    assert not regions.is_clear(frozenset({"vision"}), 1.4)
    regions.take(status(1.4), 1.4)
    assert regions.sights["vision"].t_mono_s == 1.4


def test_before_any_frame_a_region_allows_the_speed_from_which_the_vehicle_stops_in_it() -> None:
    usual = PerceptionSettings()
    assert sees_enough_for(usual, "radar") == pytest.approx(4.1, abs=0.1)
    assert sees_enough_for(usual, "vision") < sees_enough_for(usual, "radar")
    assert sees_enough_for(replace(usual, radar_depth_m=20.0), "radar") > 7.0
    assert sees_enough_for(replace(usual, brake_jerk_m_s3=2.5), "radar") < 3.6
