"""``hedgehop upload``: a mission onto the vehicle, verified by reading it back."""

from __future__ import annotations

import asyncio
from pathlib import Path

import typer

from planning.basics.plan_model import Mission
from planning.formats.detect import read_mission
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.fence_given import fence_stays
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import answer, say, say_notes
from server.cli.shared.own_nodes import OPERATOR, own_nodes
from server.cli.shared.upload_words import report_lines, report_summary
from telemetry.flight.preflight.prepare import connect, transfer
from telemetry.flight.watch import watching
from telemetry.mavlink.address import parse_addresses
from telemetry.topics.onboard_lists import UploadReport


@command
def upload(mission: o.MissionFile, *, link: o.Link, data_dir: o.Keys = None, as_json: o.AsJson = False) -> None:
    """Replace the mission on board, read it back, and say what the vehicle rounded."""
    flight = read_mission(mission.name, read_small(mission))
    parse_addresses(link)
    say_notes(*flight.warnings, fence_stays(flight))
    report = asyncio.run(_upload(flight, link, data_dir))
    answer(report_summary(report), report_lines(report), as_json=as_json)
    raise typer.Exit(DONE if report.verified else FAILED)


async def _upload(flight: Mission, link: str, data_dir: Path | None) -> UploadReport:
    async with own_nodes(recorder=False, data_dir=data_dir) as station, watching(station.bus) as watch:
        await connect(station.link, watch, link, OPERATOR, say)
        return await transfer(station.link, flight, OPERATOR, say)
