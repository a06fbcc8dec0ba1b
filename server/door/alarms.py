"""What is wrong with the station itself: on every page, also on those that come later, until it is over."""

from __future__ import annotations

import time
from typing import Literal

from server.schemas import AlarmDoc, AlarmsMessage, ErrorDoc, Pages

Kind = Literal["disk", "audit", "certificate", "restart", "stations"]


class Alarms:
    """One of each kind at most. All methods belong to the event loop."""

    def __init__(self, pages: Pages) -> None:
        self._pages = pages
        self._alarms: dict[Kind, AlarmDoc] = {}

    @property
    def message(self) -> AlarmsMessage:
        return AlarmsMessage(alarms=list(self._alarms.values()))

    def begin(self, kind: Kind, error: ErrorDoc, *, level: Literal["warning", "error"] = "error") -> None:
        """What goes on keeps the time when it began."""
        before = self._alarms.get(kind)
        goes_on = before is not None and before.error.code == error.code
        began_utc_s = before.began_utc_s if before is not None and goes_on else time.time()
        self._set({**self._alarms, kind: AlarmDoc(kind=kind, level=level, began_utc_s=began_utc_s, error=error)})

    def end(self, kind: Kind) -> None:
        self._set({other: alarm for other, alarm in self._alarms.items() if other != kind})

    def _set(self, alarms: dict[Kind, AlarmDoc]) -> None:
        if alarms != self._alarms:
            self._alarms = alarms
            self._pages.publish(self.message)
