"""The file of a recorder that was killed in flight, for the next one to go on with: a flight is one recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Header, Metadata

from planning import __version__
from telemetry.errors import RecordingError
from telemetry.recording.file_types import MCAP_MAGIC, is_mcap, opened
from telemetry.recording.mcap_files.chunks import BROKEN, records, stream_of
from telemetry.recording.mcap_files.closing import Closing
from telemetry.recording.mcap_files.mend import begun
from telemetry.recording.mcap_files.scan import read_contents
from telemetry.recording.tlog import Data

LIBRARY = f"hedgehop {__version__}"
ABOUT = "hedgehop"
"""Name of the first metadata: of what a recording is."""
WITHIN_S = 60.0
"""A flight whose recorder was gone for longer becomes two recordings."""
_CLOCKS_S = 1.0
"""Both clocks went on together since the file began, or the computer was started again, or its clock was set."""


@dataclass(frozen=True, slots=True)
class Unfinished:
    """``t_utc_s`` and ``t_mono_s``: when it was begun, on both clocks."""

    path: Path
    t_utc_s: float
    t_mono_s: float
    name: str
    by_hand: bool


@dataclass(frozen=True, slots=True)
class Begun:
    """What is kept of a file: the first ``keep`` bytes, behind them ``index``, in the end ``closing``."""

    keep: int
    index: bytes
    closing: Closing
    end_ns: int


def find_unfinished(folder: Path, *, t_utc_s: float, t_mono_s: float) -> Unfinished | None:
    """The recording that was being written until moments ago; reads its first bytes only."""
    changed = [(path.stat().st_mtime, path) for path in folder.glob("*.mcap") if path.is_file()]
    if not changed or not 0.0 <= t_utc_s - max(changed)[0] + _CLOCKS_S <= WITHIN_S:
        return None
    path = max(changed)[1]
    try:
        with opened(path) as data:
            about = _about(data)
        clocks = float(about["t_utc_s"]), float(about["t_mono_s"])
    except (RecordingError, KeyError, *BROKEN):
        return None
    if abs((t_utc_s - t_mono_s) - (clocks[0] - clocks[1])) > _CLOCKS_S:
        return None
    return Unfinished(path, *clocks, about.get("name", ""), about.get("by_hand") == "True")


def read_begun(path: Path) -> Begun:
    """Raises RecordingError for a file that cannot be gone on with."""
    with opened(path) as data:
        try:
            contents = read_contents(data)
            if contents.chunks and not contents.finished:
                return Begun(*begun(data, contents), contents.end_ns)
        except BROKEN:
            pass
    what = "The recording of the recorder before this one is damaged."
    raise RecordingError(what, where=path.name, advice="Another one is begun.")


def _about(data: Data) -> dict[str, str]:
    """Of an unfinished file of this version; empty for all others."""
    if not is_mcap(data) or data[-len(MCAP_MAGIC) :] == MCAP_MAGIC:
        return {}
    found = records(data, len(MCAP_MAGIC), len(data))
    header, first = next(found, None), next(found, None)
    if header is None or first is None or (header.opcode, first.opcode) != (Opcode.HEADER, Opcode.METADATA):
        return {}
    if Header.read(stream_of(data, header)).library != LIBRARY:
        return {}
    metadata = Metadata.read(stream_of(data, first))
    return metadata.metadata if metadata.name == ABOUT else {}
