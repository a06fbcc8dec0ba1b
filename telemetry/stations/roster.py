"""What other stations have told: nothing repeated, nothing mixed up, nothing without bounds, each at its age."""

from __future__ import annotations

import math
from collections import deque

from telemetry.errors import StationsError
from telemetry.stations.other import LOST_S, Other
from telemetry.stations.plan_lines import unpacked
from telemetry.stations.station_messages import (
    BEACON_BYTES,
    MOST_WANTS,
    VEHICLE_BYTES,
    BeaconWire,
    VehicleWire,
    WantWire,
    decode,
)
from telemetry.stations.station_names import MOST_STATIONS, Key, read_key
from telemetry.topics.station_vehicles import FleetLine, OtherStation, OtherVehicle

_BEACONS_KEPT = 128
MOST_LINES = 64
"""Of other stations' vehicles: what is more is not known, and taken to fly straight on."""
_LATELY_S = 30.0


class Roster:
    """Sans-IO. ``own``: this station's name; ``run``: of this process."""

    def __init__(self, own: str, run: int) -> None:
        self._own, self._run = own, run
        self._others: dict[str, Other] = {}
        self._beacons = 0
        self._sent_us: deque[int] = deque(maxlen=_BEACONS_KEPT)
        self._namesake_s = self._too_many_s = self._overflow_s = -math.inf
        self._not_understood: set[str] = set()
        self._wanted: set[int] = set()
        self.refused, self.refused_last = 0, ""

    def on_message(self, key: str, payload: bytes, *, now_s: float, now_utc_s: float) -> None:
        """What is refused is counted, with the reason of the last one."""
        try:
            self._take(key, payload, now_s, now_utc_s)
        except StationsError as error:
            self.refuse(error.what)

    def refuse_unread(self, times: int, now_s: float) -> None:
        """Whose they were is not known."""
        self._overflow_s = now_s
        self.refuse("Messages were too long, or under more names than are kept.", times)

    def refuse(self, why: str, times: int = 1) -> None:
        self.refused += times
        self.refused_last = why

    def beacon(self, vehicles: int, *, now_s: float, now_utc_s: float) -> BeaconWire:
        self._beacons += 1
        sent_us = round(now_s * 1e6)
        self._sent_us.append(sent_us)
        heard = [back for other in self._others.values() if (back := other.newest(now_s)) is not None]
        utc_ms = max(0, round(now_utc_s * 1000))
        return BeaconWire(
            self._run, self._beacons, sent_us, utc_ms, min(vehicles, 999), tuple(heard), self._wants(now_s)
        )

    def _wants(self, now_s: float) -> tuple[WantWire, ...]:
        """Not all at once, and not always the same: one that never comes keeps no other one away."""
        wants = [want for name in sorted(self._others) for want in self._others[name].wants(now_s)]
        from_here = self._beacons * MOST_WANTS % len(wants) if wants else 0
        return tuple((wants[from_here:] + wants[:from_here])[:MOST_WANTS])

    def take_wanted(self) -> set[int]:
        """Numbers of own vehicles whose line others have asked for since."""
        wanted, self._wanted = self._wanted, set()
        return wanted

    def lines(self) -> tuple[FleetLine, ...]:
        """Of vehicles in ``vehicles``, no more than are kept."""
        every = [line for name in sorted(self._others) for line in self._others[name].lines()]
        return tuple(every[:MOST_LINES])

    def stations(self, now_s: float, now_utc_s: float) -> tuple[OtherStation, ...]:
        return tuple(self._others[name].told(now_s, now_utc_s) for name in sorted(self._others))

    def live(self, now_s: float) -> set[str]:
        """Stations that are heard."""
        return {name for name, other in self._others.items() if now_s - other.heard_s < LOST_S}

    def vehicles(self, now_s: float) -> tuple[OtherVehicle, ...]:
        return tuple(each for name in sorted(self._others) for each in self._others[name].vehicles(now_s))

    def leaves_out(self, now_s: float) -> str:
        """Why stations that speak are not among these, and what to do; empty: none that is known of."""
        if now_s - self._namesake_s < _LATELY_S:
            return f"Another station calls itself {self._own}, too. Give one of them another name."
        if now_s - self._too_many_s < _LATELY_S:
            return f"There are more than {MOST_STATIONS} stations."
        if now_s - self._overflow_s < _LATELY_S:
            return "Messages are too long or too many to be heard. Give all stations the same version of Hedgehop."
        if self._not_understood:
            names = ", ".join(sorted(self._not_understood))
            return f"Messages of {names} cannot be understood. Give all stations the same version of Hedgehop."
        return ""

    def _take(self, text: str, payload: bytes, now_s: float, now_utc_s: float) -> None:
        key = read_key(text)
        if key is None:
            raise StationsError("A message came under a name that no station uses.")
        if key.is_line:
            self._take_line(key, payload)
            return
        message = self._read(key, payload, now_s)
        if key.station == self._own:
            if message.run != self._run:
                self._namesake_s = now_s
                raise StationsError(f"A message came from another station that calls itself {self._own}, too.")
            return
        other = self._others.get(key.station) or self._admitted(key, now_s)
        other.on_run(message.run, now_s)
        if isinstance(message, VehicleWire):
            other.on_vehicle(key.vehicle or 0, message, now_s, now_utc_s)
        else:
            back = next((heard for heard in message.heard if heard.station == self._own), None)
            mine = back is not None and back.run == self._run
            if back is not None and mine and back.sent_us not in self._sent_us:
                raise StationsError(f"{key.station} answers what this station has not said lately.")
            other.on_beacon(message, back if mine else None, now_s, now_utc_s)
            self._wanted.update(want.vehicle for want in message.wants if want.station == self._own)
            self._not_understood.discard(key.station)

    def _take_line(self, key: Key, payload: bytes) -> None:
        """Raises StationsError: malformed."""
        other = self._others.get(key.station)
        if key.station != self._own and other is not None:
            unpacked(payload)
            other.on_line(key.vehicle or 0, payload)

    def _read(self, key: Key, payload: bytes, now_s: float) -> VehicleWire | BeaconWire:
        """Of a station that is not understood it is not known whether it flies. Raises StationsError."""
        try:
            if key.vehicle is None:
                return decode(payload, BeaconWire, BEACON_BYTES)
            return decode(payload, VehicleWire, VEHICLE_BYTES)
        except StationsError:
            if key.station == self._own:
                self._namesake_s = now_s
            elif len(self._not_understood) < MOST_STATIONS:
                self._not_understood.add(key.station)
            raise

    def _admitted(self, key: Key, now_s: float) -> Other:
        if len(self._others) >= MOST_STATIONS:
            longest = max(self._others, key=lambda name: now_s - self._others[name].heard_s)
            if now_s - self._others[longest].heard_s < LOST_S or self._others[longest].was_flying:
                self._too_many_s = now_s
                raise StationsError(f"{key.station} is one station more than the {MOST_STATIONS} that are kept.")
            del self._others[longest]
        other = self._others[key.station] = Other(key.station, now_s)
        return other
