"""Vehicles of other stations: held apart at the worse end of their age, shown with it, and never taken for clear."""

from __future__ import annotations

import asyncio
import random
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg
from server.flying.apart.nearness import (
    NEAR_M,
    OVER_M,
    RADIUS_M,
    VEER_SHARE,
    Flown,
    Nearness,
    found_elsewhere,
    near_each_other,
)
from server.flying.apart.other_stations import COUNTS_S, FASTEST_M_S, OLD_S, Meeting, OtherStations
from server.flying.apart.other_vehicles import OtherVehicles, row_against
from server.flying.apart.others_heard import NODE_SILENT_S
from server.flying.apart.own_told import fleet_vehicle
from server.heard.plan_follower import Ahead
from server.schemas import StationsMessage, VehicleAlarm, VehicleDoc
from server.stations import Other
from telemetry.topics.messages import FlightStatus, LinkStatus
from telemetry.topics.station_vehicles import FleetVehicle, OtherStation, OtherVehicle, StationsStatus
from telemetry.topics.vehicle import VehicleState

HOME = 47.0, 8.0
NOW_S = 1000.0


def other(
    east_m: float = 0.0,
    *,
    age_s: float | None = 0.5,
    unsure_s: float = 0.0,
    number: int = 1,
    east_m_s: float | None = 0.0,
    **more: Any,
) -> OtherVehicle:
    """``age_s`` None: the clocks were not compared, and it came just now."""
    lat_deg, lon_deg = moved_deg(HOME, east_m, 0.0)
    was_s = NOW_S - (age_s or 0.0)
    it = FleetVehicle(
        number, "Wasp", armed=True, in_air=True, position_t_mono_s=was_s, lat_deg=lat_deg, lon_deg=lon_deg,
        alt_amsl_m=500.0, v_enu_m_s=None if east_m_s is None else (east_m_s, 0.0, 0.0),
    )  # fmt: skip
    sent_s = None if age_s is None else NOW_S
    return OtherVehicle("Bravo", replace(it, **more), None if age_s is None else was_s, NOW_S, unsure_s, sent_s)


def heard(station: OtherStation, *vehicles: OtherVehicle) -> StationsStatus:
    """For a minute now."""
    return StationsStatus(
        NOW_S,
        "Alpha",
        "connected",
        listens_since_t_mono_s=NOW_S - 60.0,
        stations=(station,),
        vehicles=vehicles,
    )


class Desk:
    """The desk, what it published, and what its node has told."""

    def __init__(self, *vehicles: OtherVehicle, **more: Any) -> None:
        self.now_s, self.published = NOW_S, list[StationsMessage]()
        hub: Any = SimpleNamespace(publish=self.published.append)
        none: Any = None
        meeting = Meeting(("tls/router:7447",), Path("Alpha.pem"), Path("fetched"))
        self.it = OtherStations(meeting, none, none, hub, lambda: [], now_mono_s=lambda: self.now_s)
        self.tell(*vehicles, **more)

    def tell(self, *vehicles: OtherVehicle, state: Any = "live", **more: Any) -> None:
        is_live = state == "live"
        station = OtherStation(
            "Bravo",
            state,
            NOW_S,
            0.0,
            len(vehicles),
            hears_us=is_live,
            sent_t_mono_s=NOW_S,
            text="" if is_live else "Lost.",
        )
        self.it.on_status(replace(heard(station, *vehicles), **more))

    def near_m(self) -> float:
        """Between a vehicle that hovers at home and the first of the others, as it is judged."""
        hovers = VehicleState(1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=HOME[0], lon_deg=HOME[1])
        found = near_each_other(
            Flown("Bee", replace(hovers, alt_amsl_m=500.0), None), self.it.flown(self.now_s)[0], self.now_s
        )
        assert found is not None
        return found.distance_m


