"""Vehicles of other stations: held apart at the worse end of their age, shown with it, and never taken for clear."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mapping.geometry.frames import moved_deg
from server.flying.apart.nearness import NEAR_M, RADIUS_M, VEER_SHARE, Flown, Nearness, near_each_other
from server.flying.apart.other_stations import COUNTS_S, OLD_S, SILENT_S, Meeting, OtherStations
from server.flying.apart.other_vehicles import OtherVehicles, row_against
from server.flying.apart.own_told import fleet_vehicle
from server.schemas import StationsMessage, VehicleAlarm, VehicleDoc
from server.stations import Other
from telemetry.topics.messages import LinkStatus
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
    return OtherVehicle("Bravo", replace(it, **more), None if age_s is None else was_s, NOW_S, unsure_s)


class Desk:
    """The desk, what it published, and what its node has told."""

    def __init__(self, *vehicles: OtherVehicle, **more: Any) -> None:
        self.now_s, self.published = NOW_S, list[StationsMessage]()
        hub: Any = SimpleNamespace(publish=self.published.append)
        none: Any = None
        meeting = Meeting("Alpha", ("tls/router:7447",), Path("Alpha.pem"))
        self.it = OtherStations(meeting, none, none, hub, lambda: [], now_mono_s=lambda: self.now_s)
        self.tell(*vehicles, **more)

    def tell(self, *vehicles: OtherVehicle, state: Any = "live", **more: Any) -> None:
        station = OtherStation("Bravo", state, NOW_S, 0.0, len(vehicles), text="" if state == "live" else "Lost.")
        status = StationsStatus(NOW_S, "Alpha", "connected", stations=(station,), vehicles=vehicles)
        self.it.on_status(replace(status, **more))

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
    assert 10.0 * 10.0 * VEER_SHARE <= new - old <= 10.0 * 10.0 * VEER_SHARE + 6.0
    # Towards: where it is by now, not where it was.
    assert Desk(other(100.0, east_m_s=-10.0, age_s=8.0)).near_m() == 0.0
    # Of one that tells no speed, or whose clock was not compared, more has to be taken.
    assert Desk(other(300.0, east_m_s=None)).near_m() == 0.0
    assert Desk(other(200.0, east_m_s=10.0, age_s=None)).near_m() < Desk(other(200.0, east_m_s=10.0)).near_m() - 20.0
    assert Desk(other(200.0, east_m_s=-10.0, age_s=None)).near_m() == 0.0


def test_at_an_unknown_height_it_is_at_ours() -> None:
    assert Desk(other(40.0, alt_amsl_m=900.0)).near_m() > 300.0
    assert Desk(other(40.0, alt_amsl_m=None)).near_m() == pytest.approx(40.0 - 2 * RADIUS_M, abs=0.1)


def test_what_is_too_old_to_count_is_said_not_to_count() -> None:
    desk = Desk(other(age_s=COUNTS_S - 1.0))
    assert len(desk.it.flown(NOW_S)) == 1
    desk.now_s += 2.0
    assert desk.it.flown(desk.now_s) == []
    (doc,) = desk.it.message().stations[0].vehicles
    assert "no longer held apart" in doc.text
    desk.tell(other(lat_deg=None, position_t_mono_s=None))
    (doc,) = desk.it.message().stations[0].vehicles
    assert "where is not known" in doc.text
    assert doc.is_old
    assert doc.age_s is None
    desk.tell(other(in_air=False, age_s=500.0))
    assert desk.it.message().stations[0].vehicles[0].text == ""


def test_pages_are_told_ages_and_at_once_when_a_station_is_lost() -> None:
    desk = Desk(other(age_s=0.5), other(age_s=OLD_S + 1.0, number=2))
    fresh, old = desk.it.message().stations[0].vehicles
    assert (fresh.age_s, fresh.is_old, old.is_old) == (pytest.approx(0.5), False, True)
    before = len(desk.published)
    desk.tell(other(), state="lost")
    assert [message.stations[0].text for message in desk.published[before:]] == ["Lost."]
    # The node itself says nothing any more: all of it is in doubt.
    desk.now_s += SILENT_S + 0.1
    message = desk.it.message()
    assert (message.router, message.stations[0].state) == ("lost", "lost")
    assert "stations node does not answer" in message.text


def test_both_alarms_name_the_other_station_and_only_ours_can_be_held() -> None:
    channel: Any = SimpleNamespace(
        state=VehicleState(1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=47.0, lon_deg=8.0, alt_amsl_m=500.0),
        in_air=True,
        flight=None,
        follower=SimpleNamespace(ahead=lambda flight: None),
    )
    desk = Desk(other(2 * RADIUS_M + NEAR_M - 1.0))
    nearness = Nearness({1: ("Bee", channel)}, elsewhere=desk.it.flown, now_mono_s=lambda: NOW_S)
    asyncio.run(nearness.look())
    assert nearness.alarms.keys() == {1}
    alarm = nearness.alarms[1]
    assert alarm.text.startswith("Bee and Wasp (Bravo 1) may come within 4 m of each other now.")
    assert "call the other station" in alarm.text
    assert alarm.key == "near 1 Wasp (Bravo 1)"
    desk.tell(other(60.0))
    asyncio.run(nearness.look())
    assert nearness.alarms == {}


def test_before_a_start_nothing_of_other_stations_is_taken_for_clear() -> None:
    desk = Desk(other(in_air=False))
    assert desk.it.row().state == "good"
    desk.tell(other())
    assert (desk.it.row().state, "Wasp (Bravo 1)" in desk.it.row().text) == ("accept", True)
    desk.tell(state="lost")
    assert (desk.it.row().state, "Bravo" in desk.it.row().text) == ("accept", True)
    desk.tell(router="lost")
    assert desk.it.row().state == "accept"
    desk.tell()
    desk.now_s += SILENT_S + 0.1
    assert desk.it.row().state == "accept"
    desk.it.status = None
    assert desk.it.row().state == "accept"


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
        number=2, name="Bee", link="live", plan_name="Ridge", alarm=VehicleAlarm(kind="loss", key="", text="Lost.")
    )
    state = VehicleState(
        1, 1, mode="AUTO", armed=True, position_t_mono_s=9.0, lat_deg=47.0, lon_deg=8.0, alt_rel_home_m=30.0,
        v_north_m_s=3.0, v_east_m_s=4.0, v_down_m_s=-1.0,
    )  # fmt: skip
    follow = SimpleNamespace(progress=0.4, height_above_dsm_m=12.0)
    channel: Any = SimpleNamespace(state=state, follow=follow, in_air=True, battery="63 %")
    told = fleet_vehicle(doc, channel, LinkStatus(0.0, quality=0.9))
    assert (told.plan, told.plan_share, told.alt_surface_m, told.battery) == ("Ridge", 0.4, 12.0, "63 %")
    assert told.v_enu_m_s == (4.0, 3.0, 1.0)
    assert (told.link_quality, told.alarm, told.position_t_mono_s) == (0.9, "Lost.", 9.0)
    channel.in_air, channel.state = False, replace(state, v_down_m_s=None)
    told = fleet_vehicle(doc, channel, None)
    assert (told.plan, told.plan_share, told.v_enu_m_s) == ("", None, None)
    channel.state = None
    assert fleet_vehicle(doc, channel, None).lat_deg is None
