"""Going on with a mission that broke off: at which item, and how the vehicle gets back to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planning.basics.plan_model import ANY_VEHICLE, MissionItem
from planning.certificate.clearance import certify
from planning.missions.flown import flown_line
from planning.missions.vehicle_terms import budget_of
from telemetry.errors import NotAllowedError
from telemetry.flight.preflight.resume import plan_resumption, resume_item
from tests.server.flight_logs import PLAIN, mission
from tests.telemetry.test_preflight import CLEARANCE, PLANNED


def test_going_on_at_the_item_that_was_flown_to() -> None:
    with_speed = replace(PLANNED, items=(MissionItem(178, 2, (1.0, 2.0, -1.0, 0.0)), *PLANNED.items))
    assert resume_item(with_speed, 4) == 4
    assert resume_item(with_speed, 1) == 3  # speed and take-off are no places to go on at
    for number in (0, 6, 7):
        with pytest.raises(NotAllowedError):
            resume_item(with_speed, number)


def test_the_way_back_is_as_high_as_needed() -> None:
    low = mission([(50.0, 150.0, 20.0), (250.0, 200.0, 5.0), (250.0, 150.0, 5.0)])
    found = plan_resumption(low, 4, PLAIN, CLEARANCE)
    assert found.from_item == 4
    assert found.needed_m == pytest.approx(10.0, abs=0.01)
    assert found.climb_to_m == pytest.approx(10.1, abs=0.11)
    assert found.certificate.certified
    assert found.certificate.min_distance_m >= 2.0
    assert plan_resumption(low, 3, PLAIN, CLEARANCE).climb_to_m >= 5.0


def test_over_a_model_that_tells_its_error_the_way_back_is_higher_by_it() -> None:
    low = mission([(50.0, 150.0, 20.0), (250.0, 200.0, 9.0), (250.0, 150.0, 9.0)])
    budget = budget_of(ANY_VEHICLE)
    asked = replace(CLEARANCE, required_clearance_m=budget.total_m, budget=budget)
    plain = plan_resumption(low, 4, PLAIN, asked)
    told = plan_resumption(low, 4, replace(PLAIN, rms_m=0.3), asked)
    more_m = 3 * 0.3 - budget.value_m("dsm_accuracy")
    assert told.needed_m == pytest.approx(plain.needed_m + more_m, abs=1e-6)
    assert told.certificate.required_clearance_m == pytest.approx(plain.certificate.required_clearance_m + more_m)


def test_where_home_may_stand_lower_the_way_back_is_higher_by_it() -> None:
    low = mission([(50.0, 150.0, 20.0), (250.0, 200.0, 9.0), (250.0, 150.0, 9.0)])
    plain = plan_resumption(low, 4, PLAIN, CLEARANCE)
    heights = PLAIN.elevation_m
    may_be_lower = replace(PLAIN, lowest_m=heights - np.float32(0.85), seam=np.zeros(heights.shape, np.bool_))
    found = plan_resumption(low, 4, may_be_lower, CLEARANCE)
    assert found.needed_m == pytest.approx(plain.needed_m + 0.85, abs=1e-5)
    assert found.certificate.certified
    with pytest.raises(NotAllowedError, match=r"Climb to 11\.0 m"):
        plan_resumption(low, 4, may_be_lower, CLEARANCE, climb_to_m=plain.climb_to_m)


def test_the_way_back_at_a_height_of_the_pilots_choice() -> None:
    low = mission([(50.0, 150.0, 20.0), (250.0, 200.0, 5.0), (250.0, 150.0, 5.0)])
    assert plan_resumption(low, 4, PLAIN, CLEARANCE, climb_to_m=15.0).climb_to_m == 15.0
    with pytest.raises(NotAllowedError, match=r"not clear at 6\.0 m.*Climb to 10\.1 m") as caught:
        plan_resumption(low, 4, PLAIN, CLEARANCE, climb_to_m=6.0)
    assert caught.value.where == "the way from home to item 4"


def test_no_way_back_over_unknown_terrain() -> None:
    cells = np.array(PLAIN.elevation_m)
    cells[:, 180:190] = np.nan
    with pytest.raises(NotAllowedError, match="does not know"):
        plan_resumption(PLANNED, 4, PLAIN.with_elevation(cells), CLEARANCE)


def test_what_was_set_before_is_named() -> None:
    with_speed = replace(PLANNED, items=(MissionItem(178, 2, (1.0, 2.0, -1.0, 0.0)), *PLANNED.items))
    assert plan_resumption(with_speed, 4, PLAIN, CLEARANCE).skipped == ()  # the link node sets speeds again
    with_camera = replace(PLANNED, items=(MissionItem(206, 2, (5.0, 0.0, 1.0, 0.0)), *PLANNED.items))
    assert plan_resumption(with_camera, 4, PLAIN, CLEARANCE).skipped == (1,)


def test_the_rest_is_certified_as_the_certificate_would() -> None:
    found = plan_resumption(PLANNED, 3, PLAIN, CLEARANCE)
    rest = replace(PLANNED, items=(PLANNED.items[0], *PLANNED.items[2:]))
    whole = certify(PLAIN, flown_line(rest, PLAIN), CLEARANCE)
    assert found.certificate.min_distance_m == pytest.approx(whole.min_distance_m, abs=0.01)
