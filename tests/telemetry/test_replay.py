"""The player: which message is due when, with a clock of the test's own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.errors import RecordingError
from telemetry.recording.player import Due, Player
from telemetry.recording.replay_sources import open_source
from telemetry.topics.messages import FlightStatus, LinkStatus, Topic, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import T0_UTC_S, flight, opened, write_flight

NOW_S = 90_000.0
SECONDS = 20.0
LAT_0_DEG, LAT_PER_S_DEG = 45.0, 1e-5


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_flight(tmp_path_factory.mktemp("replay") / "a.mcap")


@pytest.fixture
def player(path: Path) -> Iterator[Player]:
    with opened(path, NOW_S) as player:
        yield player


def run(player: Player, from_s: float, to_s: float, step_s: float = 0.02) -> list[tuple[float, Due]]:
    """(time of the test's clock, what came)."""
    steps = round((to_s - from_s) / step_s)
    times = [NOW_S + from_s + number * step_s for number in range(1, steps + 1)]
    return [(now_s - NOW_S, due) for now_s in times for due in player.on_tick(now_s)]


def play(player: Player, now_s: float = NOW_S, *, at_s: float | None = None, speed: float | None = None) -> list[Due]:
    at_utc_s = None if at_s is None else T0_UTC_S + at_s
    return player.play(now_s, playing=True, at_utc_s=at_utc_s, speed=speed)


def recorded_s(state: VehicleState) -> float:
    """When a state of the made-up flight was recorded, told by where it is."""
    assert state.lat_deg is not None
    return (state.lat_deg - LAT_0_DEG) / LAT_PER_S_DEG


def states(due: list[tuple[float, Due]]) -> list[tuple[float, VehicleState]]:
    return [(t, message) for t, (_, message) in due if isinstance(message, VehicleState)]


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0, 3.0])
def test_everything_comes_once_at_its_time(player: Player, speed: float) -> None:
    play(player, speed=speed)
    due = run(player, 0.0, SECONDS / speed + 1.0)
    expected = [(t, str(topic)) for t, topic, _ in flight() if topic != Topic.RAW and t > 0]
    assert [str(topic) for _, (topic, _) in due][: len(expected)] == [topic for _, topic in expected]
    for (came_s, _), (t_s, _) in zip(due, expected, strict=False):
        assert came_s * speed == pytest.approx(t_s, abs=0.021 * max(speed, 1.0))


def test_it_stops_at_the_end_and_begins_anew(player: Player) -> None:
    play(player)
    run(player, 0.0, SECONDS + 1)
    status = player.status(NOW_S + 21)
    assert not status.playing
    assert status.at_utc_s == status.end_utc_s == pytest.approx(T0_UTC_S + SECONDS)
    due = play(player, NOW_S + 21)
    assert player.status(NOW_S + 21).at_utc_s == T0_UTC_S
    assert any(isinstance(message, VehicleState) and not message.armed for _, message in due)


def test_fast_it_shows_the_latest_states_and_every_event(player: Player) -> None:
    play(player, speed=50.0)
    due = run(player, 0.0, 0.5)
    found = states(due)
    assert 5 < len(found) <= 25 + 1
    assert recorded_s(found[-1][1]) == pytest.approx(SECONDS, abs=1e-6)
    assert [m.text for _, (_, m) in due if isinstance(m, VehicleText)] == ["Half of it flown"]


@given(st.floats(-5, 25))
@settings(deadline=None, max_examples=25)
def test_moving_to_a_time_gives_the_state_of_things_then(path: Path, at_s: float) -> None:
    player = Player(open_source(path), NOW_S)
    due = dict(player.play(NOW_S, playing=False, at_utc_s=T0_UTC_S + at_s, speed=None))
    player.close()
    at_s = min(max(at_s, 0.0), SECONDS)
    assert player.status(NOW_S).at_utc_s == pytest.approx(T0_UTC_S + at_s)
    state, status = due[Topic.VEHICLE], due[Topic.FLIGHT]
    assert isinstance(state, VehicleState)
    assert recorded_s(state) == pytest.approx(math.floor(at_s * 10 + 1e-6) / 10, abs=1e-5)
    assert isinstance(status, FlightStatus)
    assert status.phase == ("flying" if at_s >= SECONDS / 2 else "idle")
    assert Topic.PLAN in due


def test_after_moving_it_goes_on_from_there(player: Player) -> None:
    play(player)
    run(player, 0.0, 1.0)
    play(player, NOW_S + 1.0, at_s=15.0)
    found = states(run(player, 1.0, 2.05))
    assert [round(recorded_s(s), 3) for _, s in found] == [round(15.1 + k / 10, 3) for k in range(10)]


def test_paused_nothing_goes_on(player: Player) -> None:
    play(player)
    run(player, 0.0, 5.05, 0.05)
    player.play(NOW_S + 5.05, playing=False, at_utc_s=None, speed=None)
    at_utc_s = player.status(NOW_S + 5.05).at_utc_s
    found = states(run(player, 5.05, 60.0))
    assert player.status(NOW_S + 60.0).at_utc_s == at_utc_s
    assert {round(recorded_s(s), 3) for _, s in found} == {5.0}
    assert len(found) > 50


def test_ages_are_those_of_the_recording(player: Player) -> None:
    """Also while paused: what was fresh then looks fresh now."""
    play(player, at_s=3.0)
    player.play(NOW_S, playing=False, at_utc_s=T0_UTC_S + 3.04, speed=None)
    for come_s, (_, message) in [(0.0, due) for due in player.open(NOW_S)] + run(player, 0.0, 10.0):
        if isinstance(message, LinkStatus):
            assert NOW_S + come_s - message.t_mono_s == pytest.approx(player.status(0).at_utc_s - T0_UTC_S, abs=1e-3)
        if isinstance(message, VehicleState):
            assert message.position_t_mono_s is not None
            age_s = NOW_S + come_s - message.position_t_mono_s
            assert age_s == pytest.approx(player.status(0).at_utc_s - T0_UTC_S - recorded_s(message), abs=1e-3)
            assert message.battery_t_mono_s is None


def test_a_stalled_process_does_not_rush_afterwards(player: Player) -> None:
    play(player)
    due = player.on_tick(NOW_S + 10.0)
    assert len(states([(0.0, d) for d in due])) <= 6
    assert player.status(NOW_S + 10.0).at_utc_s == pytest.approx(T0_UTC_S + 0.5)


def test_it_sleeps_no_longer_than_until_the_next_message(player: Player) -> None:
    play(player)
    run(player, 0.0, 1.05, 0.05)
    assert 0.0 <= player.wait_s() <= 0.05 + 1e-6
    play(player, NOW_S + 1.05, speed=0.1)
    assert player.wait_s() == pytest.approx(0.125)


@pytest.mark.parametrize("speed", [0.0, -1.0, 0.09, 51.0, math.nan, math.inf])
def test_speeds_that_are_none(player: Player, speed: float) -> None:
    with pytest.raises(RecordingError):
        play(player, speed=speed)
    assert player.speed == 1.0
    assert not player.playing


def test_times_that_are_none(player: Player) -> None:
    with pytest.raises(RecordingError):
        play(player, at_s=math.nan)
