"""Stepping aside by itself, on the simulated PX4: past a pole and what crosses, held, and back onto the line."""

from __future__ import annotations

from functools import partial

from tests.telemetry.px4_craft import Px4Craft
from tests.telemetry.test_avoiding_aside import (
    STANDS_M,
    Followed,
    Place,
    ends_a_pause_on_its_way_aside,
    holds_while_the_tracks_are_silent,
    is_past,
    stands,
)

MEETS_S = 12.3
"""Until it is 30 m north by itself."""


class FollowedPx4(Followed, Px4Craft):
    pass


def px4_craft(*things: Place, by: str = "sidestep") -> FollowedPx4:
    it = FollowedPx4(things)
    it.start()
    it.avoiding.enable(it.now_s, by)  # type: ignore[arg-type]
    return it


def test_it_passes_a_pole_dead_ahead_without_a_stop_and_comes_back_to_its_line() -> None:
    it = px4_craft(stands(25.0, 0.0))
    begun = len(it.trail)
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.9
    assert it.mode_names() == ["HOLD", "RTL"]
    assert it.pauses() == []
    flown_m = [up_m for _, _, up_m in it.trail[begun:]]
    assert min(flown_m) > 7.0
    assert max(flown_m) < 9.5
    back_m = [abs(e) for (_, n, _), e in zip(it.trail, it.asides, strict=True) if n > 40.0]
    assert max(back_m) < 1.3  # it wanders: 1.06 m with another seed
    assert "manoeuvre" in it.states


def test_two_poles_one_behind_the_other_and_beside_are_passed() -> None:
    it = px4_craft(stands(22.0, 0.0), stands(26.0, 3.0), stands(34.0, -1.0))
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.85


def test_what_crosses_its_way_is_passed_at_its_safety_radius() -> None:
    for by in ("climb", "sidestep"):
        begun_s: list[float] = []

        def crossing(t_s: float, begun_s: list[float] = begun_s) -> tuple[float, float]:
            return 30.0, 1.9 * (MEETS_S - (t_s - begun_s[0] if begun_s else 0.0))

        it = px4_craft(crossing, by=by)
        begun_s.append(it.now_s)
        it.until(partial(is_past, it))
        assert (it.nearest_m >= 2.7) == (by == "sidestep"), it.nearest_m


def test_when_the_tracks_stop_it_holds_and_goes_on_when_they_come_again() -> None:
    it = px4_craft(stands(25.0, 0.0))
    holds_while_the_tracks_are_silent(it)
    it.silent = False
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.8


def test_a_pause_on_the_way_aside_can_be_ended() -> None:
    it = px4_craft(stands(25.0, 0.0))
    ends_a_pause_on_its_way_aside(it)
