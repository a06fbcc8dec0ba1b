"""A cloud's points in the 3D view: where they stand, in which colours, in place of the model, and only when wanted."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from planning.terrain.clouds.thin import ThinnedCloud
from server.errors import StorageError
from server.plan.picture import Picture
from server.scene.geometry.payload import OverlayScene, PointsScene, SceneState
from server.scene.geometry.stage import Drawing
from server.scene.geometry.terrain_payload import build_points_scene
from server.scene.layers.ground_layers import points_nodes, terrain_nodes
from server.scene.layers.layers import layers, unchanged
from server.schemas import CloudDoc, PlanDoc, SelectionDoc, ViewDoc
from tests.server.fakes import Told
from tests.server.scene_fixtures import exaggerated, hill, state_over

DSM = hill()
CLOUD = CloudDoc(
    points=90, taken=90, noise=0, not_numbers=0, points_per_m2=1.0, cell_chosen=False, shares=[],
    canopy_greatest_m=None, canopy_median_m=None, canopy_share=None, small_holes=0, small_holes_m2=0.0,
    small_hole_limit_m2=25.0, shown=3, voxel_m=0.5,
)  # fmt: skip
XYZ_M = np.array([[500_010.5, 3_999_950.5, 108.0], [500_040.5, 3_999_970.5, 119.0], [500_040.5, 3_999_970.5, 109.0]])


def scene(terrain_id: str = "hill") -> PointsScene:
    return build_points_scene(terrain_id, DSM, ThinnedCloud(XYZ_M, None, 0.5), low_m=100.0, high_m=120.0)


def drawing(points: PointsScene | None, **view: Any) -> Drawing:
    state = replace(state_over(DSM), points=points)
    made = Drawing.of(DSM, replace(state, view=state.view.model_copy(update=view)))
    assert made is not None
    return made


def test_points_stand_where_the_model_would_and_stretch_with_it() -> None:
    drawn = drawing(scene(), show_points=True)
    (node,) = points_nodes(drawn)
    np.testing.assert_allclose(
        node.props["points"] * node.props["scale"], drawn.frame.scene_from_model(XYZ_M), atol=1e-3
    )
    made = Drawing.of(DSM, exaggerated(drawn.state, 3.0))
    assert made is not None
    (taller,) = points_nodes(made)
    np.testing.assert_array_equal(taller.props["points"], node.props["points"])
    assert taller.props["scale"] == (1.0, 1.0, 3.0)


def test_own_colours_are_kept_and_heights_darken_below_the_top() -> None:
    red = np.tile(np.array([[200, 10, 10]], np.uint8), (3, 1))
    own = build_points_scene("hill", DSM, ThinnedCloud(XYZ_M, red, 0.5), low_m=100.0, high_m=120.0)
    assert (own.rgb == red).all()
    _, top, deep = scene().rgb.astype(int).sum(axis=1)
    raised = np.add(XYZ_M, [0.0, 0.0, 9.5])  # the same shares of the scale, and nothing far below the model
    shallow = build_points_scene("hill", DSM, ThinnedCloud(raised, None, 0.5), low_m=109.5, high_m=129.5)
    assert top > deep
    assert shallow.rgb[2].astype(int).sum() > 1.5 * deep


def test_the_model_gives_way_to_points_that_are_there_and_to_nothing_else() -> None:
    for points, view, mesh, cloud in (
        (scene(), {"show_points": True, "show_mesh": False}, False, True),
        (scene(), {"show_points": True, "show_mesh": True}, True, True),
        (scene(), {"show_points": False, "show_mesh": False}, True, False),
        (None, {"show_points": True, "show_mesh": False}, True, False),
        (scene("another"), {"show_points": True, "show_mesh": False}, True, False),
    ):
        drawn = drawing(points, **view)
        assert bool(terrain_nodes(drawn)) == mesh
        assert bool(points_nodes(drawn)) == cloud


def test_colours_that_are_laid_over_the_model_stay_with_it_beside_points() -> None:
    drawn = drawing(scene(), show_points=True, show_mesh=False)
    overlay = OverlayScene("hill", np.zeros((2, 2, 4), np.uint8), 500_000.0, 4_000_000.0, 1.0)
    assert terrain_nodes(replace(drawn, state=replace(drawn.state, overlay=overlay))) != []
    assert terrain_nodes(drawn) == []


def test_another_plan_sends_no_point_again() -> None:
    layer = next(layer for layer in layers(lambda handle: None) if layer.name == "points")
    drawn = drawing(scene(), show_points=True, show_mesh=False)
    assert unchanged(layer.key(drawn), layer.key(replace(drawn, state=replace(drawn.state, plan=None))))
    assert not unchanged(layer.key(drawn), layer.key(drawing(scene(), show_points=False)))


def test_points_are_read_when_they_are_wanted_once_and_told_before() -> None:
    shown: list[SceneState] = []
    asked: list[str] = []
    terrain = state_over(DSM).terrain

    async def show(dsm: object, state: SceneState) -> None:
        shown.append(state)

    async def call(task: Any, *_: object) -> object:
        asked.append(task.__name__)
        return terrain if task.__name__ == "draw_terrain" else scene()

    docs = [SimpleNamespace(id="hill", cloud=CLOUD)]
    library: Any = SimpleNamespace(
        orthophotos=list,
        terrains=lambda: docs,
        mesh_of=lambda _: None,
        terrain_dir=lambda _: None,
        load_terrain=lambda _: DSM,
    )
    view: Any = SimpleNamespace(show=show)
    lane: Any = SimpleNamespace(call=call)

    async def drawn(picture: Picture, document: PlanDoc, *, points: bool) -> SceneState:
        before = len(shown)
        picture.want(document, SelectionDoc(), ViewDoc(show_points=points), None, stale=False)
        while len(shown) == before:
            await asyncio.sleep(0)
        return shown[-1]

    async def play() -> None:
        picture = Picture(view, library, lane, Told(), changed=lambda: None)
        loop = asyncio.create_task(picture.run())
        hill_plan = PlanDoc(terrain_id="hill")
        assert (await drawn(picture, hill_plan, points=False)).points is None
        assert picture.cloud == CLOUD
        assert asked == ["draw_terrain"]
        for wanted in (True, False, True):
            assert (await drawn(picture, hill_plan, points=wanted)).points is not None
        assert asked == ["draw_terrain", "draw_points"]
        assert (await drawn(picture, PlanDoc(), points=True)).points is None
        assert picture.cloud is None
        docs[0] = SimpleNamespace(id="hill", cloud=CLOUD.model_copy(update={"shown": 0}))
        assert (await drawn(picture, hill_plan, points=True)).points is None
        assert asked[2:] == ["draw_terrain"]
        loop.cancel()

    asyncio.run(asyncio.wait_for(play(), 30))


def test_points_that_failed_are_asked_for_again_once_they_were_put_off() -> None:
    terrain = state_over(DSM).terrain
    docs = [SimpleNamespace(id="hill", cloud=CLOUD)]
    states: list[str] = []
    asked: list[bool] = []
    fails = [True, False]

    async def call(task: Any, *_: object) -> object:
        if task.__name__ == "draw_terrain":
            return terrain
        asked.append(fails[0])
        if fails.pop(0):
            raise StorageError("The file is damaged.")
        return scene()

    async def play() -> None:
        shown = asyncio.Semaphore(0)

        async def show(*_: object) -> None:
            shown.release()

        library: Any = SimpleNamespace(
            orthophotos=list,
            terrains=lambda: docs,
            mesh_of=lambda _: None,
            terrain_dir=lambda _: None,
            load_terrain=lambda _: DSM,
        )
        told = Told()
        made: list[Picture] = []
        view: Any = SimpleNamespace(show=show)
        lane: Any = SimpleNamespace(call=call)
        made.append(Picture(view, library, lane, told, changed=lambda: states.append(made[0].points_state)))
        loop = asyncio.create_task(made[0].run())
        for wanted in (True, True, False, True):
            made[0].want(PlanDoc(terrain_id="hill"), SelectionDoc(), ViewDoc(show_points=wanted), None, stale=False)
            await shown.acquire()
        loop.cancel()

    asyncio.run(asyncio.wait_for(play(), 30))
    assert asked == [True, False]
    assert states == ["none", "loading", "failed", "none", "loading", "drawn"]
