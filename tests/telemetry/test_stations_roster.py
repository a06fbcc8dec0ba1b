"""Stations over a bad network, with clocks of their own: ages are true within what is told, nothing is mixed up."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.stations.compared_clocks import Clocks
from telemetry.stations.other import GONE_S, LOST_S
from telemetry.stations.roster import Roster
from telemetry.stations.station_messages import BeaconWire, HeardWire, encode, vehicle_wire
from telemetry.stations.station_names import MOST_STATIONS, beacon_key, vehicle_key
from telemetry.stations.when_told import CHANGING_S, STILL_S, Telling
from telemetry.topics.station_vehicles import FleetVehicle, OtherVehicle

TICK_S = 0.1


def at(t_s: float, number: int = 1, **more: object) -> FleetVehicle:
    """A vehicle whose latitude tells when it was there, in true seconds."""
    placed = FleetVehicle(number, f"V{number}", position_t_mono_s=t_s, lat_deg=t_s / 1000.0, lon_deg=8.0)
    return FleetVehicle(**{**{n: getattr(placed, n) for n in placed.__dataclass_fields__}, **more})  # type: ignore[arg-type]


@dataclass
class Station:
    """Its monotonic clock is ``off_s`` from the true time, and its clock of the day ``utc_off_s``."""

    name: str
    off_s: float
    utc_off_s: float = 0.0
    run: int = 0
    vehicles: int = 2

    def __post_init__(self) -> None:
        self.restart(self.run or sum(map(ord, self.name)))

    def restart(self, run: int) -> None:
        self.run = run
        self.roster, self.telling = Roster(self.name, run), Telling(run)

    def said(self, true_s: float, *, beacon: bool) -> list[tuple[str, bytes]]:
        now_s, utc_s = true_s + self.off_s, true_s + 1e9 + self.utc_off_s
        own = []
        for number in range(1, self.vehicles + 1):
            own.append(at(true_s, number, position_t_mono_s=now_s))
        said = [(vehicle_key(self.name, n), encode(wire)) for n, wire in self.telling.due(own, now_s)]
        if beacon:
            said.append((beacon_key(self.name), encode(self.roster.beacon(2, now_s=now_s, now_utc_s=utc_s))))
        return said

    def hears(self, key: str, payload: bytes, true_s: float) -> None:
        self.roster.on_message(key, payload, now_s=true_s + self.off_s, now_utc_s=true_s + 1e9 + self.utc_off_s)

    def sees(self, true_s: float) -> tuple[OtherVehicle, ...]:
        return self.roster.vehicles(true_s + self.off_s)


@dataclass
class Net:
    """Delays every message anew, but never lets one overtake another of the same station, as TCP does not."""

    stations: list[Station]
    seed: int
    fastest_s: float = 0.02
    slowest_s: float = 0.6
    true_s: float = 100.0
    beacons: int = 0
    _under_way: list[tuple[float, Station, str, bytes]] = field(default_factory=list)
    _free_s: dict[tuple[str, str], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.drawn = random.Random(self.seed)

    def run(self, for_s: float) -> None:
        for _ in range(round(for_s / TICK_S)):
            self.true_s += TICK_S
            self.beacons += 1
            for sender in self.stations:
                for key, payload in sender.said(self.true_s, beacon=self.beacons % 10 == 0):
                    for other in self.stations:
                        if other is not sender:
                            self._send(sender, other, key, payload)
            arrived = sorted((m for m in self._under_way if m[0] <= self.true_s), key=lambda m: m[0])
            self._under_way = [m for m in self._under_way if m[0] > self.true_s]
            for came_s, other, key, payload in arrived:
                other.hears(key, payload, came_s)

    def _send(self, sender: Station, other: Station, key: str, payload: bytes) -> None:
        way = sender.name, other.name
        come_s = self.true_s + self.drawn.uniform(self.fastest_s, self.slowest_s)
        come_s = self._free_s[way] = max(come_s, self._free_s.get(way, 0.0) + 1e-6)
        self._under_way.append((come_s, other, key, payload))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**16), st.floats(-1e4, 1e4), st.floats(-50.0, 50.0))
def test_the_true_age_lies_within_what_is_told(seed: int, off_s: float, utc_off_s: float) -> None:
    here, there = Station("Alpha", 2e4), Station("Bravo", 2e4 + off_s, utc_off_s)
    net = Net([here, there], seed)
    net.run(8.0)
    seen = here.sees(net.true_s)
    assert len(seen) == 2
    for other in seen:
        assert other.it.lat_deg is not None
        was_there_s = 1000.0 * other.it.lat_deg + here.off_s
        assert other.oldest_t_mono_s is not None
        assert other.oldest_t_mono_s - 2e-3 <= was_there_s <= other.oldest_t_mono_s + other.unsure_s + 2e-3
    (bravo,) = here.roster.stations(net.true_s + here.off_s, net.true_s + 1e9)
    assert bravo.clock_ahead_s is not None
    assert bravo.clock_within_s is not None
    assert abs(bravo.clock_ahead_s - utc_off_s) <= bravo.clock_within_s + 2e-3
    assert bravo.hears_us
    assert ("The clock of Bravo" in bravo.text) == (abs(bravo.clock_ahead_s) - bravo.clock_within_s > 1.0)
    assert here.roster.refused == there.roster.refused == 0


def test_a_station_is_lost_at_once_and_its_vehicles_that_stood_go_after_a_time() -> None:
    here, there = Station("Alpha", 0.0), Station("Bravo", 5.0)
    net = Net([here, there], 1)
    net.run(5.0)
    net.stations = [here]
    net.run(LOST_S + 0.7)
    (bravo,) = here.roster.stations(net.true_s, net.true_s + 1e9)
    assert bravo.state == "lost"
    assert "is not heard since" in bravo.text
    assert "keep clear" in bravo.text
    assert len(here.sees(net.true_s)) == 2
    assert here.sees(net.true_s + GONE_S) == ()
    # It may have started since, however long ago that was.
    assert [station.state for station in here.roster.stations(net.true_s + 40_000.0, 0.0)] == ["lost"]


def test_a_vehicle_that_was_in_the_air_does_not_go() -> None:
    here = Roster("Alpha", 9)
    for number, in_air in ((1, True), (2, False)):
        wire = vehicle_wire(at(100.0, number, armed=in_air, in_air=in_air), run=1, count=1, now_mono_s=100.0)
        here.on_message(vehicle_key("Bravo", number), encode(wire), now_s=100.0, now_utc_s=0.0)
    assert [other.it.number for other in here.vehicles(100.0)] == [1, 2]
    assert [other.it.number for other in here.vehicles(40_000.0)] == [1]
    # Nor for others who come: there is no room for them, and that is said.
    for index in range(MOST_STATIONS):
        here.on_message(beacon_key(f"S{index}"), encode(BeaconWire(1, 1, 0, 0, 0, ())), now_s=4e4, now_utc_s=0.0)
    assert "Bravo" in [station.name for station in here.stations(4e4, 0.0)]
    assert "more than 32 stations" in here.leaves_out(4e4)


def test_a_station_that_is_not_understood_is_left_out_until_it_is() -> None:
    here, there = Roster("Alpha", 9), Station("Bravo", 0.0)
    here.on_message(vehicle_key("Bravo", 1), b"\x93 of another version", now_s=1.0, now_utc_s=0.0)
    assert here.stations(1.0, 0.0) == ()
    assert "Messages of Bravo cannot be understood" in here.leaves_out(5000.0)
    for key, payload in there.said(5000.0, beacon=True):
        here.on_message(key, payload, now_s=5000.0, now_utc_s=0.0)
    assert here.leaves_out(5000.0) == ""
    here.refuse_unread(3, 5000.0)
    assert "too long or too many" in here.leaves_out(5000.1)
    assert here.leaves_out(5060.0) == ""


def test_of_a_thousand_mutated_messages_none_is_taken_for_more_than_its_own_stations_word() -> None:
    """Bytes of true messages turned, cut, doubled and sent under their own name: no fault, nothing without bounds."""
    here, there, drawn = Roster("Alpha", 9), Station("Bravo", 0.0), random.Random(5)
    true = [message for second in range(4) for message in there.said(100.0 + second, beacon=True)]
    for _ in range(1000):
        key, payload = drawn.choice(true)
        mutated = bytearray(payload)
        for _ in range(drawn.randint(1, 4)):
            place = drawn.randrange(len(mutated))
            match drawn.randrange(3):
                case 0:
                    mutated[place] = drawn.randrange(256)
                case 1:
                    del mutated[place:]
                    mutated += payload[:1]
                case _:
                    mutated[place:place] = mutated[: drawn.randrange(40)]
        here.on_message(key, bytes(mutated), now_s=104.0, now_utc_s=0.0)
        told = here.stations(104.0, 1e9), here.vehicles(104.0)
        assert len(told[0]) <= 1
        for other in told[1]:
            assert other.it.lat_deg is None or -90.0 <= other.it.lat_deg <= 90.0
            assert other.oldest_t_mono_s is None or other.oldest_t_mono_s <= 104.0
            assert (other.it.name + other.it.mode + other.it.alarm + other.it.in_charge).isprintable()
    assert here.refused > 500


def test_a_station_that_starts_again_is_heard_at_once_with_a_new_clock() -> None:
    here, there = Station("Alpha", 0.0), Station("Bravo", 500.0)
    net = Net([here, there], 2)
    net.run(5.0)
    there.restart(77)
    there.off_s = -40.0
    net.run(5.0)
    for other in here.sees(net.true_s):
        assert other.it.lat_deg is not None
        assert other.oldest_t_mono_s is not None
        assert other.oldest_t_mono_s <= 1000.0 * other.it.lat_deg + 2e-3 <= net.true_s
    assert "Two stations" not in here.roster.stations(net.true_s, net.true_s)[0].text


def test_two_under_one_name_are_told_and_not_mixed() -> None:
    here, one, two = Station("Alpha", 0.0), Station("Bravo", 5.0, run=1), Station("Bravo", 9.0, run=2, vehicles=1)
    net = Net([here, one], 3)
    net.run(4.0)
    net.stations = [here, one, two]
    net.run(15.0)
    (bravo,) = here.roster.stations(net.true_s, net.true_s + 1e9)
    assert "Two stations call themselves Bravo" in bravo.text
    assert bravo.is_double
    assert [other.it.number for other in here.sees(net.true_s)] == [1]
    assert here.roster.refused > 10
    assert "calls itself Bravo, too" in one.roster.leaves_out(net.true_s + one.off_s)
    assert here.roster.leaves_out(net.true_s) == ""
    # Its silence is no proof that the first one has ended, however long it lasts.
    net.stations = [here, two]
    net.run(45.0)
    (bravo,) = here.roster.stations(net.true_s, net.true_s + 1e9)
    assert (bravo.is_double, bravo.is_new) == (True, False)
    # A third process, with which no other one speaks, is alone.
    two.restart(3)
    net.run(4.0)
    (bravo,) = here.roster.stations(net.true_s, net.true_s + 1e9)
    assert bravo.is_new
    net.run(32.0)
    (bravo,) = here.roster.stations(net.true_s, net.true_s + 1e9)
    assert (bravo.is_double, bravo.is_new, bravo.hears_us) == (False, False, True)


def test_what_came_before_is_refused() -> None:
    here, there = Station("Alpha", 0.0), Station("Bravo", 5.0)
    first = there.said(100.0, beacon=True)
    later = there.said(102.5, beacon=True)
    for key, payload in [*first, *later, *first, *later]:
        here.hears(key, payload, 102.6)
    assert here.roster.refused == len(first) + len(later)
    assert "a second time" in here.roster.refused_last
    assert here.sees(102.6)[0].it.lat_deg == pytest.approx(0.1025)


@pytest.mark.parametrize(
    ("back", "why"),
    [
        (HeardWire("Alpha", 9, 123, 1), "has not said lately"),
        (HeardWire("Alpha", 9, 100_000_000, 10**9), "cannot be true"),
        (HeardWire("Alpha", 9, 100_000_000, 0), "cannot be true"),
    ],
)
def test_an_exchange_that_cannot_be_true_compares_no_clocks(back: HeardWire, why: str) -> None:
    here = Roster("Alpha", 9)
    here.beacon(0, now_s=100.0, now_utc_s=0.0)
    lie = BeaconWire(1, 1, 500_000_000, 0, 0, (back,))
    here.on_message(beacon_key("Bravo"), encode(lie), now_s=100.2, now_utc_s=0.0)
    assert here.refused == 1
    assert why in here.refused_last
    assert all(station.round_trip_s is None for station in here.stations(100.2, 0.0))


def test_no_more_stations_are_kept_than_there_is_room_for() -> None:
    here = Roster("Alpha", 9)
    for index in range(MOST_STATIONS + 5):
        here.on_message(beacon_key(f"S{index}"), encode(BeaconWire(1, 1, 0, 0, 0, ())), now_s=1.0, now_utc_s=0.0)
    assert len(here.stations(1.0, 0.0)) == MOST_STATIONS
    assert here.refused == 5
    later = LOST_S + 1.1
    here.on_message(beacon_key("New"), encode(BeaconWire(1, 1, 0, 0, 0, ())), now_s=later, now_utc_s=0.0)
    assert "New" in [station.name for station in here.stations(later, 0.0)]


def test_one_that_does_not_hear_us_is_told() -> None:
    here, there = Roster("Alpha", 9), Station("Bravo", 0.0)
    for second in range(12):
        for key, payload in there.said(100.0 + second, beacon=True):
            here.on_message(key, payload, now_s=100.0 + second, now_utc_s=0.0)
    (bravo,) = here.stations(111.0, 0.0)
    assert not bravo.hears_us
    assert "does not hear this station" in bravo.text
    assert all(other.oldest_t_mono_s is None for other in here.vehicles(111.0))


def test_a_clock_that_stood_still_is_compared_anew() -> None:
    clocks = Clocks()
    assert clocks.on_exchange(left_s=10.0, came_there_s=510.1, left_there_s=510.2, came_s=10.3)
    found = clocks.now(10.3)
    assert found is not None
    assert found.theirs_less_ours_s == pytest.approx(500.0)
    assert found.within_s == pytest.approx(0.1, abs=1e-3)
    assert clocks.now(200.0) is None
    here, there = Station("Alpha", 0.0), Station("Bravo", 5.0)
    net = Net([here, there], 4)
    net.run(5.0)
    here.off_s -= 30.0  # it slept
    net.run(2.0)
    for other in here.sees(net.true_s):
        assert other.oldest_t_mono_s is None or other.oldest_t_mono_s <= net.true_s - 30.0


def test_words_that_come_late_are_told_with_when_they_were_sent() -> None:
    here, there = Station("Alpha", 0.0), Station("Bravo", 500.0)
    net = Net([here, there], 6, fastest_s=8.0, slowest_s=8.1)
    net.run(14.0)
    (bravo,) = here.roster.stations(net.true_s, 0.0)
    # An exchange takes two ways: before that nothing is compared, and nobody is known to hear us.
    assert (bravo.state, bravo.sent_t_mono_s, bravo.hears_us) == ("live", None, False)
    assert all(other.sent_t_mono_s is None for other in here.sees(net.true_s))
    net.run(20.0)
    (bravo,) = here.roster.stations(net.true_s, 0.0)
    assert (bravo.state, bravo.hears_us) == ("live", True)
    for sent_s in (bravo.sent_t_mono_s, *(other.sent_t_mono_s for other in here.sees(net.true_s))):
        assert sent_s is not None
        assert sent_s <= net.true_s - 8.0


def test_a_vehicle_that_stands_is_told_less_often() -> None:
    telling, told = Telling(1), []
    for tick in range(100):
        now_s = 50.0 + tick * TICK_S
        told.append(len(telling.due([at(50.0, position_t_mono_s=now_s)], now_s)))
    assert sum(told) == round(100 * TICK_S / STILL_S)
    moving = [len(telling.due([at(60.0 + tick)], 61.0 + tick * TICK_S)) for tick in range(100)]
    assert sum(moving) == round(100 * TICK_S / CHANGING_S)
    assert telling.due([at(1.0, 0), at(1.0, 33)], 500.0) == []
