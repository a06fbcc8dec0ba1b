"""One command under way for the script: what it sends, and what follows when it is done or has failed."""

from __future__ import annotations

from collections.abc import Callable

from telemetry.errors import TelemetryError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send
from telemetry.mavlink.commands import ACCEPTED, CommandRun
from telemetry.mavlink.conversation import Endpoints
from telemetry.topics.vehicle import VehicleState

Then = Callable[[float], list[Action]]
OnFailed = Callable[[TelemetryError, float], list[Action]]


class PendingCommand:
    def __init__(self, endpoints: Endpoints, on_failed: OnFailed) -> None:
        self._endpoints = endpoints
        self._run: CommandRun | None = None
        self._then: Then | None = None
        self._on_failed = on_failed

    @property
    def is_under_way(self) -> bool:
        return self._run is not None

    def begin(
        self,
        message: Message,
        now_s: float,
        *,
        once: bool = False,
        confirm: Callable[[VehicleState], bool] | None = None,
        taken: frozenset[int] = frozenset({ACCEPTED}),
        then: Then | None = None,
    ) -> list[Action]:
        """In place of the one before; ``once``, ``confirm`` and ``taken`` as in CommandRun."""
        self._run = CommandRun(
            message, target=self._endpoints.vehicle, own=self._endpoints.own, once=once, confirm=confirm, taken=taken
        )
        self._then = then
        return self._pass_on(self._run.start(now_s), now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        return [] if self._run is None else self._pass_on(self._run.on_message(message, now_s), now_s)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        return [] if self._run is None else self._pass_on(self._run.on_state(state, now_s), now_s)

    def on_tick(self, now_s: float) -> list[Action]:
        return [] if self._run is None else self._pass_on(self._run.on_tick(now_s), now_s)

    def _pass_on(self, actions: list[Action], now_s: float) -> list[Action]:
        out: list[Action] = []
        for action in actions:
            if isinstance(action, Send):
                out.append(action)
            elif isinstance(action, Done | Failed):
                then, self._run, self._then = self._then, None, None
                if isinstance(action, Failed):
                    out += self._on_failed(action.error, now_s)
                elif then is not None:
                    out += then(now_s)
        return out
