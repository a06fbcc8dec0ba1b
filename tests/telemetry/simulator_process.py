"""Processes that tests of the simulated vehicle start and always end: the vehicle itself, other ground stations."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PATIENCE_S = 90.0
FAST = ("--speedup", "20", "--parameter", "LAND_SPEED=150", "--parameter", "LAND_ALT_LOW=200")
"""Quickly there and quickly down again."""
HOME = "-37.1244507,175.6892878,803.24"


class Child:
    """A running process whose output goes to a file."""

    def __init__(self, process: subprocess.Popen[bytes], log: Path) -> None:
        self.process = process
        self._log = log

    def output(self) -> str:
        return self._log.read_text(errors="replace")

    def wait_for(self, words: str, *, after: int = 0) -> int:
        """Place in the output behind the words; fails when the process ends or patience does before they come."""
        end_s = time.monotonic() + PATIENCE_S
        while (at := self.output().find(words, after)) < 0:
            assert self.process.poll() is None, f"ended without saying {words!r}:\n{self.output()}"
            assert time.monotonic() < end_s, f"never said {words!r}:\n{self.output()}"
            time.sleep(0.05)
        return at + len(words)

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()


@contextlib.contextmanager
def child(
    arguments: list[str], log: Path, *, typing: bool = False, environment: Mapping[str, str] | None = None
) -> Iterator[Child]:
    """``sys.executable`` with these arguments, from the project's folder."""
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env={**os.environ, **(environment or {})},
            stdin=subprocess.PIPE if typing else subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    try:
        yield Child(process, log)
    finally:
        end(process)


def end(process: subprocess.Popen[bytes]) -> int:
    """Exit code, after SIGTERM and if need be SIGKILL."""
    if process.stdin:
        with contextlib.suppress(OSError):
            process.stdin.close()
    process.terminate()
    try:
        return process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait(20)


@contextlib.contextmanager
def simulated_vehicle(folder: Path, *options: str, link: str = "tcpin:127.0.0.1:0") -> Iterator[tuple[Child, int]]:
    """The simulator's own process and the port that it took."""
    arguments = ["-m", "telemetry.nodes.simulator", "--link", link, f"--home={HOME}", *options]
    with child(arguments, folder / "vehicle.log") as vehicle:
        vehicle.wait_for("\n")
        yield vehicle, int(vehicle.output().split("\n")[0].rpartition(":")[2])


def wait_until(there: Callable[[], bool], what: str) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not there():
        assert time.monotonic() < end_s, f"not in time: {what}"
        time.sleep(0.02)
