"""``hedgehop fence`` and ``hedgehop rally``: a vehicle's fence and rally points sent, read and cleared."""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer import Argument, Option

from planning.basics.plan_model import Firmware, MissionItem
from planning.errors import FormatError, ParameterError
from planning.fence.fence_model import Fence, RallyPoint, fence_words
from planning.formats.fence_files import read_fence, write_fence
from planning.formats.fence_items import fence_items, fence_of, rally_items, rally_of
from planning.formats.safe_text import clean_name
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.files_in_out import check_directory, read_small, write_files
from server.cli.shared.heights_set import HeightsDone, heights_unsent, read_heights, set_heights
from server.cli.shared.output import answer, say, say_notes
from server.cli.shared.own_nodes import OPERATOR, own_nodes
from server.cli.shared.upload_words import report_lines, report_summary
from telemetry.flight.preflight.prepare import connect
from telemetry.flight.watch import watching
from telemetry.mavlink.address import parse_addresses
from telemetry.mavlink.items import mission_items, wire_items
from telemetry.topics.onboard_lists import Item, PlaceList, UploadReport
from telemetry.topics.requests import DownloadPlaces, UploadPlaces

Action = Literal["upload", "download", "clear"]
Heights = Literal["leave", "show", "set"]
Places = tuple[Fence, tuple[RallyPoint, ...]]
LinkArgument = Annotated[
    str,
    Argument(
        metavar="LINK", help="Connection to the vehicle: udpin:0.0.0.0:14550, tcp:10.0.0.7:5760; several with commas."
    ),
]
ActionArgument = Annotated[
    Action, Argument(metavar="upload|download|clear", help="Send a file, save what is on board, or remove it.")
]
FileArgument = Annotated[
    Path | None, Argument(metavar="FILE", help="A .plan, .waypoints, .kml or .geojson file; none to clear.")
]
HeightsOption = Annotated[
    Heights,
    Option(help="Floor and ceiling are parameters of the vehicle: show what would change, or set them too."),
]
LooserOption = Annotated[
    bool,
    Option(
        "--looser",
        help="With --heights set: even where that raises the ceiling or lowers the floor that acts now.",
    ),
]
_NOT_ITEMS = (
    "floor and ceiling are no items of a fence: --heights set sets them on the vehicle, --heights show says how."
)
_ENABLED = {
    "fence": "a fence acts only if the autopilot is told so (ArduPilot FENCE_ENABLE and FENCE_ACTION; PX4 GF_ACTION).",
    "rally": "rally points are used only if the autopilot is told so (ArduPilot RALLY_LIMIT_KM; PX4 RTL_TYPE).",
}