def test_it_is_held_apart_at_the_worse_end_of_its_age_and_speed() -> None:
    assert Desk(other(100.0)).near_m() == pytest.approx(100.0 - 2 * RADIUS_M, abs=0.1)
    # It came from there: what it may have moved since the earliest and the latest moment counts.
    away = Desk(other(100.0, east_m_s=10.0)).near_m()
    unsure = Desk(other(100.0, east_m_s=10.0, unsure_s=2.0)).near_m()
    assert unsure == pytest.approx(away - 20.0, abs=0.5)
    old = Desk(other(100.0, east_m_s=10.0, age_s=10.0)).near_m()
    new = Desk(other(200.0, east_m_s=10.0, age_s=0.0)).near_m()
    wider_m = 10.0 * 10.0 * VEER_SHARE + FASTEST_M_S * (10.0 - OLD_S)
    assert wider_m <= new - old <= wider_m + 6.0
    # Towards: where it is by now, not where it was.
    assert Desk(other(100.0, east_m_s=-10.0, age_s=8.0)).near_m() == 0.0
    # Of one that tells no speed, or whose clock was not compared, more has to be taken.
    assert Desk(other(300.0, east_m_s=None)).near_m() == 0.0
    assert Desk(other(200.0, east_m_s=10.0, age_s=None)).near_m() < Desk(other(200.0, east_m_s=10.0)).near_m() - 20.0
    assert Desk(other(200.0, east_m_s=-10.0, age_s=None)).near_m() == 0.0


def test_at_an_unknown_height_it_is_at_ours() -> None:
    assert Desk(other(40.0, alt_amsl_m=900.0)).near_m() > 300.0
    assert Desk(other(40.0, alt_amsl_m=None)).near_m() == pytest.approx(40.0 - 2 * RADIUS_M, abs=0.1)


@settings(deadline=None)
@example(-425.0, 0.0, 0.25, None, 0.0)  # it drifts: slower than what counts as flying on
@given(*[st.floats(-2000.0, 2000.0)] * 2, *[st.none() | st.floats(-25.0, 25.0)] * 2, st.floats(0.0, 4.0))
def test_what_is_not_heard_any_more_stands_anywhere_around_its_last_place(
    east_m: float, age_s: float, east_m_s: float | None, alt_m: float | None, unsure_s: float
) -> None:
    age_s = age_s % COUNTS_S
    desk = Desk(other(east_m, age_s=age_s, east_m_s=east_m_s, unsure_s=unsure_s, alt_amsl_m=alt_m and 500.0 + alt_m))
    desk.now_s = NOW_S - age_s + COUNTS_S - 0.01
    before_m = desk.near_m()
    desk.now_s += 0.02
    after_m = desk.near_m()
    assert desk.it.flown(desk.now_s)[0].is_silent
    assert after_m <= before_m + 0.5
    # It does not come to an end, and is not everywhere.
    desk.now_s += 1e5
    assert desk.near_m() == pytest.approx(after_m, abs=0.1)
    assert Desk(other(20_000.0, age_s=500.0)).near_m() > 15_000.0


def test_what_is_not_heard_any_more_is_said_so() -> None:
    desk = Desk(other(age_s=COUNTS_S + 1.0))
    (doc,) = desk.it.message().stations[0].vehicles
    assert "may be anywhere" in doc.text
    desk = Desk(other(lat_deg=None, position_t_mono_s=None))
    (doc,) = desk.it.message().stations[0].vehicles
    assert "where is not known" in doc.text
    assert doc.is_old
    assert doc.age_s is None
    assert desk.it.flown(NOW_S) == []
    desk.tell(other(in_air=False, age_s=500.0))
    assert desk.it.message().stations[0].vehicles[0].text == ""


