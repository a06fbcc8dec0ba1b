"""Avoidance within the fence on board, on the simulated vehicle: no detour beyond it, braking remains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from telemetry.errors import NotAllowedError
from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.topics.onboard_lists import Item
from telemetry.topics.requests import FlyManoeuvre, FlyRest
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.avoiding_bench import HOME, ME, NORTH_PER_DEG, Craft, Wall, craft, remaining_at, state, targets
from tests.telemetry.test_avoiding_aside import craft as followed
from tests.telemetry.test_avoiding_aside import stands

Corner = tuple[float, float]
"""North and east of home, in metres."""
EXCLUSION, INCLUSION, CIRCLE = 5002, 5001, 5004
EAST_PER_DEG = NORTH_PER_DEG * math.cos(math.radians(HOME.lat_deg))
NOTHING_EAST: tuple[Corner, ...] = ((-50.0, 1.8), (100.0, 1.8), (100.0, 60.0), (-50.0, 60.0))
NOTHING_WEST: tuple[Corner, ...] = ((-50.0, -1.8), (100.0, -1.8), (100.0, -60.0), (-50.0, -60.0))


def polygon(command: int, corners: Sequence[Corner]) -> tuple[Item, ...]:
    count = float(len(corners))
    return tuple(Item(command, 0, (count, 0.0, 0.0, 0.0), *_degrees(corner), 0.0) for corner in corners)


def circle(command: int, centre: Corner, radius_m: float) -> tuple[Item, ...]:
    return (Item(command, 0, (radius_m, 0.0, 0.0, 0.0), *_degrees(centre), 0.0),)


def _degrees(corner: Corner) -> tuple[float, float]:
    north_m, east_m = corner
    return HOME.lat_deg + north_m / NORTH_PER_DEG, HOME.lon_deg + east_m / EAST_PER_DEG


def east_m(it: Craft) -> float:
    return it.bench.vehicle.truth.p_neu[1]


def test_it_steps_aside_to_no_side_that_is_forbidden_and_climbs_over_what_is_ahead_instead() -> None:
    it = followed(stands(25.0, 0.0), walls=[Wall(24.0, 12.0, half_wide_m=3.0)])
    it.avoiding.fence.read_back((*polygon(EXCLUSION, NOTHING_EAST), *polygon(EXCLUSION, NOTHING_WEST)))
    it.until(lambda: it.state.mode == "RTL")
    assert max(map(abs, it.asides)) < 1.0
    assert it.states[:3] == ["off", "watching", "climbing"]
    assert any("of the fence on board. It does not step aside." in text for text in it.texts)


def test_a_fence_that_is_read_on_the_way_aside_makes_it_hold_where_it_is() -> None:
    it = followed(stands(25.0, 0.0))
    it.until(lambda: it.avoiding.detour.phase == "aside" and abs(east_m(it)) > 0.5, 60)
    side = math.copysign(1.0, east_m(it))
    reach_m = side * (abs(east_m(it)) + 1.6)
    it.avoiding.fence.read_back(
        polygon(EXCLUSION, ((-50.0, reach_m), (100.0, reach_m), (100.0, 60.0 * side), (-50.0, 60.0 * side)))
    )
    it.until(lambda: state(it) == "holding", 10)
    it.advance(10.0)
    assert max(abs(east) for east in it.asides) < abs(reach_m)
    assert "of the fence on board" in it.avoiding.status.text


def test_the_side_that_is_free_is_still_taken() -> None:
    it = followed(stands(25.0, -0.6))
    it.avoiding.fence.read_back(polygon(EXCLUSION, ((-50.0, -20.0), (100.0, -20.0), (100.0, -60.0), (-50.0, -60.0))))
    it.until(lambda: it.state.mode == "RTL")
    assert "manoeuvre" in it.states


@pytest.mark.parametrize(
    ("fence", "words"),
    [
        (polygon(EXCLUSION, ((10.0, 8.0), (40.0, 8.0), (40.0, 14.0), (10.0, 14.0))), "enter exclusion polygon 1"),
        (polygon(INCLUSION, ((-50.0, -50.0), (90.0, -50.0), (90.0, 9.0), (-50.0, 9.0))), "leave inclusion polygon 1"),
        (circle(CIRCLE, (20.0, 13.0), 2.5), r"within 0\.\d m of exclusion circle 1 .* are kept"),
    ],
)
def test_a_prepared_way_beyond_the_fence_is_refused_and_the_mission_goes_on(
    fence: tuple[Item, ...], words: str
) -> None:
    it = craft()
    it.avoiding.fence.read_back(fence)
    it.until(lambda: it.truth[0] > 8)
    request = FlyManoeuvre(ME, "around", targets((14, 10, 8), (26, 10, 8), (30, 0, 8)), 2)
    with pytest.raises(NotAllowedError, match=words):
        it.avoiding.fly(request, remaining_at(it, 2), it.now_s)
    assert state(it) == "watching"
    other = FlyManoeuvre(ME, "around", targets((14, -10, 8), (26, -10, 8), (30, 0, 8)), 2)
    it.perform(it.avoiding.fly(other, remaining_at(it, 2), it.now_s))
    assert state(it) == "manoeuvre"


def with_ceiling(it: Craft, top_m: float) -> None:
    it.avoiding.fence.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": top_m})


def test_it_climbs_no_higher_than_the_ceiling_of_its_fence_and_holds_there() -> None:
    it = craft(Wall(25, 90))
    with_ceiling(it, 16.0)
    it.until(lambda: state(it) == "ceiling")
    it.advance(10.0)
    assert max(up_m for _, _, up_m in it.trail) < 16.0
    assert "below the ceiling of its fence" in it.avoiding.status.text


def test_a_prepared_way_above_the_ceiling_is_refused() -> None:
    it = craft()
    with_ceiling(it, 16.0)
    it.until(lambda: it.truth[0] > 8)
    request = FlyManoeuvre(ME, "over", targets((10, 0, 17), (30, 0, 17)), 1, height_offset_m=9.0)
    with pytest.raises(NotAllowedError, match=r"lead to 17\.0 m; the fence on board allows 1\d\.\d m above home"):
        it.avoiding.fly(request, remaining_at(it, 1), it.now_s)


@pytest.mark.parametrize("values", [{"FENCE_ENABLE": 0.0}, {"FENCE_TYPE": 6.0}, {"FENCE_ALT_MAX": None}])
def test_a_ceiling_that_does_not_act_or_is_not_known_ends_no_climb(values: dict[str, float | None]) -> None:
    fence = FenceAboard()
    fence.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": 16.0} | values)
    assert fence.highest_m == math.inf


ROUND_HOME: dict[str, float | None] = {
    "FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_ALT_MAX": 90.0, "FENCE_ALT_MIN": -10.0, "FENCE_RADIUS": 28.0,
    "FENCE_AUTOENABLE": None, "FENCE_ALT_MAX_TP": None,
}  # fmt: skip
PX4_ROUND_HOME: dict[str, float | None] = {"GF_ACTION": 3.0, "GF_MAX_VER_DIST": 0.0, "GF_MAX_HOR_DIST": 28.0}


@pytest.mark.parametrize(
    ("kept", "name"), [(ROUND_HOME, "FENCE_RADIUS"), (PX4_ROUND_HOME, "GF_MAX_HOR_DIST")], ids=["ardupilot", "px4"]
)
def test_a_prepared_way_out_of_the_circle_around_home_is_refused_and_the_mission_goes_on(
    kept: dict[str, float | None], name: str
) -> None:
    it = craft()
    it.avoiding.fence.read_back(())
    it.avoiding.fence.take(kept)
    it.until(lambda: it.truth[0] > 8)
    request = FlyManoeuvre(ME, "around", targets((14, 12, 8), (26, 12, 8), (30, 0, 8)), 2)
    with pytest.raises(NotAllowedError, match=rf"would leave the circle around home \({name}\) of the fence on board"):
        it.avoiding.fly(request, remaining_at(it, 2), it.now_s)
    assert state(it) == "watching"
    near = FlyManoeuvre(ME, "around", targets((14, 5, 8), (20, 5, 8), (24, 0, 8)), 2)
    it.perform(it.avoiding.fly(near, remaining_at(it, 2), it.now_s))
    assert state(it) == "manoeuvre"


def test_after_a_climb_it_does_not_go_on_out_of_the_circle_around_home() -> None:
    """It neither steps aside nor flies on there: the mission's line leads beyond it."""
    it = followed(stands(25.0, 0.0), walls=[Wall(24.0, 12.0, half_wide_m=3.0)])
    it.avoiding.fence.read_back(())
    it.avoiding.fence.take(ROUND_HOME | {"FENCE_RADIUS": 24.0})
    said = "It would leave the circle around home (FENCE_RADIUS) of the fence on board."
    it.until(lambda: f"{said} It holds" in it.avoiding.status.text)
    it.advance(10.0)
    assert max(north_m for _, north_m, _ in it.trail) < 24.0


