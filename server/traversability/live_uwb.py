"""A UWB radar that scans now: its scans with their places, fused with the open model's map every few seconds."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

from mapping.sensor_frames import UwbScan
from mapping.uwb.uwb_params import UwbParams, in_words
from planning.errors import DescribedError
from server.errors import reported
from server.library import Library
from server.schemas import UwbLiveDoc
from server.traversability.traversability_desk import TraversabilityDesk
from telemetry.bus.bus import Bus
from telemetry.perception.uwb_drive import UwbDrive
from telemetry.sensors.uwb_log import write_uwb_log
from telemetry.topics.messages import Topic, VehicleText
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.uwb")

TICK_S = 1.0
SILENT_S = 2.0
"""Without a scan for so long the radar is said to be silent."""
AGAIN_S, REST = 5.0, 4.0
"""From one fusion to the next at least, and so many times as long as the last one took."""
RATE_OVER_S = 5.0
WARNING, INFO = 4, 6
"""MAV_SEVERITY"""


class LiveUwb:
    """All methods belong to the event loop."""

    def __init__(
        self,
        desk: TraversabilityDesk,
        library: Library,
        bus: Bus,
        *,
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._desk, self._library, self._bus, self._now = desk, library, bus, now_mono_s
        self.params = UwbParams()
        self._wanted = asyncio.Event()
        self._fresh()

    def _fresh(self) -> None:
        self._drive = UwbDrive()
        self._heard: deque[float] = deque()
        self._is_silent = False
        self._fused: tuple[object, ...] = ()
        """What the last fusion was made of: model, scans, parameters."""
        self._next_s = -math.inf
        self._problem = ""

    # What comes in

    def on_state(self, state: VehicleState) -> None:
        self._drive.on_state(state)

    def on_scan(self, scan: UwbScan) -> None:
        self._heard.append(self._now())
        self._drive.on_scan(scan)

    def set_params(self, params: UwbParams) -> None:
        """All scans so far are fused anew."""
        self.params = params
        self._next_s = -math.inf
        self.tick()

    def clear(self) -> None:
        """The next scan begins a new drive."""
        self._fresh()
        self.tick()

    # Life

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        return [self._beat(), self._fuse()]

    async def _beat(self) -> None:
        while True:
            self.tick()
            await asyncio.sleep(TICK_S)

    def tick(self) -> None:
        """Tells how the radar does, and wakes the fusion when it is due."""
        now_s = self._now()
        if self._heard:
            self._notice_silence(now_s)
        self._desk.tell_live(self._doc(now_s))
        if self._is_due(now_s):
            self._wanted.set()

    async def _fuse(self) -> None:
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            began_s = self._now()
            await self.fuse()
            self._next_s = self._now() + max(AGAIN_S, REST * (self._now() - began_s))

    async def fuse(self) -> None:
        """All scans so far into the open model's map; what stands against it is told with the radar's state."""
        drive, self._fused = self._drive, self._basis()
        scans, path = drive.scans(), self._library.new_upload(".npz")
        try:
            await asyncio.to_thread(write_uwb_log, path, scans)
            await self._desk.clear_live(path, f"{drive.source}, live", self.params)
            problem = ""
        except DescribedError as error:
            problem = error.what
        except Exception as error:
            problem = reported(error, log, "Fusing live scans").what
        finally:
            path.unlink(missing_ok=True)
        if drive is self._drive:
            self._problem = problem

    # How

    def _basis(self) -> tuple[object, ...]:
        return self._desk.open_terrain_id, len(self._drive), self.params

    def _is_due(self, now_s: float) -> bool:
        terrain_id, scans, _ = basis = self._basis()
        return bool(scans) and terrain_id is not None and now_s >= self._next_s and basis != self._fused

    def _notice_silence(self, now_s: float) -> None:
        silent_s = now_s - self._heard[-1]
        if (silent_s > SILENT_S) == self._is_silent:
            return
        self._is_silent = not self._is_silent
        words = f"No scans for {SILENT_S:g} s." if self._is_silent else "It scans again."
        severity = WARNING if self._is_silent else INFO
        # Among what the vehicle itself says.
        self._bus.publish(Topic.TEXT, VehicleText(time.time(), severity, f"{self._drive.source}: UWB radar: {words}"))

    def _doc(self, now_s: float) -> UwbLiveDoc:
        if not self._heard:
            return UwbLiveDoc()
        newest_s, drive = self._heard[-1], self._drive
        while len(self._heard) > 1 and self._heard[0] < now_s - RATE_OVER_S:
            self._heard.popleft()
        return UwbLiveDoc(
            state="silent" if self._is_silent else "live",
            source=drive.source,
            silent_s=round(now_s - newest_s) if self._is_silent else 0,
            scans=len(drive),
            per_s=0.0 if self._is_silent else round(len(self._heard) / RATE_OVER_S, 1),
            unplaced=drive.unplaced,
            other_geometry=drive.other_geometry,
            is_full=drive.is_full,
            problem=self._problem,
            rule=in_words(self.params),
        )
