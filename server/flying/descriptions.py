"""Descriptions of parameters that are kept in the data directory: one file of the makers for each kind of autopilot,
and those that vehicles have of themselves."""

from __future__ import annotations

import re
from pathlib import Path

from planning.errors import FormatError
from server.library.whole_files import write_atomically
from telemetry.parameters.described import Description, read_descriptions
from telemetry.topics.vehicle import Autopilot

FOLDER = "parameters"
MOST_KEPT = 8
"""Versions of firmware whose own descriptions are kept, of each kind of autopilot."""
_OWN = re.compile(r"[a-z0-9]+-vehicle-[0-9a-f]{8}")


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


def own_descriptions(data: bytes) -> dict[str, Description]:
    """Of a vehicle of itself, as it came. Blocks. Raises FormatError."""
    return read_descriptions("the vehicle's own description", data)


def keep_vehicle_descriptions(root: Path, autopilot: Autopilot, crc: int, data: bytes) -> None:
    """Found again by their CRC. Blocks. Raises StorageError, OSError."""
    kept = _vehicle_file(root, autopilot, crc)
    kept.parent.mkdir(mode=0o700, exist_ok=True)
    write_atomically(kept, data)
    for old in sorted(_vehicle_files(root, autopilot), key=lambda path: path.stat().st_mtime)[:-MOST_KEPT]:
        old.unlink(missing_ok=True)


def vehicle_descriptions(root: Path, autopilot: Autopilot, crc: int) -> dict[str, Description]:
    """As kept. Blocks. Raises FormatError, OSError."""
    return own_descriptions(_vehicle_file(root, autopilot, crc).read_bytes())


def known_crcs(root: Path, autopilot: Autopilot) -> tuple[int, ...]:
    """Of the vehicles' own descriptions that are kept. Blocks."""
    return tuple(int(path.name.rpartition("-")[2], 16) for path in _vehicle_files(root, autopilot))


def _vehicle_files(root: Path, autopilot: Autopilot) -> list[Path]:
    return [path for path in (root / FOLDER).glob(f"{autopilot}-vehicle-*") if _OWN.fullmatch(path.name)]


def _vehicle_file(root: Path, autopilot: Autopilot, crc: int) -> Path:
    return root / FOLDER / f"{autopilot}-vehicle-{crc:08x}"


def _file(root: Path, autopilot: Autopilot) -> Path:
    return root / FOLDER / f"{autopilot}-descriptions"