@pytest.mark.parametrize(
    "now",
    [
        pytest.param({"stations": ()}, id="the node has started again"),
        pytest.param({}, id="the other station has, with fewer vehicles"),
        pytest.param({"told": other(lat_deg=None, in_air=False, armed=False, link="none")}, id="and knows no place"),
        pytest.param({"told": other(lat_deg=None, link="live")}, id="it is in the air, and nobody knows where"),
    ],
)
def test_what_was_seen_to_fly_does_not_vanish(now: dict[str, Any]) -> None:
    desk, told = Desk(other(30.0)), now.pop("told", None)
    desk.tell(*([] if told is None else [told]), **now)
    desk.tell(*([] if told is None else [told]), **now)
    desk.now_s += 1000.0
    (still,) = desk.it.flown(desk.now_s)
    assert still.is_silent
    assert desk.near_m() == 0.0
    assert desk.it.row().state == "accept"
    (bravo,) = desk.it.message().stations
    assert "may be anywhere" in bravo.vehicles[0].text
    # On the ground, and heard: it is over.
    desk.now_s = NOW_S
    desk.tell(other(in_air=False, lat_deg=None, link="live"))
    assert desk.it.flown(NOW_S) == []
    assert desk.it.row().state == "good"


def test_pages_are_told_ages_and_at_once_when_a_station_is_lost() -> None:
    desk = Desk(other(age_s=0.5), other(age_s=OLD_S + 1.0, number=2))
    fresh, old = desk.it.message().stations[0].vehicles
    assert (fresh.age_s, fresh.is_old, old.is_old) == (pytest.approx(0.5), False, True)
    before = len(desk.published)
    desk.tell(other(), state="lost")
    assert [message.stations[0].text for message in desk.published[before:]] == ["Lost."]
    # The node itself says nothing any more: all of it is in doubt.
    desk.now_s += NODE_SILENT_S + 0.1
    message = desk.it.message()
    assert (message.router, message.stations[0].state) == ("lost", "lost")
    assert "stations node does not answer" in message.text


def test_both_alarms_name_the_other_station_and_only_ours_can_be_held() -> None:
    channel: Any = SimpleNamespace(
        state=VehicleState(1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=47.0, lon_deg=8.0, alt_amsl_m=500.0),
        in_air=True,
        flight=None,
        ahead=lambda: None,
        led_ahead=lambda: None,
    )
    desk = Desk(other(2 * RADIUS_M + NEAR_M - 1.0))
    nearness = Nearness({1: ("Bee", channel)}, elsewhere=desk.it.flown, now_mono_s=lambda: NOW_S)
    asyncio.run(nearness.look())
    assert nearness.alarms.keys() == {1}
    alarm = nearness.alarms[1]
    assert alarm.text.startswith("Bee and Wasp (Bravo 1) may come within 4 m of each other now.")
    assert "call the other station" in alarm.text
    assert alarm.key == "near 1 Bravo 1"
    # Seen once is seen: another name makes no other alarm.
    desk.tell(other(2 * RADIUS_M + NEAR_M - 1.0, name="Hornet"))
    asyncio.run(nearness.look())
    assert nearness.alarms[1].text.startswith("Bee and Hornet (Bravo 1)")
    assert nearness.alarms[1].key == "near 1 Bravo 1"
    desk.tell(other(60.0))
    asyncio.run(nearness.look())
    assert nearness.alarms == {}


def _own_pair(desk: Desk) -> Nearness:
    """Two of this station's that fly at each other, 20 m apart."""

    def channel(east_m: float, east_m_s: float) -> Any:
        lat_deg, lon_deg = moved_deg(HOME, east_m, 0.0)
        state = VehicleState(
            1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=lat_deg, lon_deg=lon_deg, alt_amsl_m=500.0,
            v_east_m_s=east_m_s, v_north_m_s=0.0, v_down_m_s=0.0,
        )  # fmt: skip
        return SimpleNamespace(state=state, in_air=True, flight=None, ahead=lambda: None, led_ahead=lambda: None)

    channels = {1: ("Bee", channel(0.0, 5.0)), 2: ("Fly", channel(20.0, -5.0))}
    return Nearness(channels, elsewhere=desk.it.flown, now_mono_s=lambda: NOW_S)


