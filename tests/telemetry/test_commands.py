"""Commands on good and bad links: acknowledged, refused, in progress, silent; and arming that happens once only."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RefusedError, SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Progress, Send
from telemetry.mavlink.commands import CommandRun
from telemetry.topics.vehicle import VehicleState
from tests.seeds import seeds
from tests.telemetry.lossy import STATION, VEHICLE, Faults, Run

ARM, TAKEOFF, MODE, LAND_NOW = 400, 22, 176, 21
LOSSY = Faults(loss=0.3, reordering=0.1, duplicates=0.02, corruption=0.01)


def command(number: int, *params: float) -> Any:
    padded = (*params, *(0.0,) * (7 - len(params)))
    return mavlink.MAVLink_command_long_message(*VEHICLE, number, 0, *padded)


def acknowledgement(number: int, result: int, *, to: tuple[int, int] = STATION, progress: int = 0) -> Any:
    return mavlink.MAVLink_command_ack_message(number, result, progress, 0, *to)


@dataclass
class Craft:
    """Carries commands out, counts how often, and sends a heartbeat once per second."""

    answers: list[int] = field(default_factory=lambda: [0])
    """Results in turn, the last for ever."""
    words: str = ""
    armed: bool = False
    executed: int = 0
    heard: list[Any] = field(default_factory=list)
    mute: bool = False
    deaf: bool = False
    heartbeat_s: float = 0.0

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        if self.deaf or not message.get_type().startswith("COMMAND"):
            return []
        self.heard.append(message)
        result = self.answers[min(len(self.heard), len(self.answers)) - 1]
        if result == 0:
            self.executed += 1
            self.armed = message.command == ARM or self.armed
        said = [mavlink.MAVLink_statustext_message(2, self.words.encode())] if self.words else []
        return [] if self.mute else [acknowledgement(message.command, result), *said]

    def on_tick(self, now_s: float) -> list[Any]:
        if now_s - self.heartbeat_s < 1.0:
            return []
        self.heartbeat_s = now_s
        return [mavlink.MAVLink_heartbeat_message(2, 3, 128 if self.armed else 0, 0, 3, 3)]


class WithState:
    """Feeds a command with the states that the vehicle's heartbeats make."""

    def __init__(self, run: CommandRun) -> None:
        self.run = run
        self.state = VehicleState(1, 1)
        self.start, self.on_tick = run.start, run.on_tick

    def on_message(self, message: Any, now_s: float) -> list[Action]:
        if message.get_type() == "HEARTBEAT":
            self.state = replace(self.state, heartbeat_t_mono_s=now_s, armed=bool(message.base_mode & 128))
            return self.run.on_state(self.state, now_s)
        return self.run.on_message(message, now_s)


def is_armed(state: VehicleState) -> bool:
    return state.armed


def give(
    message: Any,
    craft: Craft,
    faults: Faults = Faults(),  # noqa: B008
    *,
    once: bool = False,
    confirm: Callable[[VehicleState], bool] | None = None,
    **options: Any,
) -> Run:
    machine = WithState(CommandRun(message, target=VEHICLE, once=once, confirm=confirm))
    return Run(machine, craft, faults, **options).until_end(longest_s=200)


def test_an_accepted_command_is_done_after_one_sending() -> None:
    craft = Craft()
    run = give(command(MODE, 1, 4), craft)
    assert run.end == Done(None)
    assert len(craft.heard) == 1
    assert run.now_s < 0.1


@pytest.mark.parametrize(
    ("result", "words"),
    [(2, "denied"), (3, "does not know"), (4, "tried and failed"), (6, "cancelled"), (8, "COMMAND_INT"), (99, "99")],
)
def test_a_refusal_says_what_was_asked_and_why_in_the_vehicles_words(result: int, words: str) -> None:
    error = give(command(ARM, 1), Craft([result], words="Arm: Need Position Estimate"), once=True).error
    assert isinstance(error, RefusedError)
    assert error.what.startswith("The vehicle did not arm: ")
    assert words in error.what
    assert '"Arm: Need Position Estimate"' in error.what


def test_words_that_came_before_the_command_or_are_no_warning_are_left_out() -> None:
    class Chatty(Craft):
        def on_tick(self, now_s: float) -> list[Any]:
            return [mavlink.MAVLink_statustext_message(6, b"EKF3 IMU0 is using GPS")]

    error = give(command(ARM, 1), Chatty([4])).error
    assert "EKF3" not in error.what


def test_a_text_in_several_parts_is_put_together() -> None:
    class Verbose(Craft):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            parts = [
                mavlink.MAVLink_statustext_message(4, b"x" * 50, 7, 0),
                mavlink.MAVLink_statustext_message(4, b"yz", 7, 1),
            ]
            return [*super().on_message(message, now_s), *parts]

    assert "x" * 50 + "yz" in give(command(ARM, 1), Verbose([4])).error.what


def test_a_silent_vehicle_is_asked_again_with_a_count_and_then_given_up() -> None:
    craft = Craft(mute=True)
    run = give(command(MODE, 1, 4), craft)
    assert isinstance(run.error, SilentError)
    assert "change the flight mode" in run.error.what
    assert [message.confirmation for message in craft.heard[:4]] == [0, 1, 2, 3]
    assert 10 <= run.now_s <= 15


def test_a_command_int_is_sent_again_too() -> None:
    craft = Craft(mute=True)
    message = mavlink.MAVLink_command_int_message(*VEHICLE, 6, 192, 0, 0, -1, 1, 0, math.nan, 1, 2, 3.0)
    assert isinstance(give(message, craft).error, SilentError)
    assert len(craft.heard) > 5


