"""Coarsening and texturing of surface models for the view."""

from __future__ import annotations

import numpy as np
import pytest

from planning.terrain.orthophoto import Orthophoto
from server.scene.geometry.terrain_payload import GRID_CELLS, TEXTURE_PX, build_terrain_scene
from tests.server.scene_fixtures import hill


def test_a_large_model_is_coarsened_and_its_mast_survives() -> None:
    dsm = hill()
    z = np.zeros((700, 2500), dtype=np.float32)
    z[333, 1234] = 40
    scene = build_terrain_scene("big", dsm.with_elevation(z), shading="hillshade", orthophoto=None)
    assert max(scene.grid.alt_dsm_m.shape) <= GRID_CELLS
    assert max(scene.texture_rgb.shape) <= TEXTURE_PX
    assert scene.grid.alt_dsm_m.max() == 40
    assert (scene.legend_min_m, scene.legend_max_m) == (0, 40)
    rows, cols = scene.grid.alt_dsm_m.shape
    assert scene.texture_rgb.shape[1] / scene.texture_rgb.shape[0] == pytest.approx(cols / rows, rel=0.01)


def test_steps_are_reported() -> None:
    steps = []
    build_terrain_scene("t", hill(), shading="height", orthophoto=None, report=lambda step, share: steps.append(share))
    assert steps == [0.0, 0.5]


def test_an_orthomosaic_covers_its_part_and_relief_the_rest() -> None:
    dsm = hill(hole=False)
    west, south, _, north = dsm.bounds_m
    photo = Orthophoto(
        rgb=np.full((30, 20, 3), (200, 10, 10), dtype=np.uint8),
        known=np.ones((30, 20), dtype=np.bool_),
        bounds_m=(west, south, west + 40, north),
        crs=dsm.crs,
    )
    texture = build_terrain_scene("t", dsm, shading="orthophoto", orthophoto=photo).texture_rgb
    assert (texture[:, :40] == (200, 10, 10)).all()
    assert np.ptp(texture[:, 40:].astype(int), axis=2).max() <= 6  # grey


@pytest.mark.parametrize("shading", ["height", "orthophoto"])
def test_without_an_orthomosaic_heights_are_coloured(shading) -> None:
    texture = build_terrain_scene("t", hill(), shading=shading, orthophoto=None).texture_rgb.astype(int)
    assert np.ptp(texture, axis=2).max() > 40
