"""The autopilot's own words for its parameters: from a file that is given once and kept in the data directory."""

from __future__ import annotations

from pathlib import Path

from planning.errors import FormatError
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import say_notes
from server.library.whole_files import write_atomically
from telemetry.parameters.described import Description, read_descriptions
from telemetry.topics.vehicle import Autopilot

FOLDER = "parameters"


def descriptions(given: Path | None, data_dir: Path | None, autopilot: Autopilot) -> dict[str, Description]:
    """By name; empty where no file was ever given. A given one is kept for this autopilot."""
    kept = None if data_dir is None else data_dir / FOLDER / f"{autopilot}-descriptions"
    if given is not None:
        data = read_small(given)
        found = read_descriptions(given.name, data)
        if kept is not None:
            kept.parent.mkdir(mode=0o700, exist_ok=True)
            write_atomically(kept, data)
        return found
    if kept is None or not kept.is_file():
        return {}
    try:
        return read_descriptions(kept.name, read_small(kept))
    except FormatError as error:
        say_notes(f"the kept descriptions of parameters are not used: {error}")
        return {}
