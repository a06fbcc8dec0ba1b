"""Other aircraft of one source, live or replayed, as the pages see them, and the settings that they are judged by."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import msgspec
from pydantic import ValidationError

from server.library.whole_files import write_atomically
from server.schemas import Pages, Source, TrafficMessage, TrafficSettingsBody
from telemetry.bus.bus import Bus
from telemetry.topics.messages import Topic
from telemetry.topics.traffic import TrafficSettings, TrafficStatus

FILE = "traffic.json"
DEAD_S = 3.0
"""The link tells once a second: what it said is no picture any more when it has been silent for longer."""


class TrafficWatch:
    """The latest status; one that nobody renews is not handed on."""

    def __init__(self, source: Source, pages: Pages, *, now_mono_s: Callable[[], float] = time.monotonic) -> None:
        self._source: Source = source
        self._pages, self._now_mono_s = pages, now_mono_s
        self._heard_mono_s = float("-inf")
        self._status: TrafficStatus | None = None
        self.settings = TrafficSettings()

    @property
    def status(self) -> TrafficStatus | None:
        """None also while the link is silent: aircraft are somewhere else by then."""
        is_old = self._source == "live" and self._now_mono_s() - self._heard_mono_s > DEAD_S
        return None if is_old else self._status

    def on_status(self, status: TrafficStatus) -> None:
        self._status, self._heard_mono_s = status, self._now_mono_s()
        self._tell()

    def on_settings(self, settings: TrafficSettings) -> None:
        self.settings = settings
        self._tell()

    def forget(self) -> None:
        """Another recording or vehicle, or none."""
        if self._status is not None:
            self._status = None
            self._tell()

    def _tell(self) -> None:
        self._pages.publish(
            TrafficMessage(
                source=self._source, now_mono_s=self._now_mono_s(), settings=self.settings, status=self._status
            )
        )


class TrafficDesk:
    """The settings of one vehicle's traffic: kept in its folder, given to its link."""

    def __init__(self, root: Path, bus: Bus, watch: TrafficWatch) -> None:
        self._root, self._bus, self._watch = root, bus, watch

    async def start(self) -> None:
        """The link gets them from the bus whenever it starts."""
        self._set(await asyncio.to_thread(read_settings, self._root))

    async def change_settings(self, body: TrafficSettingsBody) -> None:
        """What the body leaves out stays."""
        wanted = replace(self._watch.settings, **body.model_dump(exclude_none=True))
        self._set(wanted)
        await asyncio.to_thread(write_atomically, self._root / FILE, msgspec.json.encode(wanted))

    def _set(self, settings: TrafficSettings) -> None:
        self._watch.on_settings(settings)
        self._bus.publish(Topic.TRAFFIC_SETTINGS, settings)


def read_settings(root: Path) -> TrafficSettings:
    """The defaults when there are none; damaged ones cost no more than setting them again."""
    try:
        found = msgspec.json.decode((root / FILE).read_bytes(), type=TrafficSettings)
        TrafficSettingsBody(**asdict(found))
    except (OSError, msgspec.MsgspecError, ValidationError):
        return TrafficSettings()
    return found
