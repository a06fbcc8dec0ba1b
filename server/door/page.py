"""One browser page as the hub holds it: what waits to be sent to it, and whether it has to go."""

from __future__ import annotations

import asyncio
import secrets
import time
from functools import cached_property
from itertools import count

from server import schemas
from server.schemas.station_docs import FIRST_VEHICLE

WAITING_MAX = 256

CLOSE_POLICY, CLOSE_SIGNED_OUT, CLOSE_SLOW, CLOSE_GOING_AWAY, CLOSE_TRY_LATER = 1008, 4401, 4408, 1001, 1013


URGENT = (
    schemas.Snapshot,
    schemas.ActiveMessage,
    schemas.ClockMessage,
    schemas.VehicleMessage,
    schemas.LinkMessage,
    schemas.NodesMessage,
    schemas.LeaseMessage,
    schemas.MeMessage,
    schemas.FlightMessage,
    schemas.FlyMessage,
    schemas.TransferMessage,
    schemas.TextMessage,
    schemas.AlertMessage,
    schemas.NoticeMessage,
    schemas.AlarmsMessage,
    schemas.ObstaclesMessage,
    schemas.FleetMessage,
    schemas.StationsMessage,
)
"""What a flight is commanded by, and what warns: on a line that takes less than there is to say it goes first."""
FIRST = ("snapshot", "active")
"""What follows counts from these: nothing overtakes them."""
IN_A_ROW = 8
"""Urgent ones, while another one waits: that one does not wait for ever."""


class Outgoing:
    """A message on its way to several pages: written as JSON once, and only if some page gets it."""

    def __init__(self, message: schemas.ServerMessage) -> None:
        self._message = message

    @cached_property
    def text(self) -> str:
        return self._message.model_dump_json()


def key_of(message: schemas.ServerMessage) -> object | None:
    """Messages of the same key replace each other; None: each one must arrive."""
    match message:
        case schemas.NoticeMessage() | schemas.TextMessage() | schemas.AlertMessage() | schemas.AnsweredMessage():
            return None
        case schemas.JobMessage():
            return message.type, message.job.id
        case schemas.VehicleMessage() | schemas.FlightMessage() | schemas.ObstaclesMessage() | schemas.TracksMessage():
            return message.type, message.source
        case schemas.HealthMessage() | schemas.TrafficMessage():
            return message.type, message.source
        case schemas.PerceptionMessage():
            return message.type, message.source, message.sensor
        case schemas.TrackMessage():
            return message.type, message.track.source
    return message.type


def _is_urgent(message: schemas.ServerMessage) -> bool:
    return isinstance(message, URGENT) and getattr(message, "source", "live") == "live"


class Page:
    """One browser page: its queue, and the reason why it has to go once there is one."""

    def __init__(self, session_key: str, *, may_change: bool = True, before: Page | None = None) -> None:
        self.page_id = secrets.token_urlsafe(16) if before is None else before.page_id
        self.session_key, self.may_change = session_key, may_change
        self.view_over = asyncio.Event() if before is None else before.view_over
        """Its 3D view ends: later than its stream, which may come back."""
        self.vehicle = FIRST_VEHICLE
        """The number of the one that it shows and commands."""
        self.heard_mono_s = time.monotonic()
        self.gone = asyncio.Event()
        self.close_code = CLOSE_GOING_AWAY
        self._urgent: dict[object, Outgoing] = {}
        self._others: dict[object, Outgoing] = {}
        self._in_a_row = 0
        self._of_vehicle: set[object] = set()
        """Keys of what waits about that vehicle."""
        self._wake = asyncio.Event()
        self._numbers = count()

    def turn_to(self, vehicle: int) -> None:
        """What still waits about the one before would be taken for words about this one."""
        for key in self._of_vehicle:
            self._urgent.pop(key, None)
            self._others.pop(key, None)
        self._of_vehicle.clear()
        self.vehicle = vehicle

    def put(self, message: schemas.ServerMessage, outgoing: Outgoing, *, of_vehicle: bool = False) -> None:
        key = self._key(message)
        (self._urgent if _is_urgent(message) else self._others)[key] = outgoing
        if of_vehicle:
            self._of_vehicle.add(key)
        self._wake.set()
        if len(self._urgent) + len(self._others) > WAITING_MAX:
            self.cut_off(CLOSE_SLOW)

    def _key(self, message: schemas.ServerMessage) -> object:
        key = key_of(message)
        return (message.type, next(self._numbers)) if key is None else key

    async def next_text(self) -> str:
        while not (self._urgent or self._others):
            self._wake.clear()
            await self._wake.wait()
        waiting = self._next()
        key = next(iter(waiting))
        self._of_vehicle.discard(key)
        return waiting.pop(key).text

    def _next(self) -> dict[object, Outgoing]:
        """Where the next message is taken from."""
        may_wait = self._in_a_row < IN_A_ROW or any(key in self._urgent for key in FIRST)
        if self._urgent and (may_wait or not self._others):
            self._in_a_row += 1
            return self._urgent
        self._in_a_row = 0
        return self._others

    def cut_off(self, code: int) -> None:
        if not self.gone.is_set():
            self.close_code = code
            self.gone.set()
