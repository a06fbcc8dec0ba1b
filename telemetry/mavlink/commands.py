"""One command until the vehicle has answered it, sans-IO; what must not happen twice is not sent twice blindly."""

from __future__ import annotations

from collections.abc import Callable

from planning.basics.mav_cmd import MavCmd
from telemetry.errors import RefusedError, SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import GROUND_STATION, Endpoints
from telemetry.mavlink.texts import VehicleWords
from telemetry.topics.vehicle import VehicleState

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)

_COMMANDS: dict[int, str] = {
    MavCmd.NAV_WAYPOINT: "fly to a waypoint",
    MavCmd.NAV_RETURN_TO_LAUNCH: "return home",
    MavCmd.NAV_LAND: "land",
    MavCmd.NAV_TAKEOFF: "take off",
    MavCmd.CONDITION_YAW: "turn to a heading",
    MavCmd.DO_SET_MODE: "change the flight mode",
    MavCmd.DO_CHANGE_SPEED: "change the speed",
    MavCmd.DO_SET_HOME: "set home",
    MavCmd.DO_REPOSITION: "fly to a place",
    MavCmd.DO_PAUSE_CONTINUE: "pause or go on",
    MavCmd.DO_SET_ROI_LOCATION: "look at a place",
    MavCmd.DO_SET_MISSION_CURRENT: "go to a mission item",
    MavCmd.MISSION_START: "start the mission",
    MavCmd.RUN_PREARM_CHECKS: "check whether it may arm",
    MavCmd.SET_MESSAGE_INTERVAL: "send a message regularly",
    MavCmd.REQUEST_MESSAGE: "send a message",
}
_RESULTS = {
    TEMPORARILY_REJECTED: "it cannot do that now",
    DENIED: "it denied that",
    UNSUPPORTED: "it does not know that command",
    FAILED: "it tried and failed",
    CANCELLED: "that was cancelled",
    7: "it takes that command only as COMMAND_LONG",
    8: "it takes that command only as COMMAND_INT",
    9: "it does not know that altitude frame",
}
RESEND_S = 0.7
LOOK_S = 2.5
"""Longer than a message can be on its way: what has not shown by then in the vehicle's state did not arrive."""
TAKEOFF_LOOK_S = 6.0
"""Motors need seconds to spin up before anything shows."""
START_LOOK_S = 1.5
"""A mission that runs is not begun again by another order to, and the motors are off 10 s after arming."""
LOOKS_S = {MavCmd.NAV_TAKEOFF: TAKEOFF_LOOK_S, MavCmd.MISSION_START: START_LOOK_S}
LOOKS = 6
LATE_S = 1.0
"""Between two heartbeats: one that came this much before the end of the wait still tells what became of a command."""
TIMEOUT_S = 12.0
PROGRESS_TIMEOUT_S = 15.0
"""Since the last word of a command that is being carried out."""
REJECTED_AGAIN_S = 1.0
REJECTIONS = 4
WORDS_S = 0.5
"""The reason of a refusal comes as a text behind it."""
MOST_CONFIRMATIONS = 255


