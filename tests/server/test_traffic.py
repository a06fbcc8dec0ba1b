"""Traffic on the server: settings kept and handed on, a link that falls silent, the 3D view, and the whole way."""

from __future__ import annotations

import asyncio
import os
import signal
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pydantic import ValidationError

from server.door.page import key_of
from server.flying.apart.airspace import Airspace
from server.heard.present import Present
from server.obstacles.alert_list import UNHEARD_S, LatchedAlerts
from server.obstacles.traffic import DEAD_S, FILE, TrafficDesk, TrafficWatch, read_settings
from server.scene.geometry import palette
from server.scene.layers.traffic_layer import LINE_S, MOST, PlacedAircraft, label, traffic_nodes
from server.schemas import TrafficMessage, TrafficSettingsBody
from telemetry.bus.node_lock import running_nodes
from telemetry.recording.recorded_topics import LATEST, NOT_REPLAYED, RECORDED
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import Aircraft, TrafficSettings, TrafficStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.running import PASSWORD
from tests.server.station import PATIENCE_S, Station, ok, station
from tests.server.test_scene_obstacles import placed


def aircraft(**changes: Any) -> Aircraft:
    it = Aircraft(
        key="adsb 4b1805",
        source="adsb",
        name="HBABC",
        kind="light",
        trust="other",
        on_ground=False,
        emergency=False,
        lat_deg=47.0,
        lon_deg=8.01,
        age_s=1.0,
        within_m=200.0,
        velocity_enu_m_s=(-40.0, 0.0),
        climb_m_s=0.0,
        alt_m=600.0,
        alt_datum="gnss",
        distance_m=760.0,
        bearing_deg=90.0,
        height_m=80.0,
        height_within_m=40.0,
    )
    return replace(it, **changes)


def status(*those: Aircraft, **changes: Any) -> TrafficStatus:
    return TrafficStatus("watching", "", 100.0, 1000.0, heard=len(those), aircraft=those, **changes)


class Kept:
    """A desk whose bus keeps what is published."""

    def __init__(self, root: Path) -> None:
        self.told, self.published = Told(), list[tuple[str, Any]]()
        self.watch = TrafficWatch("live", self.told)
        bus: Any = SimpleNamespace(publish=lambda topic, message: self.published.append((topic, message)))
        self.desk = TrafficDesk(root, bus, self.watch)
        asyncio.run(self.desk.start())

    def change(self, **fields: Any) -> None:
        asyncio.run(self.desk.change_settings(TrafficSettingsBody(**fields)))


def test_settings_reach_the_link_and_the_pages_and_are_there_again(tmp_path: Path) -> None:
    first = Kept(tmp_path)
    assert first.published == [(Topic.TRAFFIC_SETTINGS, TrafficSettings())]
    first.change(warn_distance_m=1500.0, own_icao="4B1805")
    wanted = TrafficSettings(warn_distance_m=1500.0, own_icao="4B1805")
    assert first.published[-1] == (Topic.TRAFFIC_SETTINGS, wanted)
    assert first.told[-1].settings == wanted
    first.change(own_icao="")
    assert Kept(tmp_path).published == [(Topic.TRAFFIC_SETTINGS, replace(wanted, own_icao=""))]


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"warn_distance_m": 0}', '{"look_ahead_s": 1e9}', '{"own_icao": "zz"}', '{"own_id": 7}']
)
def test_damaged_settings_are_the_defaults(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text)
    assert read_settings(tmp_path) == TrafficSettings()


@pytest.mark.parametrize("wrong", [{"own_icao": "4b18"}, {"warn_height_m": 1.0}, {"unknown": 1}, {"look_ahead_s": "x"}])
def test_what_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        TrafficSettingsBody(**wrong)


def test_what_a_silent_link_said_is_no_picture_any_more() -> None:
    now = [100.0]
    live = TrafficWatch("live", Told(), now_mono_s=lambda: now[0])
    replayed = TrafficWatch("replay", Told(), now_mono_s=lambda: now[0])
    for watch in (live, replayed):
        watch.on_status(status(aircraft()))
    now[0] += DEAD_S + 0.1
    assert live.status is None
    assert replayed.status is not None
    replayed.forget()
    assert replayed.status is None


def test_pages_get_the_newest_of_each_source_also_when_they_come_late() -> None:
    told = Told()
    present = Present(told)
    for source in ("live", "replay"):
        TrafficWatch(source, present).on_status(status())
    assert len({key_of(message) for message in told}) == 2
    assert [m.source for m in present.messages() if isinstance(m, TrafficMessage)] == ["live", "replay"]
    present.forget_replay()
    assert [m.source for m in present.messages() if isinstance(m, TrafficMessage)] == ["live"]


def test_a_warning_that_is_told_no_more_is_over() -> None:
    alerts = LatchedAlerts()
    alerts.on_alert(ObstacleAlert("traffic-1", "traffic", "traffic", "begins", 0.0, 0.0, 0.0, "Traffic"), 100.0)
    assert alerts.give_up("radar", 200.0) == ()
    assert alerts.give_up("traffic", 100.0 + UNHEARD_S + 0.1) == ("traffic-1",)
    assert alerts.docs[0].over


