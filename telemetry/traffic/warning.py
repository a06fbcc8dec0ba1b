"""Warnings of traffic: begun when an aircraft may come too near, told again while it may, over a while after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import Aircraft
from telemetry.traffic.sentences import ADVICE, clear_sentence, gone_sentence, same_sentence, traffic_sentence

CLEAR_S = 30.0
"""A warning is over when it has not been needed for so long: one that circles nearby comes back."""
DISARMED = "The vehicle is disarmed: traffic is shown, and not warned of."


@dataclass(frozen=True, slots=True)
class _Open:
    id: str
    needed_s: float
    """When it was last a conflict."""
    it: Aircraft
    """As last judged."""


class Warnings:
    """One for each aircraft at most."""

    def __init__(self) -> None:
        self._open: dict[str, _Open] = {}

    def on_picture(
        self,
        aircraft: tuple[Aircraft, ...],
        nose_deg: float | None,
        now_s: float,
        t_utc_s: float,
        *,
        armed: bool,
        same: Mapping[str, str] = MappingProxyType({}),
    ) -> list[ObstacleAlert]:
        """What is to be told now. Nothing is warned of while the vehicle is disarmed. ``same``: ``Joined.same``."""
        told: list[ObstacleAlert] = []
        there = {it.key: it for it in aircraft}

        def tell(at: _Open, phase: Literal["begins", "goes_on", "ends"], text: str) -> None:
            told.append(ObstacleAlert(at.id, "traffic", "traffic", phase, now_s, t_utc_s, now_s, text))

        for key, at in [(key, at) for key, at in self._open.items() if key in same]:
            del self._open[key]
            if same[key] in self._open:
                tell(at, "ends", same_sentence(at.it, there[same[key]]))
            else:
                self._open[same[key]] = at
        for key, at in list(self._open.items()):
            it = there.get(key)
            if it is None or not armed:
                del self._open[key]
                tell(at, "ends", gone_sentence(at.it) if armed else DISARMED)
                continue
            if not it.conflict and now_s - at.needed_s >= CLEAR_S:
                del self._open[key]
                tell(at, "ends", clear_sentence(it))
                continue
            self._open[key] = at = _Open(at.id, now_s if it.conflict else at.needed_s, it)
            tell(at, "goes_on", f"{traffic_sentence(it, nose_deg)}. {ADVICE}")
        for it in aircraft:
            if armed and it.conflict and it.key not in self._open:
                self._open[it.key] = at = _Open(f"traffic-{it.key}-{now_s:.1f}", now_s, it)
                tell(at, "begins", f"{traffic_sentence(it, nose_deg)}. {ADVICE}")
        return told
