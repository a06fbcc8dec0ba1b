"""Floor and ceiling of the plan on board: shown, set as shown, and what becomes of it where the link fails."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from server.errors import ConflictError
from server.flying.uploading.fence_heights_desk import NOT_CHECKED, FenceHeights
from server.schemas import FenceDoc, PlanDoc, SetFenceHeights
from telemetry.errors import NotAllowedError, NoVehicleError, RefusedError, SilentError
from telemetry.flight.fence_heights import TAKEN_WHEN_SWITCHED
from telemetry.flight.fence_heights_put import STAYS_OFF, UNSET
from telemetry.topics.parameters import ParameterWritten
from telemetry.topics.requests import Operator, ReadParameters, WriteParameters

ME = Operator("Anna", 7)


class Link:
    """Holds parameters as a vehicle does; those of ``keeps`` stay as they are, of ``fails`` the writing fails."""

    def __init__(self) -> None:
        self.held: dict[str, float] = {
            "FENCE_ENABLE": 0.0, "FENCE_TYPE": 7.0, "FENCE_ACTION": 1.0, "FENCE_ALT_MAX": 100.0,
            "FENCE_ALT_MIN": -10.0, "FENCE_MARGIN": 2.0, "FENCE_RADIUS": 300.0,
        }  # fmt: skip
        self.keeps: set[str] = set()
        self.fails: dict[str, Exception] = {}
        self.breaks_after_off = False
        self.took: list[tuple[str, float]] = []

    async def call(self, request: Any) -> Any:
        if isinstance(request, ReadParameters):
            return {name: self.held.get(name) for name in request.names}
        assert isinstance(request, WriteParameters)
        assert not request.even_armed
        assert len({change.name for change in request.changes}) == len(request.changes)
        if self.breaks_after_off and self.held["FENCE_ENABLE"] == 0.0:
            raise SilentError("The vehicle is silent.", advice="Check the link.")
        for change in request.changes:
            if (error := self.fails.get(change.name)) is not None:
                raise error
        return tuple(self._set(change.name, change.value) for change in request.changes)

    def _set(self, name: str, value: float) -> ParameterWritten:
        before = self.held[name]
        if name in self.keeps:
            return ParameterWritten(name, value, before, before, "kept", "It keeps the old value.")
        self.held[name] = value
        self.took.append((name, value))
        return ParameterWritten(name, value, before, value, "set")


class Bench:
    def __init__(self, *, floor_m: float | None = 5.0, ceiling_m: float | None = 60.0) -> None:
        plan = PlanDoc(fence=FenceDoc(floor_rel_home_m=floor_m, ceiling_rel_home_m=ceiling_m))
        record = SimpleNamespace(firmware="ardupilot", plan_json=plan.model_dump_json(), heights_moved_m=0.0)
        self.link, self.rises_m = Link(), 0.0
        self.aboard: Any = SimpleNamespace(record=record)
        self.live: Any = SimpleNamespace(state=SimpleNamespace(armed=False, fence_kinds_untaken=0))
        self.told: list[tuple[ParameterWritten, ...]] = []
        link: Any = self.link
        self.desk = FenceHeights(link, self.live, self.aboard, lambda: self.rises_m, self._on_written)

    def _on_written(self, written: Any) -> None:
        self.told.append(tuple(written))


def run(play: Any) -> Any:
    return asyncio.run(play)


def test_what_was_shown_is_set_heights_first_and_the_fence_switched_on_last() -> None:
    async def play() -> None:
        bench = Bench()
        shown = await bench.desk.look()
        assert [(c.name, c.before, c.after) for c in shown.changes] == [
            ("FENCE_ALT_MAX", 100.0, 60.0), ("FENCE_ALT_MIN", -10.0, 5.0), ("FENCE_TYPE", 7.0, 9.0),
            ("FENCE_ENABLE", 0.0, 1.0),
        ]  # fmt: skip
        assert bench.link.held["FENCE_ENABLE"] == 0.0  # nothing is set by looking
        done = await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert done.took
        assert [one.outcome for one in done.written] == ["set"] * 4
        assert (await bench.desk.look()).changes == []
        assert len(bench.told) == 1  # what was checked before is void

    run(play())


def test_what_is_not_what_was_shown_is_not_set() -> None:
    async def play() -> None:
        bench = Bench()
        shown = await bench.desk.look()
        bench.link.held["FENCE_ALT_MAX"] = 40.0  # another station
        with pytest.raises(ConflictError, match="have changed since"):
            await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert bench.link.held["FENCE_ENABLE"] == 0.0
        assert bench.told == []

    run(play())


def test_a_height_that_does_not_take_switches_nothing_on() -> None:
    async def play() -> None:
        bench = Bench()
        bench.link.keeps = {"FENCE_ALT_MIN"}
        done = await bench.desk.set(ME, SetFenceHeights(changes=(await bench.desk.look()).changes))
        assert not done.took
        assert [(one.name, one.outcome) for one in done.written] == [
            ("FENCE_ALT_MAX", "set"), ("FENCE_ALT_MIN", "kept"), ("FENCE_TYPE", "not sent"),
            ("FENCE_ENABLE", "not sent"),
        ]  # fmt: skip
        assert done.written[2].words == UNSET
        assert bench.link.held["FENCE_ENABLE"] == 0.0

    run(play())


def test_a_link_that_fails_in_between_is_told_with_what_was_set() -> None:
    async def play() -> None:
        bench = Bench()
        shown = await bench.desk.look()
        bench.link.fails = {"FENCE_TYPE": SilentError("The vehicle is silent.", advice="Check the link.")}
        done = await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert not done.took
        assert [one.outcome for one in done.written] == ["set", "set", "not sent", "not sent"]
        bench.link.fails = {"FENCE_TYPE": NotAllowedError("The vehicle is armed.", advice="Land and disarm it.")}
        with pytest.raises(NotAllowedError, match="armed"):  # nothing at all was written
            await bench.desk.set(ME, SetFenceHeights(changes=(await bench.desk.look()).changes))
        assert len(bench.told) == 1, "what the watch knows in flight stays"
        bench.link.fails = {"FENCE_TYPE": RefusedError("No answer.", advice="Look.")}
        with pytest.raises(RefusedError):  # perhaps it was written
            await bench.desk.set(ME, SetFenceHeights(changes=(await bench.desk.look()).changes))
        assert bench.told[1:] == [()]

    run(play())


def test_a_fence_that_is_on_is_switched_off_and_on_and_comes_on_whatever_fails_before() -> None:
    async def play() -> None:
        bench = Bench(floor_m=None)
        bench.link.held |= {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}
        shown = await bench.desk.look()
        assert TAKEN_WHEN_SWITCHED in shown.notes
        assert (await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))).took
        assert bench.link.took[1:] == [("FENCE_ENABLE", 0.0), ("FENCE_TYPE", 5.0), ("FENCE_ENABLE", 1.0)]
        bench.link.held |= {"FENCE_TYPE": 4.0, "FENCE_ALT_MAX": 100.0}
        bench.link.took.clear()
        bench.link.fails = {"FENCE_TYPE": RefusedError("No answer.", advice="Look.")}
        shown = await bench.desk.look()
        done = await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert [one.outcome for one in done.written] == ["set", "unknown", "unknown", "set"]
        assert bench.link.took[-1] == ("FENCE_ENABLE", 1.0)

        bench.link.held |= {"FENCE_TYPE": 4.0, "FENCE_ALT_MAX": 100.0}
        bench.link.fails, shown = {}, await bench.desk.look()
        bench.link.breaks_after_off = True
        done = await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert not done.took
        assert STAYS_OFF in done.written[-1].words

    run(play())


def test_of_an_armed_vehicle_nothing_is_read_written_or_forgotten() -> None:
    async def play() -> None:
        bench = Bench()
        shown = await bench.desk.look()
        bench.live.state.armed, bench.link.held = True, {}
        with pytest.raises(NotAllowedError, match="armed"):
            await bench.desk.set(ME, SetFenceHeights(changes=shown.changes))
        assert bench.told == []

    run(play())


def test_a_home_that_lies_higher_than_planned_for_lowers_the_ceiling_and_says_what_is_not_known() -> None:
    async def play() -> None:
        bench = Bench(floor_m=None)
        bench.rises_m = 3.25
        shown = await bench.desk.look()
        assert (shown.changes[0].after, NOT_CHECKED in shown.notes) == (56.75, False)
        for little_m in (0.29, -3.25):
            bench.rises_m = little_m
            assert (await bench.desk.look()).changes[0].after == 60.0
        unknown: Any = None
        bench.rises_m = unknown
        assert NOT_CHECKED in (await bench.desk.look()).notes
        bench.aboard.record.heights_moved_m = 3.25  # it was known when the mission's heights were moved
        shown = await bench.desk.look()
        assert (shown.changes[0].after, NOT_CHECKED in shown.notes) == (56.75, True)

    run(play())


def test_without_a_plan_of_ours_or_a_vehicle_there_is_nothing_to_set() -> None:
    async def play() -> None:
        bench = Bench(floor_m=None, ceiling_m=None)
        with pytest.raises(NotAllowedError, match="neither floor nor ceiling"):
            await bench.desk.look()
        bench.aboard.record = None
        with pytest.raises(ConflictError, match="No plan that was uploaded from here"):
            await bench.desk.look()
        bench.live.state = None
        with pytest.raises(NoVehicleError):
            await bench.desk.look()

    run(play())
