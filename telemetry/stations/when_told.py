"""When each of one's own vehicles is told to the others: twice a second while it changes, else every two seconds."""

from __future__ import annotations

import math
from collections.abc import Iterable

from telemetry.stations.station_messages import VehicleWire, vehicle_wire
from telemetry.stations.station_names import MOST_VEHICLES
from telemetry.topics.station_vehicles import FleetVehicle

CHANGING_S, STILL_S = 0.5, 2.0
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
    )


def _step(value: float | None, size: float) -> int | None:
    return None if value is None or not math.isfinite(value) else round(value / size)
