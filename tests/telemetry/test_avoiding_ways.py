"""Prepared ways with the simulated vehicle in virtual time: flown once, stopped short of what stands there, refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from telemetry.errors import NotAllowedError
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.topics.requests import FlyManoeuvre
from tests.telemetry.avoiding_bench import (
    AUTO,
    BRAKE,
    FLIGHT,
    LOITER,
    ME,
    Craft,
    Sense,
    Wall,
    craft,
    remaining_at,
    state,
    targets,
)


def test_a_prepared_way_around_is_flown_and_the_mission_goes_on_at_its_height() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 8)
    way = targets((14, 10, 8), (26, 10, 8), (30, 0, 8))
    request = FlyManoeuvre(ME, "around", way, 2)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    assert state(it) == "manoeuvre"
    it.until(lambda: it.bench.vehicle.truth.p_neu[1] > 9, 60)
    it.until(lambda: it.avoiding.detour.phase == "going" and not it.avoiding.detour.is_manoeuvre)
    it.until(lambda: it.state.mode == "RTL")
    assert max(up_m for _, _, up_m in it.trail) < 8.6
    assert max(n for _, n, _ in it.trail) > 59


def test_a_prepared_way_around_that_leads_into_something_unseen_is_stopped_short_of_it() -> None:
    it = craft(Wall(25, 30))
    it.perform(it.avoiding.disable(it.now_s))
    it.until(lambda: it.truth[0] > 8)
    request = FlyManoeuvre(ME, "around", targets((12, 10, 8), (40, 10, 8), (44, 0, 8)), 2)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    it.until(lambda: state(it) == "holding", 60)
    it.advance(10.0)
    assert 15.0 < max(n for _, n, _ in it.trail) < 24.3
    assert "way past" in it.avoiding.status.text
    assert it.state.mode == "BRAKE"


def test_from_the_ceiling_a_prepared_way_around_is_flown_and_the_mission_goes_on() -> None:
    it = craft(Wall(25, 90, half_wide_m=8.0))
    it.until(lambda: state(it) == "ceiling")
    high_m = it.truth[2]
    way = targets((it.truth[0], 12, high_m), (31, 12, high_m), (33, 0, high_m))
    it.perform(it.avoiding.fly(FlyManoeuvre(ME, "around", way, 1), remaining_at(it, 1), it.now_s))
    it.until(lambda: it.state.mode == "RTL")
    assert max(n for _, n, _ in it.trail) > 59
    assert all(u > high_m - 0.6 for _, n, u in it.trail if 24 < n < 30)


def test_a_prepared_way_over_climbs_on_while_it_is_not_clear() -> None:
    it = craft(Wall(25, 14))
    it.avoiding.disable(it.now_s)
    it.until(lambda: it.truth[0] > 12)
    request = FlyManoeuvre(ME, "over", targets((16, 0, 10), (30, 0, 10)), None, 2.0)
    it.perform(it.avoiding.fly(request, RemainingMission((), "hold"), it.now_s))
    it.until(lambda: it.truth[0] > 28)
    assert max(n for _, n, u in it.trail if u < 14.5) < 24.5
    it.until(lambda: state(it) == "holding")
    assert it.truth[2] > 14.5


def test_a_way_without_places_and_a_vehicle_on_the_ground_are_refused() -> None:
    it = Craft(FLIGHT, [])
    with pytest.raises(NotAllowedError, match="no places"):
        it.avoiding.fly(FlyManoeuvre(ME, "over", (), None), RemainingMission((), "hold"), 0.0)
    nowhere = (replace(targets((1, 0, 5))[0], alt_rel_home_m=float("nan")),)
    with pytest.raises(NotAllowedError, match="no number"):
        it.avoiding.fly(FlyManoeuvre(ME, "over", nowhere, None), RemainingMission((), "hold"), 0.0)
    with pytest.raises(NotAllowedError, match="are the most"):
        it.avoiding.fly(FlyManoeuvre(ME, "over", targets((1, 0, 5)), None, 40.0), RemainingMission((), "hold"), 0.0)
    with pytest.raises(NotAllowedError, match="not in the air"):
        it.avoiding.fly(FlyManoeuvre(ME, "over", targets((1, 0, 5)), None), RemainingMission((), "hold"), 0.0)


def test_what_somebody_did_before_a_prepared_way_is_ordered_does_not_end_it() -> None:
    it = craft()
    it.avoiding.disable(it.now_s)
    it.bench.command(176, 1, LOITER)
    it.until(lambda: it.state.mode == "LOITER")
    request = FlyManoeuvre(ME, "around", targets((14, 10, 8), (30, 0, 8)), 2)
    with pytest.raises(NotAllowedError, match="by hand"):
        it.avoiding.fly(request, remaining_at(it, 2), it.now_s)
    it.bench.command(176, 1, AUTO)
    it.until(lambda: it.state.mode == "AUTO" and it.truth[0] > 8)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    it.advance(2.0)
    assert state(it) == "manoeuvre"


def test_a_way_that_is_flown_after_a_pause_is_paused_no_more() -> None:
    it = craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 26)
    it.perform(it.avoiding.pause(it.now_s))
    it.advance(4.0)
    request = FlyManoeuvre(ME, "around", targets((32, 10, 16), (40, 0, 16)), 2)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    it.until(lambda: it.avoiding.detour.phase == "going")
    assert it.avoiding.resume(it.now_s) == []
    assert it.avoiding.detour.phase == "going"


def on_a_way_around(*, enabled: bool) -> Craft:
    """Past a wall that the radar has seen, and the camera is switched off."""
    it = craft(Wall(45, 12, half_wide_m=3.0), senses=[Sense("radar", 10.0, 0.1)])
    it.until(lambda: it.truth[0] > 20)
    if not enabled:
        it.perform(it.avoiding.disable(it.now_s))
    request = FlyManoeuvre(ME, "around", targets((25, 15, 8), (52, 15, 8), (55, 0, 8)), 2)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    it.until(lambda: it.avoiding.detour.phase == "going")
    it.advance(2.0)
    assert state(it) == "manoeuvre"
    return it


@pytest.mark.parametrize("enabled", [True, False])
def test_on_a_prepared_way_frames_that_stop_make_it_brake_until_they_come_again(enabled: bool) -> None:
    it = on_a_way_around(enabled=enabled)
    it.senses[0].silent = True
    it.until(lambda: state(it) == "holding", 1.5)
    assert it.avoiding.status.text.startswith("No frames from radar.")
    it.until(lambda: it.state.mode == "BRAKE" and (it.state.ground_speed_m_s or 0.0) < 0.2, 10)
    held = it.truth
    it.advance(6.0)
    assert it.truth == pytest.approx(held, abs=0.3)
    it.senses[0].silent = False
    it.until(lambda: state(it) == "manoeuvre", 5)
    it.until(lambda: it.state.mode == "RTL")


def test_a_prepared_way_is_flown_without_frames_when_the_operator_says_so() -> None:
    it = on_a_way_around(enabled=True)
    it.senses[0].silent = True
    it.until(lambda: state(it) == "holding", 1.5)
    it.until(lambda: it.state.mode == "BRAKE" and (it.state.ground_speed_m_s or 0.0) < 0.2, 10)
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: state(it) == "manoeuvre", 5)
    it.until(lambda: it.state.mode == "RTL")


def test_on_a_prepared_way_a_position_that_stands_still_makes_it_hold() -> None:
    it = on_a_way_around(enabled=True)
    old = replace(it.state, position_t_mono_s=it.now_s - 0.6)
    it.perform(it.avoiding.on_state(old, it.now_s))
    assert state(it) == "holding"
    assert it.modes()[-1] == BRAKE


def test_frames_that_cannot_be_placed_for_a_moment_do_not_stop_it_and_for_longer_do_with_their_reason() -> None:
    it = on_a_way_around(enabled=True)
    radar = it.senses[0]
    radar.state, radar.text = "frozen", "No GNSS position: the radar map stands still."
    it.advance(0.3)
    radar.state, radar.text = "running", ""
    it.advance(1.0)
    assert "holding" not in it.states
    radar.state, radar.text = "frozen", "No GNSS position: the radar map stands still."
    it.until(lambda: state(it) == "holding", 1.5)
    assert it.avoiding.status.text == "No GNSS position: the radar map stands still. Resume goes on all the same."
