"""Flights of real autopilots, replayed through the link: told phase, item and end against the vehicle's truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from mapping.geometry.frames import apart_m
from planning.basics.plan_model import VehicleProfile
from telemetry.flight.preflight import checks
from telemetry.topics.messages import FlightStatus
from tests.telemetry.replayed_link import ReplayedLink, received, replayed

ARMED = 128
RETURN_TO_LAUNCH = 20
LATE_S = 0.4
"""Between the vehicle's word and ours."""
NEAR_M = 1.0


@pytest.fixture(scope="module")
def flown(shared_data: Path) -> Callable[[str], tuple[Path, ReplayedLink]]:
    links: dict[str, ReplayedLink] = {}

    def replay(name: str) -> tuple[Path, ReplayedLink]:
        path = shared_data / "logs" / "real_flights" / f"{name}.mcap"
        if name not in links:
            links[name] = replayed(path)
        return path, links[name]

    return replay


def phases(link: ReplayedLink) -> list[str]:
    found = [status.phase for _, status in link.told]
    return [p for k, p in enumerate(found) if k == 0 or found[k - 1] != p]


def told_at(link: ReplayedLink, t_s: float) -> FlightStatus:
    return [status for at_s, status in link.told if at_s <= t_s][-1]


def disarmed_s(path: Path) -> float | None:
    """When the vehicle's heartbeat first said so after a flight."""
    armed = False
    for t_s, message in received(path):
        if message.get_type() == "HEARTBEAT" and message.get_srcComponent() == 1:
            now_armed = bool(message.base_mode & ARMED)
            if armed and not now_armed:
                return t_s
            armed = now_armed
    return None


WHOLE = ["idle", "taking_off", "flying", "returning", "landed"]


@pytest.mark.fact("A10")
@pytest.mark.parametrize(
    ("name", "way", "items"),
    [
        ("arducopter-4.7_auto", "auto", 13),
        ("px4-1.17_auto_rtk", "auto", 13),
        ("arducopter-4.7_guided_below_certified", "guided", 24),
        ("px4-1.17_guided_rtk", "guided", 12),
        ("arducopter-4.7_console_b", "auto", 16),
    ],
)
def test_a_flight_that_was_completed_is_told_as_completed(flown: Any, name: str, way: str, items: int) -> None:
    path, link = flown(name)
    assert link.failures == []
    assert [phase for phase in phases(link) if phase != "arming"] == WHOLE
    t_s, last = link.told[-1]
    assert (last.way, last.phase, last.broke_off_at, last.targets) == (way, "landed", None, items)
    at_rest_s = disarmed_s(path)
    assert at_rest_s is None or t_s == pytest.approx(at_rest_s, abs=LATE_S)


def test_a_flight_that_was_lost_from_sight_on_its_way_down_is_not_over(flown: Any) -> None:
    path, link = flown("arducopter-4.7_console_a")
    assert disarmed_s(path) is None
    assert phases(link) == WHOLE[:-1]
    assert (link.flight.broke_off_at, link.told[-1][1].target, link.told[-1][1].targets) == (None, 4, 5)


@pytest.mark.fact("P1")
@pytest.mark.parametrize(("name", "version"), [("px4-1.17_auto_rtk", None), ("arducopter-4.7_auto", "4.7.0-dev")])
def test_a_vehicle_that_was_started_then_may_be_started_now(flown: Any, name: str, version: str | None) -> None:
    """PX4 says that its position is constant as long as it stands on the ground."""
    _, link = flown(name)
    arming_s = next(t_s for t_s, status in link.told if status.phase in ("arming", "taking_off"))
    state = [state for t_s, state in link.states if t_s < arming_s][-1]
    assert (state.ready_to_arm, state.estimator_ok, state.firmware_version) == (True, True, version)
    profile = VehicleProfile("quad", position_error_m=0.5)
    assert [checks.gnss_row(state, profile).state, checks.ready_row(state).state] == ["good", "good"]


def current_items(path: Path, first: int) -> Iterator[tuple[float, int]]:
    """(time, item) by the vehicle's own word while its motors turn; ``first``: how it counts the first item."""
    armed = False
    for t_s, message in received(path):
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            armed = bool(message.base_mode & ARMED)
        elif kind == "MISSION_CURRENT" and armed and message.seq >= first:
            yield t_s, message.seq - first + 1


@pytest.mark.parametrize(("name", "first"), [("arducopter-4.7_auto", 1), ("px4-1.17_auto_rtk", 0)])
def test_the_item_that_is_told_is_the_one_that_is_flown_to(flown: Any, name: str, first: int) -> None:
    path, link = flown(name)
    truth = list(current_items(path, first))
    changes = [(t_s, item) for k, (t_s, item) in enumerate(truth) if k == 0 or truth[k - 1][1] != item]
    assert [item for _, item in changes][-3:] == [11, 12, 13]
    for t_s, item in changes:
        assert told_at(link, t_s + LATE_S).target == item
    returning_s = next(t_s for t_s, status in link.told if status.phase == "returning")
    assert returning_s == pytest.approx(changes[-1][0], abs=LATE_S)


@pytest.mark.parametrize("name", ["arducopter-4.7_guided_below_certified", "px4-1.17_guided_rtk"])
def test_a_place_that_is_told_as_reached_was_reached(flown: Any, name: str) -> None:
    _, link = flown(name)
    items = dict(enumerate(link.line.onboard.items, start=1))
    states = [(t_s, state) for t_s, state in link.states if state.alt_rel_home_m is not None]
    flying = [(t_s, status.target) for t_s, status in link.told if status.phase in ("flying", "returning")]
    assert len(flying) > 8
    for (_, reached), (t_s, _) in pairwise(flying):
        state, item = min(states, key=lambda one: abs(one[0] - t_s))[1], items[reached]
        flat_m = apart_m((item.lat_deg, item.lon_deg), (state.lat_deg, state.lon_deg))
        assert math.hypot(flat_m, state.alt_rel_home_m - item.alt_m) < NEAR_M
