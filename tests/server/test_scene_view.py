"""The 3D view against a real viser server: what is sent, what clicks hit, what drags do."""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from planning.terrain.dsm import Dsm
from server.scene.geometry.payload import SceneState
from server.scene.host import SceneHost
from server.scene.view import SceneView
from server.schemas import FenceCircleDoc, FenceDoc, FencePolygonDoc, PlaceDoc, PlanDoc, RallyDoc, SelectionDoc
from tests.server.scene_fixtures import exaggerated, hill, plan_over, pois, state_over


def host_of(server: viser.ViserServer, page_of_client: Callable[[int], str | None]) -> SceneHost:
    """A host that guards nothing, of a server that is there already."""
    host: Any = SceneHost.__new__(SceneHost)
    host.server, host.page_of_client = server, page_of_client
    return host


class Stage:
    """A view on a real server, with everything it sends and everything it reports."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.sent: list[Any] = []
        self.events: list[tuple[Any, ...]] = []
        hands: Any = SimpleNamespace(
            on_terrain_click=self._report("terrain"),
            on_mark_click=self._report("poi"),
            on_mark_moved=self._report("moved"),
        )
        self.view = SceneView(host_of(server, lambda client_id: f"page{client_id}"), hands)
        interface = server.scene._websock_interface
        queue = interface.queue_message
        interface.queue_message = lambda message: (self.sent.append(message), queue(message))[1]  # type: ignore[method-assign]

    def _report(self, kind: str):
        async def report(*what: Any) -> None:
            self.events.append((kind, *what))

        return report

    async def show(self, dsm: Dsm | None, state: SceneState) -> Counter[str]:
        """Names of the nodes that were added by this call, and "name.property" for those updated."""
        self.sent.clear()
        await self.view.show(dsm, state)
        names: Counter[str] = Counter()
        for message in self.sent:
            kind, name = type(message).__name__, getattr(message, "name", "")
            if hasattr(message, "props"):
                names[name] += 1
            elif kind == "SceneNodeUpdateMessage":
                names.update(f"{name}.{key}" for key in message.updates)
            elif kind == "RemoveSceneNodeMessage":
                names[f"-{name}"] += 1
        return names

    async def click_down(self, east_m: float, north_m: float) -> None:
        """A click from straight above a place of the hill."""
        origin = np.array([east_m - 40, north_m - 30, 500.0])
        await self.view._click(origin, np.array([0.0, 0.0, -1.0]), 0.8)


@pytest.fixture
def stage() -> Iterator[Stage]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield Stage(server)
    server.stop()


DSM = hill()


def test_a_new_plan_sends_no_terrain_again(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        first = await stage.show(DSM, state)
        assert {"/terrain", "/unknown", "/surface", "/path", "/flown", "/worst", "/pois", "/gizmo"} <= first.keys()
        assert not await stage.show(DSM, state)
        second = await stage.show(DSM, replace(state, plan=plan_over(DSM, height_m=7.0)))
        assert "/terrain" not in second
        assert "/pois" not in second
        # The slider moves: only the heights of the surface travel, not its triangles.
        assert second["/surface.vertices"] == 1
        assert "/surface" not in second

    asyncio.run(play())


def test_the_legend_of_what_is_shown_is_obeyed(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        await stage.show(DSM, state)
        hidden = state.view.model_copy(update={"show_surface": False, "show_path": False, "show_unknown": False})
        gone = await stage.show(DSM, replace(state, view=hidden))
        assert {"-/surface", "-/path", "-/flown", "-/worst", "-/unknown"} <= gone.keys()
        assert "/terrain" not in gone

    asyncio.run(play())


def test_exaggeration_stretches_the_terrain_without_sending_it(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        await stage.show(DSM, state)
        sent = await stage.show(DSM, exaggerated(state, 2.0))
        assert sent["/terrain.scale"] == 1
        assert "/terrain" not in sent
        assert "/terrain.glb_data" not in sent

    asyncio.run(play())


def test_no_terrain_clears_the_scene(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        await stage.show(DSM, state)
        sent = await stage.show(None, replace(state, terrain=None, plan=None))
        assert {"-/terrain", "-/surface", "-/path", "-/gizmo"} <= sent.keys()
        await stage.click_down(40, 30)
        assert stage.events == []

    asyncio.run(play())


def test_a_selected_point_has_handles_only_with_the_select_tool(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        assert "/gizmo/ball" in await stage.show(DSM, state)
        adding = await stage.show(DSM, replace(state, selection=SelectionDoc(tool="add_poi", poi_id="p2")))
        assert "-/gizmo" in adding
        assert "/selected" in adding
        assert "/gizmo/ball" in await stage.show(DSM, state)

    asyncio.run(play())


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_a_click_comes_back_as_the_place_that_was_hit(stage: Stage, times: float) -> None:
    async def play() -> None:
        state = replace(state_over(DSM), selection=SelectionDoc(tool="add_poi"))
        await stage.show(DSM, exaggerated(state, times))
        await stage.click_down(22.3, 44.2)
        ((kind, lat, lon, known),) = stage.events
        assert (kind, known) == ("terrain", True)
        assert DSM.xy_from_lat_lon(np.array([[lat, lon]]))[0] == pytest.approx([500_022.3, 3_999_984.2], abs=1e-3)

    asyncio.run(play())


@pytest.mark.parametrize(("east_m", "north_m"), [(15, 45), (200, 30)], ids=["hole", "outside"])
def test_a_click_on_what_nobody_knows_says_so(stage: Stage, east_m: float, north_m: float) -> None:
    async def play() -> None:
        await stage.show(DSM, replace(state_over(DSM), selection=SelectionDoc(tool="add_poi")))
        await stage.click_down(east_m, north_m)
        assert [event[3] for event in stage.events] == [False]

    asyncio.run(play())


def test_the_select_tool_picks_points(stage: Stage) -> None:
    async def play() -> None:
        await stage.show(DSM, state_over(DSM))
        await stage.click_down(75.2, 30.1)
        await stage.click_down(60, 10)
        assert stage.events[0] == ("poi", "p3")
        assert stage.events[1][0] == "terrain"

    asyncio.run(play())


def test_a_drag_reports_once_and_a_refused_move_is_put_back(stage: Stage) -> None:
    async def play() -> None:
        await stage.show(DSM, state_over(DSM))
        gizmo = stage.view._canvas.handle("/gizmo")
        assert gizmo is not None
        start = np.array(gizmo.position)
        gizmo._impl.position = start + np.array([6.0, -4.0, 0.0])  # as the browser's update does
        for phase in ("start", "update", "update", "end"):
            await stage.view._drag(phase, np.array(gizmo.position))
        ((kind, poi_id, lat, lon),) = stage.events
        assert (kind, poi_id) == ("moved", "p2")
        assert DSM.xy_from_lat_lon(np.array([[lat, lon]]))[0] == pytest.approx([500_046, 3_999_966], abs=1e-3)
        assert np.allclose(gizmo.position, start)

    asyncio.run(play())


def test_the_latest_of_hurried_states_is_the_one_that_stays(stage: Stage) -> None:
    async def play() -> None:
        state = state_over(DSM)
        chosen = [replace(state, selection=SelectionDoc(poi_id=poi_id)) for poi_id in ("p1", "p2", "p3")]
        await asyncio.gather(*(stage.view.show(DSM, each) for each in chosen))
        assert stage.view._drawn is not None
        assert stage.view._drawn.state.selection.poi_id == "p3"

    asyncio.run(play())


def test_the_cursor_comes_and_goes(stage: Stage) -> None:
    async def play() -> None:
        await stage.show(DSM, state_over(DSM))
        await stage.view.cursor(np.array([500_030.0, 3_999_970.0, 125.0]))
        mark = stage.view._canvas.handle("/cursor")
        assert mark is not None
        assert mark.position[:2] == pytest.approx([-10, 0])
        await stage.view.cursor(None)
        assert stage.view._canvas.handle("/cursor") is None

    asyncio.run(play())


def test_pages_without_a_view_have_nothing_under_their_pointer(stage: Stage) -> None:
    async def play() -> None:
        await stage.show(DSM, state_over(DSM))
        await stage.view.frame("nobody", "plan")
        assert stage.view.sample_under("nobody", 0.5, 0.5) is None

    asyncio.run(play())


class Camera:
    aspect = 1.5


class LateClient:
    """A page's view that connects after its page has asked for a shot."""

    client_id = 7
    camera = Camera()

    def atomic(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    def flush(self) -> None: ...


def test_a_shot_that_was_asked_for_too_early_is_taken_when_the_view_connects(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    clients: dict[int, LateClient] = {}
    monkeypatch.setattr(viser.ViserServer, "get_clients", lambda _: clients)

    async def play() -> None:
        await stage.show(DSM, state_over(DSM))
        await stage.view.frame("page7", "terrain")
        await stage.view.frame("page7", "top")
        clients[7] = LateClient()
        await asyncio.to_thread(lambda: asyncio.run(stage.view._joined(clients[7])))  # type: ignore[arg-type]

    asyncio.run(play())
    east, north, up = np.subtract(clients[7].camera.position, clients[7].camera.look_at)  # type: ignore[attr-defined]
    assert up > 10 * np.hypot(east, north) > 0 or (up > 0 and np.hypot(east, north) < 1e-3 * up)


def test_the_fence_is_drawn_with_words_picked_and_dragged(stage: Stage) -> None:
    dsm = hill(hole=False)
    places = [PlaceDoc(lat_deg=p.lat_deg, lon_deg=p.lon_deg) for p in pois(dsm, (10, 10), (30, 10), (20, 25), (60, 20))]
    fence = FenceDoc(
        polygons=[FencePolygonDoc(id="poly", inclusion=True, corners=places[:3])],
        circles=[FenceCircleDoc(id="round", inclusion=False, centre=places[3], radius_m=8.0)],
    )
    rally = [RallyDoc(id="rally", lat_deg=places[0].lat_deg, lon_deg=places[0].lon_deg, alt_rel_home_m=30.0)]
    document = PlanDoc(terrain_id="hill", fence=fence, rally=rally)
    state = replace(state_over(dsm), document=document, selection=SelectionDoc())

    async def play() -> None:
        names = await stage.show(dsm, state)
        assert {"/fence/poly", "/fence/round", "/rally/rally", "/fence_corners"} <= set(names)
        labels = {m.props.text for m in stage.sent if hasattr(getattr(m, "props", None), "text")}
        assert {"Stay inside: polygon 1", "Keep out: circle 1", "Rally point 1"} <= labels
        await stage.click_down(60.1, 20.1)
        await stage.click_down(30.1, 10.1)
        assert [event[:2] for event in stage.events] == [("poi", "round"), ("poi", "poly.1")]

        stage.events.clear()
        names = await stage.show(dsm, replace(state, selection=SelectionDoc(fence_mark="poly.1")))
        assert "/gizmo" in names
        gizmo = stage.view._canvas.handle("/gizmo")
        assert gizmo is not None
        start = np.array(gizmo.position)
        gizmo._impl.position = start + np.array([3.0, 2.0, 0.0])  # as the browser's update does
        for phase in ("start", "update", "end"):
            await stage.view._drag(phase, np.array(gizmo.position))
        ((kind, mark, lat, lon),) = stage.events
        assert (kind, mark) == ("moved", "poly.1")
        assert dsm.xy_from_lat_lon(np.array([[lat, lon]]))[0] == pytest.approx([500_033, 3_999_952], abs=1e-3)
        assert np.allclose(gizmo.position, start)

    asyncio.run(play())