@pytest.mark.parametrize(
    "others",
    [
        pytest.param((other(10.0),), id="between them"),
        pytest.param((other(350.0, age_s=29.0),), id="may be there"),
        pytest.param((other(300.0, age_s=COUNTS_S + 10.0),), id="not heard any more"),
        pytest.param((other(350.0, within_m=200.0),), id="its place is vague"),
    ],
)
def test_what_others_tell_hides_no_alarm_between_ones_own(others: tuple[OtherVehicle, ...]) -> None:
    nearness = _own_pair(Desk(*others))
    asyncio.run(nearness.look())
    assert [alarm.key for alarm in nearness.alarms.values()] == ["near 1 2", "near 1 2"]
    assert nearness.alarms[1].text.startswith("Bee and Fly may come within 0 m")
    assert "Wasp (Bravo 1)" in nearness.alarms[1].text


def test_alarms_between_ones_own_wait_for_no_other_station() -> None:
    desk, told = Desk(other(10.0)), list[str]()

    def elsewhere(now_s: float) -> list[Flown]:
        told.extend(alarm.key for alarm in nearness.alarms.values())
        return desk.it.flown(now_s)

    nearness = _own_pair(desk)
    nearness._elsewhere = elsewhere
    asyncio.run(nearness.look())
    assert told == ["near 1 2", "near 1 2"]


def test_a_station_of_which_the_node_no_longer_tells_is_lost_with_words() -> None:
    desk = Desk(other())
    desk.tell(stations=())
    (bravo,) = desk.it.message().stations
    assert (bravo.state, [vehicle.name for vehicle in bravo.vehicles]) == ("lost", ["Wasp"])
    assert "keep clear of where they flew" in bravo.text
    assert "Bravo is not heard" in desk.it.row().text


def test_an_alarm_does_not_end_because_the_other_one_is_not_heard_any_more() -> None:
    state = VehicleState(1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=47.0, lon_deg=8.0, alt_amsl_m=500.0)
    channel: Any = SimpleNamespace(state=state, in_air=True, flight=None, ahead=lambda: None, led_ahead=lambda: None)
    desk = Desk(other(10.0))
    nearness = Nearness({1: ("Bee", channel)}, elsewhere=desk.it.flown, now_mono_s=lambda: desk.now_s)
    asyncio.run(nearness.look())
    first = nearness.alarms[1]
    desk.tell(other(10.0), state="lost", router="lost")
    desk.now_s += 3600.0
    channel.state = replace(state, position_t_mono_s=desk.now_s)
    asyncio.run(nearness.look())
    assert nearness.alarms[1].text.startswith("Wasp (Bravo 1) is not heard any more, and may be where Bee flies. Hold")
    assert nearness.alarms[1].key != first.key
    # Nor does it hide one that is there.
    now = replace(other(9.0, number=2), oldest_t_mono_s=desk.now_s, heard_t_mono_s=desk.now_s)
    desk.tell(other(10.0), replace(now, it=replace(now.it, position_t_mono_s=desk.now_s)))
    asyncio.run(nearness.look())
    assert nearness.alarms[1].text.startswith("Bee and Wasp (Bravo 2) may come within 3 m of each other now.")
    desk.tell(other(10.0), other(in_air=False, number=2), state="lost")
    # Far from where it was: no alarm.
    channel.state = replace(channel.state, lon_deg=8.1)
    asyncio.run(nearness.look())
    assert nearness.alarms == {}


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_the_glance_at_distances_leaves_no_alarm_out(seed: int) -> None:
    drawn = random.Random(seed)
    own = {number: _anywhere(drawn, f"{number}") for number in (1, 2)}
    others = {name: _anywhere(drawn, name) for name in "abcdef"}
    found = found_elsewhere(own, NOW_S, others)
    for one, other_one in product(own, others):
        whole = near_each_other(own[one], others[other_one], NOW_S)
        if whole is not None and whole.distance_m < OVER_M:
            assert found[one, other_one] == whole


