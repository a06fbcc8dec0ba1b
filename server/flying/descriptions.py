"""The makers' descriptions of parameters: one file for each kind of autopilot, kept in the data directory."""

from __future__ import annotations

from pathlib import Path

from planning.errors import FormatError
from server.library.whole_files import write_atomically
from telemetry.parameters.described import Description, read_descriptions
from telemetry.topics.vehicle import Autopilot

FOLDER = "parameters"


def keep_descriptions(root: Path, autopilot: Autopilot, name: str, data: bytes) -> dict[str, Description]:
    """Blocks. Raises FormatError for a file that describes no parameters, StorageError."""
    found = read_descriptions(name, data)
    kept = _file(root, autopilot)
    kept.parent.mkdir(mode=0o700, exist_ok=True)
    write_atomically(kept, data)
    return found


def kept_descriptions(root: Path, autopilot: Autopilot) -> tuple[dict[str, Description], str]:
    """By name, and why they are not used. Blocks; empty where no file was ever given."""
    kept = _file(root, autopilot)
    if not kept.is_file():
        return {}, ""
    try:
        return read_descriptions(kept.name, kept.read_bytes()), ""
    except (FormatError, OSError) as error:
        return {}, f"the kept descriptions of parameters are not used: {error}"


def _file(root: Path, autopilot: Autopilot) -> Path:
    return root / FOLDER / f"{autopilot}-descriptions"
