"""``hedgehop agent``: a companion computer's radar frames and point clouds to the ground station."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from server.cli.agent.source import Source, SourceOptions, source_of
from server.cli.shared.command import command
from server.cli.shared.output import print_json, say
from server.errors import BadRequestError
from telemetry.agent.client import Agent, AgentCounts, Reading, sensor_url
from telemetry.agent.link_messages import REACH_M, ArrivalReport

TOKEN_VARIABLE = "HEDGEHOP_SENSOR_TOKEN"
TELL_EVERY_S = 5.0
LAST_FRAMES_S = 1.5
"""For what is under way when the source ends, and the ground station's last word on it."""
CONNECT_WITHIN_S = 10.0


@command
def agent(
    address: Annotated[str, Argument(metavar="URL", help="The ground station: http://HOST:PORT or https://HOST.")],
    *,
    taken_from: SourceOptions,
    token_file: Annotated[
        Path | None, Option(metavar="FILE", help=f"Holds the ground station's token; default: {TOKEN_VARIABLE}.")
    ] = None,
    name: Annotated[str, Option(help="Of this agent; default: the computer's.")] = "",
    voxel_m: Annotated[float, Option(help="One point per voxel of this edge; 0: all points.")] = 0.25,
    limit_kb_s: Annotated[float, Option(help="Bandwidth; clouds beyond it are left out.")] = 1000.0,
    as_json: Annotated[bool, Option("--json", help="Print what was sent as JSON at the end.")] = False,
) -> None:
    """Send radar frames and point clouds to a ground station: from stdin, a radar, topics of ROS 2, or a recording."""
    sensor_url(address)
    _check(voxel_m, limit_kb_s)
    made = Agent(
        address,
        token=_token(token_file),
        name=(name or socket.gethostname())[:40],
        voxel_m=voxel_m,
        limit_bytes_per_s=1000.0 * limit_kb_s,
    )
    source = source_of(taken_from)
    asyncio.run(_run(made, source))
    _answer(made.counts, source, as_json=as_json)


def _check(voxel_m: float, limit_kb_s: float) -> None:
    for what, value, low, high in (("voxel", voxel_m, 0.0, 10.0), ("limit", limit_kb_s, 1.0, 1e6)):
        if not low <= value <= high:
            raise BadRequestError(f"The {what} is {value:g}.", advice=f"Give a value from {low:g} to {high:g}.")


def _token(file: Path | None) -> str:
    token = file.read_text(encoding="utf-8").strip() if file else os.environ.get(TOKEN_VARIABLE, "").strip()
    if not token:
        raise BadRequestError(
            "The agent has no token.",
            where="--token-file",
            advice="Copy sensor-token.txt from the ground station's data directory, and name it here.",
        )
    return token


async def _run(made: Agent, source: Source) -> None:
    """Until the source ends or Ctrl+C; the connection is made again as often as it is lost."""
    loop = asyncio.get_running_loop()
    connection = asyncio.ensure_future(made.run())
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, connection.cancel)
    ended = loop.create_future()
    try:
        async with asyncio.timeout(CONNECT_WITHIN_S):
            while not made.is_ready and not connection.done():
                await asyncio.sleep(0.02)
    except TimeoutError:
        say(f"The ground station does not answer ({made.counts.trouble or 'no answer'}): it is tried again.")
    reader = threading.Thread(target=_read, args=(source.readings, made.put, loop, ended), daemon=True)
    reader.start()
    teller = asyncio.ensure_future(_tell(made, source))
    try:
        await asyncio.wait((ended, connection), return_when=asyncio.FIRST_COMPLETED)
        if ended.done() and not connection.done():
            ended.result()
            await asyncio.sleep(LAST_FRAMES_S)
    finally:
        for task in (connection, teller):
            task.cancel()
        if source.close is not None:
            await asyncio.to_thread(source.close)
            # It closes too: a thread that the end of Python meets inside a library takes the process with it.
            await asyncio.to_thread(reader.join, LAST_FRAMES_S)
        with contextlib.suppress(asyncio.CancelledError):
            await connection


def _read(
    readings: Iterator[Reading],
    put: Callable[[Reading], None],
    loop: asyncio.AbstractEventLoop,
    ended: asyncio.Future[None],
) -> None:
    """In a thread of its own: a pipe may be silent for ever."""

    def end(error: Exception | None) -> None:
        if not ended.done():
            ended.set_exception(error) if error else ended.set_result(None)

    wrong: Exception | None = None
    try:
        for reading in readings:
            loop.call_soon_threadsafe(put, reading)
    except Exception as error:
        wrong = error
    with contextlib.suppress(RuntimeError):  # the loop has ended: Ctrl+C
        loop.call_soon_threadsafe(end, wrong)


async def _tell(made: Agent, source: Source) -> None:
    while True:
        await asyncio.sleep(TELL_EVERY_S)
        counts = made.counts
        rate = f"{(counts.report.bytes_per_s if counts.report else 0.0) / 1000:.0f} kB/s"
        state = f"no connection: {counts.trouble}" if counts.trouble else rate
        say(f"{counts.sent} frames sent, {counts.skipped} left out, {state}")
        for line in _details(counts, source):
            say(line)


def _details(counts: AgentCounts, source: Source) -> Iterator[str]:
    """What of the frames did not arrive, where there is any, and how the source does."""
    if counts.points_not_finite or counts.points_out_of_reach:
        yield (
            f"points left out of clouds: {counts.points_not_finite} without numbers, {counts.points_out_of_reach} "
            f"beyond {REACH_M:.0f} m"
        )
    if counts.report is not None and counts.report.refused:
        yield f"refused by the ground station: {counts.report.refused}; the last: {counts.refused_why}"
    if counts.not_understood:
        yield f"not understood of the ground station's messages: {counts.not_understood}; is it of another version?"
    yield from (str(status) for status in (source.radar, source.lines, source.ros2) if status is not None)


def _answer(counts: AgentCounts, source: Source, *, as_json: bool) -> None:
    report = counts.report or ArrivalReport(0, 0, 0, 0, 0.0, "")
    if as_json:
        print_json(_summary(counts, report, source))
        return
    say(
        f"{counts.sent} frames sent ({counts.sent_bytes / 1e6:.1f} MB), {counts.skipped} left out; the ground "
        f"station took {report.received}, {report.late} of them late, and refused {report.refused}."
    )
    for line in _details(counts, source):
        say(line)


def _summary(counts: AgentCounts, report: ArrivalReport, source: Source) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "sent": counts.sent,
        "skipped": counts.skipped,
        "sent_bytes": counts.sent_bytes,
        "connections": counts.connections,
        "received": report.received,
        "lost": report.lost,
        "late": report.late,
        "refused": report.refused,
        "refused_why": counts.refused_why,
        "points_not_finite": counts.points_not_finite,
        "points_out_of_reach": counts.points_out_of_reach,
    }
    told = {"radar": source.radar, "lines": source.lines, "ros2": source.ros2}
    return summary | {name: status.as_dict() for name, status in told.items() if status is not None}
