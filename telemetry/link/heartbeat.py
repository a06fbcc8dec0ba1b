"""The ground station's heartbeat, and when it must fall silent so that the vehicle's own failsafe takes over."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.ways.quality import RateMeter
from telemetry.mavlink.actions import Message

PERIOD_S = 1.0
HOLD_S = 3.0
"""Time that a position hold is given before the heartbeat stops nevertheless."""


class Grace:
    """What follows when the server, and with it every operator's eye, is gone for longer than ``grace_s``."""

    def __init__(self, grace_s: float) -> None:
        self.grace_s = grace_s
        self._hold_asked_s: float | None = None

    def wants_hold(self, server_age_s: float | None, *, guided: bool, now_s: float) -> bool:
        """True once: a vehicle in GUIDED would fly on to a target that nobody watches."""
        if server_age_s is None or server_age_s <= self.grace_s:
            self._hold_asked_s = None
            return False
        if not guided or self._hold_asked_s is not None:
            return False
        self._hold_asked_s = now_s
        return True

    def may_beat(self, server_age_s: float | None, *, guided: bool, now_s: float) -> bool:
        """``server_age_s`` None: no server is expected."""
        if server_age_s is None or server_age_s <= self.grace_s:
            return True
        return guided and (self._hold_asked_s is None or now_s - self._hold_asked_s < HOLD_S)


def heartbeat() -> Message:
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )


class Heartbeat:
    """Beats once a second, and at once when asked, on its own task. ``send`` returns whether anyone was sent one."""

    def __init__(self, send: Callable[[Message], bool], may_beat: Callable[[], bool]) -> None:
        self._send, self._may_beat = send, may_beat
        self._meter = RateMeter()
        self._wanted = asyncio.Event()

    def beat_now(self) -> None:
        """A way to a vehicle is open that was not: after a restart of this node it has waited long enough."""
        self._wanted.set()

    def hz(self, now_s: float) -> float:
        return self._meter.hz(now_s)

    async def run(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            if self._may_beat() and self._send(heartbeat()):
                self._meter.count(loop.time())
            # After a pause of the whole process one beat follows, not all that were missed.
            due_s = max(due_s + PERIOD_S, loop.time())
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(due_s):  # wait_for of Python 3.11 may lose a cancellation
                    await self._wanted.wait()
                due_s = loop.time()
            self._wanted.clear()