@pytest.mark.parametrize(
    "values", [{"FENCE_ENABLE": 0.0}, {"FENCE_TYPE": 5.0}, {"FENCE_RADIUS": 300.0}, {"FENCE_RADIUS": None}]
)
def test_a_circle_around_home_that_does_not_act_is_wide_or_not_known_keeps_nobody(
    values: dict[str, float | None],
) -> None:
    it = craft()
    it.avoiding.fence.read_back(())
    it.avoiding.fence.take(ROUND_HOME | values)
    it.until(lambda: it.truth[0] > 8)
    request = FlyManoeuvre(ME, "around", targets((14, 12, 8), (26, 12, 8), (30, 0, 8)), 2)
    it.avoiding.check_may_fly(request)
    unread = it.avoiding.fence.unread(it.state)
    assert unread == (
        "Of the fence on board was not read: its circle around home (FENCE_RADIUS)" if None in values.values() else ""
    )


def test_after_the_climb_it_does_not_go_on_where_that_would_breach_the_fence() -> None:
    it = craft(Wall(25, 14))
    it.until(lambda: state(it) == "climbing")
    it.avoiding.fence.read_back(polygon(EXCLUSION, ((35.0, -9.0), (40.0, -9.0), (40.0, 9.0), (35.0, 9.0))))
    it.until(lambda: state(it) == "holding")
    it.advance(10.0)
    assert it.truth[0] < 25.0
    assert "It would enter exclusion polygon 1 of the fence on board. It holds" in it.avoiding.status.text
    it.perform(it.avoiding.resume(it.now_s))
    it.advance(10.0)
    assert state(it) == "holding"
    assert it.truth[0] < 25.0
    it.avoiding.fence.read_back(())
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: it.state.mode == "RTL")


