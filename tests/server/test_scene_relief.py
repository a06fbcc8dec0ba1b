"""The safe surface and the path as browsers get them lie where they were computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.basics.plan_model import SampledPath, Surfaces
from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.missions.vehicle_profile import load_profile
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from planning.safe_surface.surface import safe_surface_at
from planning.terrain.dsm import Dsm
from server.plan.tasks import plan_scene
from server.scene.geometry.payload import Relief, SceneState
from server.scene.geometry.relief import PATH_TOLERANCE_M, kept_within, relief
from server.scene.geometry.stage import Drawing
from server.scene.geometry.terrain_payload import build_terrain_scene
from server.scene.layers.flight_layers import flight_nodes
from server.scene.layers.ground_layers import surface_nodes
from server.schemas import PlanDoc, SelectionDoc, ViewDoc
from tests.server.scene_fixtures import hill

DRAWN_AS_FLOWN_M = 0.10


@pytest.fixture(scope="module", params=[20.0, 5.0], ids=lambda radius_m: f"R{radius_m:g}")
def demo(request: pytest.FixtureRequest) -> Plan:
    asked = PlanRequest(pois=demo_pois(), profile=load_profile("generic-quad"))
    asked = replace(asked, surface=replace(asked.surface, radius_m=request.param))
    return plan_mission(demo_dsm(), asked)


def test_what_browsers_draw_is_what_is_flown(demo: Plan) -> None:
    drawing = _drawing(demo)
    path = demo.path
    places = drawing.frame.scene_from_model(np.column_stack([path.xy_m, path.alt_dsm_m]))
    (surface,) = surface_nodes(drawing)
    drawn = _heights(np.asarray(surface.props["vertices"], dtype=np.float64), surface.props["faces"], places[:, :2])
    lowest = drawing.frame.reference_alt_dsm_m
    off_m = drawn - (path.surface_alt_dsm_m - lowest)
    assert np.isfinite(off_m).all()
    assert np.abs(off_m).max() <= DRAWN_AS_FLOWN_M
    # Nowhere does the flight look as if it were inside what is safe.
    assert (drawn - places[:, 2]).max() <= 0.0
    assert np.abs(_drawn_path_m(drawing, path) - places[:, 2]).max() <= DRAWN_AS_FLOWN_M


def _drawing(plan: Plan) -> Drawing:
    state = SceneState(
        terrain=build_terrain_scene("demo", plan.dsm, shading="height", orthophoto=None),
        plan=plan_scene(plan),
        plan_is_stale=False,
        document=PlanDoc(terrain_id="demo"),
        selection=SelectionDoc(),
        view=ViewDoc(),
    )
    drawing = Drawing.of(plan.dsm, state)
    assert drawing is not None
    return drawing


def _drawn_path_m(drawing: Drawing, path: SampledPath) -> F64:
    """Height of the drawn line at every sample of the path."""
    (line,) = [node for node in flight_nodes(drawing) if node.name == "/path"]
    points = np.vstack([line.props["points"][:, 0], line.props["points"][-1:, 1]]).astype(np.float64)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    return np.interp(path.s_m * along[-1] / path.s_m[-1], along, points[:, 2])


def _heights(vertices: F64, faces: np.ndarray, xy: F64) -> F64:
    """Of triangles above places, one place after the other; NaN where there is none."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    out = np.full(len(xy), np.nan)
    for index, at in enumerate(xy):
        near = np.flatnonzero(((low[:, :2] <= at + 1e-3) & (high[:, :2] >= at - 1e-3)).all(axis=1))
        corners = np.stack([a[near], b[near], c[near]], axis=1)
        edges = np.stack([corners[:, 0, :2] - corners[:, 2, :2], corners[:, 1, :2] - corners[:, 2, :2]], axis=-1)
        flat = np.abs(np.linalg.det(edges)) < 1e-9
        edges[flat] = np.eye(2)
        share = np.linalg.solve(edges, (at - corners[:, 2, :2])[..., None])[..., 0]
        share = np.column_stack([share, 1 - share.sum(axis=1)])
        inside = share.min(axis=1)
        inside[flat] = -np.inf
        best = int(np.argmax(inside))
        if inside[best] > -1e-3:
            out[index] = share[best] @ corners[best, :, 2]
    return out


def test_the_mesh_lies_on_the_surface_and_leaves_its_gaps_open() -> None:
    surfaces, path = _over(hill())
    mesh = relief(surfaces, path)
    assert np.isfinite(mesh.points_m).all()
    middles = mesh.points_m[mesh.faces].mean(axis=1)
    assert np.isfinite(surfaces.safe.elevation_at(middles[:, :2])).all()
    a, b, c = (mesh.points_m[mesh.faces[:, corner], :2] for corner in range(3))
    twice_m2 = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (twice_m2 > 0).all()
    known_m2 = float(np.isfinite(surfaces.safe.elevation_m).sum())
    # From centre to centre, less half a cell along every edge.
    assert 0.85 * known_m2 < twice_m2.sum() / 2 <= known_m2


def test_nothing_known_is_nothing_drawn() -> None:
    surfaces, path = _over(hill())
    nothing = surfaces.safe.with_elevation(np.full_like(surfaces.safe.elevation_m, np.nan))
    unknown = replace(path, surface_alt_dsm_m=np.full_like(path.surface_alt_dsm_m, np.nan))
    mesh = relief(replace(surfaces, safe=nothing, floor=None), unknown)
    assert isinstance(mesh, Relief)
    assert not len(mesh.faces)


def test_a_step_across_the_path_is_followed() -> None:
    dsm = hill(hole=False)
    heights = dsm.elevation_m.copy()
    heights[:, 41:] += 6.0
    surfaces, path = _over(dsm.with_elevation(heights))
    mesh = relief(surfaces, path)
    off_m = _heights(mesh.points_m, mesh.faces, path.xy_m) - path.surface_alt_dsm_m
    assert np.abs(off_m).max() <= PATH_TOLERANCE_M + 1e-6


def _over(dsm: Dsm) -> tuple[Surfaces, SampledPath]:
    """The model itself as its safe surface, and a path from west to east over it."""
    x_m = np.arange(500_005.0, 500_075.0, 0.1)
    xy_m = np.column_stack([x_m, np.full(len(x_m), 3_999_968.3)])
    surfaces = Surfaces(safe=dsm, method="exact", floor=None)
    alt_m = safe_surface_at(surfaces, xy_m)
    path = SampledPath(
        xy_m=xy_m,
        s_m=x_m - x_m[0],
        surface_alt_dsm_m=alt_m,
        ground_alt_dsm_m=alt_m,
        alt_dsm_m=alt_m,
        vertex=np.array([0, len(x_m) - 1]),
        vertex_poi=(0, 1),
    )
    return surfaces, path


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 300), tolerance=st.floats(0.0, 1.0))
def test_a_simplified_curve_keeps_its_promise(seed: int, count: int, tolerance: float) -> None:
    random = np.random.default_rng(seed)
    s = np.cumsum(random.uniform(0.01, 1.0, count))
    value = np.cumsum(random.normal(0, 0.3, count))
    kept = kept_within(s, value, tolerance)
    assert kept[0] == 0
    assert kept[-1] == count - 1
    assert np.abs(np.interp(s, s[kept], value[kept]) - value).max() <= tolerance + 1e-9
