"""Vehicles in the 3D view: where they are, which way they look, and that moving them makes no new nodes."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
import viser
from viser import transforms

from server.scene.geometry.payload import ReviewScene
from server.scene.geometry.stage import Drawing
from server.scene.layers.flight_layers import review_nodes
from server.scene.layers.vehicle_layers import VehiclePose, scene_wxyz, track_nodes, vehicle_nodes
from server.scene.view import SceneView
from tests.server.scene_fixtures import exaggerated, hill, state_over
from tests.server.test_scene_view import host_of


def drawing() -> Drawing:
    dsm = hill()
    made = Drawing.of(dsm, state_over(dsm))
    assert made is not None
    return made


def over(
    east_m: float, north_m: float, *, roll_rad: float = 0.0, pitch_rad: float = 0.0, heading_rad: float = 0.0
) -> VehiclePose:
    place = np.array([500_000 + east_m, 3_999_940 + north_m, 150.0])
    return VehiclePose(place, roll_rad, pitch_rad, heading_rad)


def axes(pose: VehiclePose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forward, left and up of the body, in the scene (east, north, up)."""
    R = transforms.SO3(np.array(scene_wxyz(pose))).as_matrix()
    return R[:, 0], R[:, 1], R[:, 2]


def test_north_east_and_nose_up_and_right_wing_down() -> None:
    forward, left, up = axes(over(40, 30))
    assert np.allclose([forward, left, up], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-9)
    forward, _, _ = axes(over(40, 30, heading_rad=math.pi / 2))
    assert np.allclose(forward, [1, 0, 0], atol=1e-9)
    forward, _, _ = axes(over(40, 30, pitch_rad=0.3))
    assert forward[2] == pytest.approx(math.sin(0.3))
    _, left, _ = axes(over(40, 30, roll_rad=0.2))
    assert left[2] == pytest.approx(math.sin(0.2))


def test_a_replayed_vehicle_is_labelled_and_a_live_one_is_not() -> None:
    words = {
        source: [node.props["text"] for node in vehicle_nodes(drawing(), source, over(40, 30)) if node.kind == "label"]
        for source in ("live", "replay")
    }
    assert words == {"live": [], "replay": ["REPLAY"]}
    assert vehicle_nodes(drawing(), "live", None) == []


def test_the_plumb_line_ends_on_the_ground() -> None:
    at = drawing()
    plumb = next(node for node in vehicle_nodes(at, "live", over(40, 30)) if node.name.endswith("_plumb"))
    foot, top = plumb.props["points"][0]
    assert top[2] > foot[2]
    assert foot[:2] == pytest.approx(top[:2])


def test_a_growing_path_changes_its_last_piece_only() -> None:
    at = drawing()
    points = np.column_stack([np.linspace(500_005, 500_070, 900), np.full(900, 3_999_970.0), np.full(900, 140.0)])
    short, longer = track_nodes(at, "live", points[:600]), track_nodes(at, "live", points[:602])
    assert [node.name for node in short] == [node.name for node in longer]
    same = [np.array_equal(a.props["points"], b.props["points"]) for a, b in zip(short, longer, strict=True)]
    assert same == [True, True, False]
    assert {node.props["points"].shape for node in longer} == {(256, 2, 3)}
    assert track_nodes(at, "live", points[:1]) == []


def test_a_recorded_flight_shows_its_plan_and_its_path() -> None:
    dsm = hill()
    state = replace(state_over(dsm), plan=None)
    flown = np.array([[500_010.0, 3_999_960.0, 130.0], [500_050.0, 3_999_960.0, 131.0]])
    for planned, names in ((flown, ["/recorded_plan", "/recorded_flight"]), (np.zeros((0, 3)), ["/recorded_flight"])):
        made = Drawing.of(dsm, replace(state, review=ReviewScene(planned_m=planned, flown_m=flown)))
        assert made is not None
        assert [node.name for node in review_nodes(made)] == names
    assert review_nodes(drawing()) == []


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def view_on(server: viser.ViserServer) -> tuple[SceneView, list[object]]:
    view = SceneView(host_of(server, lambda client_id: None), cast(Any, None))
    sent: list[object] = []
    interface = server.scene._websock_interface
    queue = interface.queue_message
    interface.queue_message = lambda message: (sent.append(message), queue(message))[1]  # type: ignore[method-assign]
    return view, sent


def test_ten_moves_a_second_are_updates_and_no_new_nodes(server: viser.ViserServer) -> None:
    view, sent = view_on(server)
    dsm = hill()

    async def scenario() -> None:
        await view.show(dsm, state_over(dsm))
        assert view.vehicles.dsm is dsm
        view.vehicles.move("live", over(10, 30))
        sent.clear()
        for step in range(20):
            view.vehicles.move("live", over(10 + step, 30, heading_rad=0.1 * step))
        assert len(sent) >= 20
        assert not [message for message in sent if hasattr(message, "props")]
        sent.clear()
        view.vehicles.move("live", None)
        assert sent
        sent.clear()
        view.vehicles.move("live", None)
        assert not sent

    asyncio.run(scenario())


def test_another_height_scale_draws_it_again_and_another_model_forgets_it(server: viser.ViserServer) -> None:
    view, sent = view_on(server)
    dsm, other = hill(), hill(hole=False)

    async def scenario() -> None:
        await view.show(dsm, state_over(dsm))
        view.vehicles.move("live", over(10, 30))
        view.vehicles.follow("live", np.array([over(10, 30).place_m, over(20, 30).place_m]))
        sent.clear()
        await view.show(dsm, exaggerated(state_over(dsm), 2.0))
        assert any("vehicle_live" in str(getattr(message, "name", "")) for message in sent)
        await view.show(other, state_over(other))
        sent.clear()
        view.vehicles.move("live", None)
        assert not sent
        await view.show(None, replace(state_over(other), terrain=None))
        assert view.vehicles.dsm is None

    asyncio.run(scenario())
