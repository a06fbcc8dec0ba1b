"""A recording without a known surface model: on plain ground of its own, and nothing of the open plan beside it."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import numpy as np

from planning.basics.plan_model import Home, Mission
from planning.following.reference import level_model
from planning.terrain.dsm import Dsm
from server.heard.vehicle_place import Placer
from server.plan.picture import Picture
from server.scene.geometry.payload import ReviewScene, SceneState
from server.scene.geometry.plain import plain_ground, plain_scene
from server.scene.geometry.stage import Drawing
from server.scene.layers.flight_layers import review_nodes
from server.schemas import PlanDoc, SelectionDoc, ViewDoc
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.scene_fixtures import hill, plan_over, state_over

LEVEL = level_model(Mission(Home(37.7, 15.0, 812.5), ()))
HOVERING = VehicleState(1, 1, lat_deg=38.5001, lon_deg=15.0, alt_rel_home_m=12.0, home_lat_deg=38.5, home_lon_deg=15.0)
FLOWN_M = np.array([[0.0, 0.0, 812.5], [0.0, 0.0, 830.0], [240.0, -35.0, 832.0]])


def test_it_is_level_at_homes_height_under_the_whole_flight() -> None:
    ground = plain_ground(LEVEL, FLOWN_M)
    assert set(np.unique(ground.elevation_at(FLOWN_M[:, :2]))) == {812.5}
    assert np.allclose(ground.lat_lon_from_xy(np.zeros((1, 2)))[0], [37.7, 15.0])


def test_its_grid_has_a_line_every_ten_metres_from_home() -> None:
    ground = plain_ground(LEVEL, FLOWN_M)
    texture = plain_scene(ground).texture_rgb
    west, _, east, _ = ground.bounds_m
    row = texture[3, :, 0].astype(int)
    middles = np.flatnonzero(np.diff((row > row.min()).astype(int)) == 1)
    x_m = west + (middles + 1.5) * (east - west) / len(row)
    assert len(x_m) >= (east - west) / 10 - 2
    assert np.abs(x_m - 10 * np.round(x_m / 10)).max() < 0.5


def test_a_recording_is_drawn_on_it_and_the_plan_comes_back_afterwards() -> None:
    drawn: list[tuple[Dsm | None, SceneState]] = []

    async def show(dsm: Dsm | None, state: SceneState) -> None:
        drawn.append((dsm, state))

    dsm = hill()
    library: Any = SimpleNamespace(
        orthophotos=list, terrains=list, mesh_of=lambda _: None, terrain_dir=lambda _: None, load_terrain=lambda _: dsm
    )

    async def call(*_: object) -> object:
        return state_over(dsm).terrain

    view: Any = SimpleNamespace(show=show)
    lane: Any = SimpleNamespace(call=call)

    async def play() -> None:
        picture = Picture(view, library, lane, Told(), changed=lambda: None)
        loop = asyncio.create_task(picture.run())
        picture.want(PlanDoc(terrain_id="hill"), SelectionDoc(), ViewDoc(), plan_over(dsm), stale=False)
        await _until(lambda: bool(drawn))
        scene = ReviewScene(np.zeros((0, 3)), FLOWN_M, ground=plain_ground(LEVEL, FLOWN_M))
        picture.show_review(None, scene)
        await _until(lambda: drawn[-1][1].review is scene)
        ground, state = drawn[-1]
        assert ground is scene.ground
        assert state.plan is None
        assert not state.document.pois
        made = Drawing.of(ground, state)
        assert made is not None
        assert [node.name for node in review_nodes(made)] == ["/recorded_flight"]

        picture.show_review(None, None)
        await _until(lambda: drawn[-1][1].review is None)
        assert drawn[-1][0] is dsm
        assert drawn[-1][1].plan is not None
        loop.cancel()

    asyncio.run(play())


def test_a_vehicle_flies_over_plain_ground_where_no_model_is_open() -> None:
    drawn: list[tuple[Dsm | None, SceneState]] = []

    async def show(dsm: Dsm | None, state: SceneState) -> None:
        drawn.append((dsm, state))

    view: Any = SimpleNamespace(show=show)
    library: Any = SimpleNamespace(orthophotos=list)
    lane: Any = SimpleNamespace()

    async def play() -> None:
        picture = Picture(view, library, lane, Told(), changed=lambda: None)
        loop = asyncio.create_task(picture.run())
        picture.want(PlanDoc(), SelectionDoc(), ViewDoc(), None, stale=False)
        await _until(lambda: len(drawn) == 1)
        assert drawn[-1][0] is None
        for place in ((37.7, 15.0), (37.70001, 15.0), (38.5, 15.0)):
            before = len(drawn)
            picture.on_vehicle(False, place)
            await _until(lambda before=before: len(drawn) > before)
        first, moved, elsewhere = (ground for ground, _ in drawn[1:])
        assert first is moved
        assert elsewhere is not None
        assert elsewhere is not first
        place_m = Placer(elsewhere).place(HOVERING)
        assert place_m is not None
        assert place_m[2] == 12.0
        assert Drawing.of(*drawn[-1]) is not None
        loop.cancel()

    asyncio.run(play())


async def _until(condition: Any) -> None:
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.01)
