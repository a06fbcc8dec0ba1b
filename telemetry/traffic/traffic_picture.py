"""The traffic around one vehicle: messages in, status and warnings out. Knows neither sockets nor clocks."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import Aircraft, TrafficSettings, TrafficStatus
from telemetry.topics.vehicle import VehicleState
from telemetry.traffic.decoding import is_traffic, reports
from telemetry.traffic.joining import Joining
from telemetry.traffic.judging import judged, shown
from telemetry.traffic.memory import TrafficMemory
from telemetry.traffic.own import Own
from telemetry.traffic.report import Position, Report
from telemetry.traffic.warning import Warnings

EVERY_S = 1.0
MOST_TOLD, MOST_OWN_NUMBERS = 64, 8
_NO_POSITION = "Where the vehicle itself is, is not known: no traffic is held against it. Look out."


class TrafficTold(NamedTuple):
    status: TrafficStatus
    alerts: list[ObstacleAlert]


class TrafficPicture:
    """Begins to tell with the first aircraft that is heard of; from then on it also tells that there is none."""

    def __init__(self, settings: TrafficSettings | None = None) -> None:
        self._settings = settings or TrafficSettings()
        self._memory, self._joining, self._warnings = TrafficMemory(), Joining(), Warnings()
        self._own_names: dict[str, None] = {}
        """Under which the vehicle itself says it is told of."""
        self._has_heard = False
        self._told_s = -math.inf

    def on_settings(self, settings: TrafficSettings) -> None:
        self._settings = settings

    def on_message(self, message: Any, state: VehicleState, now_s: float) -> None:
        """Any message on the vehicle's link; all but those of traffic are left alone."""
        if not is_traffic(message):
            return
        is_autopilot = (message.get_srcSystem(), message.get_srcComponent()) == (state.system_id, state.component_id)
        own = Own.of(state, now_s)
        for report in reports(message):
            # An autopilot tells of itself in this message; what it hears of others it tells in the others.
            is_own = report.is_own or (is_autopilot and report.source == "utm")
            self._take(report, own, now_s, is_own=is_own)

    def on_tick(self, state: VehicleState, now_s: float, t_utc_s: float) -> TrafficTold | None:
        """At most once in ``EVERY_S``; None in between, and before anything was heard."""
        if not self._has_heard or now_s - self._told_s < EVERY_S:
            return None
        self._told_s = now_s
        self._memory.forget_gone(now_s)
        own = Own.of(state, now_s)
        numbers = self._own_numbers
        placed = [(each, each.position) for each in self._memory.aircraft.values()]
        around = [
            judged(each, at, own, self._settings, now_s, own_numbers=numbers) for each, at in placed if at is not None
        ]
        joined, same = self._joining.on_picture(tuple(it for it in around if it.trust != "own"))
        others = tuple(sorted(joined, key=_urgency))
        nose_deg = None if own is None or own.nose_rad is None else math.degrees(own.nose_rad)
        alerts = self._warnings.on_picture(others, nose_deg, now_s, t_utc_s, armed=state.armed, same=same)
        on_show = tuple(it for it in others if shown(it, self._settings))
        status = TrafficStatus(
            state="watching" if own is not None else "no_position",
            text="" if own is not None else _NO_POSITION,
            t_mono_s=now_s,
            t_utc_s=t_utc_s,
            heard=len(around),
            aircraft=on_show[:MOST_TOLD],
            hidden=max(0, len(on_show) - MOST_TOLD),
            filtered=len(others) - len(on_show),
            crowded_out=self._memory.crowded_out,
            settings=self._settings,
        )
        return TrafficTold(status, alerts)

    def _take(self, report: Report, own: Own | None, now_s: float, *, is_own: bool) -> None:
        self._has_heard = True
        if is_own and report.identity.name and len(self._own_names) < MOST_OWN_NUMBERS:
            self._own_names[report.identity.name] = None

        def distance_m(position: Position) -> float:
            return 0.0 if own is None else own.distance_m(position)

        heard = self._memory.take(report, distance_m, now_s)
        if heard is None:
            return
        heard.says_own = heard.says_own or is_own
        if report.position is not None and heard.move(report.position, now_s):
            heard.always_here = heard.always_here and own is not None and own.may_be_echo(report.position)

    @property
    def _own_numbers(self) -> frozenset[str]:
        """Keys and names under which the vehicle itself is told of, as it or the operator says."""
        settings = self._settings
        icao = f"adsb {settings.own_icao.lower()}" if settings.own_icao else ""
        return frozenset({*self._own_names, icao, settings.own_id} - {""})


def _urgency(it: Aircraft) -> tuple[bool, float]:
    return not it.conflict, math.inf if it.distance_m is None else it.distance_m
