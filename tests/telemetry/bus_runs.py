"""What tests of the bus share: running to the end within a bound, and a process that takes part."""

import asyncio
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import TypeVar

PATIENCE_S = 90.0
ROOT = Path(__file__).resolve().parents[2]
T = TypeVar("T")


@contextlib.contextmanager
def short_folder() -> Iterator[Path]:
    """pytest's own folders have paths that may be too long for sockets."""
    with tempfile.TemporaryDirectory(prefix="bus-", dir="/tmp") as folder:
        yield Path(folder)


def run(whole: Callable[[], Awaitable[T]], within_s: float = PATIENCE_S) -> T:
    return asyncio.run(bounded(whole, within_s))


async def bounded(whole: Callable[[], Awaitable[T]], within_s: float = PATIENCE_S) -> T:
    async with asyncio.timeout(within_s):
        return await whole()


class Participant:
    """``python -c BODY NAME FOLDER`` and what it has said so far, line by line."""

    def __init__(self, body: str, name: str, folder: Path) -> None:
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [sys.executable, "-c", body, name, folder],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        self._reading = threading.Thread(target=self._read)
        self._reading.start()

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()
        self._reading.join()
        assert self._process.stdout is not None
        self._process.stdout.close()

    async def says(self, *lines: str) -> None:
        """Waits until it has said all these lines, in any order."""
        while not set(lines) <= set(self.lines):
            assert self._process.poll() is None, "it has ended"
            await asyncio.sleep(0.02)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))
