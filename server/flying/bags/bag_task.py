"""What a worker does with a bag of ROS: unpacks it where it is a ZIP archive, lists it, makes a recording of it."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from server.errors import BadRequestError, TooLargeError
from server.library.whole_files import storage_errors
from server.plan.file_tasks import named
from server.work.jobs import Progress
from telemetry.errors import TelemetryError

if TYPE_CHECKING:
    from telemetry.recording.ros.bag import BagTable
    from telemetry.recording.ros.bag_flight import BagAsked, BagFlight
    from telemetry.topics.obstacles import Sensor

METADATA = "metadata.yaml"
_ENDINGS = frozenset({".bag", ".db3", ".mcap"})
_MOST_MEMBERS = 10_000
_MOST_BYTES = 32 * 2**30
"""Of all files of an archive, unpacked."""
_PIECE_BYTES = 4 * 2**20
_ZIP_MAGIC = b"PK\x03\x04"


def list_uploaded(upload: Path, folder: Path, filename: str, *, report: Progress) -> tuple[Path, BagTable]:
    """Where the bag lies, and its topics; an archive is unpacked into ``folder``.

    Raises RecordingError, BadRequestError, TooLargeError, StorageError.
    """
    from telemetry.recording.ros.bag import list_bag

    bag = upload
    with upload.open("rb") as file:
        packed = file.read(4) == _ZIP_MAGIC
    if packed:
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
            what = "Nothing tells where on Earth it was recorded: it holds no NavSatFix."
            raise RecordingError(what, where=filename, advice="Give latitude and longitude of its first pose.")
        return flight


def unpacked(archive: Path, folder: Path, filename: str, *, report: Progress) -> Path:
    """The bag in a ZIP archive: the folder with metadata.yaml, or the only bag there is. Names are taken, no paths."""
    try:
        with zipfile.ZipFile(archive) as packed, storage_errors(folder):
            members, is_folder = _members(packed, filename)
            folder.mkdir(mode=0o700)
            total, done = max(1, sum(member.file_size for member in members)), 0
            # A single bag gets a name of ours, which errors can replace by the operator's.
            own = folder / f"{folder.name}{PurePosixPath(members[0].filename).suffix.lower()}"
            for member in members:
                target = folder / _name(member) if is_folder else own
                with packed.open(member) as source, target.open("xb") as out:
                    left = member.file_size
                    while piece := source.read(min(_PIECE_BYTES, left + 1)):
                        left, done = left - len(piece), done + len(piece)
                        if left < 0:
                            raise zipfile.BadZipFile("a file is longer than its directory says")
                        out.write(piece)
                        report("Unpacking", done / total)
            return folder if is_folder else own
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError) as error:
        what = f"The archive cannot be unpacked ({error})."
        raise BadRequestError(what, where=filename, advice="Pack it again, without a password.") from None


def _members(packed: zipfile.ZipFile, filename: str) -> tuple[list[zipfile.ZipInfo], bool]:
    """The files to unpack, and whether they are a folder of ROS 2. Raises BadRequestError, TooLargeError."""
    listed = packed.infolist()
    if len(listed) > _MOST_MEMBERS:
        raise TooLargeError(f"The archive holds {len(listed):,} files.", where=filename, advice="Pack the bag alone.")
    files = [m for m in listed if not m.is_dir() and "__MACOSX" not in m.filename and not _name(m).startswith(".")]
    bags = [member for member in files if PurePosixPath(member.filename).suffix.lower() in _ENDINGS]
    heads = [member for member in files if _name(member) == METADATA]
    if len(heads) == 1:
        beside = PurePosixPath(heads[0].filename).parent
        wanted = [*heads, *(member for member in bags if PurePosixPath(member.filename).parent == beside)]
    elif not heads and len(bags) == 1:
        wanted = bags
    else:
        what = f"The archive holds {len(bags)} bag files and {len(heads)} {METADATA}: which bag is meant is not clear."
        raise BadRequestError(what, where=filename, advice="Pack one .bag, one .mcap, one .db3, or one bag's folder.")
    if len({_name(member) for member in wanted}) < len(wanted):
        raise zipfile.BadZipFile("two of its files have the same name")
    if (size := sum(member.file_size for member in wanted)) > _MOST_BYTES:
        what = f"Unpacked it would be {size / 1e9:,.1f} GB; {_MOST_BYTES / 1e9:.0f} GB are the most."
        raise TooLargeError(what, where=filename, advice="Cut a shorter piece out of it.")
    return wanted, bool(heads)


def _name(member: zipfile.ZipInfo) -> str:
    return PurePosixPath(member.filename).name
