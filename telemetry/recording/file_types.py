"""What kind of file something is, told by its first bytes: recordings are opened by content, never by name."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from telemetry.errors import RecordingError, RecordingUnreadableError
from telemetry.recording.tlog import Data

MCAP_MAGIC = b"\x89MCAP0\r\n"
_FOREIGN: tuple[tuple[bytes, str], ...] = (
    (b"II*\x00", "a TIFF image"),
    (b"MM\x00*", "a TIFF image"),
    (b"II+\x00", "a BigTIFF image"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PK\x03\x04", "a ZIP or KMZ archive"),
    (b"\x1f\x8b", "a compressed file (gzip)"),
    (b"#ROSBAG V2.0", "a ROS bag"),
    (b"SQLite format 3", "an SQLite database"),
    (b"%PDF", "a PDF document"),
    (b"\x7fELF", "a program"),
)
_ADVICE = "Choose a recording (.mcap), a ground station's log (.tlog) or a vehicle's own log (.bin, .ulg)."


@contextmanager
def opened(path: Path) -> Iterator[Data]:
    """The file's content without reading it all at once.

    Raises RecordingError for what is missing, no file or empty; RecordingUnreadableError.
    """
    try:
        if not path.is_file():
            raise RecordingError("There is no such recording.", where=path.name, advice="Choose another one.")
        if path.stat().st_size == 0:
            raise RecordingError("The file is empty.", where=path.name, advice="Choose another one.")
        with path.open("rb") as file:
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        what = f"The file cannot be read: {error.strerror or error}."
        raise RecordingUnreadableError(what, where=path.name, advice="Check its permissions and its disk.") from error
    with data:
        yield data


def is_mcap(data: Data) -> bool:
    return data[: len(MCAP_MAGIC)] == MCAP_MAGIC


def foreign(path: Path, data: Data) -> RecordingError:
    """The error that says what a file is that is no recording."""
    head = bytes(data[:4096])
    kind = next((name for magic, name in _FOREIGN if head.startswith(magic)), None)
    if kind is None and len(data) < len(MCAP_MAGIC) and MCAP_MAGIC.startswith(head):
        kind = "a recording cut off within its first bytes"
    if kind is None:
        kind = "text" if _is_text(head) else "of an unknown kind"
    return RecordingError(f"The file is not a recording, it is {kind}.", where=path.name, advice=_ADVICE)


def _is_text(head: bytes) -> bool:
    try:
        head[:-3].decode("utf-8")
    except UnicodeDecodeError:
        return False
    return not any(byte < 9 or 13 < byte < 32 for byte in head)
