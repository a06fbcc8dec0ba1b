"""``hedgehop upload``: a mission onto the vehicle, verified by reading it back."""

from __future__ import annotations

import asyncio
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from planning.formats.detect import read_mission
from planning.model import Mission
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import answer, say, say_notes
from server.cli.shared.own_nodes import OPERATOR, own_nodes
from telemetry.flight.preflight.prepare import connect, transfer
from telemetry.flight.watch import watching
from telemetry.mavlink.address import parse_address
from telemetry.topics.messages import UploadReport


@command
def upload(mission: o.MissionFile, *, link: o.Link, data_dir: o.Keys = None, as_json: o.AsJson = False) -> None:
    """Replace the mission on board, read it back, and say what the vehicle rounded."""
    flight = read_mission(mission.name, read_small(mission))
    parse_address(link)
    say_notes(*flight.warnings)
    report = asyncio.run(_upload(flight, link, data_dir))
    answer(_summary(report), upload_lines(report), as_json=as_json)
    raise typer.Exit(DONE if report.verified else FAILED)


async def _upload(flight: Mission, link: str, data_dir: Path | None) -> UploadReport:
    async with own_nodes(recorder=False, data_dir=data_dir) as station, watching(station.bus) as watch:
        await connect(station.link, watch, link, OPERATOR, say)
        return await transfer(station.link, flight, OPERATOR, say)


def _summary(report: UploadReport) -> dict[str, Any]:
    return {
        "verified": report.verified,
        "items": len(report.onboard.items),
        "rounded": [asdict(rounded) for rounded in report.rounded],
        "differences": list(report.differences),
        "digest": report.onboard.digest,
        "seconds": report.seconds,
    }


def upload_lines(report: UploadReport) -> list[str]:
    """What came of it, for people."""
    items = f"{len(report.onboard.items)} items in {report.seconds:.1f} s"
    if not report.verified:
        return [f"NOT VERIFIED: {items}, and the vehicle holds something else", *(f"  {d}" for d in report.differences)]
    rounded = [
        f"  item {r.item}: {r.field} {_value(r.field, r.sent)} is kept as {_value(r.field, r.kept)}"
        for r in report.rounded
    ]
    return [f"VERIFIED: {items}, read back", *rounded]


def _value(field: str, value: float | None) -> str:
    """Vehicles keep single precision: more digits than it has are noise, but for places, which are whole numbers."""
    digits = 10 if field in ("latitude", "longitude") else 7
    return "not given" if value is None else f"{value:.{digits}g}"
