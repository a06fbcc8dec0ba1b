"""The audit log: one JSON line per command, on the disk before the command is sent, chained by hashes."""

from __future__ import annotations

import asyncio
import errno
import hashlib
import json
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from telemetry.errors import RecordingError, RecordingFullError, TelemetryError
from telemetry.topics.messages import CommandRecord
from telemetry.topics.requests import Operator

FIRST = "0" * 64
"""Stands for the line before the first one."""
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
AUTOPILOT = Operator("link", 0)
"""Who is named in the audit log for what the link does by itself."""
DISK_S = 1.0
"""A command that ends a flight well waits for the disk no longer than this."""


@dataclass(frozen=True, slots=True)
class Broken:
    """The first place where the chain does not hold; 1 is the first line."""

    line: int
    why: str


class AuditLog:
    """Appends to ``path``, which is made if it is missing. All calls wait for the disk: not for an event loop.

    ``broken`` tells what ``check_chain`` found when the file was opened; new lines follow the last one in any case.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
        try:
            content = path.read_bytes() if path.exists() else b""
            self._file = os.open(path, flags, 0o600)
        except OSError as error:
            raise _trouble(path, error) from error
        self.broken = check_chain(content)
        self._last = _last_hash(content)
        self._torn = bool(content) and not content.endswith(b"\n")

    def __enter__(self) -> AuditLog:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def write(self, record: CommandRecord) -> str:
        """Returns the line's hash when it is on the disk. Raises RecordingFullError; then do not send the command."""
        entry = {"t_utc_s": record.t_utc_s, "operator": record.operator, "words": record.words}
        line, hashed = _chained(entry, self._last)
        self._append((b"\n" if self._torn else b"") + line)
        self._last, self._torn = hashed, False
        return hashed

    def _append(self, data: bytes) -> None:
        """Whole or not at all: a full disk may take the first bytes of a line."""
        try:
            length = os.fstat(self._file).st_size
            try:
                written = 0
                while written < len(data):
                    written += os.write(self._file, data[written:])
                os.fsync(self._file)
            except OSError:
                os.ftruncate(self._file, length)
                raise
        except OSError as error:
            raise _trouble(self._path, error) from error


def check_chain(content: bytes) -> Broken | None:
    """Where the chain of an audit log's content is broken first; None: every line is as it was written."""
    before = FIRST
    for number, line in enumerate(content.splitlines(), start=1):
        entry = _parsed(line)
        if entry is None:
            return Broken(number, "The line is no entry; it may be cut short.")
        if entry.get("before") != before:
            return Broken(number, "The line does not follow the one before it: lines were changed, removed or added.")
        if entry.get("hash") != _hash(entry):
            return Broken(number, "The line was changed.")
        before = entry["hash"]
    return None


def _chained(entry: dict[str, Any], before: str) -> tuple[bytes, str]:
    linked = {**entry, "before": before}
    hashed = _hash(linked)
    return _as_json({**linked, "hash": hashed}) + b"\n", hashed


def _hash(entry: dict[str, Any]) -> str:
    return hashlib.sha256(_as_json({key: value for key, value in entry.items() if key != "hash"})).hexdigest()


def _as_json(entry: dict[str, Any]) -> bytes:
    # Escaped throughout: a line break in a name must not become a second line.
    return json.dumps(entry, sort_keys=True, ensure_ascii=True, separators=(",", ":")).encode()


def _parsed(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) else None


def _last_hash(content: bytes) -> str:
    """Of the last line that has one."""
    for line in reversed(content.splitlines()):
        entry = _parsed(line)
        if entry is not None and isinstance(entry.get("hash"), str):
            return entry["hash"]
    return FIRST


def _trouble(path: Path, error: OSError) -> RecordingError:
    if error.errno in _NO_SPACE:
        return RecordingFullError(
            "No space is left for the audit log, so the command was not sent.",
            where=path.name,
            advice="Free some space on the disk of the data folder.",
        )
    return RecordingError(
        f"The audit log cannot be written: {error.strerror}.",
        where=path.name,
        advice="Make the data folder writable; no command is sent without its entry.",
    )


class Audit(Protocol):
    """``AuditLog``: it waits for the disk."""

    def write(self, record: CommandRecord) -> object: ...


class CommandLog:
    """Every command is on the disk and on the bus before it is sent.

    ``say``: what the pilot is told when a command could not be written down and is sent all the same.
    """

    def __init__(
        self, audit: Audit | None, publish: Callable[[CommandRecord], None], say: Callable[[str], None]
    ) -> None:
        self._audit, self._publish, self._say = audit, publish, say
        self._disk = ThreadPoolExecutor(1, thread_name_prefix="audit")

    async def record(self, operator: Operator, words: str, *, must: bool = True) -> None:
        """Raises RecordingError, and nothing is to be sent then.

        ``must`` False: for what ends a flight well. A disk that is full or does not answer must not forbid that.
        """
        record = CommandRecord(time.time(), operator.name, words)
        self._publish(record)
        if self._audit is None:
            return
        writing = asyncio.get_running_loop().run_in_executor(self._disk, self._audit.write, record)
        try:
            async with asyncio.timeout(None if must else DISK_S):
                await writing
        except TimeoutError:
            self._say("The disk does not answer: the last command is not in the audit log.")
        except TelemetryError as error:
            if must:
                raise
            self._say(str(error))

    def close(self) -> None:
        self._disk.shutdown(wait=False, cancel_futures=True)