def test_it_does_not_come_down_onto_a_line_beyond_the_fence() -> None:
    it = craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 32)
    it.avoiding.fence.read_back(polygon(EXCLUSION, ((50.0, -9.0), (55.0, -9.0), (55.0, 9.0), (50.0, 9.0))))
    with pytest.raises(NotAllowedError, match=r"lower line is not flown\. It would enter exclusion polygon 1"):
        it.avoiding.fly_rest(FlyRest(ME, targets((30, 0, 14), (60, 0, 8))), it.now_s)
    assert state(it) == "offset"


def test_beyond_its_fence_already_it_takes_no_way_at_all() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 8)
    it.avoiding.fence.read_back(polygon(EXCLUSION, ((0.0, -9.0), (20.0, -9.0), (20.0, 9.0), (0.0, 9.0))))
    request = FlyManoeuvre(ME, "around", targets((14, -10, 8), (26, -10, 8)), 2)
    with pytest.raises(NotAllowedError, match="is beyond exclusion polygon 1"):
        it.avoiding.fly(request, remaining_at(it, 2), it.now_s)


def test_a_fence_that_nobody_has_read_is_said_until_it_is() -> None:
    it = craft()
    assert it.avoiding.status.text.startswith("The fence on board has not been read back")
    assert "is held against it." in it.avoiding.status.text
    it.avoiding.fence.read_back(())
    assert "(ceiling, circle around home) has not been read" in it.avoiding.status.text
    it.avoiding.fence.take({"FENCE_ENABLE": 0.0})
    assert "whether it comes on by itself (FENCE_AUTOENABLE)" in it.avoiding.status.text
    it.avoiding.fence.take({"FENCE_AUTOENABLE": None, "FENCE_TYPE": None})
    assert it.avoiding.status.text == ""
    it.avoiding.fence.read_back(polygon(EXCLUSION, NOTHING_EAST)[:3])
    assert "is not understood: the fence on board, item 1" in it.avoiding.status.text


COPTER: dict[str, float | None] = ROUND_HOME | {"FENCE_TYPE": 3.0, "FENCE_ALT_MAX_TP": None}
HOME_KNOWN = replace(VehicleState(1, 1), home_lat_deg=HOME.lat_deg, home_lon_deg=HOME.lon_deg)
NOT_READ = "Of the fence on board was not read: "


