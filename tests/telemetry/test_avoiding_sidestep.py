"""The link's half of a sidestep: flown at once and level, without braking first, then on with the mission."""

from __future__ import annotations

import math

from telemetry.topics.requests import FlyManoeuvre
from tests.telemetry.avoiding_bench import BRAKE, GUIDED, ME, RTL, Wall, craft, remaining_at, state, targets


def test_it_goes_aside_without_a_stop_and_on_with_the_mission() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 8)
    begun = len(it.trail)
    request = FlyManoeuvre(ME, "sidestep", targets((22, 10, 8), (30, 0, 8)), 2)
    it.perform(it.avoiding.fly(request, remaining_at(it, 2), it.now_s))
    assert state(it) == "manoeuvre"
    it.until(lambda: it.bench.vehicle.truth.p_neu[1] > 8, 60)
    it.until(lambda: it.avoiding.detour.phase == "going" and not it.avoiding.detour.is_manoeuvre)
    it.until(lambda: it.state.mode == "RTL")
    assert it.modes() == [GUIDED, RTL]
    assert BRAKE not in it.modes()
    flown = it.trail[begun:]
    assert min(up_m for _, _, up_m in flown) > 7.0
    assert max(n for _, n, _ in flown) > 59


def test_a_second_one_replaces_the_first_and_a_pause_can_be_ended() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 8)
    for aside in (targets((22, 10, 8)), targets((22, -10, 8))):
        it.perform(it.avoiding.fly(FlyManoeuvre(ME, "sidestep", aside, None), remaining_at(it, 2), it.now_s))
        it.until(lambda: it.avoiding.detour.phase == "going", 60)
    it.perform(it.avoiding.pause(it.now_s))
    it.until(lambda: math.hypot(it.state.ground_speed_m_s or 0.0, 0.0) < 0.3, 60)
    assert state(it) == "holding"
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: it.bench.vehicle.truth.p_neu[1] < -8, 60)


def test_the_echoes_of_what_it_goes_aside_for_do_not_stop_it() -> None:
    it = craft(Wall(17, 20))
    it.perform(it.avoiding.disable(it.now_s))
    it.until(lambda: it.truth[0] > 6)
    it.perform(it.avoiding.fly(FlyManoeuvre(ME, "sidestep", targets((13, 2, 8)), None), remaining_at(it, 2), it.now_s))
    it.until(lambda: it.truth[0] > 12.5, 60)
    assert it.modes() == [GUIDED]
