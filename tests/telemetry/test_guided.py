"""The navigation script: order and timing of targets, loiter, pause, the pilot's say, lost links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from telemetry.errors import NotAllowedError, RefusedError
from telemetry.flight.guided.guided import GuidedEnd, GuidedScript
from telemetry.flight.guided.handover import Handover
from telemetry.flight.guided.orders import Place
from telemetry.flight.guided.script_watches import Standstill
from telemetry.mavlink.actions import Action, Done, Failed, Progress
from telemetry.mavlink.reduce import reduce
from telemetry.topics.requests import StartGuided
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.guided_requests import LINE, request, target
from tests.telemetry.guided_vehicle import HOME, LOITER, METRES_PER_DEG, Craft
from tests.telemetry.lossy import VEHICLE, Faults, Run

READY = VehicleState(
    1, 1, autopilot="ardupilot", mode="STABILIZE", landed="on_ground", alt_amsl_m=HOME[2], alt_rel_home_m=0.0
)
HARSH = Faults(loss=0.3, reordering=0.1, duplicates=0.02, corruption=0.01)


class Watching:
    """Feeds the script with messages and with the states that the reducer makes of them; acts at given times."""

    def __init__(self, script: GuidedScript, acts: dict[float, Callable[[float], list[Action]]] | None = None) -> None:
        self.script, self.acts = script, dict(acts or {})
        self.state: VehicleState | None = None
        self.phases: list[str] = []
        self.start = script.start

    def on_message(self, message: Any, now_s: float) -> list[Action]:
        before = self.state
        self.state = reduce(self.state, message, t_mono_s=now_s, t_utc_s=now_s)
        actions = self.script.on_message(message, now_s)
        if self.state is not None and self.state is not before:
            actions += self.script.on_state(self.state, now_s)
        return self._note(actions)

    def on_tick(self, now_s: float) -> list[Action]:
        due = [self.acts.pop(at_s) for at_s in sorted(self.acts) if at_s <= now_s]
        actions = [action for act in due for action in act(now_s)]
        return self._note([*actions, *self.script.on_tick(now_s)])

    def _note(self, actions: list[Action]) -> list[Action]:
        if self.phases[-1:] != [self.script.phase]:
            self.phases.append(self.script.phase)
        return actions


def script(craft: Craft, asked: StartGuided) -> GuidedScript:
    ready = replace(READY, autopilot="px4", mode="HOLD") if craft.px4 else READY
    return GuidedScript(asked, ready, firmware="px4" if craft.px4 else "ardupilot", target=VEHICLE)


def fly(craft: Craft, asked: StartGuided | None = None, *, acts: Any = None, **options: Any) -> Run:
    """``acts``: by time, what is done with the script."""
    machine = script(craft, asked or request())
    bound = {at_s: (lambda now_s, act=act: act(machine, now_s)) for at_s, act in (acts or {}).items()}
    return Run(Watching(machine, bound), craft, **options).until_end(longest_s=400)


def handed_over(craft: Craft) -> list[tuple[float, float]]:
    """When and how far north the vehicle was sent, repetitions left out."""
    kinds = ("SET_POSITION_TARGET_GLOBAL_INT", "COMMAND_INT")
    places = [(t, getattr(m, "lat_int", getattr(m, "x", 0))) for t, m in craft.log if m.get_type() in kinds]
    north = [(t, round((lat * 1e-7 - HOME[0]) * METRES_PER_DEG, 1)) for t, lat in places]
    return [place for k, place in enumerate(north) if k == 0 or place[1] != north[k - 1][1]]


@pytest.mark.parametrize("px4", [False, True])
def test_a_script_arms_takes_off_flies_every_target_and_comes_home(px4: bool) -> None:
    craft = Craft(px4=px4)
    run = fly(craft)
    assert run.result == GuidedEnd(True, "All targets were flown, and the vehicle has landed.")
    assert run.machine.phases == ["arming", "taking_off", "flying", "returning", "landed"]  # type: ignore[attr-defined]
    assert [north for _, north in handed_over(craft)] == [3.0, 8.0, 13.0, 18.0]
    assert craft.arms == 1
    assert not craft.armed
    assert [a.done for a in run.actions if isinstance(a, Progress)] == [1, 2, 3, 4]


def test_the_next_target_comes_when_the_last_was_reached_and_not_before() -> None:
    craft = Craft()
    fly(craft, request(waypoint_radius_m=0.5))
    times = [t for t, _ in handed_over(craft)]
    for before, after in pairwise(times[1:]):
        assert (5.0 - 0.5) / 2.0 - 0.3 <= after - before <= 5.4 / 2.0 + 0.6


def test_loiter_time_is_waited_at_each_target() -> None:
    craft = Craft()
    fly(craft, request((target(1, 0), target(2, 5, loiter_s=6.0), target(3, 10))))
    times = [t for t, _ in handed_over(craft)]
    assert times[2] - times[1] >= 6.0 + 4.5 / 2.0
    assert times[2] - times[1] <= 6.0 + 5.0 / 2.0 + 1.0


def test_speed_is_commanded_when_it_changes() -> None:
    craft = Craft()
    fly(craft, request((target(1, 0), target(2, 5), target(3, 10, speed_m_s=1.0), target(4, 15, speed_m_s=1.0))))
    assert [m.param2 for _, m in craft.log if m.get_type() == "COMMAND_LONG" and m.command == 178] == [2.0, 1.0]


def test_a_heading_is_handed_over_with_its_target() -> None:
    craft = Craft()
    fly(craft, request((target(1, 0), target(2, 5, heading_rad=1.5))))
    sent = [m for _, m in craft.log if m.get_type() == "SET_POSITION_TARGET_GLOBAL_INT"]
    assert sent[0].type_mask & 1024
    assert not sent[-1].type_mask & 1024
    assert sent[-1].yaw == pytest.approx(1.5)


def test_the_end_may_be_a_landing_on_the_spot() -> None:
    craft = Craft()
    assert fly(craft, request(end="land")).result.completed
    assert craft.at[0] == pytest.approx(18.0, abs=0.6)


@pytest.mark.parametrize("tells", [True, False])
def test_a_target_that_the_vehicle_did_not_take_is_sent_again(tells: bool) -> None:
    craft = Craft(deaf_to_targets=3, tells_its_target=tells)
    run = fly(craft)
    assert run.result.completed
    sent = [m for _, m in craft.log if m.get_type() == "SET_POSITION_TARGET_GLOBAL_INT"]
    assert len(sent) >= len(LINE) + 1


def test_a_target_that_was_taken_is_sent_once() -> None:
    craft = Craft(speed_m_s=0.5)
    slow = tuple(replace(place, speed_m_s=0.5) for place in LINE)
    fly(craft, request(slow))
    assert sum(m.get_type() == "SET_POSITION_TARGET_GLOBAL_INT" for _, m in craft.log) == len(LINE)


@pytest.mark.parametrize("px4", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_at_30_percent_loss_all_targets_are_flown_in_order_and_arming_happens_once(px4: bool, seed: int) -> None:
    craft = Craft(px4=px4)
    run = fly(craft, faults=replace(HARSH, duplicates=0.0), seed=seed)
    assert run.result.completed
    assert craft.arms == 1
    norths = [north for _, north in handed_over(craft)]
    assert sorted(set(norths)) == [3.0, 8.0, 13.0, 18.0]
    assert [n for k, n in enumerate(norths) if n not in norths[:k]] == [3.0, 8.0, 13.0, 18.0]


def test_refused_arming_ends_the_script_in_the_vehicles_words() -> None:
    run = fly(Craft(refuse_arming=True))
    assert isinstance(run.error, RefusedError)
    assert "did not arm" in run.error.what


def test_it_starts_only_from_the_ground_and_with_a_known_height() -> None:
    for state in (replace(READY, armed=True, landed="in_air"), replace(READY, alt_amsl_m=None)):
        (end,) = GuidedScript(request(), state, firmware="ardupilot", target=VEHICLE).start(0.0)
        assert isinstance(end, Failed)
        assert isinstance(end.error, NotAllowedError)


def test_the_pilot_takes_over_and_the_script_never_fights() -> None:
    craft = Craft()

    def takes_over(machine: GuidedScript, now_s: float) -> list[Action]:
        craft.mode = LOITER
        return []

    run = fly(craft, acts={8.5: takes_over})
    assert run.result.completed is False
    assert "pilot took over" in run.result.words
    assert run.machine.script.broke_off_at in (3, 4, 5)  # type: ignore[attr-defined]
    assert [m for t, m in craft.log if t > 9.7 and m.get_type() != "COMMAND_LONG"] == []
    assert craft.mode == LOITER


def test_a_pilot_who_takes_over_on_the_way_home_is_not_fought_either() -> None:
    craft = Craft()

    def takes_over(machine: GuidedScript, now_s: float) -> list[Action]:
        assert machine.phase == "returning"
        craft.mode = LOITER
        return []

    run = fly(craft, acts={17.0: takes_over})
    assert run.result.completed is False
    assert craft.mode == LOITER


def test_a_paused_script_holds_where_it_is_and_goes_on_to_the_same_target() -> None:
    craft = Craft()
    held: list[float] = []

    def pause(machine: GuidedScript, now_s: float) -> list[Action]:
        held.append(craft.at[0])
        return machine.pause(now_s)

    def look(machine: GuidedScript, now_s: float) -> list[Action]:
        assert machine.phase == "paused"
        held.append(craft.at[0])
        return []

    run = fly(craft, acts={9.0: pause, 25.0: look, 26.0: lambda machine, now_s: machine.resume(now_s)})
    assert run.result.completed
    assert held[1] == pytest.approx(held[0], abs=0.7)
    norths = [north for _, north in handed_over(craft)]
    assert norths[0] == 3.0
    assert norths[-2:] == [13.0, 18.0]
    assert run.now_s > 26


def test_paused_during_the_take_off_it_holds_when_it_is_up() -> None:
    craft = Craft()
    heights: list[float] = []

    def look(machine: GuidedScript, now_s: float) -> list[Action]:
        assert machine.phase == "paused"
        heights.append(craft.at[2])
        return []

    acts = {3.0: lambda machine, now_s: machine.pause(now_s), 20.0: look}
    run = fly(craft, acts={**acts, 21.0: lambda machine, now_s: machine.resume(now_s)})
    assert run.result.completed
    assert heights[0] == pytest.approx(10.0, abs=0.5)
    assert handed_over(craft)[-1][1] == 18.0
    early = {2.5: lambda machine, now_s: machine.pause(now_s), 3.0: lambda machine, now_s: machine.resume(now_s)}
    craft = Craft()
    assert fly(craft, acts=early).result.completed
    assert [north for _, north in handed_over(craft)] == [3.0, 8.0, 13.0, 18.0]


def test_paused_before_the_take_off_it_ends() -> None:
    machine = GuidedScript(request(), READY, firmware="ardupilot", target=VEHICLE)
    machine.start(0.0)
    assert machine.pause(0.1) == [Done(GuidedEnd(False, "Paused before the take-off."))]
    assert machine.on_tick(1.0) == []
    assert machine.broke_off_at is None


def test_a_stopped_script_sends_nothing_and_tells_where_it_broke_off() -> None:
    craft = Craft()
    run = fly(craft, acts={9.0: lambda machine, now_s: machine.stop("Return was asked for.")})
    assert run.result == GuidedEnd(False, "Return was asked for.")
    assert run.machine.script.status().broke_off_at is not None  # type: ignore[attr-defined]
    assert craft.mode == 4


def test_a_lost_link_is_waited_for() -> None:
    craft = Craft()

    def lose(direction: str, message: Any, number: int) -> bool:
        return 9.0 <= run.now_s <= 40.0

    machine = script(craft, request())
    run = Run(Watching(machine), craft, lose=lose)
    run.until_end(longest_s=400)
    assert run.result.completed
    assert [north for _, north in handed_over(craft)] == [3.0, 8.0, 13.0, 18.0]
    sent_meanwhile = [m for t, way, m in run.log if way == "up" and 12.0 < t < 39.0]
    assert [m.get_type() for m in sent_meanwhile if m.get_type() != "COMMAND_LONG"] == []


def test_it_says_how_far_behind_the_plan_it_is_and_skips_nothing() -> None:
    plan = tuple(replace(place, t_s=2.5 * k) for k, place in enumerate(LINE))
    craft = Craft()
    late = tuple(replace(place, speed_m_s=0.5) for place in plan)
    machine = script(craft, request(late))
    Run(Watching(machine), craft).until_end()
    assert machine.behind_s is not None
    assert 3 * 10 - 3 * 2.5 - 4 <= machine.behind_s <= 3 * 10 - 3 * 2.5 + 4
    assert [north for _, north in handed_over(craft)] == [3.0, 8.0, 13.0, 18.0]
    prompt = script(Craft(), request(plan))
    Run(Watching(prompt), Craft()).until_end()
    assert prompt.behind_s is not None
    assert abs(prompt.behind_s) < 2.5


@pytest.mark.fact("P12")
def test_px4_is_sent_on_when_its_home_moves_in_flight() -> None:
    craft = Craft(px4=True)

    def moves(machine: GuidedScript, now_s: float) -> list[Action]:
        craft.home_shift_m = 1.2
        return []

    run = fly(craft, acts={9.0: moves})
    assert run.result.completed
    assert run.now_s < 60.0
    heights = [(t, m.z - HOME[2]) for t, m in craft.log if m.get_type() == "COMMAND_INT"]
    assert {round(up_m, 1) for t, up_m in heights if t < 9.0} <= {10.0, 12.0}
    assert {round(up_m, 1) for t, up_m in heights if t > 9.5} >= {11.2}


@pytest.mark.fact("A11")
@pytest.mark.parametrize(
    ("stuck_s", "words"),
    [(3.0, "no nearer to the height of the take-off for 1"), (9.5, "no nearer to item 5 for 1")],
)
def test_a_flight_that_does_not_move_says_so(stuck_s: float, words: str) -> None:
    craft, told = Craft(), dict[float, str]()

    def sticks(machine: GuidedScript, now_s: float) -> list[Action]:
        craft.stuck = True
        return []

    def look(machine: GuidedScript, now_s: float) -> list[Action]:
        told[now_s - stuck_s] = machine.status().hint
        return []

    def frees(machine: GuidedScript, now_s: float) -> list[Action]:
        craft.stuck = False
        return look(machine, now_s)

    acts = {stuck_s: sticks, stuck_s + 8: look, stuck_s + 13: frees, stuck_s + 16.0: look}
    assert fly(craft, acts=acts).result.completed
    early, stuck, free = told.values()
    assert "nearer" not in early + free
    assert words in stuck


@pytest.mark.fact("A11", "P13")
def test_what_keeps_a_vehicle_from_going_on_is_guessed_from_its_state() -> None:
    place = Place(HOME[0], HOME[1], -5.0, HOME[2])
    here = replace(READY, lat_deg=HOME[0], lon_deg=HOME[1], alt_rel_home_m=0.0)
    flying = replace(here, landed="in_air", alt_rel_home_m=-6.7)
    for state, words in ((here, "leads below its home"), (flying, "hovers 1.7 m below it")):
        standstill = Standstill()
        assert standstill.words(state, place, "item 3", 0.0) == ""
        assert standstill.words(state, place, "item 3", 9.9) == ""
        assert words in standstill.words(state, place, "item 3", 10.0)


def test_without_a_timing_nothing_is_said_about_delay() -> None:
    craft = Craft()
    machine = script(craft, request())
    Run(Watching(machine), craft).until_end()
    assert machine.behind_s is None
    status = machine.status(since_utc_s=5.0)
    assert (status.way, status.phase, status.since_utc_s, status.hint) == ("guided", "landed", 5.0, "")


def test_an_order_to_hold_that_got_lost_is_given_again_though_the_vehicle_moves() -> None:
    here = Place(-37.0, 175.0, 10.0, 800.0)
    flying_on = VehicleState(
        1, 1, position_t_mono_s=100.0, lat_deg=-36.9999, lon_deg=175.0, alt_rel_home_m=10.0, ground_speed_m_s=3.0
    )
    again = {}
    for holds in (False, True):
        handover = Handover(here, radius_m=0.5, holds=holds)
        handover.sent(flying_on, 98.0)
        again[holds] = handover.must_be_sent_again(flying_on, 100.5)
    assert again == {False: False, True: True}
    held = replace(flying_on, lat_deg=-37.00001)
    assert not handover.must_be_sent_again(held, 100.5)
