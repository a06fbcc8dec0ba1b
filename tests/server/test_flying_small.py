"""The small parts of flying: the pace of messages, the thinned path, the sentence on rounding, the terrain found."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.ground.demo_hillside import small_hill
from planning.terrain.dsm import Dsm
from server.flying.scenery import Scenery
from server.heard.channel import Channel
from server.heard.flown_track import POINTS_MAX, Track
from server.heard.onboard import is_plan, rounded_note
from server.library.terrain_of import FlownOver, covers, terrain_of
from server.scene.layers.vehicles import Vehicles
from server.schemas import PlaceDoc, PlanDoc, ReviewSeries, TerrainDoc
from server.work.bucket import Bucket
from telemetry.topics.messages import LOST_S, PlanRecord
from telemetry.topics.onboard_lists import Rounded
from telemetry.topics.vehicle import VehicleState

STATE = VehicleState(1, 1, lat_deg=37.0, lon_deg=15.0, alt_rel_home_m=10.0)


@given(st.lists(st.floats(0.0, 0.2), min_size=50, max_size=300))
def test_no_second_has_more_messages_than_the_rate_and_its_burst(gaps: list[float]) -> None:
    pace, now, sent = Bucket(20.0, 5.0, 0.0), 100.0, []
    for gap in gaps:
        now += gap
        if pace.left(now) >= 1.0:
            pace.spend(1.0)
            sent.append(now)
    assert all(sum(at <= t < at + 1.0 for t in sent) <= 25 for at in sent)


def test_a_bucket_fills_up_again_but_not_beyond_its_burst() -> None:
    bucket = Bucket(4.0, 12.0, 0.0)
    bucket.spend(16.0)
    assert bucket.left(0.5) == -2.0
    assert bucket.left(1.5) == 2.0
    assert bucket.left(1e6) == 12.0
    bucket.spend(13.0)
    assert bucket.left(1e6) < 0


def test_a_long_path_is_thinned_and_keeps_its_ends() -> None:
    track = Track()
    for k in range(3 * POINTS_MAX):
        track.add(replace(STATE, t_utc_s=1000.0 + k), None)
    doc = track.doc("live")
    assert len(doc.t_s) <= POINTS_MAX
    assert len(doc.t_s) == len(doc.s_m) == len(doc.alt_rel_home_m) == len(doc.cross_track_m)
    assert doc.t_s[0] == 0.0
    assert doc.t_s[-1] > 3 * POINTS_MAX - 20
    assert doc.t_s == sorted(doc.t_s)


def heard(t_s: float, **more: float) -> VehicleState:
    return replace(STATE, t_utc_s=1000.0 + t_s, **{"position_t_mono_s": 50.0 + t_s, **more})


def test_a_path_is_parted_where_no_position_came_until_the_vehicle_was_lost() -> None:
    track = Track()
    for t_s in (0.0, 1.0, LOST_S + 1.0):
        track.add(heard(t_s), None)
    assert None not in track.doc("live").alt_rel_home_m
    # Other messages came meanwhile, and the first new position comes too soon after one of them to be kept.
    track.add(heard(2 * LOST_S, position_t_mono_s=51.0 + LOST_S), None)
    track.see(heard(2 * LOST_S + 1.2))
    track.add(heard(2 * LOST_S + 1.3), None)
    doc = track.doc("live")
    assert doc.alt_rel_home_m == [10.0, 10.0, 10.0, 10.0, None, 10.0]
    assert doc.s_m == doc.cross_track_m == [None] * 6
    assert doc.t_s == sorted(doc.t_s)


def test_a_thinned_path_is_parted_where_it_was_and_nowhere_else() -> None:
    track = Track()
    gaps_s = (10.0, 11.0, 2000.0, 2500.0)
    away_s = 0.0
    for k in range(3 * POINTS_MAX):
        away_s += 60.0 if k in gaps_s else 0.0
        track.add(heard(k + away_s), None)
    doc = track.doc("live")
    assert len(track.states) <= POINTS_MAX
    parted = [k for k, alt_m in enumerate(doc.alt_rel_home_m) if alt_m is None]
    # Two that lie nearer to each other than what is left of the points are one.
    assert len(parted) == len(gaps_s) - 1
    assert all(doc.t_s[k + 1] - doc.t_s[k - 1] > 60.0 for k in parted)


def test_the_3d_view_draws_no_line_to_where_a_lost_vehicle_was_found_again() -> None:
    dsm, stage = small_hill(), Stage()
    west, south, _, _ = dsm.bounds_m
    channel = Channel("live", Pages())
    scenery = Scenery(cast(Vehicles, stage), {"1": channel})
    stage.dsm = dsm

    def fly(t_s: float, x_m: float) -> None:
        lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[west + x_m, south + 50.0]]))[0].tolist()
        home = {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg}
        channel.track.add(replace(heard(t_s), lat_deg=lat_deg, lon_deg=lon_deg, **home), None)

    fly(0.0, 50.0)
    fly(1.0, 51.0)
    list(scenery.drawn(with_tracks=True))
    fly(20.0, 90.0)
    fly(21.0, 91.0)
    list(scenery.drawn(with_tracks=True))
    x_m = stage.path_m[:, 0] - west
    np.testing.assert_allclose(x_m, [50.0, 51.0, np.nan, 90.0, 91.0], atol=0.01)
    fly(40.0, 20.0)
    fly(41.0, 21.0)
    list(scenery.drawn(with_tracks=True))
    np.testing.assert_allclose(stage.path_m[5:, 0] - west, [np.nan, 20.0, 21.0], atol=0.01)


class Stage:
    """What was drawn last."""

    dsm: Dsm | None = None

    def __init__(self) -> None:
        self.path_m = np.zeros((0, 3))

    def move(self, actor: str, pose: object) -> None: ...

    def follow(self, actor: str, points_m: F64) -> None:
        self.path_m = points_m


class Pages:
    def publish(self, message: object) -> None: ...


def test_a_replays_path_ends_where_it_was_wound_to() -> None:
    count = 100
    none: list[float | None] = [None] * count
    series = ReviewSeries(
        t_s=[float(k) for k in range(count)],
        alt_rel_home_m=[float(k) for k in range(count)],
        reference_alt_rel_home_m=none,
        planned_alt_rel_home_m=none,
        ground_rel_home_m=none,
        cross_track_m=none,
        s_m=none,
        distance_to_dsm_m=none,
    )
    track = Track()
    track.load(series, 1000.0, until_utc_s=1040.0)
    assert track.doc("replay").t_s[-1] == 40.0
    assert track.add(replace(STATE, t_utc_s=1041.0), None)


def test_what_the_vehicle_rounded_is_one_sentence() -> None:
    heights = [Rounded(k, "altitude", 12.349, 12.34) for k in range(1, 13)]
    assert rounded_note([]) == ""
    assert rounded_note(heights) == "The vehicle cut 12 heights to whole centimetres, at most 0.9 cm."
    both = rounded_note([heights[0], Rounded(3, "parameter 1", 5.6, 5.0)])
    assert both.endswith("at most 0.9 cm and cut 1 time to whole seconds, at most 0.6 s.")


def terrain(name: str, *, south: float, west: float, size: float, resolution_m: float = 1.0) -> TerrainDoc:
    north, east = south + size, west + size
    corners = [(north, west), (north, east), (south, east), (south, west)]
    return TerrainDoc(
        id=name,
        name=name,
        width_px=1,
        height_px=1,
        resolution_m=resolution_m,
        crs="x",
        vertical_datum=None,
        unknown_share=0.0,
        min_m=0.0,
        max_m=1.0,
        sha256=f"sha-{name}",
        spikes=[],
        warnings=[],
        corner_lat_lon_deg=[PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in corners],
        added_utc="",
    )


WIDE, FINE, AWAY = (
    terrain("wide", south=37.0, west=15.0, size=1.0),
    terrain("fine", south=37.2, west=15.2, size=0.4, resolution_m=0.1),
    terrain("away", south=-40.0, west=175.0, size=1.0),
)


@pytest.mark.parametrize(
    ("flown", "found"),
    [
        (FlownOver("away", "sha-wide", ((37.3, 15.3),)), "away"),
        (FlownOver("gone", "sha-wide", ((37.3, 15.3),)), "wide"),
        (FlownOver(places=((37.3, 15.3), (37.5, 15.5))), "fine"),
        (FlownOver(places=((37.3, 15.3), (37.9, 15.5))), "wide"),
        (FlownOver(places=((37.3, 15.3), (47.9, 15.5))), None),
        (FlownOver(), None),
    ],
)
def test_the_surface_model_of_a_recording(flown: FlownOver, found: str | None) -> None:
    doc = terrain_of(flown, [WIDE, FINE, AWAY])
    assert (None if doc is None else doc.id) == found


@given(st.floats(36.5, 38.5), st.floats(14.5, 16.5))
def test_inside_the_corners(lat_deg: float, lon_deg: float) -> None:
    assert covers(WIDE, lat_deg, lon_deg) == (37.0 <= lat_deg <= 38.0 and 15.0 <= lon_deg <= 16.0)


def test_words_about_a_plan_make_it_no_other_one_to_fly() -> None:
    flown = PlanDoc(name="Hill", seen_id="0123456789abcdef", seen_lacks="Parts of the radar map are missing.")
    record = PlanRecord(0.0, "", "", "", "px4", "", "", "", None, None, "", "", plan_json=flown.model_dump_json())
    assert is_plan(record, flown.model_copy(update={"seen_lacks": "", "name": "Slope"}))
    assert not is_plan(record, flown.model_copy(update={"seen_id": None}))
