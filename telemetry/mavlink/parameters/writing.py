"""Writing parameters one after the other, sans-IO: what it was, the new value, the vehicle's echo, and read again."""

from __future__ import annotations

import re
from enum import Enum, auto

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import FACTOR, MARGIN_S, Endpoints
from telemetry.mavlink.parameters.values import parameter_of, same_value, why_not, wire_value
from telemetry.mavlink.texts import VehicleWords
from telemetry.topics.parameters import (
    NAME_PATTERN,
    NAME_RULE,
    Outcome,
    Parameter,
    ParameterChange,
    ParameterWritten,
)
from telemetry.topics.vehicle import VehicleState

ASK_AGAIN_S = 0.25
TRIES = 20
"""Over a link that loses 30 % in each direction one question in 700,000 is not answered then."""
SET_TRIES = 8
"""Then it is read in any case: some vehicles say nothing to what they do not take."""
ROUNDS = 3
"""A late answer to an earlier question must not pass for what the vehicle holds now."""
SILENT_S = 3.0
"""Without any message of the vehicle."""
_ERRORS = {
    mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST: "The vehicle has no parameter of this name.",
    mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE: "The vehicle says that the value is out of its range.",
    mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED: "The vehicle does not let this station write it.",
    mavlink.MAV_PARAM_ERROR_READ_ONLY: "The vehicle lets nobody write it.",
}
ARMED = "The vehicle was armed meanwhile. Land, disarm it, and write it again."
GONE = "The vehicle fell silent before. Check the link, and write it again."


class _Phase(Enum):
    BEFORE = auto()
    SETTING = auto()
    AFTER = auto()


