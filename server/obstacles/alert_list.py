"""Alerts as an operator keeps them: latched until they are over AND acknowledged."""

from __future__ import annotations

from dataclasses import replace

from server.schemas import AlertDoc
from telemetry.topics.obstacles import AlertSource, ObstacleAlert

KEPT_MAX = 20
"""The oldest go first, those that are over before those that go on."""
UNHEARD_S = 5.0
"""A sensor's node tells every second what is still there: of one that has died nothing more is heard."""


class LatchedAlerts:
    """By id, in the order in which they began."""

    def __init__(self) -> None:
        self._docs: dict[str, AlertDoc] = {}
        self._heard_mono_s: dict[str, float] = {}

    @property
    def docs(self) -> list[AlertDoc]:
        """Newest first."""
        return list(reversed(self._docs.values()))

    def on_alert(self, alert: ObstacleAlert, now_mono_s: float) -> bool:
        """Whether it is one that was not there before. What ends without having begun here is not latched."""
        known = self._docs.get(alert.id)
        over = alert.phase == "ends"
        if known is None and over:
            return False
        if known is None:
            self._docs[alert.id] = AlertDoc(alert=alert, began_utc_s=alert.t_utc_s)
        else:
            # The last word of it says that it is over, not where it was.
            told = replace(alert, obstacle=alert.obstacle or known.alert.obstacle)
            self._docs[alert.id] = known.model_copy(update={"alert": told, "over": over})
        self._heard_mono_s[alert.id] = now_mono_s
        self._drop_done()
        return known is None

    def acknowledge(self, alert_id: str | None) -> None:
        """None: all of them. One that has gone meanwhile needs no word any more."""
        for each in [alert_id] if alert_id is not None else list(self._docs):
            if each in self._docs:
                self._docs[each] = self._docs[each].model_copy(update={"acknowledged": True})
        self._drop_done()

    def give_up(self, sensor: AlertSource, now_mono_s: float) -> tuple[str, ...]:
        """What a sensor's node has not told again counts as over: it has died, or been started anew. Their ids.

        Not what this server says of the node itself, or of avoidance.
        """
        silent = tuple(
            key
            for key, doc in self._docs.items()
            if doc.alert.sensor == sensor
            and doc.alert.kind not in ("sensor", "avoidance")
            and not doc.over
            and now_mono_s - self._heard_mono_s[key] > UNHEARD_S
        )
        for key in silent:
            self._docs[key] = self._docs[key].model_copy(update={"over": True})
        self._drop_done()
        return silent

    def clear(self) -> None:
        self._docs.clear()
        self._heard_mono_s.clear()

    def _drop_done(self) -> None:
        self._docs = {key: doc for key, doc in self._docs.items() if not (doc.over and doc.acknowledged)}
        while len(self._docs) > KEPT_MAX:
            oldest_over = next((key for key, doc in self._docs.items() if doc.over), None)
            del self._docs[oldest_over or next(iter(self._docs))]
        self._heard_mono_s = {key: at_s for key, at_s in self._heard_mono_s.items() if key in self._docs}