class CommandRun:
    """Sends ``message`` (COMMAND_LONG or COMMAND_INT) until it is acknowledged.

    Ends in Done(None), Failed(RefusedError) or Failed(SilentError). ``once``: after silence it is sent again only when
    the vehicle's state shows that it was not carried out. ``confirm``: whether a state shows that it was; that
    settles a lost acknowledgement. ``taken``: results after which it is done. Feed it states as they come:
    ``t_mono_s`` in them and ``now_s`` are one clock.
    """

    def __init__(
        self,
        message: Message,
        *,
        target: tuple[int, int],
        own: tuple[int, int] = GROUND_STATION,
        once: bool = False,
        confirm: Callable[[VehicleState], bool] | None = None,
        taken: frozenset[int] = frozenset({ACCEPTED}),
        timeout_s: float | None = None,
    ) -> None:
        self._message, self._endpoints = message, Endpoints(target, own)
        self._once, self._confirm, self._taken = once, confirm, taken
        self._look_s = LOOKS_S.get(message.command, LOOK_S)
        usual_s = max(TIMEOUT_S, LOOKS * self._look_s) if once else TIMEOUT_S
        self._timeout_s = usual_s if timeout_s is None else timeout_s
        self._does = command_words(message.command, message.param1)
        self._words = VehicleWords()
        self._over = False
        self._sent_s = self._deadline_s = 0.0
        self._sendings = self._rejections = 0
        self._in_progress = False
        self._again_s: float | None = None
        self._refused: tuple[int, float] | None = None

    def start(self, now_s: float) -> list[Action]:
        self._deadline_s = now_s + self._timeout_s
        return self._send(now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or not self._endpoints.is_from_vehicle(message):
            return []
        self._words.on_message(message)
        if message.get_type() != "COMMAND_ACK" or message.command != self._message.command:
            return []
        return self._on_result(message, now_s) if self._endpoints.is_for_us(message) else []

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        if self._over or self._confirm is None or state.heartbeat_t_mono_s is None:
            return []
        if state.heartbeat_t_mono_s > self._sent_s and self._confirm(state):
            return self._done()
        if self._may_send_again(state.heartbeat_t_mono_s, now_s):
            return self._send(now_s)
        return []

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if self._refused is not None:
            result, until_s = self._refused
            return self._fail(self._refusal(result)) if now_s >= until_s else []
        if self._again_s is not None and now_s >= self._again_s:
            return self._send(now_s)
        if now_s >= self._deadline_s:
            return self._fail(self._silence())
        idle = self._again_s is None and not self._in_progress
        return self._send(now_s) if idle and not self._once and now_s - self._sent_s >= RESEND_S else []

    def _may_send_again(self, heartbeat_s: float, now_s: float) -> bool:
        """For what is sent once: the vehicle was seen after the command, and had not carried it out."""
        waiting = self._once and self._again_s is None and not self._in_progress and self._refused is None
        return waiting and now_s - self._sent_s >= self._look_s and heartbeat_s - self._sent_s >= self._look_s - LATE_S

    def _send(self, now_s: float) -> list[Action]:
        self._sent_s, self._again_s = now_s, None
        if self._message.get_type() == "COMMAND_LONG":
            self._message.confirmation = min(self._sendings, MOST_CONFIRMATIONS)
        self._sendings += 1
        return [Send(self._message)]

    def _on_result(self, message: Message, now_s: float) -> list[Action]:
        if message.result in self._taken:
            return self._done()
        if message.result == IN_PROGRESS:
            self._in_progress, self._deadline_s = True, now_s + PROGRESS_TIMEOUT_S
            return [Progress(self._does, message.progress, 100)] if message.progress <= 100 else []
        if message.result == TEMPORARILY_REJECTED and self._rejections < REJECTIONS:
            if self._again_s is None:
                self._rejections, self._again_s = self._rejections + 1, now_s + REJECTED_AGAIN_S
            return []
        if self._refused is None:
            self._refused = (message.result, now_s + WORDS_S)
        return []

    def _done(self) -> list[Action]:
        self._over = True
        return [Done(None)]

    def _fail(self, error: RefusedError | SilentError) -> list[Action]:
        self._over = True
        return [Failed(error)]

    def _refusal(self, result: int) -> RefusedError:
        return RefusedError(
            f"The vehicle did not {self._does}: {result_words(result)}.{self._words.sentence()}",
            where=f"MAV_RESULT {result}",
            advice="Mend what the vehicle names, then try again.",
        )

    def _silence(self) -> SilentError:
        if self._in_progress:
            what = f'The vehicle began to "{self._does}" and was not heard to end it.'
        elif self._once and self._sendings == 1:
            what = f'The vehicle did not answer "{self._does}", and it is not known whether it did it.'
        else:
            what = f'The vehicle did not answer "{self._does}" ({self._sendings} times).'
        return SilentError(what, advice="Look at the vehicle and at the link before you try again.")


def command_words(command: int, param1: float = 0.0) -> str:
    """What is asked of the vehicle, as it stands after "to": "arm", "change the flight mode"."""
    if command == MavCmd.COMPONENT_ARM_DISARM:
        return "arm" if param1 == 1 else "disarm"
    return _COMMANDS.get(command, f"do command {command}")


def result_words(result: int) -> str:
    return _RESULTS.get(result, f"it answered with result {result}")