class ParameterWrite:
    """Ends in Done(tuple of ParameterWritten), one for each change, in their order; SilentError: nothing was sent."""

    def __init__(
        self, changes: tuple[ParameterChange, ...], *, target: tuple[int, int], bytewise: bool, even_armed: bool = False
    ) -> None:
        """Each name once. ``even_armed``: goes on when the vehicle is armed meanwhile."""
        self._changes, self._target, self._bytewise, self._even_armed = changes, target, bytewise, even_armed
        self._written: list[ParameterWritten] = []
        self._words, self._heard_s, self._armed, self._over = VehicleWords(), 0.0, False, False
        self._late_s = self._late_until_s = 0.0
        """How long after a question its answer may come, if that is longer than until it is asked again; and so, until
        when the old value may be an answer to a question from before it was set."""

    def start(self, now_s: float) -> list[Action]:
        self._heard_s = now_s
        return self._next(now_s)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        del now_s
        self._armed = state.armed
        return []

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or (message.get_srcSystem(), message.get_srcComponent()) != self._target:
            return []
        self._heard_s = now_s
        self._words.on_message(message)
        if message.get_type() == "PARAM_VALUE" and message.param_id == self._change.name:
            return self._on_value(parameter_of(message, bytewise=self._bytewise), now_s)
        if message.get_type() == "PARAM_ERROR" and self._is_about_ours(message):
            text = _ERRORS.get(message.error, f"The vehicle refuses it (parameter error {message.error}).")
            return self._settle("refused", None if self._before is None else self._before.value, now_s, text)
        return []

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over or now_s - self._asked_s < ASK_AGAIN_S:
            return []
        if self._phase is _Phase.SETTING and (self._tries >= SET_TRIES or self._stops):
            return self._enter(_Phase.AFTER, now_s)
        if self._tries < TRIES:
            return self._ask(now_s)
        return self._unanswered(now_s)

    @property
    def _change(self) -> ParameterChange:
        return self._changes[len(self._written)]

    def _is_about_ours(self, message: Message) -> bool:
        """Another station's refusal says nothing of what we asked."""
        return message.param_id == self._change.name and Endpoints(self._target).is_for_us(message)

    @property
    def _stops(self) -> bool:
        return self._armed and not self._even_armed

    def _next(self, now_s: float) -> list[Action]:
        if len(self._written) == len(self._changes):
            return self._finish()
        if self._stops:
            return self._give_up(ARMED)
        self._before: Parameter | None = None
        self._round = 0
        self._words.clear()
        if not re.fullmatch(NAME_PATTERN, self._change.name):
            return self._settle("refused", None, now_s, f"{NAME_RULE} Nothing was sent.")
        done = Progress("writing", len(self._written), len(self._changes))
        return [done, *self._enter(_Phase.BEFORE, now_s)]

    def _enter(self, phase: _Phase, now_s: float) -> list[Action]:
        if phase is _Phase.SETTING:
            self._late_until_s = self._asked_s + self._late_s
        self._phase, self._tries, self._entered_s = phase, 0, now_s
        return self._ask(now_s)

    def _ask(self, now_s: float) -> list[Action]:
        self._tries, self._asked_s = self._tries + 1, now_s
        name = self._change.name.encode()
        if self._phase is not _Phase.SETTING:
            return [Send(mavlink.MAVLink_param_request_read_message(*self._target, name, -1))]
        assert self._before is not None
        return [Send(mavlink.MAVLink_param_set_message(*self._target, name, self._wire_value, self._before.kind))]

    def _on_value(self, parameter: Parameter, now_s: float) -> list[Action]:
        if self._phase is _Phase.BEFORE:
            return self._on_before(parameter, now_s)
        if self._may_be_late(parameter, now_s):
            return []
        if self._phase is _Phase.SETTING:
            return self._enter(_Phase.AFTER, now_s)
        return self._on_after(parameter, now_s)

    def _may_be_late(self, parameter: Parameter, now_s: float) -> bool:
        """The old value, while an answer to what was asked before it was set may still be on its way."""
        old = None if self._before is None else self._before.value
        if now_s >= self._late_until_s or parameter.value is None or old is None:
            return False
        return self._same(parameter.value, old)

    def _on_before(self, parameter: Parameter, now_s: float) -> list[Action]:
        self._before, asked = parameter, self._change.value
        # The question that is answered is the first one at the earliest; asked once, nothing is late.
        self._late_s = FACTOR * (now_s - self._entered_s) + MARGIN_S if self._tries > 1 else 0.0
        if reason := why_not(asked, parameter.kind):
            return self._settle("refused", parameter.value, now_s, f"{reason} Nothing was sent.")
        if parameter.value is not None and self._same(parameter.value, asked):
            return self._settle("same", parameter.value, now_s)
        if self._stops:
            return self._give_up(ARMED)
        value = wire_value(asked, parameter.kind, bytewise=self._bytewise)
        if value is None:
            text = "No float carries this number to a vehicle that takes integers bytewise. Nothing was sent."
            return self._settle("refused", parameter.value, now_s, text)
        self._wire_value = value
        return self._enter(_Phase.SETTING, now_s)

    def _on_after(self, parameter: Parameter, now_s: float) -> list[Action]:
        after = parameter.value
        if after is not None and self._same(after, self._change.value):
            return self._settle("set", after, now_s)
        self._round += 1
        if self._round < ROUNDS and not self._stops:
            return self._enter(_Phase.SETTING, now_s)
        assert self._before is not None
        before = self._before.value
        if after is None:
            return self._settle("unknown", None, now_s, "The vehicle sends no number for it. Read it again.")
        if before is not None and self._same(after, before):
            text = "The vehicle keeps the old value: it may be read only, or not to be set now."
            return self._settle("kept", after, now_s, text)
        text = "The vehicle rounds or limits it, or another station wrote it. Read its help for its range."
        return self._settle("adjusted", after, now_s, text)

    def _same(self, one: float, other: float) -> bool:
        assert self._before is not None
        return same_value(one, other, self._before.kind, bytewise=self._bytewise)

    def _unanswered(self, now_s: float) -> list[Action]:
        silent = now_s - self._heard_s > SILENT_S
        if silent and self._before is None and not self._written:
            self._over = True
            what = f"The vehicle is silent: {self._change.name} could not be read, and nothing was written."
            return [Failed(SilentError(what, advice="Check the link."))]
        if self._before is None:
            text = GONE if silent else "The vehicle does not answer to this name. Check how it is spelt on the vehicle."
            if silent:
                return self._give_up(text)
            return self._settle("refused", None, now_s, f"{text} Nothing was sent.")
        actions = self._settle("unknown", None, now_s, "It was sent, and could not be read again. Read it again.")
        return self._give_up(GONE) if silent and not self._over else actions

    def _settle(self, outcome: Outcome, after: float | None, now_s: float, text: str = "") -> list[Action]:
        before = None if self._before is None else self._before.value
        said = self._words.sentence() if text else ""
        self._written.append(
            ParameterWritten(self._change.name, self._change.value, before, after, outcome, f"{text}{said}")
        )
        return self._next(now_s)

    def _give_up(self, text: str) -> list[Action]:
        """The rest is not sent."""
        for change in self._changes[len(self._written) :]:
            self._written.append(ParameterWritten(change.name, change.value, None, None, "not sent", text))
        return self._finish()

    def _finish(self) -> list[Action]:
        self._over = True
        return [Done(tuple(self._written))]
