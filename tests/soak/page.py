"""One operator's page, in a thread: whatever happens to the server it comes back, and it keeps all that it was told."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from tests.server.running import client

AGAIN_S = 0.3
KEPT = {"nodes", "link", "alarms", "text", "obstacles", "fly", "lease", "vehicle", "recorder"}


@dataclass(frozen=True, slots=True)
class Told:
    t_mono_s: float
    """When it was read."""
    message: dict[str, Any]

    @property
    def type(self) -> str:
        return self.message["type"]


class Page:
    """``told``: everything of the kinds that verdicts need, in order. ``connected``: there is a stream now.
    ``failed``: why it reads no more, which is no fault of the station's.
    """

    def __init__(self, port: int, sign_in: str) -> None:
        self.origin = f"http://127.0.0.1:{port}"
        self._port, self._ends = port, threading.Event()
        self.http = client(self.origin, timeout=60.0)
        self.http.get(sign_in)
        self.told: list[Told] = []
        self.connected, self.failed = False, ""
        self._reader = threading.Thread(target=self._read, name="page", daemon=True)
        self._reader.start()

    def post(self, path: str, **body: object) -> httpx.Response:
        return self.http.post(path, json=body)

    def since(self, t_mono_s: float, kind: str, until_s: float = float("inf")) -> Iterator[Told]:
        """What it was told of a kind, oldest first."""
        for each in list(self.told):
            if each.type == kind and t_mono_s <= each.t_mono_s <= until_s:
                yield each

    def until(self, wanted: Callable[[dict[str, Any]], bool], since_s: float, patience_s: float) -> Told | None:
        """The first one from ``since_s`` on, or None where it does not come in time."""
        give_up_s, looked = time.monotonic() + patience_s, 0
        while time.monotonic() < give_up_s:
            for each in self.told[looked:]:
                looked += 1
                if each.t_mono_s >= since_s and wanted(each.message):
                    return each
            time.sleep(0.05)
        return None

    def close(self) -> None:
        self._ends.set()
        self._reader.join(30)
        self.http.close()

    def _read(self) -> None:
        try:
            self._read_on()
        except Exception as error:
            self.failed = repr(error)

    def _read_on(self) -> None:
        while not self._ends.is_set():
            try:
                with self._open() as socket:
                    self.connected = True
                    self._follow(socket)
            except (OSError, WebSocketException, TimeoutError):
                self._ends.wait(AGAIN_S)
            finally:
                self.connected = False

    def _open(self) -> Connection:
        name = f"hedgehop-{self._port}"
        headers = {"Cookie": f"{name}={self.http.cookies[name]}"}
        address = f"ws://127.0.0.1:{self._port}/ws"
        return connect(
            address,
            origin=Origin(self.origin),
            additional_headers=headers,
            max_size=None,
            max_queue=None,
            open_timeout=5,
        )

    def _follow(self, socket: Connection) -> None:
        while not self._ends.is_set():
            try:
                message = json.loads(socket.recv(timeout=0.5))
            except TimeoutError:
                continue
            if message["type"] in KEPT:
                self.told.append(Told(time.monotonic(), message))
