"""Maps, regions and manoeuvres in the 3D view: at their place, in colours that are told apart, and light to send."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import viser

from server.scene.geometry import palette
from server.scene.geometry.enu import EnuPlacing
from server.scene.geometry.mark_shapes import linear_light
from server.scene.geometry.stage import Drawing
from server.scene.layers.region_layers import Route, conflict_nodes, region_nodes, route_nodes, sector_corners_enu_m
from server.scene.layers.sights import Sights
from server.scene.layers.voxel_layers import HUES, chunk_nodes, chunk_place, sent_bytes
from server.scene.mirror import MapMirror
from telemetry.topics.obstacles import MapOrigin, MissionConflict, Region
from tests.server.obstacle_messages import delta, status
from tests.server.scene_fixtures import exaggerated, hill, state_over

EAST_M, NORTH_M = 20.5, 25.5
"""Of home, from the model's south-west corner."""


def placed(times: float = 1.0) -> tuple[Drawing, EnuPlacing]:
    dsm = hill()
    drawing = Drawing.of(dsm, exaggerated(state_over(dsm), times))
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[500_000 + EAST_M, 3_999_940 + NORTH_M]]))[0].tolist()
    placing = EnuPlacing.of(dsm, MapOrigin(lat_deg, lon_deg, 900.0))
    assert drawing is not None
    assert placing is not None
    return drawing, placing


def boxes_in_scene(node: Any) -> np.ndarray:
    """(N, 3) of a node's boxes, its pose applied."""
    w, _, _, z = node.props["wxyz"]
    angle = 2 * math.atan2(z, w)
    R = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    return np.unique(node.props["batched_positions"].round(3), axis=0) @ R.T + np.array(node.props["position"])


def test_home_stands_on_the_model_and_up_counts_from_it() -> None:
    drawing, placing = placed()
    home = placing.model_from_enu(np.zeros((1, 3)))[0]
    assert home[:2] == pytest.approx([500_000 + EAST_M, 3_999_940 + NORTH_M], abs=1e-3)
    assert home[2] == pytest.approx(float(drawing.dsm.elevation_at(home[None, :2])[0]))
    assert EnuPlacing.of(drawing.dsm, MapOrigin(0.0, 0.0, 0.0)) is None
    assert EnuPlacing.of(drawing.dsm, None) is None


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_boxes_stand_where_their_voxels_are(times: float) -> None:
    drawing, placing = placed(times)
    mirror = MapMirror("radar")
    keys = [(3, 4, 5), (31, 0, 0), (12, 20, 2)]
    mirror.fold(delta(keys))
    voxels = mirror.chunk((0, 0, 0))
    assert voxels is not None
    nodes = chunk_nodes("/c", "radar", (0, 0, 0), voxels, chunk_place(drawing, placing, (0, 0, 0)), with_ground=True)
    expected = drawing.frame.scene_from_model(placing.model_from_enu(np.array(keys) + 0.5))
    found = boxes_in_scene(nodes[0])
    for each in expected:
        assert np.linalg.norm(found - each, axis=1).min() < 0.05
    height = np.ptp(nodes[0].props["vertices"], axis=0)
    assert height[2] == pytest.approx(height[0] * times, rel=1e-5)


def test_known_ground_is_grey_smaller_and_may_be_left_out() -> None:
    drawing, placing = placed()
    mirror = MapMirror("vision")
    mirror.fold(delta([(1, 1, 1), (2, 2, 2)], explained=[0, 1]))
    voxels, place = mirror.chunk((0, 0, 0)), chunk_place(drawing, placing, (0, 0, 0))
    assert voxels is not None
    seen, ground = chunk_nodes("/c", "vision", (0, 0, 0), voxels, place, with_ground=True)
    grey = linear_light(np.array(palette.KNOWN_GROUND, dtype=np.uint8))
    assert ground.props["batched_colors"][0].tolist() == grey.tolist()
    assert np.ptp(ground.props["vertices"]) < 0.6 * np.ptp(seen.props["vertices"])
    assert [n.name for n in chunk_nodes("/c", "vision", (0, 0, 0), voxels, place, with_ground=False)] == ["/c/seen"]


def test_a_few_more_voxels_cost_15_bytes_a_box() -> None:
    drawing, placing = placed()
    mirror = MapMirror("radar")
    mirror.fold(delta([(n, 0, 0) for n in range(20)]))
    place = chunk_place(drawing, placing, (0, 0, 0))

    def nodes() -> Any:
        voxels = mirror.chunk((0, 0, 0))
        assert voxels is not None
        return chunk_nodes("/c", "radar", (0, 0, 0), voxels, place, with_ground=True)

    before = nodes()
    assert sent_bytes(before, nodes()) == 0
    mirror.fold(delta([(n, 5, 0) for n in range(8)]))
    assert sent_bytes(before, nodes()) <= 15 * len(before[0].props["batched_positions"])


# Machado, Oliveira, Fernandes 2009, severity 1.0, in linear light.
BLINDNESSES = {
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "none": np.eye(3).tolist(),
}


