"""``hedgehop params get|set|save|load|compare``: over a link of the command's own."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from planning.errors import FormatError, ParameterError
from server.cli.params.params_session import ParameterSession, parameter_session
from server.cli.params.tables import (
    Descriptions,
    comparison_json,
    comparison_lines,
    parameter_json,
    parameter_lines,
    written_json,
    written_line,
    written_summary,
)
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.files_in_out import check_directory, read_small, write_files
from server.cli.shared.output import answer, say, say_notes
from server.errors import StorageError
from server.flying.descriptions import keep_descriptions, kept_descriptions
from telemetry.errors import TelemetryError
from telemetry.mavlink.address import parse_addresses
from telemetry.parameters.comparing import compare as compared
from telemetry.parameters.comparing import of_vehicle
from telemetry.parameters.described import Description, read_descriptions
from telemetry.parameters.files import (
    FileParameter,
    ParameterFile,
    is_kept_by_vehicles,
    read_parameter_file,
    value_text,
    write_mission_planner,
    write_qgc,
)
from telemetry.topics.parameters import Outcome, Parameter, ParameterChange, ParameterWritten
from telemetry.topics.vehicle import Autopilot

About = Annotated[
    Path | None,
    Option(
        metavar="FILE",
        help="What the autopilot's makers say of its parameters: apm.pdef.xml (ArduPilot), parameters.json or .json.xz "
        "(PX4). Kept in --data-dir.",
    ),
]
EvenArmed = Annotated[
    bool, Option("--even-armed", help="Write while the vehicle is armed, too: it flies by the new values at once.")
]
Only = Annotated[list[str] | None, Option(metavar="PATTERN", help="Only names like this: 'FENCE_*'; several times.")]
LeaveOut = Annotated[list[str] | None, Option(metavar="PATTERN", help="No names like this; several times.")]


@command
def get(
    names: Annotated[list[str] | None, Argument(metavar="NAME|PATTERN", help="RTL_ALT 'FENCE_*'.")] = None,
    *,
    link: o.Link,
    search: Annotated[str | None, Option(metavar="TEXT", help="Only those whose name or description has this.")] = None,
    changed: Annotated[
        bool,
        Option("--changed", help="Only those that differ from the default, as far as it is known."),
    ] = False,
    about: About = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Say what the vehicle's parameters are; all of them without a name."""
    parse_addresses(link)
    wanted = [name.upper() for name in names or ()]
    title, parameters, described = asyncio.run(_read(link, data_dir, about, wanted, whole=bool(search) or changed))
    if changed and not any(known.default is not None for known in (*parameters, *described.values())):
        advice = "Compare with a file instead, or give PX4's parameters.json with --about."
        raise ParameterError("The defaults are not known.", where="--changed", advice=advice)
    found = [
        p
        for p in parameters
        if (search is None or _is_found(p.name, search, described)) and (not changed or _is_changed(p, described))
    ]
    missing = [name for name in wanted if not any(fnmatchcase(p.name.upper(), name) for p in parameters)]
    summary = {
        "vehicle": title, "parameters": [parameter_json(p, described) for p in found], "not_found": missing,
    }  # fmt: skip
    lines = parameter_lines(found, described)
    answer(summary, lines or ["No such parameter."], as_json=as_json)
    for name in missing:
        say(f"The vehicle has no {name}.")
    raise typer.Exit(FAILED if missing else DONE)


def _is_found(name: str, text: str, described: Descriptions) -> bool:
    return text.upper() in name or (name in described and described[name].has(text))


def _is_changed(parameter: Parameter, described: Descriptions) -> bool:
    default = parameter.default
    if default is None and parameter.name in described:
        default = described[parameter.name].default
    if default is None or parameter.value is None:
        return False
    ours = of_vehicle((parameter,))
    return not compared(ours, [FileParameter(parameter.name, default, 0, parameter.kind)]).is_equal


async def _read(
    link: str, data_dir: Path | None, about: Path | None, wanted: Sequence[str], *, whole: bool
) -> tuple[str, list[Parameter], Descriptions]:
    async with parameter_session(link, data_dir) as session:
        described = _descriptions(about, data_dir, session.vehicle.autopilot)
        if wanted and not whole and not any(set(name) & set("*?[") for name in wanted):
            values = await session.named(wanted)
            return session.title, [Parameter(n, v) for n, v in values.items() if v is not None], described
        listed = await session.whole_list()
    found = [p for p in listed if not wanted or any(fnmatchcase(p.name.upper(), name) for name in wanted)]
    return session.title, sorted(found, key=lambda p: p.name), described


