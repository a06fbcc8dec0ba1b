"""Reading single parameters of the vehicle, sans-IO."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TelemetryError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send
from telemetry.mavlink.conversation import RoundTrip
from telemetry.mavlink.parameters.values import parameter_value
from telemetry.topics.parameters import NAME_BYTES

ASK_AGAIN_S = 0.3
"""Until a round trip was measured."""
TRIES = 12
"""Of a vehicle that does not answer to a number: over a link that loses 30 % in each direction one value in 3,000 is
not heard then."""
WINDOW = 15
"""ArduPilot keeps 20 questions and drops what comes above, which would look as if it had no such parameter."""
LONGEST_S = 20.0
FIRST = 0
"""Number of a parameter that every vehicle has: whether it answers tells what its silence about a name means."""
CERTAIN = 1e-4
"""A name is absent when the chance that all questions for it were lost is smaller."""


@dataclass(slots=True)
class LinkEvidence:
    """Questions that the vehicle had to answer: about what it surely has."""

    answered: int = 0
    missed: int = 0

    def chance_of_silence(self, questions: int) -> float:
        """That so many questions in a row are lost, whatever share the link loses.

        Beta-binomial: the mean over all shares, each as likely beforehand as any other, after what was answered and
        missed. A product instead of two beta functions, which cancel for small counts.
        """
        chance = 1.0
        for lost in range(questions):
            chance *= (self.missed + 1 + lost) / (self.missed + self.answered + 2 + lost)
        return chance

    def tells_absent(self, questions: int) -> bool:
        return self.chance_of_silence(questions) < CERTAIN


@dataclass(slots=True)
class _Question:
    asked: int = 0
    counted: int = 0
    """Questions of rounds in which the vehicle answered something that was asked after this name."""


class ParameterRead:
    """Ends in Done(dict name -> value, None for what the vehicle does not have). SilentError: nothing came at all.
    TransferError: too much is lost to tell whether the vehicle has what it does not answer to.

    A vehicle that sends no PARAM_ERROR is silent about what it does not have. So from the second round on its first
    parameter is asked for behind the names, by its number.
    ``bytewise``: integers stand in the float's four bytes as they are (PX4, MAVSDK), not as a number (ArduPilot).
    """

    def __init__(self, names: tuple[str, ...], *, target: tuple[int, int], bytewise: bool) -> None:
        self._target, self._bytewise = target, bytewise
        self._values: dict[str, float | None] = dict.fromkeys(names)
        self._open = {name: _Question() for name in names if 0 < len(name.encode()) <= NAME_BYTES}
        self._round_trip = RoundTrip(unknown_s=ASK_AGAIN_S)
        self._evidence = LinkEvidence()
        self._rounds, self._started_s, self._asked_s = 0, 0.0, 0.0
        self._first_answered = self._first_ever = False
        """In this round, and in any."""
        self._heard = False

    def start(self, now_s: float) -> list[Action]:
        self._started_s = now_s
        return self._ask(now_s) if self._open else self._finish()

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if not self._open or (message.get_srcSystem(), message.get_srcComponent()) != self._target:
            return []
        self._heard = True
        if message.get_type() == "PARAM_VALUE":
            if message.param_index == FIRST:
                self._hear_first(now_s)
            return self._settle(message.param_id, parameter_value(message, bytewise=self._bytewise), now_s)
        if message.get_type() == "PARAM_ERROR" and message.error == mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST:
            return self._settle(message.param_id, None, now_s)
        return []

    def on_tick(self, now_s: float) -> list[Action]:
        if not self._open or now_s - self._asked_s < self._patience_s:
            return []
        self._close_round()
        if not self._open:
            return self._finish()
        if not self._heard and self._rounds >= TRIES:
            names = ", ".join(self._values)
            return self._fail(
                SilentError(f"The vehicle is silent: {names} could not be read.", advice="Check the link.")
            )
        if now_s - self._started_s > LONGEST_S:
            return self._fail(self._doubt())
        return self._ask(now_s)

    @property
    def _patience_s(self) -> float:
        return self._round_trip.patience_s if self._first_ever else ASK_AGAIN_S

    @property
    def _asks_first(self) -> bool:
        """In this round: a vehicle that has everything is asked for nothing more."""
        return self._rounds > 1

    def _ask(self, now_s: float) -> list[Action]:
        self._rounds, self._asked_s, self._first_answered = self._rounds + 1, now_s, False
        sent: list[Action] = []
        for name, question in islice(self._open.items(), WINDOW):
            question.asked += 1
            sent.append(self._request(name, -1))
        return [*sent, self._request("", FIRST)] if self._asks_first else sent

    def _request(self, name: str, index: int) -> Send:
        return Send(mavlink.MAVLink_param_request_read_message(*self._target, name.encode(), index))

    def _hear_first(self, now_s: float) -> None:
        if not self._asks_first or self._first_answered:
            return
        if not self._evidence.missed:
            self._round_trip.measure(now_s - self._asked_s)
        self._first_answered = self._first_ever = True

    def _close_round(self) -> None:
        """What the vehicle would have answered by now if it had it."""
        if self._asks_first:
            self._evidence.answered += self._first_answered
            self._evidence.missed += not self._first_answered
        for name, question in tuple(islice(self._open.items(), WINDOW)):
            question.counted += self._first_answered
            is_absent = self._evidence.tells_absent(question.counted) if self._first_ever else question.asked >= TRIES
            if is_absent and self._heard:
                del self._open[name]

    def _settle(self, name: str, value: float | None, now_s: float) -> list[Action]:
        question = self._open.pop(name, None)
        if question is None:
            return []
        self._values[name] = value
        if question.asked == 1:
            self._round_trip.measure(now_s - self._asked_s)
        self._evidence.answered += 1
        self._evidence.missed += max(0, question.asked - 1)
        return [] if self._open else self._finish()

    def _doubt(self) -> TelemetryError:
        names = ", ".join(self._open)
        what = f"Too much is lost to tell whether the vehicle has {names}."
        return TransferError(what, advice="Check the link, then read again.")

    def _fail(self, error: TelemetryError) -> list[Action]:
        self._open = {}
        return [Failed(error)]

    def _finish(self) -> list[Action]:
        return [Done(dict(self._values))]
