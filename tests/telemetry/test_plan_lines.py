"""Lines that vehicles of other stations fly: bounded, back as they were, asked for until they come, never mixed."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import StationsError
from telemetry.stations.other import LOST_S
from telemetry.stations.plan_lines import LINE_BYTES, MOST_POINTS, ROUNDED_M, PlanLine, line_id, packed, unpacked
from telemetry.stations.roster import MOST_LINES, Roster
from telemetry.stations.station_messages import MOST_WANTS, BeaconWire, WantWire, encode, vehicle_wire
from telemetry.stations.station_names import MOST_VEHICLES, Key, beacon_key, line_key, read_key, vehicle_key
from telemetry.stations.when_told import LINE_AGAIN_S, LINE_BYTES_PER_S, LineTelling
from telemetry.topics.station_vehicles import FleetVehicle


def line(seed: int = 1, count: int = 20, **more: Any) -> PlanLine:
    drawn = np.random.default_rng(seed)
    lat_lon_deg = np.array([-47.0, 179.0]) + np.cumsum(drawn.normal(0.0, 1e-3, (count, 2)), axis=0)
    whole = PlanLine(lat_lon_deg, drawn.uniform(-50.0, 4000.0, count), np.cumsum(drawn.exponential(9.0, count)), 2.5)
    return replace(whole, **more)


@given(st.integers(0, 10_000), st.integers(2, MOST_POINTS))
def test_a_line_comes_back_within_what_its_rounding_is_told_as(seed: int, count: int) -> None:
    told = line(seed, count)
    payload = packed(told)
    heard = unpacked(payload)
    assert len(payload) <= LINE_BYTES
    assert np.abs(heard.lat_lon_deg - told.lat_lon_deg).max() <= 5.1e-8
    assert np.abs(heard.alt_amsl_m - told.alt_amsl_m).max() <= 0.0051
    assert np.abs(heard.t_s - told.t_s).max() <= 0.00051
    assert told.error_m + ROUNDED_M <= heard.error_m + 1e-9 <= told.error_m + ROUNDED_M + 0.011
    assert (packed(told), line_id(payload) > 0) == (payload, True)


def test_the_largest_line_fits() -> None:
    zigzag = np.resize([1.0, -1.0], MOST_POINTS)
    wide = PlanLine(
        np.column_stack([40.0 * zigzag, 45.0 * zigzag]), 40_000.0 * zigzag, np.arange(0.0, 9e4 * MOST_POINTS, 9e4), 9e4
    )
    assert len(packed(wide)) <= LINE_BYTES


@pytest.mark.parametrize(
    "odd",
    [
        line(count=MOST_POINTS + 1),
        line(count=1),
        line(lat_lon_deg=np.full((20, 2), np.nan)),
        line(alt_amsl_m=np.full(20, 2e5)),
        line(t_s=np.arange(20.0)[::-1]),
        line(lat_lon_deg=np.array([[47.0, 179.9], [47.0, -179.9]]), alt_amsl_m=np.zeros(2), t_s=np.arange(2.0)),
    ],
)
def test_what_cannot_be_told_is_refused(odd: PlanLine) -> None:
    with pytest.raises(StationsError):
        packed(odd)


@given(st.binary(max_size=300))
def test_noise_is_refused_and_nothing_else_happens(payload: bytes) -> None:
    with contextlib.suppress(StationsError):
        assert np.isfinite(unpacked(payload).lat_lon_deg).all()


@pytest.mark.parametrize(
    "wire",
    [
        [0, 890_000_000, 0, 0, 0, [[900_000_000, 0, 0, 0]]],
        [0, 0, 0, 9_000_000, 0, [[0, 0, 10**7, 0]]],
    ],
)
def test_a_line_that_leads_off_the_earth_is_refused(wire: list[Any]) -> None:
    with pytest.raises(StationsError, match="off the earth"):
        unpacked(msgspec.msgpack.encode(wire))


class Telling:
    """Bravo, which tells of vehicle 1 on a line."""

    def __init__(self, run: int = 3) -> None:
        self.run, self.count = run, 0

    def vehicle(self, payload: bytes | None, number: int = 1, now_s: float = 100.0) -> tuple[str, bytes]:
        self.count += 1
        on = FleetVehicle(number, "Bee", line=0 if payload is None else line_id(payload), line_s=1.5)
        return vehicle_key("Bravo", number), encode(vehicle_wire(on, run=self.run, count=self.count, now_mono_s=now_s))


def hear(roster: Roster, *messages: tuple[str, bytes], now_s: float = 100.0) -> None:
    for key, payload in messages:
        roster.on_message(key, payload, now_s=now_s, now_utc_s=0.0)


def wants(roster: Roster, now_s: float = 100.0) -> list[int]:
    return [want.vehicle for want in roster.beacon(0, now_s=now_s, now_utc_s=0.0).wants]


def test_a_line_is_asked_for_until_it_has_come_and_goes_with_the_plan() -> None:
    here, bravo = Roster("Alpha", 9), Telling()
    first, second = packed(line(1)), packed(line(2))
    hear(here, bravo.vehicle(first))
    assert (wants(here), here.lines()) == ([1], ())
    hear(here, (line_key("Bravo", 1), second))  # late, or another one's
    assert (wants(here), here.lines(), here.refused) == ([1], (), 0)
    hear(here, (line_key("Bravo", 1), first))
    assert (wants(here), [each.packed for each in here.lines()]) == ([], [first])
    (told,) = here.vehicles(100.0)
    assert (told.it.line, told.it.line_s) == (line_id(first), 1.5)
    # Another plan: the line of the one before is none any more.
    hear(here, bravo.vehicle(second))
    assert (wants(here), here.lines()) == ([1], ())
    hear(here, (line_key("Bravo", 1), second), bravo.vehicle(None))
    assert (wants(here), here.lines()) == ([], ())


def test_a_station_that_starts_again_with_another_plan_is_asked_anew() -> None:
    here, first, second = Roster("Alpha", 9), packed(line(1)), packed(line(2))
    hear(here, Telling(3).vehicle(first), (line_key("Bravo", 1), first))
    hear(here, Telling(4).vehicle(second))
    assert (wants(here), here.lines()) == ([1], ())
    # The same plan needs no second way.
    hear(here, Telling(5).vehicle(second), (line_key("Bravo", 1), second))
    hear(here, Telling(6).vehicle(second))
    assert (wants(here), len(here.lines())) == ([], 1)


def test_what_is_malformed_is_refused_and_a_lost_station_is_asked_nothing() -> None:
    here, bravo, payload = Roster("Alpha", 9), Telling(), packed(line())
    hear(here, bravo.vehicle(payload), (line_key("Bravo", 1), payload[:-1]), (line_key("Bravo", 1), b""))
    assert (here.refused, here.lines()) == (2, ())
    assert wants(here, 100.0 + LOST_S) == []
    # Nobody's whom nobody has heard of, nor one that comes back under this station's own name.
    hear(here, (line_key("Delta", 1), payload), (line_key("Alpha", 1), payload))
    assert ([station.name for station in here.stations(100.0, 0.0)], here.lines()) == (["Bravo"], ())


def test_of_many_lines_each_is_asked_for_in_its_turn_and_no_more_are_kept() -> None:
    here, bravo, payload = Roster("Alpha", 9), Telling(), packed(line())
    hear(here, *[bravo.vehicle(payload, number) for number in range(1, MOST_VEHICLES + 1)])
    asked = [wants(here) for _ in range(MOST_VEHICLES // MOST_WANTS)]
    assert sorted(number for each in asked for number in each) == list(range(1, MOST_VEHICLES + 1))
    for name in "ABC":
        for number in range(1, MOST_VEHICLES + 1):
            key, told = bravo.vehicle(payload, number)
            hear(here, (key.replace("Bravo", name), told), (line_key(name, number), payload))
    assert len(here.lines()) == MOST_LINES


def test_others_wants_are_heard_once_and_only_ones_own() -> None:
    here = Roster("Alpha", 9)
    asks = BeaconWire(1, 1, 0, 0, 0, (), (WantWire("Alpha", 2), WantWire("Charlie", 5)))
    hear(here, (beacon_key("Bravo"), encode(asks)))
    assert (here.take_wanted(), here.take_wanted()) == ({2}, set())


def test_lines_take_their_share_of_the_way_and_no_more() -> None:
    telling = LineTelling()
    lines = {number: packed(line(number, MOST_POINTS)) for number in range(1, 6)}
    sent, now_s = list[tuple[float, int, int]](), 100.0
    while now_s < 130.0:
        telling.want(range(1, 8))
        if (due := telling.due(lines, now_s)) is not None:
            sent.append((now_s, due[0], len(due[1])))
            assert due[1] == lines[due[0]]
        now_s += 0.1
    assert {number for _, number, _ in sent} == set(lines)
    assert sum(size for *_, size in sent) <= LINE_BYTES_PER_S * 30.0 + LINE_BYTES
    for number in lines:
        times_s = [t_s for t_s, each, _ in sent if each == number]
        assert (np.diff(times_s) >= LINE_AGAIN_S - 1e-6).all()


def test_another_plan_waits_for_its_share_alone() -> None:
    telling, first, second = LineTelling(), packed(line(1)), packed(line(2))
    for payload, now_s in ((first, 100.0), (second, 100.0 + LINE_BYTES / LINE_BYTES_PER_S)):
        telling.want([1])
        assert telling.due({1: payload}, now_s) == (1, payload)
    telling.want([1])
    assert telling.due({1: second}, now_s + LINE_AGAIN_S / 2) is None
    # Asked for once is answered once.
    assert telling.due({1: second}, now_s + 9.0) is None


def test_names_of_lines() -> None:
    assert read_key(line_key("Alpha-2", 12)) == Key("Alpha-2", 12, is_line=True)
    assert read_key("hedgehop/stations/1/Alpha/line/0") is None
    assert read_key("hedgehop/stations/1/Alpha/line") is None