@pytest.mark.parametrize(
    ("told", "unread"),
    [
        (COPTER, ""),
        (COPTER | {"FENCE_ALT_MIN": None}, ""),  # an old copter has none, and no ceiling needs it
        (COPTER | {"FENCE_TYPE": 2.0, "FENCE_ALT_MAX": None}, ""),
        (COPTER | {"FENCE_TYPE": 1.0, "FENCE_RADIUS": None}, ""),
        (COPTER | {"FENCE_TYPE": 4.0, "FENCE_ALT_MAX": None, "FENCE_RADIUS": math.nan}, ""),
        (COPTER | {"FENCE_TYPE": None}, f"{NOT_READ}its kinds (FENCE_TYPE)"),
        (
            COPTER | {"FENCE_ALT_MAX": None, "FENCE_RADIUS": None},
            f"{NOT_READ}its ceiling (FENCE_ALT_MAX), its circle around home (FENCE_RADIUS)",
        ),
        (
            COPTER | {"FENCE_ALT_MAX_TP": 0.0},
            "The ceiling of the fence on board does not count from home (FENCE_ALT_MAX_TP 0)",
        ),
        ({"FENCE_ENABLE": 0.0, "FENCE_AUTOENABLE": 0.0}, ""),
        (
            {"FENCE_ENABLE": 0.0},
            f"{NOT_READ}whether it comes on by itself (FENCE_AUTOENABLE), its kinds (FENCE_TYPE)",
        ),
        ({"FENCE_ENABLE": 0.0, "FENCE_AUTOENABLE": 3.0}, f"{NOT_READ}its kinds (FENCE_TYPE)"),
        ({"GF_ACTION": 0.0}, ""),
        (
            {"GF_ACTION": 2.0},
            f"{NOT_READ}its ceiling (GF_MAX_VER_DIST), its circle around home (GF_MAX_HOR_DIST)",
        ),
    ],
)
def test_it_is_known_once_what_acts_was_told_and_all_that_is_missing_is_named(
    told: dict[str, float | None], unread: str
) -> None:
    fence = FenceAboard()
    fence.take(told)
    assert fence.unread(HOME_KNOWN) == unread


def test_a_ceiling_that_was_heard_is_not_known_before_what_it_counts_from() -> None:
    fence = FenceAboard()
    for name, value in (("FENCE_ENABLE", 1.0), ("FENCE_TYPE", 1.0), ("FENCE_ALT_MAX", 60.0)):
        fence.take({name: value})
    assert fence.unread(HOME_KNOWN) == f"{NOT_READ}what its ceiling counts from (FENCE_ALT_MAX_TP)"


@pytest.mark.parametrize(
    ("way", "is_allowed"),
    [
        (((60.0, 0.0), (20.0, 0.0)), True),
        (((60.0, 0.0), (-20.0, 5.0)), True),  # through the middle, and well inside
        (((60.0, 0.0), (55.0, 3.0)), True),  # closer, though not inside yet
        (((60.0, 0.0), (60.0, 0.0)), True),  # where it is
        (((60.0, 0.0), (61.0, 0.0)), False),
        (((60.0, 0.0), (58.0, 25.0)), False),  # beside it, farther away at the end
        (((60.0, 0.0), (-58.0, 0.0)), False),  # out again on the other side
        (((60.0, 0.0), (-49.0, 0.0)), False),  # and as near to its edge as is not kept
    ],
)
@pytest.mark.parametrize("kept", [ROUND_HOME | {"FENCE_RADIUS": 50.0}, PX4_ROUND_HOME | {"GF_MAX_HOR_DIST": 50.0}])
def test_beyond_the_circle_around_home_a_way_that_only_comes_closer_is_taken(
    kept: dict[str, float | None], way: tuple[Corner, Corner], is_allowed: bool
) -> None:
    fence = FenceAboard()
    fence.margin_m = 2.0
    fence.read_back(())
    fence.take(kept)
    begin, end = map(_degrees, way)
    beyond = replace(HOME_KNOWN, lat_deg=begin[0], lon_deg=begin[1])
    why = fence.why_not(beyond, (begin, end, end))
    assert why == "" if is_allowed else "is beyond the circle around home" in why
