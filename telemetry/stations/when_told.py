"""When each of one's own vehicles is told to the others: twice a second while it changes, else every two seconds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from telemetry.stations.station_messages import VehicleWire, vehicle_wire
from telemetry.stations.station_names import MOST_VEHICLES
from telemetry.topics.station_vehicles import FleetVehicle

CHANGING_S, STILL_S = 0.5, 2.0
LINE_BYTES_PER_S, LINE_AGAIN_S = 3000.0, 4.0
"""A tenth of a line of 256 kbit/s for all vehicles' lines together; the same one is sent no sooner again."""
_SLACK_S = 0.02
"""Who looks ten times a second looks a little early or late."""


class Telling:
    """Sans-IO; one for the life of a process."""

    def __init__(self, run: int) -> None:
        self._run = run
        self._told: dict[int, tuple[float, object]] = {}
        self._counts: dict[int, int] = {}

    def due(self, vehicles: Iterable[FleetVehicle], now_s: float) -> list[tuple[int, VehicleWire]]:
        """Number and message of each vehicle that is to be told now."""
        messages = list[tuple[int, VehicleWire]]()
        for each in vehicles:
            if not 1 <= each.number <= MOST_VEHICLES:
                continue
            told_s, before = self._told.get(each.number, (-math.inf, None))
            looks = _coarse(each)
            wait_s = STILL_S if looks == before else CHANGING_S
            if now_s - told_s < wait_s - _SLACK_S:
                continue
            self._told[each.number] = now_s, looks
            count = self._counts[each.number] = self._counts.get(each.number, 0) + 1
            messages.append((each.number, vehicle_wire(each, run=self._run, count=count, now_mono_s=now_s)))
        return messages


def _coarse(of: FleetVehicle) -> object:
    """What counts as a change: noise of a vehicle that stands does not."""
    return (
        _step(of.lat_deg, 1e-5),
        _step(of.lon_deg, 1e-5),
        _step(of.alt_amsl_m, 1.0),
        _step(of.alt_rel_home_m, 1.0),
        None if of.v_enu_m_s is None else tuple(_step(v, 0.5) for v in of.v_enu_m_s),
        of.mode,
        of.phase,
        of.in_charge,
        of.in_charge_silent,
        of.armed,
        of.in_air,
        of.link,
        of.plan,
        of.alarm,
        of.name,
        of.line,
        of.line_s is None,
    )


class LineTelling:
    """Lines that somebody wants, one after the other: they share the way with positions, and these come first."""

    def __init__(self) -> None:
        self._wanted: dict[int, None] = {}
        self._sent: dict[int, tuple[float, bytes]] = {}
        self._free_s = -math.inf

    def want(self, numbers: Iterable[int]) -> None:
        self._wanted.update(dict.fromkeys(numbers))

    def due(self, lines: Mapping[int, bytes], now_s: float) -> tuple[int, bytes] | None:
        """Number and line of the vehicle whose line is to be sent now."""
        if now_s < self._free_s:
            return None
        for number in list(self._wanted):
            del self._wanted[number]
            sent_s, before = self._sent.get(number, (-math.inf, b""))
            line = lines.get(number)
            # What was sent to all a moment ago is still under way to who wants it, too.
            if line is None or (line == before and now_s - sent_s < LINE_AGAIN_S):
                continue
            self._sent[number] = now_s, line
            self._free_s = now_s + len(line) / LINE_BYTES_PER_S
            return number, line
        return None


def _step(value: float | None, size: float) -> int | None:
    return None if value is None or not math.isfinite(value) else round(value / size)
