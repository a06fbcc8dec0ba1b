"""``hedgehop logs list|get``: over a link of the command's own."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from planning.errors import ParameterError
from server.cli.shared import options as o
from server.cli.shared.command import DONE, command
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.output import answer, end_progress, progress, say
from server.cli.shared.own_nodes import OPERATOR, Station, own_nodes
from server.errors import StorageError
from server.library.shelf import iso_utc
from telemetry.bus.link_client import log_stretches
from telemetry.errors import NoVehicleError, TelemetryError
from telemetry.flight.preflight.prepare import connect
from telemetry.flight.watch import watching
from telemetry.mavlink.address import parse_addresses
from telemetry.topics.requests import ListVehicleLogs
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import VehicleLog

ENDINGS = {"ardupilot": ".bin", "px4": ".ulg"}


@command
def list_(*, link: o.Link, data_dir: o.Keys = None, as_json: o.AsJson = False) -> None:
    """Say which logs lie on the vehicle, the newest first; refused while it is armed."""
    parse_addresses(link)
    logs = asyncio.run(_list(link, data_dir))
    lines = [f"{log.number:5d}  {_begun(log):20s}  {log.size_bytes / 1e6:9.2f} MB" for log in logs]
    answer({"logs": [_json(log) for log in logs]}, lines or ["There is no log on the vehicle."], as_json=as_json)


@command
def get(
    number: Annotated[str, Argument(metavar="NUMBER|newest", help="As `hedgehop logs list` says.")],
    *,
    link: o.Link,
    out: Annotated[Path, Option(metavar="DIR", help="Directory for the file.")] = Path(),
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
) -> None:
    """Read a log from the vehicle into a file; refused while it is armed."""
    parse_addresses(link)
    if number != "newest" and not (number.isascii() and number.isdigit() and len(number) < 6):
        raise ParameterError(f"{number!r} is no number of a log.", advice="Give a number, or newest.")
    check_directory(out)
    started_s = time.monotonic()
    log, file = asyncio.run(_get(link, data_dir, number, out))
    seconds = time.monotonic() - started_s
    size = file.stat().st_size
    summary = {**_json(log), "file": str(file), "read_bytes": size, "seconds": round(seconds, 1)}
    answer(summary, [f"Read {size / 1e6:.2f} MB in {seconds:.0f} s: {file}"], as_json=as_json)
    raise typer.Exit(DONE)


@asynccontextmanager
async def _connected(link: str, data_dir: Path | None) -> AsyncIterator[tuple[Station, VehicleState]]:
    async with own_nodes(recorder=False, data_dir=data_dir) as station, watching(station.bus) as watch:
        yield station, await connect(station.link, watch, link, OPERATOR, say)


async def _list(link: str, data_dir: Path | None) -> tuple[VehicleLog, ...]:
    async with _connected(link, data_dir) as (station, _):
        return await station.link.call(ListVehicleLogs(OPERATOR))


async def _get(link: str, data_dir: Path | None, number: str, out: Path) -> tuple[VehicleLog, Path]:
    async with _connected(link, data_dir) as (station, vehicle):
        logs = await station.link.call(ListVehicleLogs(OPERATOR))
        chosen = [log for log in logs if number == "newest" or log.number == int(number)][:1]
        if not chosen:
            raise NoVehicleError(f"There is no log {number} on the vehicle.", advice="See `hedgehop logs list`.")
        log = chosen[0]
        file = out / f"log-{vehicle.system_id}-{log.number}{ENDINGS.get(vehicle.autopilot, '.log')}"
        if file.exists():
            raise StorageError("There is such a file already.", where=str(file), advice="Move it, or give --out.")
        await _into(file, station, log)
        return log, file


async def _into(file: Path, station: Station, log: VehicleLog) -> None:
    """Under another name until it is whole; what came of one that broke off is kept and said."""
    part = file.with_name(file.name + ".part")
    say(f"Reading log {log.number}, {log.size_bytes / 1e6:.2f} MB")
    read = 0
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as opened:
            async for stretch in log_stretches(station.link, OPERATOR, log):
                await asyncio.to_thread(opened.write, stretch)
                read += len(stretch)
                progress("Reading the log", read / max(1, log.size_bytes))
    except OSError as error:
        raise StorageError(f"The file cannot be written: {error.strerror}.", where=str(part)) from error
    except TelemetryError:
        end_progress()
        say(f"{read} bytes came: {part}")
        raise
    end_progress()
    os.replace(part, file)


def _begun(log: VehicleLog) -> str:
    return "time unknown" if log.begun_utc_s is None else iso_utc(log.begun_utc_s)


def _json(log: VehicleLog) -> dict[str, Any]:
    begun = None if log.begun_utc_s is None else iso_utc(log.begun_utc_s)
    return {"number": log.number, "begun_utc": begun, "bytes": log.size_bytes}
