"""``hedgehop fly``: a mission from the upload to the landing, and what the flight came to.

Ctrl+C before the start ends the command. In the air it never does so at once, because the vehicle would fly on
unwatched: the first says so, the second commands the return home, the third leaves the vehicle to itself.
"""

from __future__ import annotations

import asyncio
import shutil
import signal
import tempfile
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Option

from planning.basics.plan_model import Mission
from planning.formats.detect import read_mission
from planning.formats.other_surface import other_surface
from planning.planner.part import mission_places
from planning.terrain.dsm import Dsm
from server.cli.review_command import tell
from server.cli.shared import options as o
from server.cli.shared.checklist_asked import check_checklist, ticked
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.fence_given import fence_stays
from server.cli.shared.files_in_out import check_new, read_small
from server.cli.shared.flight_progress import FlightProgress
from server.cli.shared.mission_vehicle import judged_by
from server.cli.shared.output import end_progress, progress, say, say_notes
from server.cli.shared.own_nodes import OPERATOR, Station, own_nodes
from server.cli.shared.terrain_given import read_around
from server.errors import StorageError
from server.flying.review import recording_of, review
from server.schemas.review_docs import ReviewDoc
from server.work.clocks import StepTimer
from telemetry.errors import TelemetryError
from telemetry.flight.fly import FlyOptions, FlyResult
from telemetry.flight.fly import fly as conduct
from telemetry.mavlink.address import parse_addresses
from telemetry.recording.flight_log import read_flight_log
from telemetry.topics.recording_requests import StartRecording, StopRecording

NODE_TIMEOUT_S = 30.0


class Acceptable(StrEnum):
    """Rows of the check that a pilot may take upon themselves."""

    GNSS = "gnss"
    BATTERY = "battery"
    RTL_HEIGHT = "rtl_height"


@command
def fly(
    mission: o.MissionFile,
    *,
    link: o.Link,
    mode: Annotated[
        Literal["auto", "guided"], Option(help="The mission on board, or waypoints handed over one at a time.")
    ] = "auto",
    dsm: o.FlightDsm = None,
    from_item: Annotated[int, Option(min=1, help="Go on at this item with a mission that broke off; needs --dsm.")] = 1,
    accept: Annotated[
        list[Acceptable] | None, Option(help="Fly although this row of the check is only acceptable; several times.")
    ] = None,
    checklist: Annotated[
        Path | None, Option(metavar="FILE", help="Ask each line of this text on the terminal before anything is sent.")
    ] = None,
    checklist_done_by: Annotated[
        str, Option(metavar="NAME", help="Who has looked at each point of the checklist: then none is asked.")
    ] = "",
    record: Annotated[Path | None, Option(metavar="FILE", help="Keep the recording (.mcap) here.")] = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
    given: Annotated[o.VehicleOptions, Without("max_items")],
    demands: Annotated[o.ClearanceOptions, Without("flown_as", "max_height_above_ground_m")],
    how: Annotated[o.ModelOptions, Without("max_hole_m2", "remove_spikes")],
) -> None:
    """Upload a mission, check the start, fly it, and judge the flight.

    Without --dsm neither the ground at home nor the clearance is checked.
    """
    flight = read_mission(mission.name, read_small(mission))
    parse_addresses(link)
    if record is not None:
        check_new(record)
    points = check_checklist(checklist, checklist_done_by)
    request = judged_by(flight, given, demands, mode)
    places, demanded_m = partial(mission_places, mission=flight), request.clearance().required_clearance_m
    model = None if dsm is None else read_around(dsm, StepTimer(progress), how, places, demanded_m)
    other = None if model is None else other_surface(flight, model)
    say_notes(other, *flight.warnings, fence_stays(flight))
    if model is None:
        say_notes("without --dsm neither the ground at home nor the clearance is checked.")
    options = FlyOptions(
        address=link,
        operator=OPERATOR,
        profile=request.profile,
        clearance=request.clearance() if model is None else request.clearance_over(model),
        way=mode,
        dsm=model,
        from_item=from_item,
        accept=frozenset(accept or ()),
        checklist=ticked(points, checklist_done_by),
        name=mission.stem,
    )
    result, doc = asyncio.run(_Conductor(flight, options, record, data_dir).run())
    say(result.text)
    completed = result.completed and (doc.figures is None or doc.figures.completed)
    if doc.figures is not None:
        doc = doc.model_copy(update={"figures": doc.figures.model_copy(update={"completed": completed})})
    tell(doc if other is None else doc.model_copy(update={"other_surface": other}), as_json=as_json)
    kept = doc.figures is None or doc.figures.below_required is None
    raise typer.Exit(DONE if completed and kept else FAILED)


class _Conductor:
    """One flight with nodes of its own, and what Ctrl+C means at each moment of it."""

    def __init__(self, mission: Mission, options: FlyOptions, record: Path | None, data_dir: Path | None) -> None:
        self._mission, self._options, self._record, self._data_dir = mission, options, record, data_dir
        self._go_home = asyncio.Event()
        self._progress = FlightProgress(options)
        self._pressed = 0
        self._task: asyncio.Task[object] | None = None

    async def run(self) -> tuple[FlyResult, ReviewDoc]:
        self._task = asyncio.current_task()
        loop = asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGINT, self._on_interrupt)
        try:
            async with own_nodes(recorder=True, data_dir=self._data_dir) as station:
                return await self._fly(station)
        except asyncio.CancelledError:
            raise typer.Abort from None
        finally:
            loop.remove_signal_handler(signal.SIGINT)

    async def _fly(self, station: Station) -> tuple[FlyResult, ReviewDoc]:
        options = self._options
        name = await station.bus.call("recorder", StartRecording(options.name), result=str, timeout_s=NODE_TIMEOUT_S)
        recording = station.recordings / name
        try:
            result = await conduct(
                station.link, station.bus, self._mission, options, self._progress, go_home=self._go_home
            )
        finally:
            end_progress()
            await self._end_recording(station, recording)
        return result, await asyncio.to_thread(_judge, recording, options.dsm)

    async def _end_recording(self, station: Station, recording: Path) -> None:
        """What was recorded of a flight is kept also when the recorder does not answer or the place for it is full."""
        try:
            await station.bus.call("recorder", StopRecording(), result=type(None), timeout_s=NODE_TIMEOUT_S)
        except TelemetryError as error:
            say_notes(str(error))
        if self._record is not None and self._progress.has_flown:
            await asyncio.to_thread(keep_recording, recording, self._record)

    def _on_interrupt(self) -> None:
        assert self._task is not None
        if not self._progress.in_flight:
            self._task.cancel()
            return
        self._pressed += 1
        end_progress()
        if self._pressed == 1:
            say("The vehicle flies on. Ctrl+C again commands it to return home, a third time leaves it to itself.")
        elif self._pressed == 2:
            self._go_home.set()
        else:
            say("The vehicle is left to itself: nobody watches it any more.")
            self._task.cancel()


def keep_recording(recording: Path, record: Path) -> None:
    """Raises StorageError when it cannot be written there; it then says where it stays."""
    try:
        shutil.copyfile(recording, record)
    except OSError as error:
        kept = Path(tempfile.mkdtemp(prefix="hedgehop-kept-")) / recording.name
        shutil.move(recording, kept)
        what = f"The recording cannot be written: {error.strerror or error}."
        raise StorageError(what, where=str(record), advice=f"It is kept as {kept}: move it away from there.") from error


def _judge(recording: Path, dsm: Dsm | None) -> ReviewDoc:
    log = read_flight_log(recording)
    return review(replace(log, faults=()), recording_of(log, recording), dsm=dsm)
