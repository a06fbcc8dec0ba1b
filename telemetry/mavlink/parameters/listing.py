"""Reading the whole list of parameters, sans-IO: it streams in by itself, then what was lost is asked for by index."""

from __future__ import annotations

from itertools import islice

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import RoundTrip
from telemetry.mavlink.parameters.values import parameter_of
from telemetry.topics.parameters import Parameter, ParameterList

UNNUMBERED = 65535
"""Index of an answer to a change or to a name, and of PX4's _HASH_CHECK, which is no parameter."""
LIST_EVERY_S = 1.0
"""The request for the list is sent again until the first value comes."""
QUIET_S = 0.6
"""Nothing for so long: the stream has ended. A vehicle that shares a slow radio pauses for less."""
WINDOW = 10
"""ArduPilot keeps 20 requests and drops what comes above; other stations ask, too."""
LATE_S = 2.0
"""Values of the list before a change come late for no longer than this."""
SILENT_S = 10.0
"""Without any value."""
LONGEST_S = 600.0
MOST_BEGINNINGS = 6


class ParameterListRead:
    """Ends in Done(ParameterList). The list changes while it is read where a value switches others on or off: then its
    numbering is another, and it is read anew."""

    def __init__(self, *, target: tuple[int, int], bytewise: bool) -> None:
        self._target, self._bytewise = target, bytewise
        self._round_trip = RoundTrip()
        self._count: int | None = None
        self._before: tuple[int, float] | None = None
        """Count of the list before a change, and until when values of it are late ones."""
        self._beginnings, self._listed_s, self._started_s, self._new_s = 0, 0.0, 0.0, 0.0
        self._over = False
        self._forget()

    def _forget(self) -> None:
        self._found: dict[int, Parameter] = {}
        self._index: dict[str, int] = {}
        self._missing: dict[int, float | None] = {}
        """Once the stream has ended: what did not come, and when it was asked for."""
        self._asked_again: set[int] = set()

    def start(self, now_s: float) -> list[Action]:
        self._started_s = now_s
        return self._begin(now_s)

    def _begin(self, now_s: float) -> list[Action]:
        self._forget()
        self._beginnings += 1
        if self._beginnings > MOST_BEGINNINGS:
            what = f"The list of parameters changed {MOST_BEGINNINGS} times while it was read."
            advice = "Let no other station write parameters meanwhile, then read again."
            return self._fail(TransferError(what, advice=advice))
        self._new_s = now_s
        return self._request_list(now_s)

    def _request_list(self, now_s: float) -> list[Action]:
        self._listed_s = now_s
        return [Send(mavlink.MAVLink_param_request_list_message(*self._target))]

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or message.get_type() != "PARAM_VALUE":
            return []
        if (message.get_srcSystem(), message.get_srcComponent()) != self._target:
            return []
        parameter, index = parameter_of(message, bytewise=self._bytewise), message.param_index
        if index == UNNUMBERED:
            self._changed(parameter)
            return []
        if self._is_late(message.param_count, now_s):
            return []
        if self._has_other_numbers(parameter.name, index, message.param_count):
            self._before = None if self._count is None else (self._count, now_s + LATE_S)
            self._count = message.param_count
            return self._begin(now_s)
        self._count = message.param_count
        return self._keep(parameter, index, now_s)

    def _changed(self, parameter: Parameter) -> None:
        """Somebody has set it meanwhile."""
        index = self._index.get(parameter.name)
        if index is not None:
            self._found[index] = parameter

    def _is_late(self, count: int, now_s: float) -> bool:
        return self._before is not None and count == self._before[0] != self._count and now_s < self._before[1]

    def _has_other_numbers(self, name: str, index: int, count: int) -> bool:
        if count != self._count:
            return self._count is not None
        held = self._found.get(index)
        return self._index.get(name, index) != index or (held is not None and held.name != name)

    def _keep(self, parameter: Parameter, index: int, now_s: float) -> list[Action]:
        assert self._count is not None
        asked_s = self._missing.pop(index, None)
        if asked_s is not None and index not in self._asked_again:
            self._round_trip.measure(now_s - asked_s)
        if index >= self._count:
            return []
        is_new = index not in self._found
        self._found[index] = parameter  # the latest counts: PX4 says a change with its number
        if not is_new:
            return []
        self._index[parameter.name], self._new_s = index, now_s
        if len(self._found) == self._count:
            self._over = True
            return [Done(ParameterList(tuple(self._found[index] for index in range(self._count))))]
        return [Progress("reading", len(self._found), self._count), *self._ask(now_s)]

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._new_s > SILENT_S or now_s - self._started_s > LONGEST_S:
            return self._fail(self._gap())
        if self._found:
            return self._ask(now_s)
        return self._request_list(now_s) if now_s - self._listed_s >= LIST_EVERY_S else []

    def _ask(self, now_s: float) -> list[Action]:
        """For what is missing, a few at a time, once the stream has ended."""
        if self._count is None:
            return []
        if not self._missing:
            if now_s - self._new_s < QUIET_S:
                return []
            self._missing = {index: None for index in range(self._count) if index not in self._found}
        due_s = now_s - self._round_trip.patience_s
        asked = tuple(islice(self._missing.items(), WINDOW))
        actions: list[Action] = []
        for index, asked_s in asked:
            if asked_s is None or asked_s <= due_s:
                if asked_s is not None:
                    self._asked_again.add(index)
                self._missing[index] = now_s
                actions.append(Send(mavlink.MAVLink_param_request_read_message(*self._target, b"", index)))
        return actions

    def _gap(self) -> SilentError | TransferError:
        if self._count is None:
            return SilentError("The vehicle did not send its parameters.", advice="Check the link.")
        missing = self._count - len(self._found)
        return TransferError(
            f"{missing} of the vehicle's {self._count} parameters did not come.",
            advice="Check the link, then read again.",
        )

    def _fail(self, error: SilentError | TransferError) -> list[Action]:
        self._over = True
        return [Failed(error)]