@command
def set_(
    pairs: Annotated[list[str], Argument(metavar="NAME VALUE|NAME=VALUE", help="RTL_ALT 1900 or RTL_ALT=1900.")],
    *,
    link: o.Link,
    even_armed: EvenArmed = False,
    about: About = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Write parameters, each read back before the next; refused while the vehicle is armed."""
    parse_addresses(link)
    changes = _changes(pairs)
    written, described = asyncio.run(_set(link, data_dir, about, changes, even_armed))
    _tell(written, described, as_json=as_json)


async def _set(
    link: str, data_dir: Path | None, about: Path | None, changes: list[ParameterChange], even_armed: bool
) -> tuple[list[ParameterWritten], Descriptions]:
    async with parameter_session(link, data_dir) as session:
        described = _descriptions(about, data_dir, session.vehicle.autopilot)
        _note_ranges(changes, described)
        return await session.write(changes, _say_written, even_armed=even_armed), described


def _note_ranges(changes: Sequence[ParameterChange], described: Descriptions) -> None:
    for change in changes:
        known = described.get(change.name)
        if known is not None and known.outside(change.value):
            low, high = ("open" if end is None else f"{end:g}" for end in (known.low, known.high))
            say_notes(
                f"{change.name} {value_text(change.value)} is outside what its makers recommend, {low} to {high}."
            )


def _changes(pairs: Sequence[str]) -> list[ParameterChange]:
    """Of ``NAME VALUE`` and ``NAME=VALUE``. Raises ParameterError."""
    words = [word for pair in pairs for word in (pair.split("=", 1) if "=" in pair else (pair,))]
    if len(words) % 2:
        raise ParameterError(f"{words[-1]!r} has no value.", advice="Write NAME VALUE or NAME=VALUE.")
    lines = [f"{name},{value}" for name, value in zip(words[::2], words[1::2], strict=True)]
    try:
        given = read_parameter_file("command line", "\n".join(lines).encode())
    except FormatError as error:
        raise ParameterError(error.what, where=error.where, advice=error.advice) from None
    return [ParameterChange(p.name, p.value) for p in given.parameters]


@command
def save(
    file: Annotated[Path, Argument(metavar="FILE", help="New: .param or .parm (Mission Planner), .params (QGC).")],
    *,
    link: o.Link,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Write all parameters of the vehicle into a file."""
    parse_addresses(link)
    if file.suffix.lower() not in (".param", ".parm", ".params"):
        advice = "Name it .param or .parm for Mission Planner and MAVProxy, .params for QGroundControl."
        raise FormatError("The file's name says no format.", where=str(file), advice=advice)
    check_directory(file.parent)
    if file.exists():
        raise StorageError("There is such a file already.", where=str(file), advice="Give another name.")
    title, system_id, parameters = asyncio.run(_list(link, data_dir))
    heading = f"Parameters of {title}\n{time.strftime('%Y-%m-%d %H:%M:%S UTC', time.gmtime())}, saved by Hedgehop"
    if file.suffix.lower() == ".params":
        text = write_qgc(parameters, system_id=system_id, heading=heading)
    else:
        text = write_mission_planner(parameters, heading)
    write_files(file.parent, {file.name: text})
    left_out = [p.name for p in parameters if p.value is None]
    if left_out:
        say_notes(f"not in the file, for the vehicle sends no number for them: {', '.join(left_out)}.")
    saved = len(parameters) - len(left_out)
    summary = {"file": str(file), "saved": saved, "left_out": left_out}
    answer(summary, [f"Saved {saved} parameters: {file}"], as_json=as_json)


async def _list(link: str, data_dir: Path | None) -> tuple[str, int, tuple[Parameter, ...]]:
    async with parameter_session(link, data_dir) as session:
        return session.title, session.vehicle.system_id, await session.whole_list()


@command
def load(
    file: Annotated[Path, Argument(metavar="FILE", help="Mission Planner's, MAVProxy's or QGroundControl's.")],
    *,
    link: o.Link,
    only: Only = None,
    leave_out: LeaveOut = None,
    even_armed: EvenArmed = False,
    about: About = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Write what differs from a file, each read back before the next; refused while the vehicle is armed.

    See first with compare what that is.
    """
    parse_addresses(link)
    given = _file(file)
    _note_own(given.parameters)
    chosen = _chosen(given.parameters, only, leave_out)
    if not chosen:
        raise ParameterError(
            "Nothing of the file is chosen.", where=str(file), advice="Look at --only and --leave-out."
        )
    written, described = asyncio.run(_load(link, data_dir, about, chosen, even_armed))
    _tell(written, described, as_json=as_json)


def _chosen(given: Sequence[FileParameter], only: list[str] | None, leave_out: list[str] | None) -> list[FileParameter]:
    return [
        p
        for p in given
        if not is_kept_by_vehicles(p.name) and (not only or _like(p.name, only)) and not _like(p.name, leave_out or ())
    ]


def _note_own(given: Sequence[FileParameter]) -> None:
    own = [p.name for p in given if is_kept_by_vehicles(p.name)]
    if own:
        say_notes(f"left out, for vehicles count or measure it by themselves: {', '.join(own)}.")


def _like(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(name.upper(), pattern.upper()) for pattern in patterns)


async def _load(
    link: str, data_dir: Path | None, about: Path | None, chosen: list[FileParameter], even_armed: bool
) -> tuple[list[ParameterWritten], Descriptions]:
    async with parameter_session(link, data_dir) as session:
        described = _descriptions(about, data_dir, session.vehicle.autopilot)
        made = compared(chosen, of_vehicle(await session.whole_list()))
        by_name = {p.name: p for p in chosen}
        changes = [ParameterChange(d.name, by_name[d.name].value) for d in made.different]
        say(f"{made.same} are so already, {len(changes)} differ, {len(made.only_here)} are not in the vehicle's list")
        _note_ranges(changes, described)
        written = await session.write(changes, _say_written, even_armed=even_armed)
        if all(w.outcome != "not sent" for w in written):
            written += await _write_unlisted(session, made.only_here, begun=bool(written), even_armed=even_armed)
        return written, described


async def _write_unlisted(
    session: ParameterSession, unlisted: Sequence[FileParameter], *, begun: bool, even_armed: bool
) -> list[ParameterWritten]:
    """ArduPilot does not list what belongs to a feature that is switched off, or was until now; it answers by name."""
    if not unlisted:
        return []
    changes = {p.name: ParameterChange(p.name, p.value) for p in unlisted}
    try:
        values = await session.named(list(changes))
    except TelemetryError as error:
        if not begun:
            raise
        return [_unwritten(change, "not sent", str(error)) for change in changes.values()]
    text = "The vehicle has no such parameter, or its feature is switched off. Nothing was sent."
    gone = [_unwritten(changes[name], "refused", text) for name, value in values.items() if value is None]
    there = [changes[name] for name, value in values.items() if value is not None]
    return [*(await session.write(there, _say_written, begun=begun, even_armed=even_armed)), *gone]


def _unwritten(change: ParameterChange, outcome: Outcome, words: str) -> ParameterWritten:
    written = ParameterWritten(change.name, change.value, None, None, outcome, words)
    _say_written(written)
    return written


@command
def compare(
    file: Annotated[Path, Argument(metavar="FILE|URL", help="A file, or the link to another vehicle.")],
    *,
    link: o.Link,
    only: Only = None,
    leave_out: LeaveOut = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Say how the vehicle differs from a file or from another vehicle; ends with 1 if it does."""
    parse_addresses(link)
    other = str(file)
    given: Sequence[FileParameter] | None = None
    if file.is_file() or not _is_link(other):
        given = _file(o.existing(file) or file).parameters
    title, _, ours = asyncio.run(_list(link, data_dir))
    there = file.name
    if given is None:
        there, _, theirs = asyncio.run(_list(other, data_dir))
        given = of_vehicle(theirs)
    _note_own(given)
    made = compared(_chosen(of_vehicle(ours), only, leave_out), _chosen(given, only, leave_out))
    summary = {"here": title, "there": there, **comparison_json(made)}
    answer(summary, comparison_lines(made, title, there), as_json=as_json)
    raise typer.Exit(DONE if made.is_equal else FAILED)


def _is_link(text: str) -> bool:
    return ":" in text or text.startswith("/dev/")


def _file(path: Path) -> ParameterFile:
    given = read_parameter_file(path.name, read_small(path))
    say_notes(*given.notes)
    return given


def _say_written(written: ParameterWritten) -> None:
    say(written_line(written))


def _tell(written: list[ParameterWritten], described: Descriptions, *, as_json: bool) -> None:
    answer(written_json(written), written_summary(written, described), as_json=as_json)
    raise typer.Exit(DONE if all(w.took for w in written) else FAILED)


def _descriptions(given: Path | None, data_dir: Path | None, autopilot: Autopilot) -> dict[str, Description]:
    """The autopilot's own words, by name; empty where no file was ever given. A given one is kept for it."""
    if given is not None:
        data = read_small(given)
        if data_dir is None:
            return read_descriptions(given.name, data)
        return keep_descriptions(data_dir, autopilot, given.name, data)
    found, why = ({}, "") if data_dir is None else kept_descriptions(data_dir, autopilot)
    if why:
        say_notes(why)
    return found
