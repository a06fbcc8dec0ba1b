"""The camera's points in the 3D view: where they lie, always as many, and nothing while nobody looks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import viser

from server.scene.geometry.canvas import Canvas
from server.scene.geometry.stage import Drawing
from server.scene.layers.sights import Sights
from server.scene.layers.voxel_layers import cloud_nodes
from telemetry.perception.showing import MOST_POINTS
from telemetry.topics.looks import CloudLook, packed_cm
from telemetry.topics.obstacles import MapOrigin
from tests.server.obstacle_messages import delta
from tests.server.test_obstacles_section import watching
from tests.server.test_scene_obstacles import placed


def showing(drawing: Drawing, *, on: bool) -> Drawing:
    view = drawing.state.view.model_copy(update={"show_cloud": on})
    return replace(drawing, state=replace(drawing.state, view=view))


def look(origin: MapOrigin, count: int, t_s: float = 10.0) -> CloudLook:
    points = np.column_stack([np.linspace(-5, 5, count), np.linspace(2, 30, count), np.zeros(count)])
    return CloudLook(t_s, 1000.0 + t_s, origin, (3.0, 4.0, 5.0), packed_cm(points))


def test_points_stand_where_they_were_seen_and_are_always_as_many() -> None:
    drawing, placing = placed()
    drawing = showing(drawing, on=True)
    sizes = set()
    for count in (7, 900):
        (node,) = cloud_nodes(drawing, placing, look(placing.origin, count), prefix="/n")
        sizes.add(node.props["points"].shape)
        first = node.props["points"][0].astype(float) + node.props["position"]
        expected = drawing.frame.scene_from_model(placing.model_from_enu(np.array([[-2.0, 6.0, 5.0]])))[0]
        np.testing.assert_allclose(first, expected, atol=0.03)
    assert sizes == {(MOST_POINTS, 3)}
    assert node.props["points"].nbytes == 6 * MOST_POINTS
    assert cloud_nodes(showing(drawing, on=False), placing, look(placing.origin, 9), prefix="/n") == []


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_each_cloud_is_drawn_once_and_only_while_the_layer_is_on(server: viser.ViserServer) -> None:
    drawing, placing = placed()
    put: list[dict[str, Any]] = []
    sights = Sights(server, cast(Any, SimpleNamespace(draw=put.append, nodes=[])))
    sights.redraw(showing(drawing, on=False))
    cloud = look(placing.origin, 50)
    for _ in range(3):
        sights.draw_cloud("live", cloud)
    assert [len(layers["cloud"]) for layers in put] in ([], [0])
    put.clear()
    sights.redraw(showing(drawing, on=True))
    for shown in (cloud, cloud, look(placing.origin, 60), None, None):
        sights.draw_cloud("live", shown)
    assert [len(layers["cloud"]) for layers in put] == [1, 1, 0]


def test_the_models_ground_is_told_above_home(server: viser.ViserServer) -> None:
    drawing, placing = placed()
    sights = Sights(server, Canvas(server))
    assert np.isnan(sights.ground_up_m(placing.origin, np.zeros((2, 3)))).all()
    sights.redraw(drawing)
    up_m = sights.ground_up_m(placing.origin, np.array([[0.0, 0.0, 77.0], [9000.0, 0.0, 0.0]]))
    assert up_m[0] == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(up_m[1])


def test_a_camera_that_has_stopped_shows_nothing() -> None:
    now_s = [10.5]
    watch = watching()
    watch._now_mono_s = lambda: now_s[0]  # pyright: ignore[reportPrivateUsage]
    asked = delta([(0, 0, 0)]).origin
    watch.on_cloud_look(look(asked, 5))
    assert watch.fresh_cloud() is not None
    now_s[0] = 14.0
    assert watch.fresh_cloud() is None
