"""The mission of the flight that is under way: what may be gone on with, here and by the next link node."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import MissionUnknownError, NotAllowedError
from telemetry.flight.guided.beginning import CALM_S
from telemetry.link.onboard import FOREIGN_MISSION, HOME_MOVED, NOT_TAKEN_UP, OnBoard, Started, UnderWay
from telemetry.nodes.link import Memory, read_memory, write_memory
from telemetry.topics.messages import FlightStatus
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.requests import TakeUp
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import ARMED, AUTO, heartbeat
from tests.telemetry.link_bench import ME
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_piloting import BRAKE, MISSION, POSITION, desk, in_air

TAKEN_UP = TakeUp(ME, "new", -37.0, 175.0, 10.0)
FLYING = FlightStatus(way="auto", phase="paused", target=2, targets=3, since_utc_s=1.0)


def holding(*, mode: str = "BRAKE", north_m: float = 0.0) -> VehicleState:
    now_s = time.monotonic()
    placed: dict[str, Any] = {"lat_deg": -37.0 + north_m / 111_000, "lon_deg": 175.0, "alt_rel_home_m": 10.0}
    told: dict[str, Any] = {"armed": True, "landed": "in_air", "mode": mode, "position_t_mono_s": now_s}
    return VehicleState(1, 1, autopilot="ardupilot", **placed, **told)


def on_board(digest: str | None) -> OnBoard:
    onboard = OnBoard()
    if digest is not None:
        onboard.transfer_ends(OnboardMission(MISSION, None, None, None, digest), 0.0)
    return onboard


def taken_up() -> UnderWay:
    flight = UnderWay(on_board("new"))
    flight.begin("new", TAKEN_UP)
    return flight


@pytest.mark.parametrize("mode", ["RTL", "LAND", "GUIDED"])
def test_a_taken_up_mission_begins_where_it_was_certified_also_after_another_mode(mode: str) -> None:
    flight = taken_up()
    flight.on_state(holding(mode=mode))
    flight.check_goes_on(holding())
    with pytest.raises(NotAllowedError, match="from where the certified way begins") as refused:
        flight.check_goes_on(holding(north_m=80.0))
    assert refused.value.advice.startswith("Take the plan up again.")


def test_gusts_change_what_is_said_of_a_plan_that_waits_seldom_and_let_it_go_on_once_it_is_calm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flight, now_s, said = taken_up(), 1000.0, list[tuple[float, str]]()

    def check(**state: Any) -> None:
        told = replace(holding(), position_t_mono_s=now_s, **state)
        try:
            flight.check_goes_on(told)
            words = ""
        except NotAllowedError as error:
            words = str(error)
        if not said or said[-1][1] != words:
            said.append((now_s, words))

    monkeypatch.setattr("telemetry.link.onboard.time.monotonic", lambda: now_s)
    check()
    for number in range(200):  # ten seconds of gusts, each another, at 20 Hz
        now_s += 0.05
        away = {"lat_deg": -37.0 + (1.0 + number / 100) / 111_000}
        check(**{0: {"ground_speed_m_s": 1.0 + number / 50 + 0.01}, 1: {}, 2: away}[number % 3])
    assert said[1][0] == pytest.approx(1000.05), "at once"
    assert all(words and not any(c.isdigit() for c in words) for _, words in said[1:])
    assert all(later - before >= CALM_S - 1e-6 for (before, _), (later, _) in pairwise(said[1:]))
    calm_s = now_s
    while said[-1][1]:
        now_s += 0.05
        check()
    assert now_s - calm_s == pytest.approx(CALM_S, abs=0.11)


def test_once_it_is_flown_it_is_gone_on_with_from_anywhere() -> None:
    flight = taken_up()
    flight.on_state(holding(mode="AUTO"))
    flight.check_goes_on(holding(north_m=80.0))
    assert flight.started == Started("new")


def test_other_fences_and_rally_points_end_it_until_a_plan_is_taken_up() -> None:
    flight = taken_up()
    flight.replaces_places()
    flight.replaces()
    with pytest.raises(NotAllowedError, match="not certified with the fence and rally points"):
        flight.check_goes_on(holding())
    flight.begin("new", TAKEN_UP)
    flight.check_goes_on(holding())


def test_what_the_node_before_knew_is_held_against_what_is_read_and_stops_nobody_before() -> None:
    onboard = on_board(None)
    flight = UnderWay(onboard)
    flight.inherit(Started("old"))
    assert flight.must_be_read
    assert not flight.turns_foreign(holding(mode="AUTO")), "nobody has looked yet"
    with pytest.raises(MissionUnknownError, match="not known any more"):
        flight.check_goes_on(holding())
    onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "mixed"), 0.0)
    flight.on_state(holding())
    assert not flight.must_be_read
    with pytest.raises(MissionUnknownError, match="Another mission"):
        flight.check_goes_on(holding())
    assert flight.turns_foreign(holding(mode="AUTO"))
    assert not flight.turns_foreign(holding(mode="AUTO")), "said once"


@pytest.mark.parametrize("places", [False, True])
def test_who_flies_our_own_lists_that_were_not_taken_up_is_not_told_of_another_station(*, places: bool) -> None:
    onboard = on_board("old")
    flight = UnderWay(onboard)
    flight.begin("old")
    if places:
        flight.replaces_places()
    else:
        flight.replaces()
        onboard.transfer_begins(replaces=True)
        onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "new"), 0.0)
    assert flight.turns_foreign(holding(mode="AUTO"))
    assert flight.why_foreign == NOT_TAKEN_UP
    onboard.on_foreign(mavlink.MAVLink_mission_clear_all_message(1, 1), 1)
    assert flight.why_foreign == FOREIGN_MISSION, "somebody else wrote after us"
    flight.begin("new", TAKEN_UP)
    assert flight.why_foreign == FOREIGN_MISSION


def test_a_node_that_is_started_anew_still_knows_that_it_was_us() -> None:
    onboard = on_board(None)
    flight = UnderWay(onboard)
    flight.inherit(Started("old", replaced_here=True))
    onboard.transfer_ends(OnboardMission(MISSION, None, None, None, "mixed"), 0.0)
    flight.on_state(holding())
    assert flight.turns_foreign(holding(mode="AUTO"))
    assert flight.why_foreign == NOT_TAKEN_UP


@pytest.mark.parametrize(
    "started", [Started(), Started("old"), Started("new", TAKEN_UP), Started("old", replaced_here=True)]
)
def test_it_is_written_down_for_the_next_node(tmp_path: Path, started: Started) -> None:
    memory = Memory(flight=FLYING, started=started)
    write_memory(tmp_path / "link.json", memory)
    assert read_memory(tmp_path / "link.json") == memory


@pytest.mark.parametrize(("digest", "may"), [("old", True), ("mixed", False)])
def test_resume_after_a_restart_reads_what_is_on_board_and_flies_only_what_was_started(digest: str, may: bool) -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=BRAKE, base_mode=ARMED), in_air(), POSITION) as it:
            it.flight.take_up(FLYING)
            it.pilot.inherit(Started("old"))
            it.on_board = OnboardMission(MISSION, None, None, None, digest)
            it.pilot.on_tick()
            assert it.pilot.started == Started("old")
            resuming = it.pilot.resume()
            if may:
                with pytest.raises(TimeoutError):
                    await it.within(0.3, resuming)
                assert it.modes() == [AUTO]
            else:
                with pytest.raises(MissionUnknownError, match="Another mission"):
                    await resuming
                assert it.modes() == []

    run(whole)


@pytest.mark.parametrize("meanwhile", ["written anew by somebody", "flown past an obstacle"])
def test_what_changes_while_the_mission_is_read_is_not_flown_on(
    meanwhile: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=BRAKE, base_mode=ARMED), in_air(), POSITION) as it:
            it.flight.take_up(FLYING)
            it.pilot.inherit(Started("old"))
            it.on_board = OnboardMission(MISSION, None, None, None, "old")
            it.pilot.on_tick()
            onboard, ends = it.bench.vehicle.onboard, it.bench.vehicle.onboard.transfer_ends

            def and_then(mission: OnboardMission, now_s: float) -> None:
                ends(mission, now_s)
                if meanwhile == "written anew by somebody":
                    onboard.on_foreign(mavlink.MAVLink_mission_clear_all_message(1, 1), 1)
                else:
                    monkeypatch.setattr(type(it.pilot), "is_guided", True)

            monkeypatch.setattr(onboard, "transfer_ends", and_then)
            with pytest.raises((MissionUnknownError, NotAllowedError), match=r"not known any more|Another"):
                await it.pilot.resume()
            assert it.modes() == []

    run(whole)


def test_a_vehicle_that_was_not_heard_since_a_restart_is_not_told_to_start_its_mission() -> None:
    async def whole() -> None:
        async with desk() as it:
            it.flight.take_up(replace(FLYING, phase="paused"))
            it.pilot.inherit(Started("old"))
            it.pilot.on_tick()
            assert it.pilot.status.not_resumed == "The vehicle has not been heard yet."
            it.bench.hear(heartbeat(custom_mode=BRAKE, base_mode=ARMED), in_air(), POSITION)
            assert it.pilot.status.not_resumed == ""

    run(whole)


def test_the_end_of_the_flight_ends_it() -> None:
    async def whole() -> None:
        async with desk(heartbeat(custom_mode=BRAKE, base_mode=ARMED), in_air()) as it:
            it.flight.take_up(replace(FLYING, phase="landed"))
            it.pilot.inherit(Started("new", TAKEN_UP))
            it.pilot.on_tick()
            assert it.pilot.started == Started()

    run(whole)


def test_a_home_that_the_vehicle_refused_leaves_what_is_paused_as_it_was() -> None:
    flight = taken_up()
    before, ordered = flight.started, flight.moves_home(perhaps=True)
    with pytest.raises(NotAllowedError, match="may have been moved"):
        flight.check_goes_on(holding())
    flight.stays_home(before, ordered)
    flight.check_goes_on(holding())


def test_a_refusal_does_not_take_back_what_somebody_else_moved_meanwhile() -> None:
    flight = taken_up()
    before, ordered = flight.started, flight.moves_home(perhaps=True)
    flight.moves_home()
    flight.stays_home(before, ordered)
    with pytest.raises(NotAllowedError, match="certified for the home before"):
        flight.check_goes_on(holding())


def test_a_mission_that_flies_on_from_another_home_is_told_why_it_is_held() -> None:
    flight = taken_up()
    flight.moves_home()
    assert flight.turns_foreign(holding(mode="AUTO"))
    assert flight.why_foreign == HOME_MOVED
    flight.moves_home(perhaps=True)
    assert "may have been moved" in flight.why_foreign
