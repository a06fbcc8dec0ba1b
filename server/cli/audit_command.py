"""``hedgehop audit``: whether the log of commands is whole, and the log as a table."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

from server.cli.shared.command import command
from server.cli.shared.output import say
from server.errors import NotFoundError
from telemetry.errors import RecordingError
from telemetry.link.audit import AUDIT_FILE
from telemetry.link.audit_chain import Checked, check_file, parsed
from telemetry.link.keys import audit_key_file
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.topics.messages import LinkStatus, Topic

COLUMNS = ("t_utc", "operator", "words", "result")


@command
def audit(
    data_dir: Annotated[Path, Argument(help="The data directory, or its audit.jsonl.", metavar="DATA_DIR|FILE")],
    *,
    table: Annotated[Path | None, Option("--csv", help="Write the commands and what came of them here.")] = None,
) -> None:
    """Hold the log of commands against this machine's key and against what the recordings have seen of it."""
    log = data_dir if data_dir.is_file() else data_dir / AUDIT_FILE
    folder = log.parent
    key_file = audit_key_file(folder)
    for needed in (log, key_file):
        if not needed.is_file():
            raise NotFoundError(
                f"There is no {needed.name}.", where=str(needed.parent), advice="Name a data directory."
            )
    checked = check_file(log, key_file.read_bytes())
    faults = [*_broken(checked), *_missing(folder, checked)]
    if table is not None:
        _write(table, log)
        say(f"Written: {table}")
    for fault in faults:
        say(fault)
    if faults:
        say("Keep a copy of the log and of the recordings, and find out who could write to the data directory.")
        raise Exit(1)
    say(f"The audit log is whole: {checked.lines} lines.")


def _broken(checked: Checked) -> list[str]:
    broken = checked.broken
    return [] if broken is None else [f"BROKEN at line {broken.line}. {broken.why}"]


def _missing(folder: Path, checked: Checked) -> Iterator[str]:
    """Lines that a recording of this machine knew and the log has not any more. Behind a break nothing can be told."""
    if checked.broken is not None:
        return
    aside = (line for path in folder.glob("audit-until-*.jsonl") for line in path.read_bytes().splitlines())
    known = checked.hashes | {(parsed(line) or {}).get("hash") for line in aside}
    for path in sorted((folder / "recordings").glob("*.mcap")):
        try:
            with open_recording(path) as recording:
                last = recording.latest(Topic.LINK, recording.end_utc_s)
        except RecordingError:
            continue  # it has its own words in Review
        status = None if last is None else last.message
        if isinstance(status, LinkStatus) and status.audit_head.strip("0") and status.audit_head not in known:
            yield f"LINES ARE MISSING: {path.name} was recorded when the log had a line that it has not any more."


def _write(table: Path, log: Path) -> None:
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for line in log.read_bytes().splitlines():
            entry = parsed(line) or {"words": json.dumps(line.decode(errors="replace")), "result": "not readable"}
            t_utc_s = entry.get("t_utc_s")
            told = datetime.fromtimestamp(t_utc_s, UTC).isoformat() if isinstance(t_utc_s, int | float) else ""
            writer.writerow([told, *(_cell(entry.get(name, "")) for name in COLUMNS[1:])])


def _cell(value: object) -> str:
    """A program that opens the table must not take a name for a formula."""
    text = str(value)
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text
