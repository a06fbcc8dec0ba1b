"""Gives the recording of a killed recorder the index that it lacks, so that any MCAP viewer opens it."""

from __future__ import annotations

import fcntl
import os
import shutil
from dataclasses import replace
from pathlib import Path

from telemetry.errors import RecordingError
from telemetry.recording.file_types import is_mcap, opened
from telemetry.recording.mcap_files.chunks import BROKEN, chunk_content, message_index, messages
from telemetry.recording.mcap_files.closing import ChunkPlace, Closing
from telemetry.recording.mcap_files.scan import Contents, read_contents
from telemetry.recording.mcap_files.sink import describe
from telemetry.recording.tlog import Data


def mend(path: Path) -> bool:
    """Cuts off the last, broken piece and writes the index. False when there was nothing to mend.

    The mended file takes the place of the other one at once: whoever is reading that goes on reading it.
    Raises RecordingError for files that hold nothing, are not Hedgehop's or cannot be written.
    """
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            tail = _tail(path)
            if tail is not None:
                _replace(path, *tail)
            return tail is not None
    except BlockingIOError:
        return False
    except OSError as error:
        raise describe(error, path) from error


def _replace(path: Path, keep: int, block: bytes) -> None:
    new = path.with_name(f".{path.name}.mending")
    try:
        shutil.copyfile(path, new)
        with new.open("r+b") as file:
            file.truncate(keep)
            file.seek(keep)
            file.write(block)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
    finally:
        new.unlink(missing_ok=True)


def _tail(path: Path) -> tuple[int, bytes] | None:
    """How many bytes are kept and what comes behind them; None for finished and foreign files."""
    with opened(path) as data:
        try:
            contents = read_contents(data) if is_mcap(data) else None
        except BROKEN:
            contents = None
        if contents is None or contents.finished or not contents.library.startswith("hedgehop"):
            return None
        if not contents.chunks:
            raise RecordingError("The recording holds no messages.", where=path.name, advice="It can be deleted.")
        keep, index, closing = begun(data, contents)
        return keep, index + closing.block(keep + len(index))


def begun(data: Data, contents: Contents) -> tuple[int, bytes, Closing]:
    """How many bytes of a file without an index are kept, what comes behind them, and the index of both.

    The last chunk's own index is written anew: a part of it may be missing.
    """
    closing = Closing()
    last = contents.chunks[-1]
    keep = last.offset + last.length
    closing.schemas, closing.channels = contents.schemas, contents.channels
    for chunk in contents.chunks[:-1]:
        closing.add_chunk(chunk, _counts(_entries(data, chunk)))
    entries = _entries(data, last)
    index, offsets = message_index(entries, keep)
    closing.add_chunk(replace(last, channels=offsets, index_length=len(index)), _counts(entries))
    for name, offset, length in contents.metadata_places:
        if offset < keep:
            closing.add_metadata(name, offset, length)
    for attachment in contents.attachments.values():
        if attachment.offset < keep:
            closing.add_attachment(attachment)
    return keep, index, closing


def _entries(data: Data, chunk: ChunkPlace) -> dict[int, list[tuple[int, int]]]:
    """(time, offset in the chunk) of every message by channel; none of a damaged chunk."""
    found: dict[int, list[tuple[int, int]]] = {}
    try:
        content = chunk_content(data, chunk)
    except BROKEN:
        return found
    for message in messages(content):
        found.setdefault(message.channel, []).append((message.t_ns, message.offset))
    return found


def _counts(entries: dict[int, list[tuple[int, int]]]) -> dict[int, int]:
    return {channel: len(places) for channel, places in entries.items()}