@pytest.mark.parametrize("kind", sorted(BLINDNESSES))
@pytest.mark.parametrize("probability", [0.6, 0.97])
def test_the_sensors_hues_are_told_apart_whoever_looks(kind: str, probability: float) -> None:
    def seen(hue: tuple[int, int, int]) -> np.ndarray:
        srgb = palette.probability_rgb(hue, np.array([probability]))[0] / 255.0
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        return _lab(np.clip(np.array(BLINDNESSES[kind]) @ linear, 0.0, 1.0))

    assert np.linalg.norm(seen(HUES["radar"]) - seen(HUES["vision"])) > 25.0


def _lab(linear: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of linear sRGB, D65."""
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    f = np.cbrt(xyz / np.array([0.9505, 1.0, 1.089]))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_surer_is_lighter() -> None:
    rgb = palette.probability_rgb(palette.RADAR, np.array([0.5, 0.7, 0.84, 0.97])).astype(int).sum(axis=1)
    assert (np.diff(rgb) > 0).all()


def test_a_region_that_holds_something_is_thicker_and_filled_not_only_red() -> None:
    drawing, placing = placed()
    free = region_nodes(drawing, placing, {"radar": status()}, prefix="/n")
    held = region_nodes(drawing, placing, {"radar": status(occupied=True)}, prefix="/n")
    assert [node.kind for node in free] == ["line_segments"]
    assert [node.kind for node in held] == ["line_segments", "mesh_simple"]
    assert held[0].props["thickness"] > free[0].props["thickness"]
    hidden = replace(
        drawing, state=replace(drawing.state, view=drawing.state.view.model_copy(update={"show_regions": False}))
    )
    assert region_nodes(hidden, placing, {"radar": status()}, prefix="/n") == []
    assert region_nodes(drawing, placing, {"radar": status(state="stale")}, prefix="/n") == []


def test_the_sector_lies_ahead() -> None:
    low, high = sector_corners_enu_m(Region((1.0, 2.0, 10.0), math.pi / 2, 7.0, 0.4, 2.0, False))
    assert low[0].tolist() == [1.0, 2.0, 9.0]
    assert high[0].tolist() == [1.0, 2.0, 11.0]
    assert low[1:, 0].max() == pytest.approx(8.0)
    assert np.linalg.norm(low[1:, :2] - [1.0, 2.0], axis=1) == pytest.approx(7.0)
    assert np.ptp(low[1:, 1]) == pytest.approx(2 * 7.0 * math.sin(0.2))


def test_the_nearest_conflict_is_marked_with_its_distance_and_time() -> None:
    drawing, placing = placed()

    def conflict(ahead_m: float, time_s: float | None) -> MissionConflict:
        return MissionConflict(ahead_m, time_s, 4, 0.6, (5.0, 5.0, 5.0), 37.0, 15.0, 9)

    statuses = {
        "radar": status(conflict=conflict(80.0, 27.0)),
        "vision": status("vision", conflict=conflict(31.0, None)),
    }
    nodes = conflict_nodes(drawing, placing, statuses, prefix="/n")  # pyright: ignore[reportArgumentType]
    assert [n.props["text"] for n in nodes if n.kind == "label"] == ["In the way: 31 m ahead"]
    assert conflict_nodes(drawing, placing, {"radar": status()}, prefix="/n") == []


def test_a_manoeuvre_is_a_line_with_its_clearance() -> None:
    drawing, placing = placed()
    route = Route("over", np.array([(0.0, 0.0, 5.0), (0.0, 0.0, 12.0), (0.0, 30.0, 12.0)]), "Over: 2.1 m clear")
    line, words = route_nodes(drawing, placing, [route], prefix="/n")
    assert line.props["points"].shape == (2, 2, 3)
    assert words.props["text"] == "Over: 2.1 m clear"


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_on_the_stage_what_has_gone_is_taken_away(server: viser.ViserServer) -> None:
    drawing, placing = placed()
    put: dict[str, Any] = {}
    sights = Sights(server, cast(Any, SimpleNamespace(draw=put.update, nodes=[])))
    sights.redraw(drawing)
    sights.draw_now("live", placing.origin, {"radar": status(occupied=True)}, [])
    assert len(put["regions_live"]) == 2
    put.clear()
    sights.draw_now("replay", placing.origin, {}, [])
    assert put == {"regions_live": []}
    look = sights.look("radar", placing.origin)
    assert look is not None
    mirror = MapMirror("radar")
    mirror.fold(delta([(1, 1, 1)]))
    assert sights.draw_chunks("radar", look, {(0, 0, 0): mirror.chunk((0, 0, 0))}) > 0
    assert sights.draw_chunks("radar", look, {(0, 0, 0): mirror.chunk((0, 0, 0))}) == 0
    hidden = replace(look, visible=False)
    assert not hidden.same(look)
    sights.draw_chunks("radar", hidden, {(0, 0, 0): mirror.chunk((0, 0, 0))})
    assert sights.draw_chunks("radar", look, {(0, 0, 0): mirror.chunk((0, 0, 0))}) > 0
    sights.drop_chunks("radar")
    whole = sights.look("vision_flight", placing.origin)
    assert whole is not None
    assert (look.visible, look.with_ground, whole.visible) == (True, False, False)
    assert sights.draw_chunks("radar", look, {(0, 0, 0): mirror.chunk((0, 0, 0))}) > 0
