"""``hedgehop audit``: whether the log of commands is whole, and the log as a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

from server.cli.shared.command import command
from server.cli.shared.output import say
from server.errors import NotFoundError
from server.library.audit_log import ADVICE, as_table, look_through, read_key
from telemetry.link.audit import AUDIT_FILE
from telemetry.link.keys import audit_key_file


@command
def audit(
    data_dir: Annotated[Path, Argument(help="The data directory, or its audit.jsonl.", metavar="DATA_DIR|FILE")],
    *,
    table: Annotated[Path | None, Option("--csv", help="Write the commands and what came of them here.")] = None,
) -> None:
    """Hold the log of commands against this machine's key and against what the recordings have seen of it."""
    log = data_dir if data_dir.is_file() else data_dir / AUDIT_FILE
    for needed in (log, audit_key_file(log.parent)):
        if not needed.is_file():
            raise NotFoundError(
                f"There is no {needed.name}.", where=str(needed.parent), advice="Name a data directory."
            )
    verdict = look_through(log, read_key(log.parent))
    if table is not None:
        table.write_text(as_table(log), encoding="utf-8", newline="")
        say(f"Written: {table}")
    for sentence in verdict.sentences:
        say(sentence)
    if verdict.faults:
        say(ADVICE)
        raise Exit(1)