def test_a_rejection_for_now_is_tried_again() -> None:
    craft = Craft([1, 1, 0])
    run = give(command(MODE, 1, 4), craft)
    assert run.end == Done(None)
    assert len(craft.heard) == 3
    assert isinstance(give(command(MODE, 1, 4), Craft([1])).error, RefusedError)


def test_a_command_in_progress_is_waited_for_and_not_sent_again() -> None:
    class Slow(Craft):
        began_s: float | None = None

        def on_message(self, message: Any, now_s: float) -> list[Any]:
            self.began_s = now_s
            return [*super().on_message(message, now_s)]

        def on_tick(self, now_s: float) -> list[Any]:
            if self.began_s is None:
                return []
            share = (now_s - self.began_s) / 30
            result = acknowledgement(MODE, 0) if share >= 1 else acknowledgement(MODE, 5, progress=int(share * 100))
            return [result]

    craft = Slow([5])
    run = give(command(MODE, 1, 4), craft)
    assert run.end == Done(None)
    assert run.now_s > 29
    assert len(craft.heard) == 1
    assert [a.done for a in run.actions if isinstance(a, Progress)][-1] > 90


def test_a_command_in_progress_that_is_never_ended_is_named() -> None:
    error = give(command(MODE, 1, 4), Craft([5])).error
    assert isinstance(error, SilentError)
    assert "not heard to end" in error.what


def test_acknowledgements_for_others_and_of_others_are_not_ours() -> None:
    run = CommandRun(command(ARM, 1), target=VEHICLE, once=True)
    run.start(0.0)
    messages = [
        acknowledgement(ARM, 0, to=(254, 190)),
        acknowledgement(MODE, 0),
    ]
    for message in messages:
        message._header.srcSystem, message._header.srcComponent = VEHICLE
    stranger = acknowledgement(ARM, 0)
    stranger._header.srcSystem, stranger._header.srcComponent = (7, 1)
    assert [run.on_message(message, 0.1) for message in (*messages, stranger)] == [[], [], []]


def test_arming_whose_acknowledgement_was_lost_is_settled_by_the_state() -> None:
    craft = Craft(mute=True)
    run = give(command(ARM, 1), craft, once=True, confirm=is_armed)
    assert run.end == Done(None)
    assert craft.executed == 1
    assert len(craft.heard) == 1


def test_arming_is_sent_again_only_after_the_vehicle_was_seen_disarmed() -> None:
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "up" and not lost:
            lost.append(number)
            return True
        return False

    craft = Craft()
    run = give(command(ARM, 1), craft, once=True, confirm=is_armed, lose=lose)
    assert run.end == Done(None)
    assert craft.executed == 1
    assert run.now_s >= 2.5


def test_without_any_sight_of_the_vehicle_arming_is_sent_once_and_said_to_be_unknown() -> None:
    craft = Craft(mute=True)
    run = give(command(ARM, 1), craft, once=True, confirm=is_armed, lose=lambda way, *_: way == "down")
    assert isinstance(run.error, SilentError)
    assert "not known" in run.error.what
    assert len(craft.heard) == 1


def test_a_take_off_gets_time_to_show() -> None:
    """The motors spin up for seconds; meanwhile the vehicle still says that it is on the ground."""
    run = CommandRun(command(TAKEOFF), target=VEHICLE, once=True, confirm=lambda state: state.landed == "in_air")
    run.start(0.0)
    state = VehicleState(1, 1, landed="on_ground", armed=True)
    sent = [run.on_state(replace(state, heartbeat_t_mono_s=t), t) for t in (1.0, 2.0, 3.0, 4.0, 5.0)]
    assert sent == [[]] * 5
    assert run.on_state(replace(state, heartbeat_t_mono_s=5.9, landed="in_air"), 6.1) == [Done(None)]


def test_an_old_state_neither_confirms_nor_allows_another_sending() -> None:
    run = CommandRun(command(ARM, 1), target=VEHICLE, once=True, confirm=is_armed)
    run.start(10.0)
    assert run.on_state(VehicleState(1, 1, heartbeat_t_mono_s=9.9, armed=True), 10.1) == []
    assert run.on_state(VehicleState(1, 1, heartbeat_t_mono_s=10.4), 20.0) == []
    again = run.on_state(VehicleState(1, 1, heartbeat_t_mono_s=19.9), 20.0)
    assert isinstance(again[0], Send)
    assert again[0].message.confirmation == 1


@seeds(200)
def test_at_30_percent_loss_arming_ends_in_an_answer_and_happens_once(seed: int) -> None:
    """Repetitions by the link itself are left out here: the vehicle cannot tell them from ours."""
    craft = Craft()
    run = give(command(ARM, 1), craft, replace(LOSSY, duplicates=0.0), once=True, confirm=is_armed, seed=seed)
    assert run.end == Done(None) or isinstance(run.error, SilentError | RefusedError)
    assert craft.executed <= 1
    assert craft.armed or isinstance(run.end, Failed)


@seeds(200)
def test_at_30_percent_loss_other_commands_end_in_an_answer(seed: int) -> None:
    run = give(command(MODE, 1, 4), Craft(), LOSSY, seed=seed)
    assert run.end == Done(None)
    assert run.now_s < 12


@seeds(30)
def test_at_30_percent_loss_a_refusal_stays_a_refusal(seed: int) -> None:
    craft = Craft([4])
    run = give(command(ARM, 1), craft, LOSSY, once=True, confirm=is_armed, seed=seed)
    assert isinstance(run.error, RefusedError | SilentError)
    assert not craft.armed
