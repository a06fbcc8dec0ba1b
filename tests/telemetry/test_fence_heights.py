"""A plan's floor and ceiling as the parameters that an autopilot keeps them in."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from planning.fence.fence_model import NO_FENCE, Fence, circle
from telemetry.errors import NotAllowedError
from telemetry.flight.fence_heights import (
    SAME_HOME_M,
    TAKEN_WHEN_SWITCHED,
    HeightChanges,
    height_changes,
    heights_aboard,
    highest_return_m,
)
from telemetry.flight.fence_kinds import KindsSeen
from telemetry.flight.preflight.parameters import return_as_flown

COPTER: dict[str, float | None] = {
    "FENCE_ENABLE": 0.0, "FENCE_AUTOENABLE": None, "FENCE_TYPE": 7.0, "FENCE_ACTION": 1.0, "FENCE_ALT_MAX": 100.0,
    "FENCE_ALT_MIN": -10.0, "FENCE_MARGIN": 2.0, "FENCE_RADIUS": 300.0,
}  # fmt: skip
PX4: dict[str, float | None] = {"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 0.0, "GF_MAX_HOR_DIST": 0.0}
BOTH = Fence(floor_rel_home_m=5.0, ceiling_rel_home_m=60.0)
SHAPE = circle(47.0, 8.0, 50.0, inclusion=True, where="t")


def words(made: HeightChanges) -> list[str]:
    return [change.words for change in made.changes]


def after(made: HeightChanges, before: dict[str, float | None]) -> dict[str, float | None]:
    return before | {change.name: change.after for change in made.changes}


def test_a_fence_that_is_off_comes_on_with_what_the_plan_has_and_nothing_else() -> None:
    made = height_changes(BOTH, COPTER, "ardupilot")
    assert words(made) == [
        "FENCE_ALT_MAX 100 -> 60 m", "FENCE_ALT_MIN -10 -> 5 m", "FENCE_TYPE 7 -> 9", "FENCE_ENABLE 0 -> 1",
    ]  # fmt: skip
    said = " ".join(made.notes)
    assert "The circle around home (FENCE_RADIUS, 300 m) stays off" in said
    assert "Shapes on board, where there are any, stay off (FENCE_TYPE)" in said
    assert "The ceiling (FENCE_ALT_MAX) stays off" not in said
    assert "returns at 58 m at most" in said
    assert "At its fence the vehicle returns, or lands where it cannot (FENCE_ACTION 1)." in said


@pytest.mark.parametrize("on", [{"FENCE_ENABLE": 1.0}, {"FENCE_AUTOENABLE": 3.0}])
def test_what_acts_already_goes_on_to_act(on: dict[str, float]) -> None:
    made = height_changes(BOTH, COPTER | on, "ardupilot")
    assert "FENCE_TYPE 7 -> 15" in words(made)
    assert "stays off" not in " ".join(made.notes)


@pytest.mark.parametrize(("kinds", "is_anew"), [(4.0, True), (8.0, True), (1.0, False), (7.0, False)])
def test_a_fence_that_is_on_is_switched_anew_where_it_gains_a_kind_that_it_takes_only_then(kinds, is_anew) -> None:
    """The floor is taken by itself, after each take-off."""
    made = height_changes(BOTH, COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": kinds}, "ardupilot")
    switched = ["FENCE_ENABLE 1 -> 0", "FENCE_ENABLE 0 -> 1"] if is_anew else []
    assert [each for each in words(made) if "ENABLE" in each] == switched
    assert (TAKEN_WHEN_SWITCHED in made.notes) is is_anew


def test_a_kind_that_was_named_while_it_was_on_is_not_taken_for_one_that_acts() -> None:
    held = after(height_changes(BOTH, COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}, "ardupilot"), COPTER)
    assert height_changes(BOTH, held, "ardupilot").changes == ()
    made = height_changes(BOTH, held, "ardupilot", untaken_kinds=1)
    assert words(made) == ["FENCE_ENABLE 1 -> 0", "FENCE_ENABLE 0 -> 1"]
    assert TAKEN_WHEN_SWITCHED in made.notes


def test_setting_it_anew_names_no_kind_while_the_fence_is_on() -> None:
    """Each that was would be told as one that may not act."""
    on = COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}
    made = height_changes(Fence(ceiling_rel_home_m=60.0), on, "ardupilot")
    assert words(made)[-3:] == ["FENCE_ENABLE 1 -> 0", "FENCE_TYPE 4 -> 5", "FENCE_ENABLE 0 -> 1"]
    seen = KindsSeen()
    seen.take(on)
    for change in made.changes:
        seen.take({change.name: change.after})
        assert seen.untaken == 0


def test_kinds_that_begin_to_act_besides_the_plans_are_told() -> None:
    on = COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_RADIUS": 30.0}
    said = " ".join(height_changes(Fence(ceiling_rel_home_m=60.0), on, "ardupilot", untaken_kinds=7).notes)
    assert "With that the circle around home (FENCE_RADIUS 30 m) of its fence may begin to act" in said
    assert "With that the shapes of its fence may begin to act" in said
    assert "With that the ceiling" not in said, "it is the plan's"
    untold = " ".join(height_changes(Fence(ceiling_rel_home_m=60.0), on, "ardupilot", untaken_kinds=1).notes)
    assert "begin to act" not in untold


@pytest.mark.parametrize("kinds", [1.0, 5.0])
def test_shapes_that_no_plan_of_ours_has_stay_off_and_that_is_said(kinds: float) -> None:
    """Whether FENCE_TYPE named them while the fence was off or not: which are on board is not read for it."""
    notes = " ".join(height_changes(BOTH, COPTER | {"FENCE_TYPE": kinds}, "ardupilot").notes)
    assert "Shapes on board, where there are any, stay off" in notes
    acting = COPTER | {"FENCE_TYPE": 5.0, "FENCE_ENABLE": 1.0}
    assert "Shapes on board" not in " ".join(height_changes(BOTH, acting, "ardupilot").notes)


def test_a_ceiling_or_a_floor_that_acts_and_is_stricter_is_not_loosened_without_a_word() -> None:
    acts = COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 9.0, "FENCE_ALT_MAX": 40.0, "FENCE_ALT_MIN": 8.0}
    made = height_changes(BOTH, acts, "ardupilot")
    assert made.notes[0] == "This raises the ceiling that acts now, from 40 to 60 m above home."
    assert made.notes[1] == "This lowers the floor that acts now, from 8 to 5 m above home."
    assert made.looser == made.notes[:2]
    for stricter in ({"FENCE_ALT_MAX": 70.0, "FENCE_ALT_MIN": 4.0}, {"FENCE_ENABLE": 0.0}):
        made = height_changes(BOTH, acts | stricter, "ardupilot")
        assert "that acts now" not in " ".join(made.notes)
        assert made.looser == ()
    px4 = height_changes(Fence(ceiling_rel_home_m=60.0), PX4 | {"GF_MAX_VER_DIST": 30.0}, "px4")
    assert "This raises the ceiling that acts now" in px4.notes[0]


@pytest.mark.parametrize(("name", "fence"), [("FENCE_ALT_MAX_TP", BOTH), ("FENCE_ALT_MIN_TP", BOTH)])
def test_a_height_that_is_not_counted_from_home_is_not_set_compared_or_returned_at(name, fence) -> None:
    acts = COPTER | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 9.0, "FENCE_ALT_MAX": 60.0, "FENCE_ALT_MIN": 5.0}
    assert height_changes(fence, acts | {name: 1.0}, "ardupilot").changes == ()
    for counts in (0.0, 2.0, 3.0):
        with pytest.raises(NotAllowedError, match=f"{name} is {counts:g}"):
            height_changes(fence, acts | {name: counts}, "ardupilot")
        own = heights_aboard(acts | {name: counts}, "ardupilot")
        is_ceiling = name == "FENCE_ALT_MAX_TP"
        assert (own.ceiling_rel_home_m is None, own.floor_rel_home_m is None) == (is_ceiling, not is_ceiling)
        assert (highest_return_m(acts | {name: counts}, "ardupilot") == math.inf) is is_ceiling


def test_shapes_of_the_plan_act_too_once_it_is_switched_on() -> None:
    made = height_changes(Fence(circles=(SHAPE,), ceiling_rel_home_m=60.0), COPTER, "ardupilot")
    assert "FENCE_TYPE 7 -> 5" in words(made)


def test_what_is_on_board_already_is_not_written_again() -> None:
    once = after(height_changes(BOTH, COPTER, "ardupilot"), COPTER)
    assert height_changes(BOTH, once, "ardupilot").changes == ()
    assert heights_aboard(once, "ardupilot") == BOTH


def test_px4_takes_a_ceiling_says_that_it_has_no_floor_and_is_switched_on() -> None:
    made = height_changes(BOTH, PX4, "px4")
    assert words(made) == ["GF_MAX_VER_DIST 0 -> 60 m"]
    assert "PX4 has no floor" in made.notes[0]
    off = height_changes(BOTH, PX4 | {"GF_ACTION": 0.0, "GF_MAX_HOR_DIST": 80.0}, "px4")
    assert words(off) == ["GF_MAX_VER_DIST 0 -> 60 m", "GF_ACTION 0 -> 2"]
    assert "GF_MAX_HOR_DIST 80 m" in " ".join(off.notes)
    assert "At its fence the vehicle holds its place (GF_ACTION 2)." in off.notes


@pytest.mark.parametrize(
    ("fence", "changed", "firmware", "said"),
    [
        (NO_FENCE, {}, "ardupilot", "neither floor nor ceiling"),
        (Fence(ceiling_rel_home_m=-3.0), {}, "ardupilot", "A ceiling at -3 m above home is none"),
        (Fence(ceiling_rel_home_m=0.004), {}, "px4", "A ceiling at 0 m above home is none"),
        (Fence(ceiling_rel_home_m=1.0), {}, "ardupilot", "would return at -1 m above home"),
        (Fence(ceiling_rel_home_m=3.9), {}, "ardupilot", "would return at 1.9 m above home"),
        (Fence(floor_rel_home_m=-120.0), {}, "ardupilot", "-100 m is its lowest"),
        (Fence(floor_rel_home_m=5.0, ceiling_rel_home_m=9.0), {}, "ardupilot", "The vehicle would not arm"),
        (Fence(floor_rel_home_m=97.0), {}, "ardupilot", "The vehicle would not arm"),
        (Fence(ceiling_rel_home_m=20.0), {"FENCE_ALT_MIN": 30.0}, "ardupilot", "The vehicle would not arm"),
        (Fence(floor_rel_home_m=5.0), {}, "px4", "PX4 has no floor"),
        (BOTH, {"FENCE_TYPE": None}, "ardupilot", "does not tell FENCE_TYPE"),
        (BOTH, {"FENCE_ALT_MAX": math.nan}, "ardupilot", "does not tell FENCE_ALT_MAX"),
        (BOTH, {"GF_MAX_VER_DIST": None}, "px4", "does not tell GF_MAX_VER_DIST"),
    ],
)
def test_what_a_vehicle_cannot_keep_or_would_not_arm_with_is_refused(fence, changed, firmware, said: str) -> None:
    with pytest.raises(NotAllowedError, match=said):
        height_changes(fence, (PX4 if firmware == "px4" else COPTER) | changed, firmware)


@given(
    low_m=st.floats(-90, 90), room_m=st.floats(4.1, 300), rises_m=st.floats(-20, 20), kinds=st.integers(0, 15),
    on=st.booleans(),
)  # fmt: skip
def test_the_vehicles_band_is_never_wider_than_the_plans_from_either_home(low_m, room_m, rises_m, kinds, on) -> None:
    fence = Fence(floor_rel_home_m=low_m, ceiling_rel_home_m=low_m + room_m)
    before: dict[str, Any] = COPTER | {"FENCE_TYPE": float(kinds), "FENCE_ENABLE": float(on)}
    try:
        made = height_changes(fence, before, "ardupilot", home_rises_m=rises_m)
    except NotAllowedError:
        assume(False)
        raise
    own = heights_aboard(after(made, before), "ardupilot")
    assert own.floor_rel_home_m is not None
    assert own.ceiling_rel_home_m is not None
    planned_m = -rises_m if abs(rises_m) > SAME_HOME_M else 0.0  # home, as seen from the vehicle's
    for planned_home_m in (0.0, planned_m):
        assert own.floor_rel_home_m >= low_m + planned_home_m - 0.006
        assert own.ceiling_rel_home_m <= low_m + room_m + planned_home_m + 0.006


def test_the_return_stays_below_the_ceiling_by_the_vehicles_margin() -> None:
    """ArduCopter cuts its return height to FENCE_ALT_MAX - FENCE_MARGIN where the ceiling is on."""
    kept = COPTER | {"FENCE_ENABLE": 1.0, "FENCE_ALT_MAX": 30.0, "RTL_ALT": 3000.0}
    assert highest_return_m(kept, "ardupilot") == 28.0
    found = return_as_flown(kept, "ardupilot")
    assert (found.height_m, found.below_ceiling) == (28.0, True)
    for changed in ({"FENCE_ENABLE": 0.0}, {"FENCE_TYPE": 6.0}, {"FENCE_ALT_MAX": None}, {"RTL_ALT": 2800.0}):
        own = return_as_flown(kept | changed, "ardupilot")
        assert (own.height_m, own.below_ceiling) == ((changed.get("RTL_ALT") or 3000.0) / 100, False)
    assert return_as_flown(kept | {"FENCE_MARGIN": None}, "ardupilot").height_m == 28.0
    assert highest_return_m({"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 30.0}, "px4") == math.inf
