"""Every command is on the disk and on the bus before it is sent."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from telemetry.errors import TelemetryError
from telemetry.messages import CommandRecord
from telemetry.requests import Operator

DISK_S = 1.0
"""A command that ends a flight well waits for the disk no longer than this."""


class Audit(Protocol):
    """``telemetry.mavlink.audit.AuditLog``: it waits for the disk."""

    def write(self, record: CommandRecord) -> object: ...


class Trail:
    """``say``: what the pilot is told when a command could not be written down and is sent all the same."""

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
