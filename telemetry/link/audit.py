"""The audit log: one JSON line per command, on the disk before the command is sent, and one for what came of it."""

from __future__ import annotations

import asyncio
import errno
import os
import secrets
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol

from telemetry.errors import RecordingError, RecordingFullError, TelemetryError
from telemetry.link.audit_chain import FIRST, chained, check_file, log_id, parsed
from telemetry.link.keys import write_key_file
from telemetry.topics.messages import CommandRecord
from telemetry.topics.requests import Operator

AUDIT_FILE = "audit.jsonl"
KEY_BYTES = 32
END_BYTES = 1 << 16
"""The last line is shorter."""
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
AUTOPILOT = Operator("link", 0)
"""Who is named in the audit log for what the link does by itself."""
DISK_S = 1.0
"""A command that ends a flight well waits for the disk no longer than this."""


def open_audit(path: Path, key_file: Path) -> AuditLog:
    """With this machine's key, which is made if it is missing. A log from before it is set aside, and that is said."""
    try:
        key = key_file.read_bytes() if key_file.exists() else b""
        note = ""
        if len(key) != KEY_BYTES:
            if path.exists() and path.stat().st_size:
                aside = path.with_name(f"audit-until-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}.jsonl")
                os.replace(path, aside)
                note = f"This machine had no key for its audit log: the log until now stands in {aside.name}."
            key = secrets.token_bytes(KEY_BYTES)
            write_key_file(key_file, key)
    except OSError as error:
        raise _trouble(path, error) from error
    return AuditLog(path, key, note=note)


class AuditLog:
    """Appends to ``path``, which is made if it is missing. All calls wait for the disk: not for an event loop.

    ``head`` is the last line's hash; new lines follow it, whatever ``check`` finds. ``id``: the same as long as the key
    is. ``note``: to be told to people.
    """

    def __init__(self, path: Path, key: bytes = b"", *, note: str = "") -> None:
        self._path, self._key, self.note = path, key, note
        self.id = log_id(key)
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
        try:
            self._file = os.open(path, flags, 0o600)
            self._length = os.fstat(self._file).st_size
            end = os.pread(self._file, END_BYTES, max(0, self._length - END_BYTES))
        except OSError as error:
            raise _trouble(path, error) from error
        self.head = _last_hash(end)
        self._left = b"" if end.endswith(b"\n") else end.rpartition(b"\n")[2]
        """What a power cut has left of the last line."""

    def check(self) -> str:
        """What is wrong with what was there at the start, in words; nothing: every line is as it was written."""
        try:
            broken = check_file(self._path, self._key, self._length).broken
        except OSError as error:
            return f"The audit log cannot be read: {error.strerror}."
        if broken is None:
            return self.note
        return (
            f"The audit log is BROKEN at line {broken.line}. {broken.why} Keep a copy of {self._path.name} and of the "
            "recordings, and find out who could write to the data folder. hedgehop audit says more."
        )

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
        entry: dict[str, Any] = {"t_utc_s": record.t_utc_s, "operator": record.operator, "words": record.words}
        if record.result:
            entry["result"] = record.result
        if self._left and parsed(self._left) is None:
            entry["torn"] = len(self._left)
        line, hashed = chained(entry, self.head, self._key)
        self._append((b"\n" if self._left else b"") + line)
        self.head, self._left = hashed, b""
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


def _last_hash(content: bytes) -> str:
    """Of the last line that has one."""
    for line in reversed(content.splitlines()):
        entry = parsed(line)
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

    head: str
    id: str

    def check(self) -> str: ...
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
        self.trouble = ""
        """What is wrong with the log, in words."""

    @property
    def head(self) -> str:
        return "" if self._audit is None else self._audit.head

    @property
    def log_id(self) -> str:
        return "" if self._audit is None else self._audit.id

    async def check(self) -> None:
        """Of a log that may be long: beside what is written to it."""
        if self._audit is not None:
            self.trouble = await asyncio.to_thread(self._audit.check)

    async def settle(self, operator: Operator, words: str, result: str) -> None:
        """What came of a command that was written down."""
        await self._write(CommandRecord(time.time(), operator.name, words, result), must=False)

    async def record(self, operator: Operator, words: str, *, must: bool = True) -> None:
        """Raises RecordingError, and nothing is to be sent then.

        ``must`` False: for what ends a flight well. A disk that is full or does not answer must not forbid that.
        """
        record = CommandRecord(time.time(), operator.name, words)
        self._publish(record)
        await self._write(record, must=must)

    async def _write(self, record: CommandRecord, *, must: bool) -> None:
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
