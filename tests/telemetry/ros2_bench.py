"""Robots and routers as processes of their own, and what was read of them, waited for and never slept for."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from telemetry.agent.client import Reading
from telemetry.agent.ros2_source import Ros2Asked, Ros2Source
from telemetry.ros2.zenoh_endpoint import zenoh_address

PATIENCE_S = 60.0


class Process:
    """One ``tests.telemetry.ros2_robot``."""

    def __init__(self, port: int, mode: str) -> None:
        command = [sys.executable, "-m", "tests.telemetry.ros2_robot", f"tcp/127.0.0.1:{port}", mode]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._answer() == "ready"

    def do(self, what: str, **fields: Any) -> Any:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": what, **fields}) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())

    def kill(self) -> None:
        self._process.kill()
        self._process.wait(PATIENCE_S)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):
                pipe.close()


@contextlib.contextmanager
def process(port: int, mode: str) -> Iterator[Process]:
    made = Process(port, mode)
    try:
        yield made
    finally:
        made.kill()


def wait_for(state: Callable[[], Any], what: str) -> Any:
    """Its first value that counts as true."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        if found := state():
            return found
        time.sleep(0.01)
    raise AssertionError(f"waited for {what}")


class Reader:
    """A source that is read through in a thread."""

    def __init__(self, asked: Ros2Asked, port: int, *, is_peer: bool) -> None:
        self.told: list[str] = []
        self.readings: list[Reading] = []
        self.error: BaseException | None = None
        self.source = Ros2Source(asked, zenoh_address(f"127.0.0.1:{port}", is_peer=is_peer), tell=self.told.append)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            for reading in self.source.readings():
                self.readings.append(reading)
        except BaseException as error:
            self.error = error

    def of(self, kind: type) -> list[Any]:
        return [each for each in self.readings if isinstance(each, kind)]

    def wait_told(self, words: str) -> str:
        return wait_for(lambda: next((each for each in self.told if words in each), None), words)

    def close(self) -> None:
        self.source.close()
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        if self.error is not None:
            raise self.error


@contextlib.contextmanager
def reading(asked: Ros2Asked, port: int, *, is_peer: bool = True) -> Iterator[Reader]:
    made = Reader(asked, port, is_peer=is_peer)
    try:
        yield made
    finally:
        made.close()
