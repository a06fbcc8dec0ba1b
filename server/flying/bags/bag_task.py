"""What a worker does with a bag of ROS: unpacks it where it is a ZIP archive, lists it, makes a recording of it."""

from __future__ import annotations

import zipfile
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from server.errors import BadRequestError
from server.plan import archives
from server.plan.archives import named
from server.work.jobs import Progress
from telemetry.errors import TelemetryError

if TYPE_CHECKING:
    from telemetry.recording.ros.bag import BagTable
    from telemetry.recording.ros.bag_flight import BagAsked, BagFlight
    from telemetry.topics.obstacles import Sensor

METADATA = "metadata.yaml"
_ENDINGS = frozenset({".bag", ".db3", ".mcap"})
_MOST_BYTES = 32 * 2**30
"""Of all files of an archive, unpacked."""


def list_uploaded(upload: Path, folder: Path, filename: str, *, report: Progress) -> tuple[Path, BagTable]:
    """Where the bag lies, and its topics; an archive is unpacked into ``folder``.

    Raises RecordingError, BadRequestError, TooLargeError, StorageError.
    """
    from telemetry.recording.ros.bag import list_bag

    bag = upload
    if archives.is_archive(upload):
        bag = unpacked(upload, folder, filename, report=report)
        upload.unlink(missing_ok=True)
    with named(bag, filename, kind=TelemetryError):
        return bag, list_bag(bag, progress=lambda share: report("Looking through the bag", share))


def make_recording(
    bag: Path, filename: str, table: BagTable, asked: BagAsked, sensor: Sensor, out: Path, *, report: Progress
) -> BagFlight:
    """Raises RecordingError: what is missing, and what there is instead."""
    from telemetry.errors import RecordingError
    from telemetry.recording.ros.bag_flight import write_bag_flight
    from telemetry.recording.ros.bag_types import FIX

    with named(bag, filename, kind=TelemetryError):
        flight = write_bag_flight(
            bag,
            table,
            asked,
            sensor,
            out,
            name=Path(filename).stem,
            progress=lambda share: report("Reading the bag", share),
        )
        if not flight.is_on_earth:
            fixes = sum(topic.count for topic in table.topics if topic.type == FIX)
            why = f"none of its {fixes:,} NavSatFix has a fix" if fixes else "it holds no NavSatFix"
            what = f"Nothing tells where on Earth it was recorded: {why}."
            raise RecordingError(what, where=filename, advice="Give latitude and longitude of its first pose.")
        return flight


def unpacked(archive: Path, folder: Path, filename: str, *, report: Progress) -> Path:
    """The bag in a ZIP archive: the folder with metadata.yaml, or the only bag there is. Names are taken, no paths."""
    with archives.opened(archive, filename) as packed:
        members, is_folder = _members(packed, filename)
        # A single bag gets a name of ours, which errors can replace by the operator's.
        own = f"{folder.name}{PurePosixPath(members[0].filename).suffix.lower()}"
        wanted = {archives.name_of(member) if is_folder else own: member for member in members}
        archives.unpack(packed, wanted, folder, filename, most_bytes=_MOST_BYTES, report=report)
    return folder if is_folder else folder / own


def _members(packed: zipfile.ZipFile, filename: str) -> tuple[list[zipfile.ZipInfo], bool]:
    """The files to unpack, and whether they are a folder of ROS 2. Raises BadRequestError."""
    files = [each for each in packed.infolist() if _is_file(each)]
    bags = [member for member in files if PurePosixPath(member.filename).suffix.lower() in _ENDINGS]
    heads = [member for member in files if archives.name_of(member) == METADATA]
    if len(heads) == 1:
        beside = PurePosixPath(heads[0].filename).parent
        wanted = [*heads, *(member for member in bags if PurePosixPath(member.filename).parent == beside)]
    elif not heads and len(bags) == 1:
        wanted = bags
    else:
        what = f"The archive holds {len(bags)} bag files and {len(heads)} {METADATA}: which bag is meant is not clear."
        raise BadRequestError(what, where=filename, advice="Pack one .bag, one .mcap, one .db3, or one bag's folder.")
    if len({archives.name_of(member) for member in wanted}) < len(wanted):
        raise zipfile.BadZipFile("two of its files have the same name")
    return wanted, bool(heads)


def _is_file(member: zipfile.ZipInfo) -> bool:
    return not member.is_dir() and "__MACOSX" not in member.filename and not archives.name_of(member).startswith(".")
