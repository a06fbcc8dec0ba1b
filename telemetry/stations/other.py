"""One other station: its newest words, its vehicles, and how its clock stands to ours."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from telemetry.errors import StationsError
from telemetry.stations.compared_clocks import DRIFT, Clocks
from telemetry.stations.plan_lines import line_id
from telemetry.stations.station_messages import BeaconWire, HeardWire, VehicleWire, WantWire, vehicle_of
from telemetry.topics.station_vehicles import FleetLine, OtherStation, OtherVehicle

LOST_S = 4.0
"""It sends once a second and more; a packet that is lost costs a second at most."""
GONE_S = 300.0
"""A vehicle that stood and was not heard for so long is no longer told of."""
CLOCKS_PART_S = 1.0
_ANSWERS_S = 10.0
"""It should have said by then that it hears us."""
_LEFTOVER_S = 10.0
"""Messages of a process that was replaced may be under way for so long; later ones come from a second one."""
_TWICE_S = 30.0
_RUNS_KEPT = 8


@dataclass(slots=True)
class _Heard:
    wire: VehicleWire
    came_s: float
    left: tuple[float, float, float] | None = None
    """When it was sent, on our clock; None: the clocks were not compared yet."""


class Other:
    def __init__(self, name: str, now_s: float) -> None:
        self._name = name
        self._since_s = self.heard_s = now_s
        self._heard_utc_s = 0.0
        self._run: int | None = None
        self._runs_before: deque[int] = deque(maxlen=_RUNS_KEPT)
        self._replaced_s = self._twice_s = self._hears_us_s = float("-inf")
        self._beacon: BeaconWire | None = None
        self._beacon_came_s = 0.0
        self._double_run: int | None = None
        self._utc_less_mono_s = 0.0
        self._clocks = Clocks()
        self._vehicles: dict[int, _Heard] = {}
        self._lines: dict[int, bytes] = {}

    @property
    def was_flying(self) -> bool:
        """A vehicle of it was in the air when it was last heard of."""
        return any(heard.wire.flags & 2 for heard in self._vehicles.values())

    def newest(self, now_s: float) -> HeardWire | None:
        """Of its beacons, for an answer; None: there is none from this moment."""
        beacon = self._beacon
        if beacon is None or now_s - self._beacon_came_s >= LOST_S:
            return None
        return HeardWire(self._name, beacon.run, beacon.sent_us, round(self._beacon_came_s * 1e6))

    def on_run(self, run: int, now_s: float) -> None:
        """Another process speaks for it: its clock and its counts begin anew. Raises StationsError."""
        if run == self._run:
            return
        if run in self._runs_before:
            if now_s - self._replaced_s > _LEFTOVER_S:
                self._twice_s, self._double_run = now_s, self._run
            raise StationsError(f"A message came from a process of {self._name} that another one has replaced.")
        if self._run is not None:
            self._runs_before.append(self._run)
            self._replaced_s = now_s
        self._run, self._beacon, self._hears_us_s = run, None, float("-inf")
        self._vehicles.clear()
        self._clocks.forget()

    def on_vehicle(self, number: int, wire: VehicleWire, now_s: float, now_utc_s: float) -> None:
        """Raises StationsError: it came before."""
        before = self._vehicles.get(number)
        if before is not None and wire.count <= before.wire.count:
            raise StationsError(f"A message about vehicle {number} of {self._name} came a second time, or too late.")
        self._vehicles[number] = _Heard(wire, now_s)
        self.heard_s, self._heard_utc_s = now_s, now_utc_s

    def on_beacon(self, wire: BeaconWire, back: HeardWire | None, now_s: float, now_utc_s: float) -> None:
        """``back``: what it tells of one of our own beacons. Raises StationsError: it came before."""
        if self._beacon is not None and wire.count <= self._beacon.count:
            raise StationsError(f"A beacon of {self._name} came a second time, or too late.")
        self._beacon, self._beacon_came_s = wire, now_s
        self._utc_less_mono_s = wire.utc_ms / 1e3 - wire.sent_us / 1e6
        self.heard_s, self._heard_utc_s = now_s, now_utc_s
        if back is None:
            return
        stamps = {"left_s": back.sent_us / 1e6, "came_there_s": back.came_us / 1e6, "left_there_s": wire.sent_us / 1e6}
        if not self._clocks.on_exchange(**stamps, came_s=now_s):
            raise StationsError(f"The times that {self._name} tells of an exchange cannot be true.")
        self._hears_us_s = now_s

    def on_line(self, number: int, payload: bytes) -> None:
        """One of a plan that has changed meanwhile is late, and no fault."""
        if self._told_line(number) == line_id(payload):
            self._lines[number] = payload

    def wants(self, now_s: float) -> list[WantWire]:
        """Lines of which it tells and that have not come."""
        if now_s - self.heard_s >= LOST_S:
            return []
        have = {line.number for line in self.lines()}
        return [
            WantWire(self._name, number)
            for number in sorted(self._vehicles)
            if self._told_line(number) and number not in have
        ]

    def lines(self) -> list[FleetLine]:
        """Those that its vehicles fly now."""
        self._lines = {
            number: payload for number, payload in self._lines.items() if self._told_line(number) == line_id(payload)
        }
        return [FleetLine(self._name, number, payload) for number, payload in sorted(self._lines.items())]

    def _told_line(self, number: int) -> int:
        heard = self._vehicles.get(number)
        return 0 if heard is None else heard.wire.line

    def told(self, now_s: float, now_utc_s: float) -> OtherStation:
        compared = self._clocks.now(now_s)
        ahead_s = within_s = round_trip_s = None
        if compared is not None and self._beacon is not None:
            ahead_s = self._utc_less_mono_s + compared.theirs_less_ours_s - (now_utc_s - now_s)
            within_s, round_trip_s = compared.within_s, compared.round_trip_s
        is_lost = now_s - self.heard_s >= LOST_S
        hears_us = now_s - self._hears_us_s < _ANSWERS_S
        return OtherStation(
            name=self._name,
            state="lost" if is_lost else "live",
            heard_t_mono_s=self.heard_s,
            heard_utc_s=self._heard_utc_s,
            vehicles=len(self._vehicles) if self._beacon is None else self._beacon.vehicles,
            round_trip_s=round_trip_s,
            clock_ahead_s=ahead_s,
            clock_within_s=within_s,
            hears_us=hears_us and not is_lost,
            sent_t_mono_s=self._beacon_sent_s(now_s),
            is_new=now_s - self._replaced_s < _LEFTOVER_S + 1.0,
            is_double=now_s - self._twice_s < _TWICE_S or (self._run is not None and self._run == self._double_run),
            text=" ".join(self._words(now_s, is_lost, hears_us, ahead_s, within_s or 0.0)),
        )

    def vehicles(self, now_s: float) -> list[OtherVehicle]:
        gone = [number for number, heard in self._vehicles.items() if now_s - heard.came_s > GONE_S]
        for number in gone:
            if not self._vehicles[number].wire.flags & 2:
                del self._vehicles[number]
        return [self._vehicle(number, now_s) for number in sorted(self._vehicles)]

    def _vehicle(self, number: int, now_s: float) -> OtherVehicle:
        heard = self._vehicles[number]
        if heard.left is None:
            heard.left = self._left(heard.wire.sent_us, heard.came_s, now_s)
        run, left, age_s = self._run or 0, heard.left, (heard.wire.age_ms or 0) / 1e3
        sent_s = None if left is None else left[0]
        if heard.wire.age_ms is None:
            it = vehicle_of(heard.wire, number, None)
            return OtherVehicle(self._name, it, None, heard.came_s, sent_t_mono_s=sent_s, run=run)
        if left is None:
            it = vehicle_of(heard.wire, number, heard.came_s - age_s)
            return OtherVehicle(self._name, it, None, heard.came_s, run=run)
        oldest_s, likely_s, youngest_s = left
        it = vehicle_of(heard.wire, number, likely_s - age_s)
        return OtherVehicle(self._name, it, oldest_s - age_s, heard.came_s, youngest_s - oldest_s, sent_s, run)

    def _beacon_sent_s(self, now_s: float) -> float | None:
        """At the earliest."""
        left = None if self._beacon is None else self._left(self._beacon.sent_us, self._beacon_came_s, now_s)
        return None if left is None else left[0]

    def _left(self, sent_us: int, came_s: float, now_s: float) -> tuple[float, float, float] | None:
        """When it was sent, on our clock: at the earliest, likely, and at the latest."""
        compared = self._clocks.now(now_s)
        if compared is None:
            return None
        within_s = compared.within_s + DRIFT * (now_s - came_s)
        left_s = sent_us / 1e6 - compared.theirs_less_ours_s
        if left_s > came_s + within_s:  # nothing comes before it was sent: one of the clocks stood still
            self._clocks.forget()
            return None
        earliest_s, likely_s, latest_s = (min(came_s, left_s + off_s) for off_s in (-within_s, 0.0, within_s))
        return earliest_s, likely_s, latest_s

    def _words(
        self, now_s: float, is_lost: bool, hears_us: bool, ahead_s: float | None, within_s: float
    ) -> Iterator[str]:
        if is_lost:
            at = datetime.fromtimestamp(self._heard_utc_s, UTC)
            yield (
                f"{self._name} is not heard since {at:%H:%M:%S} UTC. Its vehicles may be anywhere by now: "
                "keep clear of where they flew, and call its pilot."
            )
            return
        if now_s - self._twice_s < _TWICE_S:
            yield f"Two stations call themselves {self._name}: only one of them is shown. Give one another name."
        if not hears_us and now_s - self._since_s > _ANSWERS_S:
            yield f"{self._name} does not hear this station: see that its name and certificate are its own."
        if ahead_s is not None and abs(ahead_s) - within_s > CLOCKS_PART_S:
            way = "ahead of" if ahead_s > 0 else "behind"
            yield f"The clock of {self._name} is {abs(ahead_s):.1f} s {way} ours; ages here are true. Set both clocks."