def _anywhere(drawn: random.Random, name: str) -> Flown:
    spread_m = drawn.choice([100.0, 1000.0, 5000.0])
    lat_deg, lon_deg = moved_deg((drawn.choice([0.0, 47.0, 70.0]), 179.999), *(drawn.gauss(0, spread_m) for _ in "xy"))
    state = VehicleState(
        1, 1, lat_deg=lat_deg, lon_deg=lon_deg, position_t_mono_s=NOW_S - drawn.expovariate(0.2),
        alt_amsl_m=drawn.choice([None, 500.0]), horizontal_accuracy_m=drawn.choice([None, 40.0]),
        v_east_m_s=drawn.gauss(0, 9), v_north_m_s=drawn.gauss(0, 9), v_down_m_s=drawn.gauss(0, 2),
    )  # fmt: skip
    if drawn.random() < 0.5:
        return Flown(name, state, None, drawn.choice([0.0, 300.0]))
    steps = np.cumsum([[drawn.gauss(0, 3e-4), drawn.gauss(0, 3e-4)] for _ in range(8)], axis=0)
    t_s = np.arange(1.0, 9.0) * drawn.choice([2.0, 30.0])
    ahead = Ahead(lat_lon_deg=np.array([lat_deg, lon_deg]) + steps, alt_rel_home_m=np.full(8, 20.0), t_s=t_s)
    return Flown(name, replace(state, home_alt_amsl_m=drawn.choice([None, 480.0])), ahead)


def test_the_row_of_the_check_holds_what_both_say() -> None:
    waits = Other(Flown("Bee", VehicleState(1, 1), None), flies=False, on_board=None)
    alone, told = row_against(waits, [], NOW_S), list[Any]()
    desk = Desk(other(in_air=False))
    rows = OtherVehicles({1: lambda: waits}, {1: told.append}, elsewhere=desk.it.row, now_mono_s=lambda: NOW_S)
    asyncio.run(rows.look())
    assert told[-1].state == "good"
    assert alone.text in told[-1].text
    assert "that is heard" in told[-1].text
    desk.tell(other())
    asyncio.run(rows.look())
    assert (told[-1].state, told[-1].mend) == ("accept", "Agree with whoever flies there.")


def test_own_vehicles_are_told_as_they_are_known() -> None:
    doc = VehicleDoc(
        number=2,
        name="Bee",
        holder="Anna",
        phase="flying",
        link="live",
        plan_name="Ridge",
        alarm=VehicleAlarm(kind="loss", key="", text="Lost."),
    )
    state = VehicleState(
        1, 1, mode="AUTO", armed=True, position_t_mono_s=9.0, lat_deg=47.0, lon_deg=8.0, alt_rel_home_m=30.0,
        v_north_m_s=3.0, v_east_m_s=4.0, v_down_m_s=-1.0,
    )  # fmt: skip
    follow = SimpleNamespace(progress=0.4, height_above_dsm_m=12.0)
    channel: Any = SimpleNamespace(state=state, follow=follow, in_air=True, battery="63 %", flight=FlightStatus("auto"))
    told = fleet_vehicle(doc, channel, LinkStatus(0.0, quality=0.9), in_charge_silent=True)
    assert (told.in_charge, told.in_charge_silent, told.phase) == ("Anna", True, "flying")
    assert (told.plan, told.plan_share, told.alt_surface_m, told.battery) == ("Ridge", 0.4, 12.0, "63 %")
    assert told.v_enu_m_s == (4.0, 3.0, 1.0)
    assert (told.link_quality, told.alarm, told.position_t_mono_s) == (0.9, "Lost.", 9.0)
    channel.flight = FlightStatus("guided", "flying")
    assert fleet_vehicle(doc, channel, None).plan == ""
    channel.in_air, channel.state = False, replace(state, v_down_m_s=None)
    told = fleet_vehicle(doc, channel, None)
    assert (told.plan, told.plan_share, told.v_enu_m_s) == ("", None, None)
    channel.state = None
    told = fleet_vehicle(doc.model_copy(update={"holder": None}), channel, None)
    assert (told.lat_deg, told.in_charge) == (None, "")
