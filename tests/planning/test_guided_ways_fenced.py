"""Guided ways with a fence: around it where that can be certified, else refused in its own words."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planning.fence.fence_model import Fence, RallyPoint, circle
from planning.guided.guided_model import GoTo, Orbit, Rally, ToHome
from tests.planning.test_guided_ways import CLEARANCE, DEMAND, REQUIRED_M, WEST, asked, at, flat, here, model, nearest_m


def test_a_fence_refuses_with_its_own_words_and_is_not_flown_over() -> None:
    dsm = model(flat())
    fence = Fence(circles=(circle(*at(dsm, 75.0, 60.0), 5.0, inclusion=False, where="test"),))
    way = asked(flat(), GoTo(8.0, at(dsm, 75.0, 60.0)), demand=replace(DEMAND, fence=fence))
    assert way.problem == "way"
    assert "exclusion circle 1" in way.reasons[0]


@pytest.mark.parametrize("wish", ["to", "orbit"])
def test_behind_a_fence_only_the_vehicles_own_return_is_not_clear(wish: str) -> None:
    """The line leads around the zone; the straight return would cross it: that may be accepted, the line is kept."""
    dsm = model(flat())
    fence = Fence(circles=(circle(*at(dsm, 80.0, 60.0), 5.0, inclusion=False, where="test"),))
    goal = at(dsm, 100.0, 60.0)
    way = asked(flat(), GoTo(8.0, goal) if wish == "to" else Orbit(goal, 5.0, 8.0), demand=replace(DEMAND, fence=fence))
    assert (way.problem, way.turns > 0) == ("return", True)
    assert way.certificate.fence is not None
    assert (way.certificate.fence.keeps, way.certificate.fence.line_keeps) == (False, True)
    assert "A way home" in way.reasons[0]
    assert "a guided way leads there" in way.certificate.reasons[0].mend


@pytest.mark.parametrize("wish", ["to", "orbit"])
def test_a_fence_on_the_way_is_passed_beside_where_home_stays_in_sight(wish: str) -> None:
    dsm = model(flat())
    fence = Fence(circles=(circle(*at(dsm, 85.0, 60.0), 4.0, inclusion=False, where="test"),))
    goal = at(dsm, 85.0, 95.0)
    way = asked(
        flat(),
        GoTo(8.0, goal) if wish == "to" else Orbit(goal, 5.0, 8.0),
        start=here(dsm, 85.0, 30.0, 8.0),
        demand=replace(DEMAND, fence=fence),
    )
    assert way.problem is None
    assert way.turns > 0
    assert way.certificate.fence is not None
    assert way.certificate.fence.keeps
    assert way.points_m[:, 0].min() < WEST + 80.0
    assert way.raised_m == 0.0
    assert nearest_m(flat(), way) >= REQUIRED_M


@pytest.mark.parametrize("wish", ["home", "rally"])
def test_ways_home_lead_around_a_fence_that_hides_home(wish: str) -> None:
    """The vehicle's own straight way back would breach it; who is on a certified way home does not need that one."""
    dsm = model(flat())
    fence = Fence(circles=(circle(*at(dsm, 80.0, 60.0), 4.0, inclusion=False, where="test"),))
    start, demand = here(dsm, 100.0, 60.0, 8.0), replace(DEMAND, fence=fence)
    goal = ToHome(8.0) if wish == "home" else Rally(RallyPoint(*at(dsm, 50.0, 60.0), 8.0), 8.0)
    way = asked(flat(), goal, start=start, demand=demand)
    assert way.problem is None
    assert way.turns > 0
    assert way.certificate.fence is not None
    assert (way.certificate.fence.keeps, way.certificate.fence.line_keeps) == (False, True)
    assert asked(flat(), GoTo(8.0, at(dsm, 60.0, 60.0)), start=start, demand=demand).problem == "return"


def test_a_way_home_below_a_ceiling_that_the_vehicles_own_return_breaches_is_flown() -> None:
    dsm = model(flat())
    clearance = replace(CLEARANCE, rtl_height_m=30.0)
    demand = replace(DEMAND, clearance=clearance, fence=Fence(ceiling_rel_home_m=25.0))
    start = here(dsm, 100.0, 60.0, 15.0)
    way = asked(flat(), ToHome(15.0), start=start, demand=demand)
    assert (way.problem, way.points_m[-1, 2]) == (None, pytest.approx(115.0))
    assert any("climbs to 30.00 m" in reason for reason in way.reasons)
    assert asked(flat(), ToHome(24.5), start=start, demand=demand).problem == "way"
    assert asked(flat(), GoTo(15.0, at(dsm, 60.0, 60.0)), start=start, demand=demand).problem == "way"