def test_a_recording_holds_it_and_shows_it_again() -> None:
    assert Topic.TRAFFIC in RECORDED & LATEST
    assert Topic.TRAFFIC not in NOT_REPLAYED


# 3D


def test_an_aircraft_is_drawn_with_its_line_its_doubt_and_its_height() -> None:
    drawing, _ = placed()
    place_m = np.array([500_050.0, 3_999_950.0, 1_000.0])
    those = [PlacedAircraft(aircraft(), place_m, place_m - [600.0, 0.0, 0.0])]
    nodes = {node.name: node for node in traffic_nodes(drawing, those)}
    assert nodes["/traffic/adsb_4b1805/words"].props["text"] == "HBABC +80 m"
    ahead = nodes["/traffic/adsb_4b1805/ahead"].props["points"][0]
    assert np.linalg.norm(ahead[0] - ahead[1]) == pytest.approx(600.0, rel=1e-3)
    ring = nodes["/traffic/adsb_4b1805/within"].props["points"][:, 0]
    assert np.linalg.norm(ring - ahead[0], axis=1) == pytest.approx(200.0, rel=1e-3)
    hidden = drawing.state.view.model_copy(update={"show_traffic": False})
    assert traffic_nodes(replace(drawing, state=replace(drawing.state, view=hidden)), those) == []
    assert len({node.name.split("/")[2] for node in traffic_nodes(drawing, those * (MOST + 5))}) == 1


def test_what_is_dangerous_old_or_without_a_height_says_so() -> None:
    drawing, _ = placed()
    assert label(aircraft(height_m=None, age_s=12.0)) == "HBABC height ?, 12 s old"
    place_m = np.array([500_050.0, 3_999_950.0, 1_000.0])

    def colors(it: Aircraft) -> set[tuple[int, ...]]:
        nodes = traffic_nodes(drawing, [PlacedAircraft(it, place_m, place_m)])
        return {tuple(n.props["colors"].reshape(-1, 3)[0].tolist()) for n in nodes if "colors" in n.props}

    sure, dangerous, old = colors(aircraft()), colors(aircraft(conflict=True)), colors(aircraft(age_s=30.0))
    assert len(sure | dangerous | old) == 3
    assert palette.TRACK_DANGEROUS not in sure


def test_aircraft_stand_at_the_vehicles_height_and_each_is_drawn_once() -> None:
    drawing, placing = placed()
    shown: list[list[PlacedAircraft]] = []
    stage: Any = SimpleNamespace(dsm=drawing.dsm, drawing=drawing, show=lambda those, _: shown.append(list(those)))
    home = placing.origin
    state = VehicleState(
        1, 1, lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_rel_home_m=30.0, home_lat_deg=home.lat_deg,
        home_lon_deg=home.lon_deg,
    )  # fmt: skip
    here = {"lat_deg": home.lat_deg, "lon_deg": home.lon_deg}
    watches = [TrafficWatch("live", Told()), TrafficWatch("live", Told()), TrafficWatch("replay", Told())]
    channel = cast(Any, SimpleNamespace(state=state))
    airspace = Airspace(stage, [(channel, watch) for watch in watches[:2]], (channel, watches[2]))
    airspace.draw()
    watches[0].on_status(status(aircraft(age_s=4.0, **here)))
    watches[1].on_status(status(aircraft(height_m=50.0, **here), aircraft(key="rid 1", height_m=None, **here)))
    airspace.draw()
    airspace.draw()
    assert [len(those) for those in shown] == [0, 2]  # nothing new: nothing is drawn again
    first, second = sorted(shown[-1], key=lambda each: each.it.key)
    own_m = placing.home_alt_dsm_m + 30.0
    assert first.place_m[2] == pytest.approx(own_m + 50.0)
    assert second.place_m[2] == pytest.approx(own_m)
    assert np.linalg.norm(first.ahead_m[:2] - first.place_m[:2]) == pytest.approx(40.0 * LINE_S, rel=0.01)
    watches[2].on_status(status())
    airspace.draw()
    assert shown[-1] == []


# The whole way


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_the_demos_aircraft_reaches_the_page_by_the_settings_that_were_given(tmp_path: Path) -> None:
    def traffic(page: Station, wanted: Any) -> TrafficMessage:
        return page.until(lambda m: m.type == "traffic" and wanted(m), 4 * PATIENCE_S)

    try:
        with station(tmp_path, demo=True, flies=True, demo_traffic=True, password=PASSWORD) as page:
            seen = traffic(page, lambda m: m.status and m.status.aircraft and m.status.aircraft[0].distance_m)
            assert seen.status is not None
            (it,) = seen.status.aircraft
            assert (it.name, it.kind, it.alt_datum) == ("DEMO1", "light", "gnss")
            ok(page.http.put("/api/traffic/settings", json={"warn_distance_m": 800.0}))
            again = traffic(page, lambda m: m.status and m.status.settings.warn_distance_m == 800.0)
            assert again.settings.warn_distance_m == 800.0
            refused = page.http.put("/api/traffic/settings", json={"own_icao": "nobody"})
            assert refused.status_code == 422
            assert "six hexadecimal digits" in refused.json()["what"]
    finally:
        for facts in running_nodes(tmp_path / "run"):
            os.kill(facts.pid, signal.SIGKILL)
