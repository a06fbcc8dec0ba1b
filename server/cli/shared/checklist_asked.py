"""A crew's checklist on the command line: asked point by point on a terminal, or ticked by who answers for it."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import typer

from planning.errors import ParameterError
from planning.formats.safe_text import clean_name, decode_text
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import harmless, say, say_notes
from server.cli.shared.own_nodes import OPERATOR
from telemetry.errors import NotAllowedError
from telemetry.topics.checklist import ChecklistPoint, points_of

DONE_BY = "--checklist-done-by"


def check_checklist(file: Path | None, done_by: str) -> tuple[ChecklistPoint, ...]:
    """The points of the file, before any is asked. Raises FormatError, ParameterError where nobody can tick them."""
    if file is None:
        if done_by:
            raise ParameterError("There is no checklist.", where=DONE_BY, advice="Give the list with --checklist.")
        return ()
    points = points_of(decode_text(file.name, read_small(file)), where=str(file))
    if not points:
        say_notes(f"{file} has no point: nothing is asked.")
    elif not done_by and not sys.stdin.isatty():
        raise ParameterError(
            f"The checklist has {len(points)} points, and there is no terminal to ask them on.",
            where=str(file),
            advice=f"Start it on a terminal, or give {DONE_BY} and the name of who has looked at each point.",
        )
    return points


def ticked(points: tuple[ChecklistPoint, ...], done_by: str) -> tuple[ChecklistPoint, ...]:
    """Each point with who ticked it when. Raises NotAllowedError at the first that is not so."""
    if points and done_by:
        say(f"Checklist of {len(points)} points: done by {done_by}")
    return tuple(_ticked(point, before, done_by) for point, before in zip(points, (None, *points), strict=False))


def _ticked(point: ChecklistPoint, before: ChecklistPoint | None, done_by: str) -> ChecklistPoint:
    if not done_by:
        if point.heading and (before is None or before.heading != point.heading):
            say(point.heading)
        if not _is_so(point.text):
            what = f'The checklist is open at "{point.text}".'
            raise NotAllowedError(what, where="the check before the start", advice="Nothing was sent to the vehicle.")
    return replace(point, ticked_by=clean_name(done_by) or OPERATOR.name, ticked_utc_s=time.time())


def _is_so(text: str) -> bool:
    """Nothing but what a command answers goes to stdout. Raises typer.Abort on Ctrl+C."""
    try:
        while True:
            sys.stderr.write(f"  {harmless(text)} [y/N]: ")
            sys.stderr.flush()
            typed = sys.stdin.readline().strip().lower()
            if typed in ("y", "yes", "n", "no", ""):
                return typed in ("y", "yes")
    except KeyboardInterrupt:
        raise typer.Abort from None