@command
def fence(
    link: LinkArgument,
    action: ActionArgument,
    file: FileArgument = None,
    *,
    heights: HeightsOption = "leave",
    looser: LooserOption = False,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Send a fence to the vehicle and read it back, save the one on board, or clear it."""
    if heights != "leave" and action != "upload":
        raise ParameterError(f"--heights {heights} goes with upload alone.", advice="Leave it out.")
    if looser and heights != "set":
        raise ParameterError("--looser goes with --heights set alone.", advice="Leave it out.")
    _run("fence", link, action, file, data_dir, as_json=as_json, heights=heights, looser=looser)


@command
def rally(
    link: LinkArgument,
    action: ActionArgument,
    file: FileArgument = None,
    *,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Send rally points to the vehicle and read them back, save those on board, or clear them."""
    _run("rally", link, action, file, data_dir, as_json=as_json)


def _run(
    kind: PlaceList,
    link: str,
    action: Action,
    file: Path | None,
    data_dir: Path | None,
    *,
    as_json: bool,
    heights: Heights = "leave",
    looser: bool = False,
) -> None:
    parse_addresses(link)
    job = _Job(kind, link, data_dir)
    if action == "download":
        _save(job, _target(file, action), as_json=as_json)
        return
    if action == "clear" and file is not None:
        raise ParameterError("Clearing takes no file.", where=clean_name(file.name), advice="Leave the file out.")
    places = (Fence(), ()) if action == "clear" else _read(kind, _target(file, action), heights)
    done = asyncio.run(job.send(places, heights, looser=looser))
    summary: dict[str, Any] = {"list": kind, "action": action}
    lines: list[str] = []
    if done.report is not None:
        summary |= report_summary(done.report)
        lines += report_lines(done.report)
    if done.heights is not None:
        summary["heights"] = done.heights.summary
        lines += done.heights.lines
    answer(summary, lines, as_json=as_json)
    verified = done.report is None or done.report.verified
    raise typer.Exit(DONE if verified and (done.heights is None or done.heights.took) else FAILED)


@dataclass(frozen=True, slots=True)
class _Done:
    report: UploadReport | None
    """None: the fence has no shapes, and what is on board stays."""
    heights: HeightsDone | None = None


@dataclass(frozen=True, slots=True)
class _Job:
    kind: PlaceList
    link: str
    data_dir: Path | None

    async def send(self, places: Places, heights: Heights, *, looser: bool) -> _Done:
        async with own_nodes(recorder=False, data_dir=self.data_dir) as station, watching(station.bus) as watch:
            state = await connect(station.link, watch, self.link, OPERATOR, say)
            firmware: Firmware = "px4" if state.autopilot == "px4" else "ardupilot"
            # What cannot be set is told before anything is sent.
            found = None
            if heights != "leave":
                found = await read_heights(
                    station.link, places[0], firmware, writes=heights == "set", may_loosen=looser
                )
            items, report = _items(self.kind, places, firmware), None
            if items or heights == "leave":
                report = await station.link.call(UploadPlaces(OPERATOR, self.kind, wire_items(items)))
            if found is None:
                return _Done(report)
            if report is not None and not report.verified:
                return _Done(report, heights_unsent(found, writes=heights == "set"))
            return _Done(
                report, await set_heights(station.link, found, writes=heights == "set", begun=report is not None)
            )

    async def read(self) -> tuple[Item, ...]:
        async with own_nodes(recorder=False, data_dir=self.data_dir) as station, watching(station.bus) as watch:
            await connect(station.link, watch, self.link, OPERATOR, say)
            return await station.link.call(DownloadPlaces(OPERATOR, self.kind))


def _target(file: Path | None, action: Action) -> Path:
    if file is None:
        raise ParameterError(f"To {action}, a file is needed.", where="FILE", advice="Name it after the action.")
    return file


def _read(kind: PlaceList, file: Path, heights: Heights) -> Places:
    """Raises FormatError for a file that holds nothing of what is asked for: that would clear the list."""
    found = read_fence(file.name, read_small(file))
    say_notes(*found.warnings)
    sets = kind == "fence" and heights != "leave"
    if sets and not found.fence.has_heights:
        what = "The file's fence has neither floor nor ceiling."
        raise FormatError(what, where=clean_name(file.name), advice="Leave --heights out, or give it one.")
    if not _items(kind, (found.fence, found.rally), "px4") and not sets:
        what = "shapes of a fence" if kind == "fence" else "rally points"
        raise FormatError(
            f"The file holds no {what}.", where=clean_name(file.name), advice=f"To remove them, use: {kind} LINK clear"
        )
    say_notes(_NOT_ITEMS if kind == "fence" and found.fence.has_heights and not sets else None, _ENABLED[kind])
    return found.fence, found.rally


def _items(kind: PlaceList, places: Places, firmware: Firmware) -> tuple[MissionItem, ...]:
    return fence_items(places[0]) if kind == "fence" else rally_items(places[1], firmware)


def _save(job: _Job, file: Path, *, as_json: bool) -> None:
    write_fence(file.name, Fence(), ())  # a name that no format ends with is told before the vehicle is asked
    check_directory(file.parent)
    warnings: list[str] = []
    items = mission_items(asyncio.run(job.read()))
    where = f"the {job.kind} on board"
    shapes = fence_of(items, where, warnings) if job.kind == "fence" else Fence()
    points = rally_of(items, where) if job.kind == "rally" else ()
    say_notes(*warnings)
    write_files(file.parent, {file.name: write_fence(file.name, shapes, points)})
    words = fence_words(shapes, points) if items else f"The vehicle has no {job.kind}"
    summary: dict[str, Any] = {"list": job.kind, "action": "download", "items": len(items), "file": str(file)}
    summary |= {"fence": asdict(shapes), "rally": [asdict(point) for point in points], "warnings": warnings}
    answer(summary, [f"{words}. Written to {file}"], as_json=as_json)
    raise typer.Exit(DONE)
