"""Scenarios, as pages run them: one at a time, in a process that yields to all others, never beside a flight."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any

from server.errors import BusyError, ConflictError, JobCancelledError, NotFoundError, reported
from server.library.scenario_runs import ScenarioShelf
from server.library.shelf import utc_now
from server.library.whole_files import new_id
from server.schemas import (
    ErrorDoc,
    Pages,
    RunScenario,
    ScenarioDoc,
    ScenarioResultDoc,
    ScenarioRunDoc,
    ScenarioRunsMessage,
)
from server.studies import scenario_task
from server.work.jobs import Lane
from server.work.task_group import Background
from telemetry.simulation.scenarios.catalogue import NAMES, SCENARIOS, scenario_named

log = logging.getLogger("hedgehop.scenarios")

NICENESS = 10
TOLD_EVERY_S = 0.25
IN_FLIGHT = ErrorDoc(
    code="conflict",
    what="A vehicle is armed: no scenario runs beside a flight.",
    where="scenarios",
    advice="They take the processor that the flight needs. Run it again once the vehicle is disarmed.",
)


def scenario_docs() -> list[ScenarioDoc]:
    return [
        ScenarioDoc(
            name=one.name,
            flown=one.flown,
            held=one.held,
            paper=one.paper,
            command_line_only=one.hours,
        )
        for one in SCENARIOS
    ]


class ScenarioDesk:
    """All methods belong to the event loop."""

    def __init__(
        self,
        shelf: ScenarioShelf,
        pages: Pages,
        background: Background,
        *,
        fly: Callable[..., Any] = scenario_task.fly,
    ) -> None:
        self._shelf, self._pages, self._background, self._fly = shelf, pages, background, fly
        self._lane = Lane("scenarios", niceness=NICENESS)
        self._now: ScenarioRunDoc | None = None
        """The one that runs."""
        self._last: ScenarioRunDoc | None = None
        """The last one, if it came to nothing: not kept, but told."""
        self._why_ended: ErrorDoc | None = None
        self._told_mono_s = 0.0

    async def close(self) -> None:
        await self._lane.close()

    def message(self) -> ScenarioRunsMessage:
        present = [run for run in (self._now, self._last) if run is not None]
        return ScenarioRunsMessage(runs=[*present, *self._shelf.runs()])

    def run(self, body: RunScenario, *, armed: bool) -> ScenarioRunDoc:
        """``armed``: a vehicle is. Raises NotFoundError, ConflictError, BusyError."""
        if body.name not in NAMES:
            raise NotFoundError(f"There is no scenario {body.name!r}.", advice=f"Choose one of {', '.join(NAMES)}.")
        if scenario_named(body.name).hours:
            raise ConflictError(
                f"{body.name} takes an hour of flight and gigabytes of the disk.",
                where="scenarios",
                advice=f"Run it on the command line: hedgehop scenario {body.name}.",
            )
        if armed:
            raise ConflictError(IN_FLIGHT.what, where=IN_FLIGHT.where, advice=IN_FLIGHT.advice)
        if self._now is not None:
            raise BusyError(f"{self._now.name} is running.", advice="Let it finish, or cancel it.")
        self._last, self._why_ended = None, None
        self._now = ScenarioRunDoc(
            id=new_id(), name=body.name, seed=body.seed, started_utc=utc_now(), state="running", step="Starting"
        )
        self._background.spawn(self._run(self._now))
        self._pages.publish(self.message())
        return self._now

    def cancel(self, run_id: str) -> None:
        """Raises NotFoundError for one that does not run."""
        if self._now is None or self._now.id != run_id:
            raise NotFoundError("This scenario does not run.", where=run_id[:40], advice="It may be over already.")
        self._lane.cancel()

    def on_armed(self) -> None:
        """A flight begins: it needs the processor."""
        if self._now is not None:
            self._why_ended = IN_FLIGHT
            self._lane.cancel()

    def result(self, run_id: str) -> ScenarioResultDoc:
        """Raises NotFoundError."""
        return self._shelf.get(run_id)

    async def delete(self, run_id: str) -> None:
        """Raises NotFoundError."""
        await asyncio.to_thread(self._shelf.delete, run_id)
        self._pages.publish(self.message())

    async def _run(self, run: ScenarioRunDoc) -> None:
        began_s = time.monotonic()
        try:
            parts, passed = await self._lane.call(self._fly, run.name, run.seed, progress=self._progress)
            done = run.model_copy(
                update={"state": "done", "step": "", "passed": passed, "seconds": time.monotonic() - began_s}
            )
            await asyncio.to_thread(self._shelf.add, ScenarioResultDoc(run=done, parts=parts))
        except JobCancelledError:
            self._last = run.model_copy(update={"state": "cancelled", "step": "", "error": self._why_ended})
        except Exception as error:
            doc = reported(error, log, f"Scenario {run.name}")
            self._last = run.model_copy(update={"state": "failed", "step": "", "error": doc})
        finally:
            self._now = None
            self._pages.publish(self.message())

    def _progress(self, step: str, share: float | None) -> None:
        if self._now is None:
            return
        self._now = self._now.model_copy(update={"step": step, "progress": share})
        now_s = time.monotonic()
        if now_s - self._told_mono_s >= TOLD_EVERY_S:
            self._told_mono_s = now_s
            self._pages.publish(self.message())
