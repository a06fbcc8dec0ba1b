"""The check's row of fence and rally points, on what a vehicle gives back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, circle, polygon
from telemetry.flight.fence_actions import at_fence
from telemetry.flight.fence_radius import circle_aboard
from telemetry.flight.preflight.checks import Row
from telemetry.flight.preflight.fence_check import fence_row, flown_within, sent_places
from telemetry.topics.onboard_lists import PlacesOnboard

FENCE = Fence(
    polygons=(polygon([(47.0, 8.0), (47.0, 8.01), (47.01, 8.0)], inclusion=True, where="test"),),
    circles=(circle(47.001, 8.001, 50.0, inclusion=False, where="test"),),
    ceiling_rel_home_m=80.0,
)
RALLY = (RallyPoint(47.002, 8.002, 30.5),)
PLANNED = (FENCE, RALLY)
ACTS = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ACTION": 1.0, "FENCE_ALT_MAX": 80.0, "FENCE_RADIUS": 300.0}


def aboard() -> PlacesOnboard:
    return PlacesOnboard(**sent_places(PLANNED, "ardupilot"))


def judged(onboard: PlacesOnboard, planned=PLANNED, parameters=ACTS, firmware: Firmware = "ardupilot") -> Row:
    row = fence_row(planned, onboard, parameters, firmware)
    assert row is not None
    return row


def test_the_plans_own_is_good_and_says_what_the_vehicle_does() -> None:
    row = judged(aboard())
    assert row.state == "good"
    assert "1 polygon, 1 circle, 1 rally point on board, the plan's" in row.text
    assert "At its fence the vehicle returns, or lands where it cannot (FENCE_ACTION 1)." in row.text


def test_a_corner_that_lies_elsewhere_or_a_point_that_is_missing_is_not_the_plans() -> None:
    whole = aboard()
    shifted = (replace(whole.fence[0], lat_deg=whole.fence[0].lat_deg + 1e-5), *whole.fence[1:])
    for onboard in (replace(whole, fence=shifted), replace(whole, fence=()), replace(whole, rally=())):
        row = judged(onboard)
        assert (row.state, row.mend) == ("bad", "Upload the plan again.")


def test_a_fence_that_the_plan_does_not_have_is_flown_within_all_the_same() -> None:
    row = judged(aboard(), planned=(NO_FENCE, ()))
    assert row.state == "good"
    assert "another than the plan's" in row.text
    assert "hedgehop fence LINK clear" in row.mend
    within = flown_within((NO_FENCE, ()), aboard())
    assert within[0] == replace(FENCE, ceiling_rel_home_m=None)
    assert within[1][0].alt_rel_home_m == 31.0  # as ArduPilot keeps it
    assert flown_within(PLANNED, aboard()) == PLANNED


def test_a_plan_with_a_ceiling_alone_is_flown_within_the_vehicles_shapes_as_well() -> None:
    planned = (replace(NO_FENCE, ceiling_rel_home_m=60.0), RALLY)
    row = judged(aboard(), planned=planned)
    assert "but the fence is not the plan's" in row.text
    assert "hedgehop fence LINK clear" in row.mend
    within = flown_within(planned, aboard())
    assert within[0] == replace(FENCE, ceiling_rel_home_m=60.0)
    assert within[1] == RALLY


HEIGHTS = replace(NO_FENCE, floor_rel_home_m=5.0, ceiling_rel_home_m=60.0)
KEPT = ACTS | {"FENCE_TYPE": 15.0, "FENCE_ALT_MAX": 60.0, "FENCE_ALT_MIN": 5.0}


@pytest.mark.parametrize(
    ("changed", "state", "said"),
    [
        ({}, "good", "The plan's floor at 5 m above home is on board. The plan's ceiling at 60 m above home is on"),
        ({"FENCE_ALT_MAX": 59.999}, "good", "ceiling at 60 m above home is on board."),
        ({"FENCE_ALT_MAX": 50.0}, "good", "is on board, stricter: 50 m; the flight is held against that."),
        ({"FENCE_ALT_MIN": 7.0}, "good", "is on board, stricter: 7 m"),
        ({"FENCE_ALT_MAX": 70.0}, "accept", "The vehicle's ceiling, 70 m above home, is not the plan's, 60 m."),
        ({"FENCE_ALT_MIN": 4.0}, "accept", "The vehicle's floor, 4 m above home, is not the plan's, 5 m."),
        ({"FENCE_TYPE": 7.0}, "accept", "The plan's floor at 5 m above home is not on board."),
        ({"FENCE_ENABLE": 0.0}, "accept", "The plan's ceiling at 60 m above home is not on board."),
        ({"FENCE_ENABLE": 0.0, "FENCE_AUTOENABLE": 3.0}, "good", "The plan's ceiling at 60 m above home is on board."),
        ({"FENCE_ENABLE": None}, "accept", "may not be on board: that was not read"),
        ({"FENCE_TYPE": None}, "accept", "may not be on board: that was not read"),
    ],
)
def test_floor_and_ceiling_are_compared_with_what_the_vehicle_acts_at(changed, state, said) -> None:
    row = judged(PlacesOnboard(), planned=(HEIGHTS, ()), parameters=KEPT | changed)
    assert row.state == state
    assert said in row.text
    assert ("--heights set" in row.mend) is (state == "accept")


def test_px4_keeps_a_ceiling_and_no_floor() -> None:
    row = judged(
        PlacesOnboard(), (HEIGHTS, ()), {"GF_ACTION": 3.0, "GF_MAX_VER_DIST": 60.0, "GF_MAX_HOR_DIST": 0.0}, "px4"
    )
    assert (row.state, row.mend) == ("good", "")
    assert "PX4 has no floor: the vehicle knows nothing of the plan's." in row.text
    assert "The plan's ceiling at 60 m above home is on board." in row.text
    row = judged(PlacesOnboard(), (HEIGHTS, ()), {"GF_ACTION": 3.0, "GF_MAX_VER_DIST": 0.0}, "px4")
    assert row.state == "accept"


def test_heights_of_the_vehicles_own_are_told_and_kept_to() -> None:
    row = judged(PlacesOnboard(), planned=(NO_FENCE, ()), parameters=KEPT)
    assert row.state == "good"
    assert "The vehicle keeps a ceiling of its own at 60 m above home; so does the flight." in row.text
    both = judged(aboard(), parameters=KEPT | {"FENCE_ALT_MAX": 80.0, "FENCE_TYPE": 5.0})
    assert "on board, the plan's; the flight is held against it. The plan's ceiling at 80 m above home is" in both.text


def test_a_circle_around_home_at_which_the_vehicle_acts_is_told_and_one_that_was_not_read_is_to_be_accepted() -> None:
    px4 = {"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 0.0, "GF_MAX_HOR_DIST": 80.0}
    of_both: tuple[tuple[dict[str, float], Firmware, str, int], ...] = (
        (ACTS, "ardupilot", "FENCE_RADIUS", 300),
        (px4, "px4", "GF_MAX_HOR_DIST", 80),
    )
    for parameters, firmware, name, radius_m in of_both:
        row = judged(PlacesOnboard(), (NO_FENCE, ()), parameters, firmware)
        assert row.state == "good"
        assert f"The vehicle keeps within {radius_m} m of home ({name}); so does the flight." in row.text
        unread = judged(PlacesOnboard(), (NO_FENCE, ()), parameters | {name: None}, firmware)
        assert (unread.state, "was not read" in unread.text, "accept it" in unread.mend) == ("accept", True, True)
        circle_of = circle_aboard(parameters, firmware, (47.0, 8.0)).circles
        assert [(each.inclusion, each.centre_lat_lon_deg, each.radius_m) for each in circle_of] == [
            (True, (47.0, 8.0), radius_m)
        ]
    assert circle_aboard(ACTS | {"FENCE_TYPE": 5.0}, "ardupilot", (47.0, 8.0)) == NO_FENCE
    assert circle_aboard(ACTS | {"FENCE_ENABLE": 0.0}, "ardupilot", (47.0, 8.0)) == NO_FENCE
    assert circle_aboard(px4 | {"GF_ACTION": 0.0}, "px4", (47.0, 8.0)) == NO_FENCE


def test_a_height_that_is_not_counted_from_home_is_to_be_accepted() -> None:
    row = judged(PlacesOnboard(), (NO_FENCE, ()), KEPT | {"FENCE_ALT_MAX_TP": 0.0})
    assert row.state == "accept"
    assert "is not counted from home (FENCE_ALT_MAX_TP 0)" in row.text
    assert "ceiling of its own" not in row.text


def test_nothing_anywhere_is_no_row() -> None:
    for off in ({"FENCE_ENABLE": 0.0}, {"FENCE_TYPE": 4.0}):
        assert fence_row((NO_FENCE, ()), PlacesOnboard(), ACTS | off, "ardupilot") is None


@pytest.mark.parametrize(
    ("parameters", "firmware", "said"),
    [
        (ACTS | {"FENCE_ENABLE": 0.0}, "ardupilot", "FENCE_ENABLE is 0"),
        (ACTS | {"FENCE_TYPE": 3.0}, "ardupilot", "FENCE_TYPE is 3, without 4"),
        ({"GF_ACTION": 0.0}, "px4", "GF_ACTION is 0"),
    ],
)
def test_a_fence_that_the_vehicle_does_not_act_on_has_to_be_accepted(parameters, firmware, said) -> None:
    onboard = PlacesOnboard(**sent_places(PLANNED, firmware))
    row = judged(onboard, parameters=parameters, firmware=firmware)
    assert row.state == "accept"
    assert said in row.text


def test_what_could_not_be_read_stands_in_the_way_of_a_plan_with_a_fence_only() -> None:
    silent = PlacesOnboard(unread="The vehicle does not answer.")
    assert judged(silent).state == "unknown"
    assert judged(silent, planned=(NO_FENCE, ())).state == "accept"


def test_a_list_that_means_nothing_is_bad() -> None:
    cut = replace(aboard(), fence=aboard().fence[:2])
    row = judged(cut, planned=(NO_FENCE, ()))
    assert row.state == "bad"
    assert "not understood" in row.text


def test_what_is_not_known_of_the_action_is_not_claimed() -> None:
    assert at_fence({}, "ardupilot") == ""
    assert "not known here: FENCE_ACTION is 42" in at_fence({"FENCE_ACTION": 42.0}, "ardupilot")
    assert at_fence({"GF_ACTION": 3.0}, "px4") == "At its fence the vehicle returns (GF_ACTION 3)."
