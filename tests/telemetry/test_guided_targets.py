"""A planned mission as targets of the navigation script."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.errors import MissionError
from planning.formats.trajectory_csv import Trajectory
from planning.formats.wpl import read_wpl
from telemetry.flight.guided.script_targets import guided_plan, with_timing

HOME = Home(-37.0, 175.0, 100.0, "NZVD2016")
NAN = math.nan


def item(
    command: int, *params: float, lat: float = 0.0, lon: float = 0.0, alt: float = 0.0, frame: int = 3
) -> MissionItem:
    p = (*params, 0.0, 0.0, 0.0, 0.0)
    return MissionItem(command, frame, (p[0], p[1], p[2], p[3]), lat, lon, alt)


def at(north: int, *, alt: float = 10.0, hold: float = 0.0, **more: Any) -> MissionItem:
    return item(16, hold, lat=-37.0 + north * 1e-4, lon=175.0, alt=alt, **more)


def plan(*items: MissionItem, **more: Any) -> Mission:
    return Mission(HOME, items, **more)


TAKEOFF, RTL = item(22, alt=12.0, lat=-37.0, lon=175.0), item(20, frame=2)


def test_waypoints_become_targets_with_their_numbers_in_the_mission() -> None:
    guided = guided_plan(plan(item(178, 1, 5.0, -1, frame=2), TAKEOFF, at(0), at(1, hold=3), item(206, 5), at(2), RTL))
    assert [target.item for target in guided.targets] == [3, 4, 6]
    assert [target.loiter_s for target in guided.targets] == [0.0, 3.0, 0.0]
    assert {target.speed_m_s for target in guided.targets} == {5.0}
    assert guided.takeoff_alt_rel_home_m == 12.0
    assert guided.end == "rtl"


def test_speed_comes_from_the_items_else_from_the_caller_else_from_the_mission() -> None:
    mission = plan(TAKEOFF, at(0), item(178, 1, 1.5, -1, frame=2), at(1), RTL, cruise_speed_m_s=4.0)
    assert [target.speed_m_s for target in guided_plan(mission).targets] == [4.0, 1.5]
    assert [target.speed_m_s for target in guided_plan(mission, speed_m_s=2.0).targets] == [2.0, 1.5]


def test_loiter_items_are_targets_too() -> None:
    target = guided_plan(plan(TAKEOFF, item(19, 7.0, lat=-37.001, lon=175.0, alt=9.0), RTL)).targets[0]
    assert (target.lat_deg, target.loiter_s, target.alt_rel_home_m) == (-37.001, 7.0, 9.0)


def test_heading_comes_from_condition_yaw_or_px4s_waypoints_or_the_point_to_look_at() -> None:
    ardupilot = guided_plan(plan(TAKEOFF, at(0), item(115, 90.0, frame=2), at(1), RTL)).targets
    assert ardupilot[0].heading_rad is None
    assert ardupilot[1].heading_rad == pytest.approx(math.pi / 2)
    px4 = plan(
        TAKEOFF,
        item(16, 0, 0, 0, 180.0, lat=-37.0, lon=175.0, alt=5.0),
        item(16, 0, 0, 0, NAN, lat=-37.0, lon=175.1, alt=5.0),
        firmware="px4",
    )
    assert [target.heading_rad for target in guided_plan(px4).targets] == [pytest.approx(math.pi), None]
    looking = plan(TAKEOFF, item(195, lat=-37.0, lon=175.1), at(0), item(197), at(1), RTL)
    assert [target.heading_rad for target in guided_plan(looking).targets] == [pytest.approx(math.pi / 2), None]


def test_a_landing_at_home_is_flown_over_home_first() -> None:
    mission = plan(TAKEOFF, at(3, alt=20.0), item(21, lat=-37.0, lon=175.0), cruise_speed_m_s=3.0)
    guided = guided_plan(mission)
    assert guided.end == "land"
    assert [(target.item, target.lat_deg, target.alt_rel_home_m) for target in guided.targets] == [
        (2, pytest.approx(-36.9997), 20.0),
        (3, -37.0, 20.0),
    ]


def test_a_place_or_height_of_zero_keeps_the_present_one() -> None:
    mission = plan(TAKEOFF, at(2, alt=20.0), item(16, alt=25.0), at(4, alt=0.0), RTL)
    second, third = guided_plan(mission).targets[1:]
    assert (second.lat_deg, second.alt_rel_home_m) == (pytest.approx(-36.9998), 25.0)
    assert third.alt_rel_home_m == 25.0


def test_heights_above_sea_level_are_counted_from_home_when_its_datum_is_known() -> None:
    mission = plan(TAKEOFF, at(0, alt=130.0, frame=0), RTL)
    assert guided_plan(mission).targets[0].alt_rel_home_m == pytest.approx(30.0)
    unknown = Mission(Home(-37.0, 175.0, 100.0), mission.items)
    with pytest.raises(MissionError, match="height above home is not known"):
        guided_plan(unknown)
    with pytest.raises(MissionError, match="item 2"):
        guided_plan(plan(TAKEOFF, at(0, frame=10), RTL))


@pytest.mark.parametrize("command", [17, 18, 82, 177, 92])
def test_what_the_script_cannot_fly_is_refused_by_name(command: int) -> None:
    with pytest.raises(MissionError, match=f"item 3.*command {command}"):
        guided_plan(plan(TAKEOFF, at(0), item(command, lat=-37.0, lon=175.0, alt=5.0), RTL))


def test_a_mission_without_waypoints_has_no_targets() -> None:
    with pytest.raises(MissionError, match="no waypoint"):
        guided_plan(plan(TAKEOFF, RTL))


def test_what_follows_the_return_is_left_out() -> None:
    assert len(guided_plan(plan(TAKEOFF, at(0), RTL, at(1))).targets) == 1


def test_the_recorded_mission_gives_85_targets(shared_data: Path) -> None:
    mission = read_wpl((shared_data / "logs" / "arducopter" / "mission.waypoints").read_bytes())
    guided = guided_plan(mission, speed_m_s=3.0)
    assert len(guided.targets) == 85
    assert guided.takeoff_alt_rel_home_m == pytest.approx(13.55)
    assert [target.item for target in guided.targets if target.loiter_s > 0] == [33, 48, 64]
    assert sum(target.loiter_s for target in guided.targets) == 7.0


def trajectory(lat_lon: list[tuple[float, float]], step_s: float, loiter_s: list[float]) -> Trajectory:
    count = len(lat_lon)
    steps_s = np.append(np.full(count - 1, step_s), 0.0)
    flat = np.zeros(count)
    return Trajectory(HOME, np.array(lat_lon), flat, flat, flat, steps_s, np.array(loiter_s), "1")


def test_timing_is_that_of_the_papers_law_counted_from_the_first_target() -> None:
    lat_lon = [(-37.0 + k * 1e-5, 175.0) for k in range(0, 31)]
    loiter_s = [4.0 if k == 10 else 0.0 for k in range(31)]
    targets = guided_plan(plan(TAKEOFF, at(1), at(2), at(3), RTL)).targets
    timed = with_timing(targets, trajectory(lat_lon, 0.5, loiter_s))
    # Target 1 is sample 10 (5 s), where it waits 4 s; targets 2 and 3 are samples 20 and 30.
    assert [target.t_s for target in timed] == pytest.approx([0.0, 9.0, 14.0])


def test_a_route_that_comes_back_is_timed_at_the_first_pass() -> None:
    there = [(-37.0 + k * 1e-5, 175.0) for k in range(0, 31)]
    targets = guided_plan(plan(TAKEOFF, at(1), at(3), at(1), RTL)).targets
    timed = with_timing(targets, trajectory(there + there[-2::-1], 1.0, [0.0] * 61))
    assert [target.t_s for target in timed] == pytest.approx([0.0, 20.0, 40.0])
