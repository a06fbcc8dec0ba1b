"""Stepping aside by itself, on the simulated vehicle: past poles and what moves, and back onto the mission's line."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from planning.evading.velocity_obstacles import Limits, Obstacles
from telemetry.flight.avoidance.passing_tracks import Scene, is_last_moment
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import VelocitySettings
from telemetry.topics.tracks import Track, TracksStatus
from tests.telemetry.avoiding_bench import BRAKE, FLIGHT, HOME, NORTH_PER_DEG, RTL, Craft, Sense, Wall

Place = Callable[[float], tuple[float, float]]
"""North and east at a time."""
ROOM = (40.0,) * 120
SIGHT_RAD, REACH_M = math.radians(45.0), 40.0
STANDS_M = 2.0


def stands(north_m: float, east_m: float) -> Place:
    return lambda t_s: (north_m, east_m)


class Followed(Craft):
    """With a tracks node that knows what is in its sight ten times a second, and remembers what stands."""

    def __init__(
        self, things: Sequence[Place], *, room_m: tuple[float, ...] = ROOM, walls: Sequence[Wall] = ()
    ) -> None:
        super().__init__(FLIGHT, list(walls), [Sense("radar", 10.0, 0.1)] if walls else [])
        self.things, self.room_m, self.silent = things, room_m, False
        self.nearest_m = math.inf
        self.asides: list[float] = []
        self._due_s = 0.0
        self._seen: set[int] = set()

    def step(self) -> None:
        super().step()
        north_m, east_m, _ = self.truth
        self.asides.append(east_m)
        for thing in self.things:
            n, e = thing(self.now_s)
            self.nearest_m = min(self.nearest_m, math.hypot(n - north_m, e - east_m))
        if self.now_s >= self._due_s and not self.silent:
            self._due_s = self.now_s + 0.1
            self.perform(self.avoiding.on_tracks(self._tracks(), self.now_s))

    def _tracks(self) -> TracksStatus:
        tracks = [self._track(k, thing) for k, thing in enumerate(self.things) if self._sees(k, thing)]
        return TracksStatus(
            state="running",
            text="",
            t_mono_s=self.now_s,
            t_utc_s=self.now_s,
            done_t_mono_s=self.now_s,
            tracks=tuple(tracks),
            max_speed_m_s=5.0,
            safety_radius_m=3.0,
            room_m=self.room_m,
        )

    def _sees(self, number: int, thing: Place) -> bool:
        north_m, east_m, _ = self.truth
        n, e = thing(self.now_s)
        off_rad = math.remainder(math.atan2(e - east_m, n - north_m) - self.bench.vehicle.truth.heading_rad, math.tau)
        if abs(off_rad) <= SIGHT_RAD and math.hypot(n - north_m, e - east_m) <= REACH_M:
            self._seen.add(number)
        return number in self._seen

    def _track(self, number: int, thing: Place) -> Track:
        (n, e), (n2, e2) = thing(self.now_s), thing(self.now_s + 0.1)
        north_m, east_m, up_m = self.truth
        velocity = ((e2 - e) / 0.1, (n2 - n) / 0.1)
        return Track(
            id=number,
            enu_m=(e, n, up_m),
            velocity_enu_m_s=velocity,
            covariance_m2=(0.01, 0.0, 0.01),
            age_s=3.0,
            updates=30,
            moving=math.hypot(*velocity) > 0.3,
            range_m=math.hypot(n - north_m, e - east_m),
            bearing_deg=0.0,
            closest_m=0.0,
            closest_in_s=1.0,
            dangerous=True,
            lat_deg=HOME.lat_deg + n / NORTH_PER_DEG,
            lon_deg=HOME.lon_deg + e / NORTH_PER_DEG / math.cos(math.radians(HOME.lat_deg)),
        )


def craft(*things: Place, by: str = "sidestep", **of) -> Followed:
    it = Followed(things, **of)
    it.start()
    it.avoiding.enable(it.now_s, by)  # type: ignore[arg-type]
    return it


def holds_while_the_tracks_are_silent(it: Followed) -> None:
    """From its way aside on; they stay silent."""
    it.until(lambda: it.avoiding.detour.phase == "aside", 60)
    it.silent = True
    it.until(lambda: it.avoiding.status.state == "holding", 10)
    it.until(lambda: (it.state.ground_speed_m_s or 0.0) < 0.3, 20)
    assert "tracks have stopped" in it.avoiding.status.text
    at_m = it.truth[0]
    it.advance(5.0)
    assert abs(it.truth[0] - at_m) < 1.0


def ends_a_pause_on_its_way_aside(it: Followed) -> None:
    it.until(lambda: it.avoiding.detour.phase == "aside", 60)
    it.advance(1.0)
    it.perform(it.avoiding.pause(it.now_s))
    it.until(lambda: (it.state.ground_speed_m_s or 0.0) < 0.3, 20)
    assert it.avoiding.status.state == "holding"
    it.advance(3.0)
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.8


@pytest.mark.parametrize("east_m", [-1.0, 0.0, 0.4, 1.5])
def test_it_passes_a_pole_dead_ahead_level_and_comes_back_to_its_line(east_m: float) -> None:
    it = craft(stands(25.0, east_m))
    begun = len(it.trail)
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.9
    assert BRAKE not in it.modes()
    assert min(up_m for _, _, up_m in it.trail[begun:]) > 7.0
    assert max(up_m for _, _, up_m in it.trail[begun:]) < 9.5
    back = [e for (_, n, _), e in zip(it.trail, it.asides, strict=True) if n > 40.0]
    assert max(map(abs, back)) < 1.0
    assert "manoeuvre" in it.states


def test_two_poles_one_behind_the_other_and_beside_are_passed() -> None:
    it = craft(stands(22.0, 0.0), stands(26.0, 3.0), stands(34.0, -1.0))
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.85


def test_by_climbing_alone_nothing_is_done_about_tracks() -> None:
    it = craft(stands(25.0, 0.0), by="climb")
    it.until(lambda: it.truth[0] > 40.0)
    assert it.modes() == []
    assert it.nearest_m < 0.5


def test_what_crosses_its_way_is_passed_at_its_safety_radius() -> None:
    begun_s: list[float] = []

    def crossing(t_s: float) -> tuple[float, float]:
        left_s = t_s - begun_s[0] if begun_s else 0.0
        return 30.0, 20.0 - 1.9 * left_s

    for by in ("climb", "sidestep"):
        begun_s.clear()
        it = craft(crossing, by=by)
        begun_s.append(it.now_s)
        it.until(partial(is_past, it))
        if by == "climb":
            assert it.nearest_m < 2.5  # it really would come too near
        else:
            assert it.nearest_m >= 2.7
            assert "manoeuvre" in it.states


def is_past(it: Followed) -> bool:
    return it.truth[0] > 42.0


def test_it_goes_to_the_side_where_no_ground_rises() -> None:
    hill = tuple(3.0 if 5 <= k < 60 else 40.0 for k in range(120))  # all of the east
    it = craft(stands(25.0, -0.6), room_m=hill)
    it.until(lambda: it.state.mode == "RTL")
    assert it.nearest_m >= STANDS_M * 0.9
    assert max(it.asides) < 0.8


def test_without_a_surface_model_it_climbs_over_what_its_region_shows() -> None:
    it = craft(stands(25.0, 0.0), room_m=(), walls=[Wall(24.0, 12.0, half_wide_m=3.0)])
    assert "climbs instead" in it.avoiding.status.text
    it.until(lambda: it.state.mode == "RTL")
    assert "climbing" in it.states
    assert max(map(abs, it.asides)) < 1.0


def test_what_is_not_followed_but_seen_ahead_on_the_way_aside_makes_it_climb() -> None:
    it = craft(stands(25.0, 0.0), walls=[Wall(24.0, 12.0)])
    it.until(lambda: it.state.mode == "RTL")
    assert "climbing" in it.states
    assert max(up_m for _, _, up_m in it.trail) > 12.0


@pytest.mark.parametrize("resumes", [False, True])
def test_when_the_tracks_stop_it_holds_until_they_come_again_or_it_is_told_to_go_on(resumes: bool) -> None:
    it = craft(stands(25.0, 0.0))
    holds_while_the_tracks_are_silent(it)
    if resumes:
        it.perform(it.avoiding.resume(it.now_s))
    else:
        it.silent = False
    it.until(lambda: it.state.mode == "RTL")


def test_where_no_velocity_leads_past_it_does_not_begin() -> None:
    fence = [stands(24.0, 1.5 * k) for k in range(-11, 12)]
    it = craft(*fence, walls=[Wall(24.0, 12.0)])
    it.perform(it.avoiding.on_tick(it.now_s))
    it.avoiding.on_settings(replace(PerceptionSettings(), velocities=VelocitySettings(max_turn_deg=20.0)))
    it.until(lambda: it.state.mode == "RTL")
    assert "climbing" in it.states
    assert max(map(abs, it.asides)) < 3.0


def test_a_pause_on_the_way_aside_can_be_ended() -> None:
    it = craft(stands(25.0, 0.0))
    ends_a_pause_on_its_way_aside(it)
    assert it.modes()[-1] == RTL


def test_the_last_moment_to_stop_is_told_of_the_choice_with_the_most_room_alone() -> None:
    pole, north = Obstacles.of([0.0, 0.0], [(0.0, 5.0)], [(0.0, 0.0)], radius_m=2.0), np.array([0.0, 3.0])
    scene = Scene(pole, Limits(max_speed_m_s=5.0), nearest_only=False, by_room=True, horizon_m=15.0, room_m=ROOM)
    assert not is_last_moment(scene, 0.9 * north)
    assert is_last_moment(scene, 1.3 * north)
    assert not is_last_moment(replace(scene, by_room=False), 1.3 * north)
