"""One table of phases and events: in the code, drawn above it and in the docs, and flown by as it stands there."""

# pyright: reportPrivateUsage=false
from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import pytest

from telemetry.flight.avoidance import detour as flown
from telemetry.flight.avoidance import phases
from telemetry.flight.avoidance.backing import Backing
from telemetry.flight.avoidance.climb import Climb
from telemetry.flight.avoidance.detour import Detour
from telemetry.flight.avoidance.detour_state import DetourParams
from telemetry.flight.avoidance.phases import ANY, TABLE, Event, Phase, Sidestep, next_phase
from telemetry.flight.avoidance.regions import Regions
from telemetry.flight.guided.helm import Helm
from telemetry.flight.guided.legs import Legs
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.mavlink.actions import Action, Send
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.avoiding_bench import targets

PHASES: tuple[Phase, ...] = get_args(Phase)
EVENTS: tuple[Event, ...] = get_args(Event)
ROWS = [("any", event, to) for event, to in ANY.items()]
ROWS += [(phase, event, to) for phase, events in TABLE.items() for event, to in events.items()]
NOW_S = 20.0
STATE = VehicleState(
    1,
    1,
    armed=True,
    landed="in_air",
    mode="GUIDED",
    lat_deg=-37.0,
    lon_deg=175.0,
    alt_rel_home_m=10.0,
    alt_amsl_m=90.0,
    position_t_mono_s=NOW_S,
    heartbeat_t_mono_s=NOW_S,
)
WAY = targets((20.0, 0.0, 12.0), (40.0, 0.0, 12.0))
REMAINING = RemainingMission(WAY, "rtl")


def in_phase(phase: Phase) -> Detour:
    """A detour that has all that any phase may ask for."""
    helm = Helm((1, 1), lambda mode, now_s: None)
    helm.on_state(STATE, NOW_S)
    made = Detour(helm, Regions(PerceptionSettings()), DetourParams())
    made.remaining, made._plan_m, made._legs = REMAINING, 8.0, Legs(helm, WAY)
    made._climb = Climb(helm, STATE, speed_m_s=1.5, latency_s=0.3, least_m=0.0, ceiling_m=40.0)
    made._backing = Backing(helm, made.trail, STATE, 2.0)
    made.aside.begin(STATE, WAY)
    made.phase = phase
    return made


def order(it: Detour, event: Event) -> list[Action] | None:
    """None: the event is none that is ordered."""
    match event:
        case "obstacle":
            return it.avoid(REMAINING, frozenset(), NOW_S)
        case "way ordered":
            return it.fly(WAY, REMAINING, over=True, offset_m=2.0, now_s=NOW_S)
        case "sidestep ordered":
            return it.sidestep(WAY, REMAINING, now_s=NOW_S)
        case "step aside":
            return it.step_aside(STATE, REMAINING, NOW_S)
        case "no way past":
            return it.give_up_aside(STATE, NOW_S)
        case "switched off":
            return it.stop_aside(NOW_S)
        case "lower line":
            return it.come_down(WAY, STATE, NOW_S)
        case "blocked":
            return it.stop_short(NOW_S)
        case "beyond fence":
            return it.stop_at_fence("It would leave it.", NOW_S)
        case "silent":
            return it.hold_if_silent(VehicleState(1, 1), NOW_S)
        case "paused":
            return it.pause(NOW_S)
        case _:
            return None


def test_the_docs_and_the_code_have_one_table() -> None:
    page = (Path(__file__).parents[2] / "docs" / "avoidance.md").read_text(encoding="utf-8")
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line[:2] == "| "]
    assert [(row[0], row[1], row[4]) for row in cells[1:]] == ROWS
    assert all(row[2] and row[3] for row in cells)


def test_the_drawing_above_the_code_is_the_same_table() -> None:
    assert phases.__doc__ is not None
    drawn: list[tuple[str, str, str]] = []
    phase = ""
    for line in re.findall(r"^    (.*)$", phases.__doc__, re.M):
        phase = line[:10].strip() or phase
        drawn += [(phase, event, to) for event, to in re.findall(r"([a-z ]+) -> (\w+)", line[10:])]
    drawn = [(phase, event.strip(), to) for phase, event, to in drawn]
    assert sorted(drawn) == sorted(ROWS)


def test_every_event_is_looked_for_or_ordered_and_every_phase_can_be_come_to() -> None:
    assert set(TABLE) == set(PHASES) == {to for _, _, to in ROWS}
    assert {event for _, event, _ in ROWS} == set(EVENTS)
    for event in EVENTS:
        by_resume = event in ("resumed", "clear at last")
        assert (event in flown._LOOKS) + (order(in_phase("going"), event) is not None) + by_resume == 1


@pytest.mark.parametrize("event", list(flown._LOOKS))
def test_what_a_look_finds_leads_where_the_table_says(event: Event, monkeypatch: pytest.MonkeyPatch) -> None:
    looks = {one: (lambda *_, holds=one == event: holds, act) for one, (_, act) in flown._LOOKS.items()}
    monkeypatch.setattr(flown, "_LOOKS", looks)
    for phase in PHASES:
        it = in_phase(phase)
        it.look(STATE, NOW_S)
        assert it.phase == TABLE[phase].get(event, phase), phase


@pytest.mark.parametrize("event", [event for event in EVENTS if order(in_phase("idle"), event) is not None])
def test_an_order_leads_where_the_table_says_and_else_changes_nothing(
    event: Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flown, "_LOOKS", {})
    for phase in PHASES:
        it, to = in_phase(phase), next_phase(phase, event)
        before = it.variant, it.why, it.remaining, it.offset_m
        actions = order(it, event)
        assert it.phase == (to or phase), phase
        if to is None:
            assert actions == []
            assert (it.variant, it.why, it.remaining, it.offset_m) == before


def test_resuming_leads_on_from_what_holds_and_from_the_ceiling_once_it_is_clear(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(flown, "_LOOKS", {})
    for phase in PHASES:
        it = in_phase(phase)
        it._paused = phase == "holding"
        monkeypatch.setattr(it._trusted, "say_clear", lambda _: True)
        it.resume(STATE, NOW_S)
        to = {"holding": TABLE["holding"]["resumed"], "ceiling": TABLE["ceiling"]["clear at last"]}
        assert it.phase == to.get(phase, phase)


@pytest.mark.parametrize("event", ["obstacle", "way ordered", "paused"])
def test_it_brakes_whatever_it_was_doing(event: Event) -> None:
    for phase in PHASES:
        (sent,) = order(in_phase(phase), event) or []
        assert isinstance(sent, Send)
        assert (sent.message.command, sent.message.param2) == (176, 17.0), phase


def test_a_sidestep_does_not_brake_and_is_nothing_that_is_stopped_short_on() -> None:
    it = in_phase("idle")
    (sent,) = it.sidestep(WAY, REMAINING, now_s=NOW_S)
    assert isinstance(sent, Send)
    assert (sent.message.command, sent.message.param2) == (176, 4.0)
    it.look(STATE, NOW_S)
    assert (it.phase, type(it.variant), it.goes_past, it.goes_over) == ("going", Sidestep, False, False)
